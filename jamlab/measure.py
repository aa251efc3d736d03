"""Measure a packing: its standard observables as plain numbers for tables and files."""

import time
from collections.abc import Callable, Iterable, Sequence
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from jamlab.arrays import Array
from jamlab.checks import check_choice, checked
from jamlab.errors import BoundaryError, ConvergenceError, InputError, JamlabError
from jamlab.geometry.contact_lengths import contact_lengths
from jamlab.geometry.contact_network import Contacts, contacts, contacts_are_certain
from jamlab.geometry.orientational_order import orientational_order
from jamlab.geometry.packing_fraction import cover_by_disks, cover_outside_voids, packing_fraction
from jamlab.geometry.particle_shape import area_ratios, edge_lengths, shape_factors
from jamlab.geometry.power_cells import DiskCells, cut_disks
from jamlab.geometry.voids.voids import voids
from jamlab.mechanics.elasticity import AVERAGING_ANGLES, compression_modulus, elastic_tensor, modulus_along
from jamlab.mechanics.energy_terms import Terms, energy_terms
from jamlab.mechanics.force_network import force_network
from jamlab.mechanics.stiffness import forces, stress
from jamlab.packing.neighbors import Pairs
from jamlab.packing.packing import Packing
from jamlab.processes.cores import available_cores
from jamlab.processes.progress import Progress, no_progress
from jamlab.processes.side_by_side import run_side_by_side

COLUMNS = (
    *("rho", "phi", "z", "z_all", "rattlers", "pressure", "energy", "contact_energy", "g", "g_x", "b"),
    *("shape", "shape_rim", "area", "contact_length", "shortest_edge", "longest_edge"),
    *("voids", "void_sides", "void_area", "void_shape", "max_force"),
)


QUANTITIES = (*COLUMNS, "psi_6", "psi_6_overall")

_TRIAL = 0.5  # s after which `measure_all` looks at the time that a state takes
_START = 2.0  # s that new processes take to start and to load what measures


@checked
def measure(packing: Packing, quantities: str | Iterable[str] = COLUMNS) -> dict[str, float]:
    """Observables of a packing at an energy minimum, in its own units.

    Args:
        packing: SP or DP.
        quantities: one or some of `QUANTITIES`; only what they need is computed. Default `COLUMNS`.

    Returns:
        rho: true packing fraction (DP: rims included); phi: nominal one; z: contacts per particle without rattlers;
        z_all: of all that press, over all particles; rattlers: their number; pressure; energy: total; contact_energy:
        per disk or vertex; g: relaxed shear modulus by linear response, mean over directions; g_x: the same for shear
        along x; b: relaxed bulk modulus; shape, shape_rim: mean shape factors (SP: disks cut by their power cells; DP:
        bare polygons, and with their rims); area: mean of area over area at rest (`jamlab.area_ratios`);
        contact_length: mean over pairs of polygons; shortest_edge, longest_edge: of polygons (these three nan for SP);
        voids: their number; void_sides, void_area, void_shape: means over voids that do not percolate; max_force:
        largest force left, which says how near to a minimum the packing is; psi_6, psi_6_overall: mean of |psi_6| and
        |mean of psi_6| of `jamlab.orientational_order`. z is nan without a backbone; g, g_x and b are nan where the
        packing is not jammed, not stable or not at a minimum (`jamlab.shear_modulus` then says why); z, z_all and
        rattlers are nan where positions are rounded so that a contact may be open or closed (`Packing.rounding`); the
        void columns are nan where outlines of polygons cross, the means also where every void percolates.

    Raises:
        InputError: a quantity that is not among `QUANTITIES`.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> found = jamlab.measure(p, ["rho", "z", "g", "b"])
        >>> {name: round(value, 3) for name, value in found.items()}
        {'rho': 0.853, 'z': 4.452, 'g': 0.029, 'b': 0.486}
    """
    names = _check_names(quantities)
    state = _State(packing)
    found: dict[str, float] = {}
    for group, observe in _GROUPS:
        if not set(group).isdisjoint(names):
            found |= observe(state)
    return {name: found[name] for name in names}


def _check_names(quantities: str | Iterable[str]) -> tuple[str, ...]:
    names = (quantities,) if isinstance(quantities, str) else tuple(quantities)
    for name in names:
        check_choice("quantity", name, QUANTITIES)
    return names


