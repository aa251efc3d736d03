"""Charts of packings of disks: the search for onset, and packing at a pressure."""

import operator
import time
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
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
from studies.speed_accuracy.chart import Chart, Panel, Point, Trial, points_of

_N = 16
_STEPS = {"bisection": (0.1, 5e-2, 1e-2, 2e-3, 5e-4), "paper": (1e-2, 3e-3, 1e-3, 3e-4)}
_PACKING, _MEAN = "onset of one packing", "mean over packings"


def search_onset(seed: int) -> Iterator[Trial]:
    """Search from one random start by every step; the difference keeps its sign, so that it averages."""
    reference = jam("sp", _N, seed, search="paper", step=float(defaults("onset")["step_paper"])).phi
    panel = Panel(_PACKING, reference, 1e-8, operator.sub, {"runs": 1})
    for search, steps in _STEPS.items():
        for step in steps:
            default = search == "bisection" and step == float(defaults("onset")["step"])
            yield panel.trial(search, f"{step:g}", partial(_find, seed, search, step), default)


def _find(seed: int, search: str, step: float) -> float:
    return jam("sp", _N, seed, search=search, step=step).phi


def points_of_onsets(trials: pd.DataFrame) -> list[Point]:
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
        panel = Panel(f"p = {pressure:g} k", pressure, 1e-16 / pressure, lambda p, asked: p / asked - 1, {"runs": 1})
        usual = force_tolerance("sp")
        for force in (*(f * pressure for f in _PACK_FORCES), usual):
            yield panel.trial("pack", f"force {force:g}", partial(_pack, pressure, seed, force), force == usual)
        for force in _FORCES:
            yield panel.trial("free box, FIRE alone", f"{force:g} p", partial(_fire_in_free_box, pressure, seed, force))
        yield from _secant(panel, pressure, seed)


def _pack(pressure: float, seed: int, force: float) -> float:
    return float(pack(_DISKS, pressure, seed, tolerance=force).provenance["pressure"])


def _start(pressure: float, seed: int) -> Packing:
    return random_disks(_DISKS, seed, phi=float(defaults("pressure")["phi_jammed"]) + 2 * pressure, units="k")


def _fire_in_free_box(pressure: float, seed: int, force: float) -> float:
    """The pressure where the enthalpy is minimised by FIRE alone, from the start on."""
    with Session(_start(pressure, seed)) as session:
        session.minimize(1e-2 * pressure, style="fire", steps=_FIRE_STEPS)  # the box would blow up at once
        border = Border(COMPRESSION, pressure)
        found = session.minimize(force * pressure, style="fire", steps=_FIRE_STEPS, border=border)
    if found.max_force > force * pressure:
        raise ConvergenceError("force tolerance not met")
    return found.pressure


def _secant(panel: Panel, pressure: float, seed: int) -> Iterator[Trial]:
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
                yield Trial(panel.name, "secant in φ", f"miss {waiting.pop(0):g}", took, miss, panel.reference_error)
            if not waiting:
                return
            if before is not None and before[0] != phi and before[1] > 0.1 * pressure < state.pressure:
                found = (state.pressure - before[1]) / (phi - before[0])
                slope = found if 0.03 < found < 3 else slope
            before = (phi, state.pressure)
            phi += min((pressure - state.pressure) / slope, 0.5 * pressure / slope)
            session.load(at_phi(session.packing(), phi))
    for miss in waiting:
        numbers = (float("nan"), float("nan"), panel.reference_error)
        yield Trial(panel.name, "secant in φ", f"miss {miss:g}", *numbers, note=f"{_MOST} minima")


CHARTS = (
    Chart("onset-search", search_onset, average=points_of_onsets),
    Chart("pressure-packing", pack_to_pressures),
)
