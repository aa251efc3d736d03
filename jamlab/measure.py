"""All first measurements of one packing, as plain numbers for tables and files."""

from collections.abc import Callable, Iterable

import numpy as np

from jamlab.checks import check_choice
from jamlab.errors import BoundaryError, ConvergenceError
from jamlab.geometry.contact_lengths import contact_lengths
from jamlab.geometry.contact_network import contacts, contacts_are_certain
from jamlab.geometry.orientational_order import orientational_order
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


QUANTITIES = (*COLUMNS, "psi_6", "psi_6_overall")


def measure(packing: Packing, quantities: Iterable[str] = COLUMNS) -> dict[str, float]:
    """Observables of a packing at an energy minimum, in its own units.

    Args:
        packing: SP or DP.
        quantities: some of `QUANTITIES`; only what they need is computed. Default `COLUMNS`.

    Returns:
        rho: true packing fraction (DP: rims included); phi: nominal one; z: contacts per particle without rattlers;
        rattlers: their number; pressure; energy: total; contact_energy: per disk or vertex; g: relaxed shear modulus by
        linear response, mean over directions; g_x: the same for shear along x; b: relaxed bulk modulus; shape,
        shape_rim: mean shape factors (SP: disks cut by their power cells; DP: bare polygons, and with their rims);
        area: mean of area over area at rest (`jamlab.area_ratios`); contact_length: mean over pairs of polygons;
        shortest_edge, longest_edge: of polygons (these three nan for SP); voids: their number;
        void_sides, void_area, void_shape: means over voids that do not percolate; max_force: largest force left, which
        says how near to a minimum the packing is; psi_6, psi_6_overall: mean of |psi_6| and |mean of psi_6| of
        `jamlab.orientational_order`. z is nan without a backbone; g, g_x and b are nan where the packing
        is not jammed, not stable or not at a minimum (`jamlab.shear_modulus` then says why); z and rattlers are nan
        where positions are rounded so that a contact may be open or closed (`Packing.rounding`); the void columns are
        nan where outlines of polygons cross, the means also where every void percolates.

    Raises:
        InputError: a quantity that is not among `QUANTITIES`.
    """
    names = tuple(quantities)
    for name in names:
        check_choice("quantity", name, QUANTITIES)
    found: dict[str, float] = {}
    for group, observe in _GROUPS:
        if not set(group).isdisjoint(names):
            found |= observe(packing)
    return {name: found[name] for name in names}


def table(packings: list[Packing]) -> dict[str, np.ndarray]:
    """Measurements of several packings: column name -> (len(packings),) float64."""
    rows = [measure(packing) for packing in packings]
    return {name: np.array([row[name] for row in rows]) for name in COLUMNS}


def _network(packing: Packing) -> dict[str, float]:
    if not contacts_are_certain(packing):
        return {"z": float("nan"), "rattlers": float("nan")}
    network = contacts(packing)
    return {"z": network.z, "rattlers": float(network.rattlers.sum())}


def _energies(packing: Packing) -> dict[str, float]:
    terms = energy_terms(packing)
    bearing = [t for t in terms if t.name in ("spring", "contact")]
    return {
        "energy": float(sum(t.energy.sum() for t in terms)),
        "contact_energy": float(sum(t.energy.sum() for t in bearing) / len(packing.positions)),
    }


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


def _covered(packing: Packing) -> dict[str, float]:
    """rho and the void columns; for droplets rho comes from the same boundary as the voids."""
    names = ("voids", "void_sides", "void_area", "void_shape")
    try:
        found = voids(packing)
    except BoundaryError:
        return {"rho": packing_fraction(packing)} | dict.fromkeys(names, float("nan"))
    closed = found.percolating == 0
    means = (float(v[closed].mean()) if closed.any() else float("nan") for v in (found.sides, found.area, found.shape))
    rho = packing_fraction(packing) if packing.model == "sp" else 1.0 - float(found.area.sum() / packing.area)
    return {"rho": rho} | dict(zip(names, (float(len(found.area)), *means), strict=True))


def _moduli(packing: Packing) -> dict[str, float]:
    try:
        c = elastic_tensor(packing).relaxed
    except ConvergenceError:
        return dict.fromkeys(("g", "g_x", "b"), float("nan"))
    return {
        "g": float(modulus_along(c, AVERAGING_ANGLES).mean()),
        "g_x": float(modulus_along(c, np.zeros(1))[0]),
        "b": compression_modulus(c, _pressure(packing)),
    }


def _pressure(packing: Packing) -> float:
    return float(0.5 * np.trace(stress(packing)))


def _order(packing: Packing) -> dict[str, float]:
    order = orientational_order(packing)
    return {"psi_6": order.mean_local, "psi_6_overall": order.overall}


# what is computed together
_GROUPS: tuple[tuple[tuple[str, ...], Callable[[Packing], dict[str, float]]], ...] = (
    (("rho", "voids", "void_sides", "void_area", "void_shape"), _covered),
    (("phi",), lambda packing: {"phi": packing.phi}),
    (("z", "rattlers"), _network),
    (("pressure",), lambda packing: {"pressure": _pressure(packing)}),
    (("energy", "contact_energy"), _energies),
    (("g", "g_x", "b"), _moduli),
    (("shape", "shape_rim", "area", "contact_length", "shortest_edge", "longest_edge"), _shape),
    (("max_force",), lambda packing: {"max_force": float(np.hypot(*forces(packing).T).max())}),
    (("psi_6", "psi_6_overall"), _order),
)