def why_no_modulus(packing: Packing) -> str:
    """Say why g, g_x and b of a packing are nan; "" if they are not."""
    network = contacts(packing)
    if network.loose:
        return f"the packing came loose at phi = {packing.phi:.4f}: no contact bears a load, it flows"
    bearing = force_network(packing, network=network)
    try:
        elastic_tensor(packing, network=bearing)
    except ConvergenceError as error:
        rattlers = int(network.rattlers.sum())
        squeezed = rattlers - (packing.n - bearing.packing.n)
        if packing.provenance.get("on_rattlers"):
            return f"rattlers stop a droplet that would slide, but linear response leaves them out: without, {error}"
        if not (rattlers and packing.converged):
            return str(error)
        kept = f", but for {squeezed} that two contacts squeeze, and that may roll" if squeezed else ""
        return f"with its {rattlers} rattlers taken out{kept}, {error}"
    return ""


@checked
def measure_all(
    packings: Sequence[Packing],
    quantities: str | Iterable[str] = COLUMNS,
    *,
    processes: int | None = None,
    progress: Progress | None = None,
) -> "dict[str, Array]":
    """Observables of several packings, such as a sweep, side by side where that is faster.

    Args:
        packings: SP or DP; each is measured on one core, so the numbers do not depend on `processes`.
        quantities: see `measure`.
        processes: at most so many at once, by default one for each core that this process may use. Work of a few
            seconds, which new processes would not make shorter, is done in this one.
        progress: called after each packing with the share of all that is measured, and in words.

    Returns:
        Quantity -> (len(packings),) float64, in the order of the packings.

    Raises:
        InputError: a quantity that is not among `QUANTITIES`, or `processes` below 1.
        EngineError: a process was killed.
        JamlabError: what `measure` raises; the message names the state, counted from 0.

    Example:
        >>> onset = jamlab.jam(n=16, seed=1)
        >>> measured = jamlab.measure_all([onset, *jamlab.compress(onset, to=0.9, step=0.02)], ["rho", "z"])
        >>> measured["rho"].shape == measured["z"].shape, round(float(measured["rho"][-1]), 3)
        (True, 0.9)
    """
    if processes is not None and processes < 1:
        raise InputError(f"processes = {processes}: must be 1 or more")
    names, total = _check_names(quantities), len(packings)
    tell = progress or no_progress

    def show(done: int) -> None:
        tell(done / total, f"{done} of {total} states")

    states = list(enumerate(packings))
    one = partial(_measure_state, names=names)
    rows, began = [], time.perf_counter()
    with threadpool_limits(1):
        for state in states:
            rows.append(one(state))
            show(len(rows))
            spent = time.perf_counter() - began
            if spent > _TRIAL and _count_processes(total - len(rows), spent / len(rows), processes) > 1:
                break
    if rest := states[len(rows) :]:
        count, first = _count_processes(len(rest), spent / len(rows), processes), len(rows)
        rows += run_side_by_side(one, rest, count, done=lambda done: show(first + done))
    return {name: np.array([row[name] for row in rows]) for name in names}


def _measure_state(
    state: tuple[int, Packing], report: Callable[..., None] = lambda *step: None, *, names: tuple[str, ...]
) -> dict[str, float]:
    index, packing = state
    try:
        return measure(packing, names)
    except JamlabError as error:
        raise type(error)(f"state {index}: {error}") from error


def _count_processes(left: int, seconds: float, most: int | None) -> int:
    """Number of processes for states that take some seconds each; 1 where starting more would take longer."""
    if (left - 1) * seconds < _START:
        return 1
    count = min(left, available_cores() if most is None else most)
    return count if left * seconds * (1 - 1 / count) > _START else 1


class _State:
    """A packing with its contacts and energy terms, found once and only when needed."""

    def __init__(self, packing: Packing) -> None:
        self.packing = packing

    @cached_property
    def network(self) -> Contacts:
        return contacts(self.packing)

    @property
    def touching(self) -> Pairs:
        """SP: disks that touch."""
        assert isinstance(self.network.meetings, Pairs)
        return self.network.meetings

    @cached_property
    def cells(self) -> DiskCells | None:
        """Disks cut by their power cells; None for droplets."""
        if self.packing.diameters is None:
            return None
        return cut_disks(self.touching, 0.5 * self.packing.diameters)

    @cached_property
    def shape(self) -> Array:
        return shape_factors(self.packing, cells=self.cells)

    @cached_property
    def terms(self) -> list[Terms]:
        return energy_terms(self.packing, self.network.meetings)

    @cached_property
    def pressure(self) -> float:
        return float(0.5 * np.trace(stress(self.packing, self.terms)))


