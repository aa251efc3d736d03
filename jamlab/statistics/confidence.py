"""The confidence of every interval and promise, and bounds of errors from measured ones by order statistics."""

import math
from collections.abc import Sequence

import numpy as np
from scipy.special import ndtri

from jamlab.arrays import Array

CONFIDENCE = 0.95  # share of intervals that hold the truth, and of new packings that keep what is promised
STANDARD_ERRORS = float(ndtri(0.5 + 0.5 * CONFIDENCE))  # on either side of such an interval: 1.96


def room(error: float, bias_error: float) -> float:
    """Part of an error that is left for the scatter, as roots of sums of squares; half of the bias where that takes all
    of it."""
    return math.sqrt(error**2 - bias_error**2) if bias_error < error else 0.5 * bias_error


def exceeded_by_few(errors: Array | Sequence[float]) -> float:
    """Error that a new packing exceeds in 1 - `CONFIDENCE` of all cases, whatever the distribution: the k-th largest of
    m, k/(m + 1) = 1 - `CONFIDENCE`, as a new one is as likely in every place among them. Infinite, no promise, for m <
    19."""
    place = int((1 - CONFIDENCE) * (len(errors) + 1) + 1e-9)
    return float(np.sort(errors)[-place]) if place else float("inf")


def between(levels: Array, values: Array | Sequence[float], at: float) -> float:
    """Value on the line between the two levels beside a place; infinite if that of either is."""
    left, right, part = neighbours(levels, at)
    return float(values[left] if part == 0 else (1 - part) * values[left] + part * values[right])


def neighbours(levels: Array, at: float) -> tuple[int, int, float]:
    """Levels on both sides of a place, and the part of the way from the first to the second; one level stands alone."""
    if len(levels) == 1 or at <= levels[0]:
        return 0, 0, 0.0
    right = min(int(np.searchsorted(levels, at)), len(levels) - 1)
    part = float((at - levels[right - 1]) / (levels[right] - levels[right - 1]))
    return (right, right, 0.0) if part == 1 else (right - 1, right, part)


def bend(levels: Array, values: Array, at: float) -> float:
    """How far a curve through the levels may lie from the line between two of them: |f''| (x - a)(b - x)/2. The second
    derivative is the largest of those through three levels at the four around the place."""
    left, right, part = neighbours(levels, at)
    if part == 0:
        return 0.0
    slopes = np.diff(values) / np.diff(levels)
    around = range(max(left - 1, 1), min(right + 2, len(levels) - 1))
    halves = [(slopes[k] - slopes[k - 1]) / (levels[k + 1] - levels[k - 1]) for k in around]
    known = [abs(half) for half in halves if np.isfinite(half)]
    return float(max(known, default=0.0) * (at - levels[left]) * (levels[right] - at))
