"""Measure a packing: its standard observables as plain numbers for tables and files."""

from __future__ import annotations

import itertools
import pickle
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from jamlab.arguments.choices import QuantityName
from jamlab.arrays import Array
from jamlab.checks import as_plain, check_choice, checked
from jamlab.errors import BoundaryError, ConvergenceError, InputError, JamlabError
from jamlab.geometry.contact_network import contacts, contacts_are_certain
from jamlab.geometry.hexatic_order import hexatic_order
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.geometry.particle_shape import contact_lengths, relative_areas, shape_factors
from jamlab.geometry.voids.voids import voids
from jamlab.mechanics.elasticity import linear_response, mean_shear_modulus, modulus_along
from jamlab.mechanics.force_network import force_network
from jamlab.mechanics.negative_moduli import warn_of_negative
from jamlab.mechanics.stiffness import energy_terms, forces, pressure, stress
from jamlab.packing.area_change import compression
from jamlab.packing.packing import Packing
from jamlab.packing.quantities import COLUMNS, QUANTITIES
from jamlab.processes.progress import Progress, told
from jamlab.processes.side_by_side import run_side_by_side, workers_there

MODULI = ("g", "g_x", "b")


@dataclass(frozen=True)
class MeasureTimes:
    """What decides whether `measure` starts processes, and how many calls an executor gets."""

    look: float = 0.5  # s after which `measure` looks at the time that a state takes
    start: float = 2.0  # s that new processes take to start and to load what measures
    calls: int = 2000  # at most: each takes a scheduler some ms


TIMES = MeasureTimes()


_Own = Callable[..., Any]  # of the user: takes a packing, returns a number
_Named = QuantityName | _Own | Iterable[QuantityName | _Own]  # for type checkers; the call says what was meant


@overload
def measure(packing: Packing, quantities: _Named = ...) -> dict[str, float]: ...
@overload
def measure(
    packing: Sequence[Packing],
    quantities: _Named = ...,
    *,
    workers: int | Executor | None = 1,
    progress: Progress | None = None,
) -> dict[str, Array]: ...
@checked
def measure(
    packing: Packing | Sequence[Packing],
    quantities: str | _Own | Iterable[str | _Own] = COLUMNS,
    *,
    workers: int | Executor | None = 1,
    progress: Progress | None = None,
) -> Any:
    """Measure observables of one packing at an energy minimum, or of several in parallel, in units of the packing.

    Args:
        packing: one SP or DP packing, or several, such as a sweep.
        quantities: one or more of `QUANTITIES`, or functions of your own that take a packing and return a number.
            Default: `COLUMNS`.
        workers: largest number of processes that measure several packings, or an executor
            (`concurrent.futures.Executor`); None: all cores. Processes start only if they save more than the two
            seconds that their start takes; lambdas and functions of the running script are called in this one.
        progress: called after each of several packings with (fraction done, text); True: print it.

    Returns:
        Numbers by the name of the quantity, see `MEASURED` of `jamlab.packing.quantities`, or of the function; for
        several packings arrays (len(packing),). g, g_x and b are nan if the packing is unjammed, unstable or not at a
        minimum (`jamlab.shear_modulus` gives the reason). g is nan between walls, where only shear along x is
        defined. z, z_all and rattlers are nan if rounded positions do not decide whether a contact is open.

    Warns:
        JamlabWarning: g, g_x or b of a packing is negative; once for each packing.

    Raises:
        InputError: a quantity that is not among `QUANTITIES`, two of one name, a function that returns no number or
            cannot be sent to the executor, or `workers` below 1.
        EngineError: a process was killed, or the executor cannot be used.
        JamlabError: errors of the analysis, such as of a quantity by name that the model of a packing leaves out; for
            several packings the message names the state, counted from 0.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> found = jamlab.measure(p, ["rho", "z", "g", "b"])
        >>> {name: round(value, 3) for name, value in found.items()}
        {'rho': 0.853, 'z': 4.452, 'g': 0.029, 'b': 0.486}
        >>> def strongest(packing: jamlab.Packing) -> float:
        ...     return float(jamlab.contacts(packing).forces.size.max())
        >>> round(jamlab.measure(p, ["pressure", strongest])["strongest"], 3)
        0.021
        >>> onset = jamlab.jam(n=16, seed=1)
        >>> measured = jamlab.measure([onset, *jamlab.compress(onset, to=0.9, step=0.02)], ["rho", "z"])
        >>> measured["rho"].shape == measured["z"].shape, round(float(measured["rho"][-1]), 3)
        (True, 0.9)
    """
    found = numbers_of(packing, quantities, workers=workers, progress=progress)
    moduli = {name: np.atleast_1d(found[name]) for name in MODULI if name in found}
    for state, each in enumerate([packing] if isinstance(packing, Packing) else packing):
        place = "" if isinstance(packing, Packing) else f"state {state}"
        warn_of_negative(each, {name: values[state] for name, values in moduli.items()}, place)
    return found


