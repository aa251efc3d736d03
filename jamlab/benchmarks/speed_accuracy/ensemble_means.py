"""Means over packings: a few large packings or many small ones, finite size against scatter."""

import time
from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from jamlab.benchmarks.speed_accuracy.curve_points import BAND, Point
from jamlab.benchmarks.speed_accuracy.topic import Topic, Trial
from jamlab.measure import measure as measure_packing
from jamlab.protocols.target_pressure import pack

_PRESSURE = 1e-3
_SIZES = (16, 32, 64, 128, 256)
_LARGE = {1024: 100, 4096: 50}  # N of the reference -> how many of the seeds
_EXTRAPOLATED = 64  # sizes from here on carry it to large N
_PACKINGS = (1, 2, 5, 10, 20, 50)
_DRAWS = 2000
_QUANTITIES = {"phi": "φ", "z": "z", "g": "G, k"}


def measure(seed: int) -> Iterator[Trial]:
    """Make a packing of every size; `error` holds its values, from which `points` makes errors of means."""
    for n in (*_SIZES, *(n for n, packings in _LARGE.items() if seed <= packings)):
        began = time.process_time()
        values = measure_packing(pack(n, _PRESSURE, seed), tuple(_QUANTITIES))
        seconds = time.process_time() - began
        for key, panel in _QUANTITIES.items():
            yield Trial(panel, f"N = {n}", "", seconds, float(values[key]))


def points(trials: pd.DataFrame) -> list[Point]:
    """Errors of means over so many packings of a size, drawn with repetition from all that there are.

    The floor is the error of the reference, see `limit_of_size`.
    """
    rng = np.random.default_rng(0)
    found = []
    for panel in _QUANTITIES.values():
        sizes = {n: trials[(trials["panel"] == panel) & (trials["method"] == f"N = {n}")].dropna(subset="error")
                 for n in (*_SIZES, *_LARGE)}  # fmt: skip
        wide = {n: rows["error"].to_numpy() for n, rows in sizes.items() if n >= _EXTRAPOLATED}
        reference, floor = limit_of_size(wide)
        for n in _SIZES:
            values, cost = sizes[n]["error"].to_numpy(), float(sizes[n]["seconds"].median())
            for count in _PACKINGS:
                off = np.abs(rng.choice(values, (_DRAWS, count)).mean(axis=1) - reference)
                low, high = map(float, np.quantile(off, BAND))
                numbers = (count * cost, float(off.mean()), low, high, floor)
                found.append(Point(panel, f"N = {n}", f"{count}", *numbers, len(values), 0, False, loose=True))
    return found


def limit_of_size(values: Mapping[int, NDArray[np.float64]]) -> tuple[float, float]:
    """Limit a of large N and its standard error, from a + b/N through the means of packings of three sizes or more.

    Where the means scatter about that line by more than their errors, the error grows by as much.

    Args:
        values: N -> values of the packings.
    """
    mean = np.array([each.mean() for each in values.values()])
    weight = 1.0 / np.array([each.std(ddof=1) / np.sqrt(len(each)) for each in values.values()])
    inverse = 1.0 / np.array(list(values))
    line, covariance = np.polyfit(inverse, mean, 1, w=weight, cov="unscaled")
    misfit = float((((np.polyval(line, inverse) - mean) * weight) ** 2).sum()) / (len(mean) - 2)
    return float(line[1]), float(np.sqrt(covariance[1, 1] * max(misfit, 1.0)))


TOPIC = Topic(
    f"Means over packings of disks at p = {_PRESSURE:g} k",
    "error of the mean",
    "number of packings",
    f"limit a of large N, by a + b/N through means from N = {_EXTRAPOLATED} on, with "
    f"{' and '.join(f'{packings} packings of {n}' for n, packings in _LARGE.items())} among them. Its standard error, "
    "times what the means scatter about that line over their errors, is the floor: a mean known a hundred times better "
    "would take ten thousand times as many packings as the mean it judges",
    measure,
    seeds=range(1, 101),
    points=points,
)
