"""All first measurements of one packing, as plain numbers for tables and files."""

import numpy as np

from jamlab.contacts import contacts
from jamlab.elasticity import linear_shear_modulus
from jamlab.energy_terms import energy_terms
from jamlab.errors import ConvergenceError
from jamlab.hessian import stress
from jamlab.packing import Packing
from jamlab.packing_fraction import packing_fraction
from jamlab.shape import shape_factors

COLUMNS = ("rho", "phi", "z", "rattlers", "pressure", "energy", "contact_energy", "g", "g_x", "shape")


def measure(packing: Packing) -> dict[str, float]:
    """Observables of a packing at an energy minimum, in its own units.

    Returns:
        rho: true packing fraction (DP: rims included); phi: nominal one; z: contacts per particle without rattlers;
        rattlers: their number; pressure; energy: total; contact_energy: per disk or vertex; g: relaxed shear modulus by
        linear response, mean over directions; g_x: the same for shear along x; shape: mean shape factor (SP: disks cut
        by their power cells; DP: bare polygons without rim). z is nan without a backbone, g and g_x are nan where the
        packing is not jammed or not stable: `jamlab.shear_modulus` then says why.
    """
    network = contacts(packing)
    terms = energy_terms(packing)
    s = stress(packing)
    bearing = [t for t in terms if t.name in ("spring", "contact")]
    return {
        "rho": packing_fraction(packing),
        "phi": packing.phi,
        "z": network.z,
        "rattlers": float(network.rattlers.sum()),
        "pressure": float(0.5 * (s[0, 0] + s[1, 1])),
        "energy": float(sum(t.energy.sum() for t in terms)),
        "contact_energy": float(sum(t.energy.sum() for t in bearing) / len(packing.positions)),
        "g": _modulus(packing, average=True),
        "g_x": _modulus(packing, average=False),
        "shape": float(np.nanmean(shape_factors(packing))),
    }


def table(packings: list[Packing]) -> dict[str, np.ndarray]:
    """Measurements of several packings: column name -> (len(packings),) float64."""
    rows = [measure(packing) for packing in packings]
    return {name: np.array([row[name] for row in rows]) for name in COLUMNS}


def _modulus(packing: Packing, *, average: bool) -> float:
    try:
        return linear_shear_modulus(packing, average=average)
    except ConvergenceError:
        return float("nan")