def numbers_of(
    packing: Packing | Sequence[Packing],
    quantities: str | _Own | Iterable[str | _Own] = COLUMNS,
    *,
    workers: int | Executor | None = 1,
    progress: Progress | None = None,
) -> Any:
    """`measure` without its warning, for those who look at the moduli themselves."""
    wanted = _by_name(quantities)
    if quantities is not COLUMNS:
        for each in [packing] if isinstance(packing, Packing) else packing:
            _check_said(each, wanted)
    if isinstance(packing, Packing):
        return _measure_one(packing, wanted)
    return _measure_several(packing, wanted, workers, progress)


_Wanted = dict[str, _Own | None]  # name -> function of the user; None: of jamlab


def _measure_one(packing: Packing, wanted: _Wanted) -> dict[str, float]:
    found: dict[str, float] = {}
    for name, own in wanted.items():
        if own is not None:
            found[name] = _number(name, own(packing))
        elif name in _NEEDED and not packing.kind.says(_NEEDED[name]):
            found[name] = float("nan")
        elif name in _ALONE:
            found[name] = _ALONE[name](packing)
        elif name not in found:
            found |= _OBSERVED[name](packing)
    return {name: found[name] for name in wanted}


def _check_said(packing: Packing, wanted: Iterable[str]) -> None:
    """Refuse quantities by name that the model of a packing leaves out."""
    for name in wanted:
        if name in _NEEDED and not packing.kind.says(_NEEDED[name]):
            packing.kind.lacks(_NEEDED[name])


def _by_name(quantities: str | _Own | Iterable[str | _Own]) -> _Wanted:
    """What is wanted by name; names of jamlab may be given twice, those of functions not."""
    wanted: _Wanted = {}
    for each in [quantities] if isinstance(quantities, str) or callable(quantities) else quantities:
        named = each.func if isinstance(each, partial) else each
        name = each if isinstance(each, str) else str(getattr(named, "__name__", type(each).__name__))
        if isinstance(each, str):
            check_choice("quantity", name, QUANTITIES)
        if wanted.get(name, each) is not each and not (isinstance(each, str) and wanted[name] is None):
            raise InputError(f"two quantities are called {name}: give the function another name")
        if not isinstance(each, str) and name in QUANTITIES:
            raise InputError(f"{name} is a quantity of jamlab: give the function another name")
        wanted[name] = None if isinstance(each, str) else each
    return wanted


def _number(name: str, value: Any) -> float:
    """What a function of the user returned, as a number."""
    plain = as_plain(value)
    if isinstance(plain, bool | int | float):
        return float(plain)
    raise InputError(f"{name} returned a value of type {type(value).__name__}: it must return one number")


