"""The search for jamming onset: phi_J of every packing and its mean, against compression in the paper's small steps."""

import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from jamlab.engine.deck_defaults import defaults
from jamlab.errors import ConvergenceError
from jamlab.protocols.onset import jam
from jamlab.studies.cost.chart import Chart, Trial
from jamlab.studies.cost.curves import Point, points_of

_N = 16
_STEPS = {"bisection": (0.1, 5e-2, 1e-2, 2e-3, 5e-4), "paper": (1e-2, 3e-3, 1e-3, 3e-4)}
_PACKING, _MEAN = "onset of one packing", "mean over packings"


def measure(seed: int) -> Iterator[Trial]:
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


CHART = Chart(
    "onset-search",
    f"Search for the onset of {_N} disks",
    "error of φ at onset",
    "first step in φ",
    "compression from φ = 0.2 in steps of 1e-4 all the way, search='paper'. φ_J of a packing is known to 1e-8. Errors "
    "of the mean are its paired difference and the standard error of that, squares added; the largest standard error "
    "is what twenty packings leave unknown of any mean",
    measure,
    average=points,
    reason="twenty packings do not tell first steps of 0.05 from 0.01; hundreds hold the default to the paper's "
    "distribution, benchmark_onset.py",
)
