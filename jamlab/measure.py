"""All first measurements of one packing, as plain numbers for tables and files."""

import numpy as np

from jamlab.contacts import contacts
from jamlab.elasticity import elastic_tensor, modulus_along
from jamlab.energy_terms import energy_terms
from jamlab.errors import ConvergenceError
from jamlab.hessian import forces, stress
from jamlab.packing import Packing
from jamlab.packing_fraction import packing_fraction
from jamlab.shape import shape_factors

COLUMNS = ("rho", "phi", "z", "rattlers", "pressure", "energy", "contact_energy", "g", "g_x", "shape", "max_force")


def measure(packing: Packing) -> dict[str, float]:
    """Observables of a packing at an energy minimum, in its own units.

    Returns:
        rho: true packing fraction (DP: rims included); phi: nominal one; z: contacts per particle without rattlers;
        rattlers: their number; pressure; energy: total; contact_energy: per disk or vertex; g: relaxed shear modulus by
        linear response, mean over directions; g_x: the same for shear along x; shape: mean shape factor (SP: disks cut
        by their power cells; DP: bare polygons without rim); max_force: largest force left, which says how near to a
        minimum the packing is. z is nan without a backbone, g and g_x are nan where the
        packing is not jammed, not stable or not at a minimum: `jamlab.shear_modulus` then says why.
    """
    network = contacts(packing)
    terms = energy_terms(packing)
    s = stress(packing)
    g, g_x = _moduli(packing)
    bearing = [t for t in terms if t.name in ("spring", "contact")]
    return {
        "rho": packing_fraction(packing),
        "phi": packing.phi,
        "z": network.z,
        "rattlers": float(network.rattlers.sum()),
        "pressure": float(0.5 * (s[0, 0] + s[1, 1])),
        "energy": float(sum(t.energy.sum() for t in terms)),
        "contact_energy": float(sum(t.energy.sum() for t in bearing) / len(packing.positions)),
        "g": g,
        "g_x": g_x,
        "shape": float(np.nanmean(shape_factors(packing))),
        "max_force": float(np.hypot(*forces(packing).T).max()),
    }


def table(packings: list[Packing]) -> dict[str, np.ndarray]:
    """Measurements of several packings: column name -> (len(packings),) float64."""
    rows = [measure(packing) for packing in packings]
    return {name: np.array([row[name] for row in rows]) for name in COLUMNS}


def _moduli(packing: Packing) -> tuple[float, float]:
    try:
        c = elastic_tensor(packing).relaxed
    except ConvergenceError:
        return float("nan"), float("nan")
    return modulus_along(c, average=True), modulus_along(c)