def _measure_contacts(state: _State) -> dict[str, float]:
    if not contacts_are_certain(state.packing):
        return dict.fromkeys(("z", "z_all", "rattlers"), float("nan"))
    network = state.network
    return {"z": network.z, "z_all": network.z_all, "rattlers": float(network.rattlers.sum())}


def _measure_energy(state: _State) -> dict[str, float]:
    bearing = [t for t in state.terms if t.name in ("spring", "contact")]
    return {
        "energy": float(sum(t.energy.sum() for t in state.terms)),
        "contact_energy": float(sum(t.energy.sum() for t in bearing) / len(state.packing.positions)),
    }


def _measure_force(state: _State) -> dict[str, float]:
    return {"max_force": float(np.hypot(*forces(state.packing, state.terms).T).max())}


def _measure_shape(state: _State) -> dict[str, float]:
    return {"shape": float(np.nanmean(state.shape))}


def _measure_shape_with_rim(state: _State) -> dict[str, float]:
    shape = state.shape if state.cells else shape_factors(state.packing, rim=True)
    return {"shape_rim": float(np.nanmean(shape))}


def _measure_area(state: _State) -> dict[str, float]:
    return {"area": float(area_ratios(state.packing, cells=state.cells).mean())}


def _measure_edges(state: _State) -> dict[str, float]:
    if state.cells:
        return {"shortest_edge": float("nan"), "longest_edge": float("nan")}
    edges = edge_lengths(state.packing)
    return {"shortest_edge": float(edges.min()), "longest_edge": float(edges.max())}


def _measure_contact_lengths(state: _State) -> dict[str, float]:
    length = np.zeros(0) if state.cells else contact_lengths(state.packing, state.network).length
    return {"contact_length": float(length.mean()) if len(length) else float("nan")}


def _measure_cover(state: _State) -> dict[str, float]:
    """rho and the void columns; for droplets rho comes from the same boundary as the voids."""
    packing = state.packing
    try:
        found = voids(packing)
    except BoundaryError:
        names = ("voids", "void_sides", "void_area", "void_shape")
        return {"rho": packing_fraction(packing), **dict.fromkeys(names, float("nan"))}
    if packing.model == "dp":
        rho = cover_outside_voids(packing, found)
    else:
        rho, _ = cover_by_disks(packing, state.touching)
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


def _measure_moduli(state: _State) -> dict[str, float]:
    try:
        c = elastic_tensor(state.packing, network=force_network(state.packing, network=state.network)).relaxed
    except ConvergenceError:
        return dict.fromkeys(("g", "g_x", "b"), float("nan"))
    return {
        "g": float(modulus_along(c, AVERAGING_ANGLES).mean()),
        "g_x": float(modulus_along(c, np.zeros(1))[0]),
        "b": compression_modulus(c, state.pressure),
    }


def _measure_order(state: _State) -> dict[str, float]:
    order = orientational_order(state.packing)
    return {"psi_6": order.mean_local, "psi_6_overall": order.overall}


# what is computed together
_GROUPS: tuple[tuple[tuple[str, ...], Callable[[_State], dict[str, float]]], ...] = (
    (("rho", "voids", "void_sides", "void_area", "void_shape"), _measure_cover),
    (("phi",), lambda state: {"phi": state.packing.phi}),
    (("z", "z_all", "rattlers"), _measure_contacts),
    (("pressure",), lambda state: {"pressure": state.pressure}),
    (("energy", "contact_energy"), _measure_energy),
    (("g", "g_x", "b"), _measure_moduli),
    (("shape",), _measure_shape),
    (("shape_rim",), _measure_shape_with_rim),
    (("area",), _measure_area),
    (("contact_length",), _measure_contact_lengths),
    (("shortest_edge", "longest_edge"), _measure_edges),
    (("max_force",), _measure_force),
    (("psi_6", "psi_6_overall"), _measure_order),
)
