"""Measure a packing: its standard observables as plain numbers for tables and files."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.checks import checked
from jamlab.errors import BoundaryError, ConvergenceError
from jamlab.geometry.contact_lengths import contact_lengths
from jamlab.geometry.contact_network import Contacts, contacts
from jamlab.geometry.packing_fraction import cover_by_disks, cover_outside_voids, packing_fraction
from jamlab.geometry.particle_shape import area_ratios, edge_lengths, shape_factors
from jamlab.geometry.power_cells import cut_disks
from jamlab.geometry.voids.voids import voids
from jamlab.mechanics.elasticity import AVERAGING_ANGLES, compression_modulus, elastic_tensor, modulus_along
from jamlab.mechanics.energy_terms import energy_terms
from jamlab.mechanics.force_network import force_network
from jamlab.mechanics.stiffness import forces, stress
from jamlab.packing.neighbors import Pairs
from jamlab.packing.packing import Packing

COLUMNS = (
    *("rho", "phi", "z", "rattlers", "pressure", "energy", "contact_energy", "g", "g_x", "b"),
    *("shape", "shape_rim", "area", "contact_length", "shortest_edge", "longest_edge"),
    *("voids", "void_sides", "void_area", "void_shape", "max_force"),
)


@checked
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
    terms = energy_terms(packing, network.meetings)
    pressure = float(0.5 * np.trace(stress(packing, terms)))
    bearing = [t for t in terms if t.name in ("spring", "contact")]
    found = {
        "phi": packing.phi,
        "z": network.z,
        "rattlers": float(network.rattlers.sum()),
        "pressure": pressure,
        "energy": float(sum(t.energy.sum() for t in terms)),
        "contact_energy": float(sum(t.energy.sum() for t in bearing) / len(packing.positions)),
        "max_force": float(np.hypot(*forces(packing, terms).T).max()),
        **_measure_moduli(packing, network, pressure),
        **_measure_shape(packing, network),
        **_measure_cover(packing, network),
    }
    return {name: found[name] for name in COLUMNS}


def table(packings: list[Packing]) -> dict[str, np.ndarray]:
    """Measurements of several packings: column name -> (len(packings),) float64."""
    rows = [measure(packing) for packing in packings]
    return {name: np.array([row[name] for row in rows]) for name in COLUMNS}


def _measure_shape(packing: Packing, network: Contacts) -> dict[str, float]:
    names = ("contact_length", "shortest_edge", "longest_edge")
    cells, of_droplets = None, dict.fromkeys(names, float("nan"))
    if isinstance(network.meetings, Pairs):
        cells = cut_disks(network.meetings, 0.5 * np.asarray(packing.diameters))
    else:
        length, edges = contact_lengths(packing, network).length, edge_lengths(packing)
        mean = float(length.mean()) if len(length) else float("nan")
        of_droplets = dict(zip(names, (mean, float(edges.min()), float(edges.max())), strict=True))
    shape = shape_factors(packing, cells=cells)
    with_rim = shape if cells else shape_factors(packing, rim=True)
    return {
        "shape": float(np.nanmean(shape)),
        "shape_rim": float(np.nanmean(with_rim)),
        "area": float(area_ratios(packing, cells=cells).mean()),
        **of_droplets,
    }


def _measure_cover(packing: Packing, network: Contacts) -> dict[str, float]:
    """rho and the void columns; for droplets rho comes from the same boundary as the voids."""
    try:
        found = voids(packing)
    except BoundaryError:
        names = ("voids", "void_sides", "void_area", "void_shape")
        return {"rho": packing_fraction(packing), **dict.fromkeys(names, float("nan"))}
    if isinstance(network.meetings, Pairs):
        rho, _ = cover_by_disks(packing, network.meetings)
    else:
        rho = cover_outside_voids(packing, found)
    closed = found.percolating == 0

    def mean(values: NDArray[Any]) -> float:
        return float(values[closed].mean()) if closed.any() else float("nan")

    return {
        "rho": rho,
        "voids": float(len(found.area)),
        "void_sides": mean(found.sides),
        "void_area": mean(found.area),
        "void_shape": mean(found.shape),
    }


def _measure_moduli(packing: Packing, network: Contacts, pressure: float) -> dict[str, float]:
    try:
        c = elastic_tensor(packing, network=force_network(packing, network=network)).relaxed
    except ConvergenceError:
        return dict.fromkeys(("g", "g_x", "b"), float("nan"))
    return {
        "g": float(modulus_along(c, AVERAGING_ANGLES).mean()),
        "g_x": float(modulus_along(c, np.zeros(1))[0]),
        "b": compression_modulus(c, pressure),
    }