def why_no_modulus(packing: Packing) -> str:
    """Say why g, g_x and b of a packing are nan; "" if they are not."""
    network = contacts(packing)
    if network.unjammed:
        return f"the packing unjammed at phi = {packing.phi:.4f}: no contact carries a force"
    try:
        linear_response(packing)
    except ConvergenceError as error:
        rattlers = int(network.rattlers.sum())
        squeezed = rattlers - (packing.n - force_network(packing).packing.n)
        if packing.on_rattlers:
            return f"rattlers stop a droplet from sliding, but linear response ignores rattlers: {error}"
        if not (rattlers and packing.converged):
            return str(error)
        kept = f" except {squeezed} squeezed by two contacts" if squeezed else ""
        return f"{error} ({rattlers} rattlers ignored{kept})"
    return "" if packing.frame.admits(np.eye(4)) else packing.frame.undefined("g, the mean over directions,")


def _measure_several(
    packings: Sequence[Packing], wanted: _Wanted, workers: int | Executor | None, progress: Progress | None
) -> dict[str, Array]:
    where, total = workers_there(workers), len(packings)

    def show(done: int) -> None:
        if progress is not None:
            told(progress)(done / total, f"{done} of {total} states")

    states = list(enumerate(packings))
    one = partial(_measure_state, wanted=wanted)
    rows: list[dict[str, float]] = []
    if isinstance(where, Executor):
        return _columns(_measure_in_groups(states, wanted, where, show), wanted)
    most = where if all(map(_may_travel, wanted.values())) else 1
    began = time.perf_counter()
    with threadpool_limits(1):
        for state in states:
            rows.append(one(state))
            show(len(rows))
            spent = time.perf_counter() - began
            if spent > TIMES.look and _count_processes(total - len(rows), spent / len(rows), most) > 1:
                break
    if rest := states[len(rows) :]:
        count, first = _count_processes(len(rest), spent / len(rows), most), len(rows)
        rows += run_side_by_side(one, rest, count, done=lambda done: show(first + done))
    return _columns(rows, wanted)


