"""All first measurements of one packing, as plain numbers for tables and files."""

import numpy as np

from jamlab.errors import BoundaryError, ConvergenceError
from jamlab.geometry.contact_lengths import contact_lengths
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.geometry.particle_shape import area_ratios, edge_lengths, shape_factors
from jamlab.geometry.voids.voids import voids
from jamlab.mechanics.elasticity import AVERAGING_ANGLES, compression_modulus, elastic_tensor, modulus_along
from jamlab.mechanics.energy_terms import energy_terms
from jamlab.mechanics.stiffness import forces, stress
from jamlab.packing.packing import Packing

COLUMNS = (
    *("rho", "phi", "z", "rattlers", "pressure", "energy", "contact_energy", "g", "g_x", "b"),
    *("shape", "shape_rim", "area", "contact_length", "shortest_edge", "longest_edge"),
    *("voids", "void_sides", "void_area", "void_shape", "max_force"),
)


def measure(packing: Packing) -> dict[str, float]:
    """Observables of a packing at an energy minimum, in its own units.

    Returns:
        rho: true packing fraction (DP: rims included); phi: nominal one; z: contacts per particle without rattlers;
        rattlers: their number; pressure; energy: total; contact_energy: per disk or vertex; g: relaxed shear modulus by
        linear response, mean over directions; g_x: the same for shear along x; b: relaxed bulk modulus; shape,
        shape_rim: mean shape factors (SP: disks cut by their power cells; DP: bare polygons, and with their rims);
        area: mean of area over area at rest (`jamlab.area_ratios`); contact_length: mean over pairs of polygons;
        shortest_edge, longest_edge: of polygons (these three nan for SP); voids: their number;
        void_sides, void_area, void_shape: means over voids that do not percolate; max_force: largest force left, which
        says how near to a minimum the packing is. z is nan without a backbone; g, g_x and b are nan where the packing
        is not jammed, not stable or not at a minimum (`jamlab.shear_modulus` then says why); the void columns are nan
        where outlines of polygons cross, the means also where every void percolates.
    """
    network = contacts(packing)
    terms = energy_terms(packing)
    pressure = float(0.5 * np.trace(stress(packing)))
    g, g_x, b = _moduli(packing, pressure)
    bearing = [t for t in terms if t.name in ("spring", "contact")]
    rho, around = _covered(packing)
    return {
        "rho": rho,
        "phi": packing.phi,
        "z": network.z,
        "rattlers": float(network.rattlers.sum()),
        "pressure": pressure,
        "energy": float(sum(t.energy.sum() for t in terms)),
        "contact_energy": float(sum(t.energy.sum() for t in bearing) / len(packing.positions)),
        "g": g,
        "g_x": g_x,
        "b": b,
        **_shape(packing),
        **around,
        "max_force": float(np.hypot(*forces(packing).T).max()),
    }


def table(packings: list[Packing]) -> dict[str, np.ndarray]:
    """Measurements of several packings: column name -> (len(packings),) float64."""
    rows = [measure(packing) for packing in packings]
    return {name: np.array([row[name] for row in rows]) for name in COLUMNS}


def _shape(packing: Packing) -> dict[str, float]:
    found = {
        "shape": float(np.nanmean(shape_factors(packing))),
        "shape_rim": float(np.nanmean(shape_factors(packing, rim=True))),
        "area": float(area_ratios(packing).mean()),
    }
    if packing.model == "sp":
        return found | dict.fromkeys(("contact_length", "shortest_edge", "longest_edge"), float("nan"))
    lengths, edges = contact_lengths(packing).length, edge_lengths(packing)
    mean = float(lengths.mean()) if len(lengths) else float("nan")
    return found | {"contact_length": mean, "shortest_edge": float(edges.min()), "longest_edge": float(edges.max())}


def _covered(packing: Packing) -> tuple[float, dict[str, float]]:
    """rho and the void columns; for droplets rho comes from the same boundary as the voids."""
    names = ("voids", "void_sides", "void_area", "void_shape")
    try:
        found = voids(packing)
    except BoundaryError:
        return packing_fraction(packing), dict.fromkeys(names, float("nan"))
    closed = found.percolating == 0
    means = (float(v[closed].mean()) if closed.any() else float("nan") for v in (found.sides, found.area, found.shape))
    rho = packing_fraction(packing) if packing.model == "sp" else 1.0 - float(found.area.sum() / packing.area)
    return rho, dict(zip(names, (float(len(found.area)), *means), strict=True))


def _moduli(packing: Packing, pressure: float) -> tuple[float, float, float]:
    try:
        c = elastic_tensor(packing).relaxed
    except ConvergenceError:
        return float("nan"), float("nan"), float("nan")
    along_x = float(modulus_along(c, np.zeros(1))[0])
    return float(modulus_along(c, AVERAGING_ANGLES).mean()), along_x, compression_modulus(c, pressure)
