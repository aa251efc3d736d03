"""Chart of means over packings: how many of which size."""

import time
from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd
from scipy.optimize import curve_fit

from jamlab.arrays import Array
from jamlab.measure import measure
from jamlab.protocols.target_pressure import pack
from studies.speed_accuracy.chart import BAND, Chart, Trial, ranked

_PRESSURE = 1e-3
_SIZES = (16, 32, 64, 128, 256)
_LARGE = {1024: 20, 4096: 10}  # N of the reference -> how many of the seeds
# of N, between which differences from the limit of large N fall: 0.69(4) for phi, 0.84(3) for z
_EXPONENTS = (0.5, 1.0)
_PACKINGS = (1, 2, 5, 10, 20, 50)
_DRAWS = 2000
_QUANTITIES = {"phi": "φ", "z": "z", "g": "G, k"}


def means_of_sizes(seed: int) -> Iterator[Trial]:
    """Make a packing of every size; `error` holds its values, from which `points_of_means` makes errors of means."""
    for n in (*_SIZES, *(n for n, packings in _LARGE.items() if seed <= packings)):
        began = time.process_time()
        values = measure(pack(n, _PRESSURE, seed), ("phi", "z", "g"))
        seconds = time.process_time() - began
        for key, panel in _QUANTITIES.items():
            yield Trial(panel, f"N = {n}", "", seconds, float(values[key]))


def points_of_means(trials: pd.DataFrame) -> pd.DataFrame:
    """Errors of means over so many packings of a size, drawn with repetition from all that there are. The floor is the
    error of the reference, see `limit_of_size`."""
    rng, rows = np.random.default_rng(0), []
    for panel in _QUANTITIES.values():
        here = trials[trials["panel"] == panel].dropna(subset="error")
        sizes = {n: here[here["method"] == f"N = {n}"] for n in (*_SIZES, *_LARGE)}
        reference, floor = limit_of_size({n: found["error"].to_numpy() for n, found in sizes.items()})
        for n in _SIZES:
            values, cost = sizes[n]["error"].to_numpy(), float(sizes[n]["seconds"].median())
            for count in _PACKINGS:
                off = np.abs(rng.choice(values, (_DRAWS, count)).mean(axis=1) - reference)
                low, high = map(float, np.quantile(off, BAND))
                row = {"panel": panel, "method": f"N = {n}", "setting": f"{count}", "seconds": count * cost}
                row |= {"error": float(off.mean()), "low": low, "high": high, "packings": len(values), "failed": 0}
                rows.append(row | {"cut": 0, "default": False, "note": "", "floor": floor})
    return ranked(pd.DataFrame(rows))


def limit_of_size(values: Mapping[int, Array]) -> tuple[float, float]:
    """Limit a of large N and its standard error, from a + b/N^c through the means of packings of four sizes or more.
    Where the means scatter about that curve by more than their errors, the error grows by as much."""
    size = np.array(list(values), dtype=np.float64)
    mean = np.array([each.mean() for each in values.values()])
    sigma = np.array([each.std(ddof=1) / np.sqrt(len(each)) for each in values.values()])
    start, bounds = (mean[-1], mean[0] - mean[-1], np.mean(_EXPONENTS)), [(-np.inf, -np.inf), (np.inf, np.inf)]
    low, high = ((*bound, exponent) for bound, exponent in zip(bounds, _EXPONENTS, strict=True))
    found, covariance = curve_fit(_means, size, mean, start, sigma, absolute_sigma=True, bounds=(low, high))
    misfit = float((((_means(size, *found) - mean) / sigma) ** 2).sum()) / (len(size) - len(found))
    return float(found[0]), float(np.sqrt(covariance[0, 0] * max(misfit, 1.0)))


def _means(size: Array, limit: float, part: float, exponent: float) -> Array:
    return limit + part * size**-exponent


CHARTS = (Chart("ensemble-means", means_of_sizes, points=points_of_means),)