def _measure_in_groups(
    states: list[tuple[int, Packing]], wanted: _Wanted, executor: Executor, show: Callable[[int], None]
) -> list[dict[str, float]]:
    """Rows of all states from an executor, in no more calls than its scheduler bears."""
    size = -(-len(states) // TIMES.calls) or 1
    groups = [states[first : first + size] for first in range(0, len(states), size)]
    done = itertools.count(1)
    found = run_side_by_side(
        partial(_measure_group, wanted=wanted),
        groups,
        executor,
        report=lambda group: show(min(next(done), len(states))),
    )
    return [row for rows in found for row in rows]


def _measure_group(
    states: Sequence[tuple[int, Packing]], report: Callable[..., None], *, wanted: _Wanted
) -> list[dict[str, float]]:
    rows = []
    for state in states:
        rows.append(_measure_state(state, wanted=wanted))
        report()
    return rows


def _columns(rows: list[dict[str, float]], names: Iterable[str]) -> dict[str, Array]:
    return {name: np.array([row[name] for row in rows]) for name in names}


def _may_travel(own: _Own | None) -> bool:
    """Whether another process can call a function: not one of the script that runs, or without a name."""
    if getattr(own, "__module__", "") == "__main__":
        return False
    try:
        pickle.dumps(own)
    except (pickle.PicklingError, AttributeError, TypeError):  # as which it is depends on what stands in the way
        return False
    return True


def _measure_state(
    state: tuple[int, Packing], report: Callable[..., None] = lambda *step: None, *, wanted: _Wanted
) -> dict[str, float]:
    index, packing = state
    try:
        return _measure_one(packing, wanted)
    except JamlabError as error:
        raise type(error)(f"state {index}: {error}") from error
    except Exception as error:  # of a function of the user, which is not ours to word
        error.add_note(f"state {index}")
        raise


def _count_processes(left: int, seconds: float, most: int) -> int:
    """Number of processes for states that take some seconds each; 1 where starting more would take longer."""
    if (left - 1) * seconds < TIMES.start:
        return 1
    count = min(left, most)
    return count if left * seconds * (1 - 1 / count) > TIMES.start else 1


_OF_VOIDS = ("voids", "void_sides", "void_area", "void_shape_factor")
_NEEDED: dict[str, str] = {  # quantity -> method of the model that it needs
    **dict.fromkeys(_OF_VOIDS, "boundary"),
    **dict.fromkeys(("shape_factor", "shape_factor_rim"), "outline"),
    **dict.fromkeys(("psi_6", "psi_6_global"), "power_points"),
    "area": "relative_areas",
}
_Observe = Callable[[Packing], dict[str, float]]
_OBSERVED: dict[str, _Observe] = {}  # quantity -> what computes it, with others of its kind


def _observes(*names: str) -> Callable[[_Observe], _Observe]:
    def register(function: _Observe) -> _Observe:
        _OBSERVED.update(dict.fromkeys(names, function))
        return function

    return register


@_observes("z", "z_all", "rattlers")
def _contacts(packing: Packing) -> dict[str, float]:
    if not contacts_are_certain(packing):
        return dict.fromkeys(("z", "z_all", "rattlers"), float("nan"))
    network = contacts(packing)
    return {"z": network.z, "z_all": network.z_all, "rattlers": float(network.rattlers.sum())}


@_observes("energy", "contact_energy")
def _energy(packing: Packing) -> dict[str, float]:
    terms = energy_terms(packing)
    bearing = [t for t in terms if t.name in ("spring", "contact")]
    return {
        "energy": float(sum(t.energy.sum() for t in terms)),
        "contact_energy": float(sum(t.energy.sum() for t in bearing) / len(packing.positions)),
    }


@_observes("shortest_edge", "longest_edge", "contact_length")
def _edges(packing: Packing) -> dict[str, float]:
    if not packing.kind.has_outlines:
        return dict.fromkeys(("shortest_edge", "longest_edge", "contact_length"), float("nan"))
    length = contact_lengths(packing).length
    mean = float(length.mean()) if len(length) else float("nan")
    shortest = float(np.hypot(*packing.polygons.edges.T).min())
    return {"shortest_edge": shortest, "longest_edge": packing.kind.longest_edge(packing), "contact_length": mean}


@_observes("rho", "voids", "void_sides", "void_area", "void_shape_factor")
def _cover(packing: Packing) -> dict[str, float]:
    known = "exact" in packing.kind.fraction_methods
    rho = {"rho": packing_fraction(packing) if known else float("nan")}
    if not packing.kind.says("boundary"):
        return rho
    try:
        found = voids(packing)
    except BoundaryError:
        return rho | dict.fromkeys(_OF_VOIDS, float("nan"))
    closed = found.percolating == 0

    def mean(values: NDArray[Any]) -> float:
        return float(values[closed].mean()) if closed.any() else float("nan")

    return rho | {
        "voids": float(len(found.area)),
        "void_sides": mean(found.sides),
        "void_area": mean(found.area),
        "void_shape_factor": mean(found.shape_factor),
    }


@_observes(*MODULI)
def _moduli(packing: Packing) -> dict[str, float]:
    try:
        c = linear_response(packing).relaxed
    except ConvergenceError:
        return dict.fromkeys(MODULI, float("nan"))
    return {
        "g": mean_shear_modulus(packing, c),
        "g_x": float(modulus_along(c, np.zeros(1))[0]),
        "b": compression(packing).modulus(c, stress(packing)),
    }


@_observes("psi_6", "psi_6_global")
def _order(packing: Packing) -> dict[str, float]:
    order = hexatic_order(packing)
    return {"psi_6": order.mean_local, "psi_6_global": order.global_order}


_ALONE: dict[str, Callable[[Packing], float]] = {
    "phi": lambda packing: packing.phi,
    "pressure": pressure,
    "max_force": lambda packing: float(np.hypot(*forces(packing).T).max()),
    "shape_factor": lambda packing: float(np.nanmean(shape_factors(packing))),
    "shape_factor_rim": lambda packing: float(np.nanmean(shape_factors(packing, rim=True))),
    "area": lambda packing: float(relative_areas(packing).mean()),
}
