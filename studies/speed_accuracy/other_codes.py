"""Chart of one minimum in other codes: distance from it against CPU time."""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.engine.session import evaluate
from jamlab.errors import InputError
from jamlab.geometry.contact_network import contacts
from jamlab.packing.neighbors import shortest_images
from jamlab.packing.packing import Packing
from jamlab.processes.side_by_side import run_side_by_side
from jamlab.protocols.relaxation import usual_force_tolerance
from studies.other_codes.compare import PEERS, jolted_minimum
from studies.other_codes.peers import MISSING, MOST_STEPS, Descent, Jamlab, installed
from studies.speed_accuracy.chart import Chart, Trial
from studies.tables import shortest

# Codes on jax compile for ten seconds before every packing; with JAX_COMPILATION_CACHE_DIR set to a folder and
# JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS to 0, most of it is done once for all packings of a size.

_PHI = 0.88
_PACKINGS = {64: 20, 1024: 5, 8192: 3}  # N -> how many of the seeds
_JOLT = {64: 0.01, 1024: 0.01, 8192: 0.001}  # mean diameters: the more disks, the sooner one of them leaves its minimum
_TOLERANCES = (1e-4, 1e-8, 1e-12)
_REFERENCE, _CHECK = 1e-14, 10.0  # force left in the reference; and in one that tells how well it is known, times that
_ROUNDING = 4.0  # times that of coordinates: no smaller force can be asked for, stiffness is 1
_ELSEWHERE = 1e-5  # distance at the tightest tolerance beyond which the minimum is another one
_COMPILING = 0.5  # s of set-up and a first step that a note tells
_LIMIT = 10.0  # CPU s of a run
_TRIED = 30  # steps by which the cost of a step is known
_REPEATS = 0.2  # s after which a run is not repeated


class Run(NamedTuple):
    """One minimisation: CPU seconds, positions reached (n, 2), what a reader must know, whether it was cut short."""

    seconds: float
    positions: Array
    note: str
    cut: bool = False


def measure_codes(seed: int) -> Iterator[Trial]:
    """Measure every code at every tolerance, from a minimum whose disks were moved a little."""
    for peer in PEERS:
        if installed(peer.package) is None:
            raise InputError(f"{peer.name}: {MISSING}")
    for n in [n for n, packings in _PACKINGS.items() if seed <= packings]:
        start, minimum = jolted_minimum(n, seed, _PHI, _JOLT[n])
        bearing = ~contacts(minimum).rattlers
        descend = Jamlab().descent(start)
        least = max(_REFERENCE, _ROUNDING * float(np.spacing(start.box.max())))
        exact, nearly = (descend(force, MOST_STEPS) for force in (least, _CHECK * least))
        known = _distance(nearly, exact, start, bearing)
        apart = [peer for peer in PEERS if peer.apart]
        found = {peer.name: _runs((peer.descent, start)) for peer in (Jamlab(), *PEERS) if not peer.apart}
        theirs = run_side_by_side(_runs, [(peer.descent, start) for peer in apart], 1)
        for name, runs in (found | {peer.name: each for peer, each in zip(apart, theirs, strict=True)}).items():
            trials = []
            for tolerance, run in zip(_TOLERANCES, runs, strict=True):
                error = _distance(run.positions, exact, start, bearing)
                default = name == "jamlab" and tolerance == usual_force_tolerance("sp")
                numbers = (run.seconds, error, known, default, run.note, run.cut)
                trials.append(Trial(f"N = {n}", name, f"{tolerance:g}", *numbers))
            if trials[-1].error > _ELSEWHERE and not trials[-1].cut:
                trials = [replace(trial, error=float("nan"), note="ends in another minimum") for trial in trials]
            yield from trials


def _runs(item: tuple[Callable[[Packing], Descent], Packing], _: Any = None) -> list[Run]:
    """One run for each tolerance, from a start. One that its limit cuts short stands for tighter ones too."""
    prepare, start = item
    began = time.process_time()
    run = prepare(start)
    run(_TOLERANCES[0], 1)
    first = time.process_time() - began
    began = time.process_time()
    run(_TOLERANCES[-1], _TRIED)
    steps = min(MOST_STEPS, int(_LIMIT / (time.process_time() - began) * _TRIED))
    note = f"set-up {first:.1f} s more" if first > _COMPILING else ""
    found: list[Run] = []
    for tolerance in _TOLERANCES:
        if found and found[-1].cut:
            found.append(found[-1])
        else:
            seconds, positions = shortest(partial(run, tolerance, steps), budget=_REPEATS)
            left = _force_left(start, positions)
            if left > 2 * tolerance and seconds < 0.5 * _LIMIT and steps < MOST_STEPS:  # later steps may be cheaper
                longer = partial(run, tolerance, min(MOST_STEPS, int(steps * _LIMIT / seconds)))
                seconds, positions = shortest(longer, budget=_REPEATS)
                left = _force_left(start, positions)
            missed = left > 2 * tolerance
            cut = missed and seconds > 0.5 * _LIMIT
            if missed:
                note = f"{f'cut short after {_LIMIT:g} s' if cut else 'stalls'} at a largest force of {left:.0e}"
            found.append(Run(seconds, positions, note, cut))
        note = ""
    return found


def _force_left(start: Packing, positions: Array) -> float:
    return evaluate(start.with_state(positions=positions)).max_force


def _distance(positions: Array, exact: Array, start: Packing, bearing: NDArray[np.bool_]) -> float:
    """Root mean square distance of the disks that bear force, in mean diameters, without the motion of all of them."""
    moved = (positions - exact)[bearing]
    moved -= shortest_images(moved, start.box) @ start.box
    return float(np.sqrt(((moved - moved.mean(axis=0)) ** 2).sum(axis=1).mean()))


CHARTS = (Chart("other-codes", measure_codes, rehearsed=False),)  # every run warms up by itself
