"""The confidence of every interval and promise, and how an error that is allowed is shared out."""

import math

from scipy.special import ndtri

CONFIDENCE = 0.95  # share of intervals that hold the truth, and of new packings that keep what is promised
STANDARD_ERRORS = float(ndtri(0.5 + 0.5 * CONFIDENCE))  # on either side of such an interval: 1.96


def room(error: float, bias_error: float) -> float:
    """Part of an error that is left for the scatter, as roots of sums of squares; half of the bias where that takes all
    of it."""
    return math.sqrt(error**2 - bias_error**2) if bias_error < error else 0.5 * bias_error
