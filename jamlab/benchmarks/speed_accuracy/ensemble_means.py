"""Means over packings: a few large packings or many small ones, finite size against scatter."""

import time
from collections.abc import Iterator

import numpy as np
import pandas as pd

from jamlab.benchmarks.speed_accuracy.curve_points import BAND, Point
from jamlab.benchmarks.speed_accuracy.topic import Topic, Trial
from jamlab.measure import measure as measure_packing
from jamlab.protocols.target_pressure import pack

_PRESSURE = 1e-3
_SIZES = (16, 32, 64, 128, 256)
_REFERENCE = 1024
_PACKINGS = (1, 2, 5, 10, 20, 50)
_DRAWS = 2000
_QUANTITIES = {"phi": "φ", "z": "z", "g": "G, k"}


def measure(seed: int) -> Iterator[Trial]:
    """Make a packing of every size; `error` holds its values, from which `points` makes errors of means."""
    for n in (*_SIZES, _REFERENCE):
        began = time.process_time()
        values = measure_packing(pack(n, _PRESSURE, seed), tuple(_QUANTITIES))
        seconds = time.process_time() - began
        for key, panel in _QUANTITIES.items():
            yield Trial(panel, f"N = {n}", "", seconds, float(values[key]))


def points(trials: pd.DataFrame) -> list[Point]:
    """Errors of means over so many packings of a size, drawn with repetition from all that there are.

    The floor is the standard error of the reference, the mean over the largest size.
    """
    rng = np.random.default_rng(0)
    found = []
    for panel in _QUANTITIES.values():
        sizes = {n: trials[(trials["panel"] == panel) & (trials["method"] == f"N = {n}")].dropna(subset="error")
                 for n in (*_SIZES, _REFERENCE)}  # fmt: skip
        largest = sizes.pop(_REFERENCE)["error"].to_numpy()
        reference, floor = float(largest.mean()), float(largest.std(ddof=1) / np.sqrt(len(largest)))
        for n, rows in sizes.items():
            values, cost = rows["error"].to_numpy(), float(rows["seconds"].median())
            for count in _PACKINGS:
                off = np.abs(rng.choice(values, (_DRAWS, count)).mean(axis=1) - reference)
                low, high = map(float, np.quantile(off, BAND))
                numbers = (count * cost, float(off.mean()), low, high, floor)
                found.append(Point(panel, f"N = {n}", f"{count}", *numbers, len(values), 0, False))
    return found


TOPIC = Topic(
    f"Means over packings of disks at p = {_PRESSURE:g} k",
    "error of the mean",
    "number of packings",
    f"mean over 100 packings of {_REFERENCE} disks. Its standard error is the floor: a mean that is known a hundred "
    "times better would take ten thousand times as many packings as the mean it judges",
    measure,
    seeds=range(1, 101),
    points=points,
)
