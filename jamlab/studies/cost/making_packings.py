"""Charts of how packings of disks are made: the search for onset, and a pressure."""

import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from jamlab.engine.box_border import COMPRESSION, Border
from jamlab.engine.deck_defaults import defaults
from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError
from jamlab.packing.deformation import at_phi
from jamlab.packing.packing import Packing
from jamlab.protocols.onset import jam
from jamlab.protocols.random_start import random_disks
from jamlab.protocols.relaxation import force_tolerance, relax
from jamlab.protocols.target_pressure import pack
from jamlab.studies.cost.chart import Chart, Point, Trial, points_of

_N = 16
_STEPS = {"bisection": (0.1, 5e-2, 1e-2, 2e-3, 5e-4), "paper": (1e-2, 3e-3, 1e-3, 3e-4)}
_PACKING, _MEAN = "onset of one packing", "mean over packings"


def search_onset(seed: int) -> Iterator[Trial]:
    """Search from one random start by every step; the difference keeps its sign, so that it averages."""
    reference, _ = _find(seed, "paper", float(defaults("onset")["step_paper"]))
    for search, steps in _STEPS.items():
        for step in steps:
            default = search == "bisection" and step == float(defaults("onset")["step"])
            phi, seconds = _find(seed, search, step)
            note = "" if np.isfinite(phi) else "no onset found"
            yield Trial(_PACKING, search, f"{step:g}", seconds, phi - reference, 1e-8, default, note)


def _find(seed: int, search: str, step: float) -> tuple[float, float]:
    began = time.process_time()
    try:
        phi = jam("sp", _N, seed, search=search, step=step).phi
    except ConvergenceError:
        phi = float("nan")
    return phi, time.process_time() - began


def points(trials: pd.DataFrame) -> list[Point]:
    """Points of one packing; and of the mean, whose error holds its bias and what is unknown of it. What twenty
    packings know of a mean is told by the step whose difference is known least: one that differs in none of them, or in
    two, may do so in the next."""
    found = points_of(trials)
    means = []
    for point in found:
        rows = trials[(trials["method"] == point.method) & (trials["setting"] == point.setting)]
        off = rows["error"].dropna().to_numpy(dtype=np.float64)
        if len(off) > 1:
            means.append((point, float(off.mean()), float(off.std(ddof=1) / np.sqrt(len(off)))))
    floor = max((spread for _, _, spread in means), default=0.0)
    for point, bias, spread in means:
        middle = abs(bias)
        ends = (max(0.0, middle - 1.28 * spread), middle + 1.28 * spread)  # 10 and 90 % of what the bias may be
        error = float(np.hypot(bias, spread))
        changes: Any = {"low": ends[0], "high": ends[1], "floor": floor, "loose": floor > 0}
        found.append(replace(point, panel=_MEAN, error=error, **changes))
    return found


ONSET = Chart(
    "onset-search",
    f"Search for the onset of {_N} disks",
    "error of φ at onset",
    "first step in φ",
    "compression from φ = 0.2 in steps of 1e-4 all the way, search='paper'. φ_J of a packing is known to 1e-8. Errors "
    "of the mean are its paired difference and the standard error of that, squares added; the largest standard error "
    "is what twenty packings leave unknown of any mean",
    search_onset,
    average=points,
    reason="twenty packings do not tell first steps of 0.05 from 0.01; hundreds hold the default to the paper's "
    "distribution, benchmark_onset.py",
)


_DISKS = 256
_PRESSURES = (1e-2, 1e-3, 1e-4)
_FORCES = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10)  # over the pressure
_PACK_FORCES = (1e-4, 1e-6)  # the same where Newton steps follow: they need a start, and end far below
_MISSES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10)  # of the pressure, relative
_MOST = 60  # minima of a secant
_FIRE_STEPS = 50_000


def pack_to_pressures(seed: int) -> Iterator[Trial]:
    """Measure at every pressure from one random start; the target itself is the reference."""
    for pressure in _PRESSURES:
        panel, unsure = f"p = {pressure:g} k", 1e-16 / pressure
        usual = force_tolerance("sp")
        for force in (*(f * pressure for f in _PACK_FORCES), usual):
            began = time.process_time()
            try:
                off, note = (
                    float(pack(_DISKS, pressure, seed, tolerance=force).provenance["pressure"]) / pressure - 1,
                    "",
                )
            except ConvergenceError as error:
                off, note = float("nan"), str(error)
            seconds = time.process_time() - began
            yield Trial(panel, "pack", f"force {force:g}", seconds, off, unsure, force == usual, note)
        yield from _free_box_by_fire(panel, pressure, seed, unsure)
        yield from _secant(panel, pressure, seed, unsure)


def _start(pressure: float, seed: int) -> Packing:
    return random_disks(_DISKS, seed, phi=float(defaults("pressure")["phi_jammed"]) + 2 * pressure, units="k")


def _free_box_by_fire(panel: str, pressure: float, seed: int, unsure: float) -> Iterator[Trial]:
    """The enthalpy by FIRE alone, each tolerance from the start on."""
    for force in _FORCES:
        began = time.process_time()
        with Session(_start(pressure, seed)) as session:
            session.minimize(1e-2 * pressure, style="fire", steps=_FIRE_STEPS)  # the box would blow up at once
            border = Border(COMPRESSION, pressure)
            found = session.minimize(force * pressure, style="fire", steps=_FIRE_STEPS, border=border)
        seconds = time.process_time() - began
        met = found.max_force <= force * pressure
        off, note = (found.pressure / pressure - 1, "") if met else (float("nan"), "force tolerance not met")
        yield Trial(panel, "free box, FIRE alone", f"{force:g} p", seconds, off, unsure, note=note)


def _secant(panel: str, pressure: float, seed: int, unsure: float) -> Iterator[Trial]:
    """Minima at fixed box, phi by a secant, as the deck in.sp.pressure; the clock is read at every miss that is met."""
    waiting = list(_MISSES)
    began = time.process_time()
    start = _start(pressure, seed)
    with Session(start) as session:
        slope, before, phi = 0.3, None, start.phi
        for _ in range(_MOST):
            state = relax(session).evaluation
            miss = state.pressure / pressure - 1
            while waiting and abs(miss) <= waiting[0]:
                took = time.process_time() - began
                yield Trial(panel, "secant in φ", f"miss {waiting.pop(0):g}", took, miss, unsure)
            if not waiting:
                return
            if before is not None and before[0] != phi and before[1] > 0.1 * pressure < state.pressure:
                found = (state.pressure - before[1]) / (phi - before[0])
                slope = found if 0.03 < found < 3 else slope
            before = (phi, state.pressure)
            phi += min((pressure - state.pressure) / slope, 0.5 * pressure / slope)
            session.load(at_phi(session.packing(), phi))
    for miss in waiting:
        yield Trial(panel, "secant in φ", f"miss {miss:g}", float("nan"), float("nan"), unsure, note="60 minima")


PRESSURE = Chart(
    "pressure-packing",
    f"Packing {_DISKS} disks at a pressure, from a random start",
    "relative error of the pressure",
    "force tolerance, in k d or over the pressure; miss of the pressure at which the secant ends",
    "the pressure asked for, exact to the rounding of a stress, 1e-16 k",
    pack_to_pressures,
    reason="FIRE with a free box right from the quench ends in other packings: over 40 seeds, paired, phi is higher by "
    "1(2)e-4 at p = 1e-2, 1.5(3)e-3 at 1e-3 and 2.5(4)e-3 at 1e-4; so pack walks there by stages at every pressure",
)
