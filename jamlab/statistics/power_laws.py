"""Fit power laws near jamming; `jamlab.statistics.confidence` gives the intervals of what is fitted here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array, ArrayLike
from jamlab.checks import checked, finite_array
from jamlab.errors import InputError

_STEEPEST = 100.0  # exponent that powers of sizes and of distances from onset bear in float64


@dataclass(frozen=True)
class PowerLaw:
    """y = sum of coefficients_k x^exponents_k."""

    # coefficients, exponents: (terms,)
    coefficients: Array
    exponents: Array
    # low, high: smallest and largest x fitted
    low: float
    high: float
    spread: float  # root mean square of the relative residuals

    def __call__(self, x: ArrayLike) -> Array:
        """y at x, of the shape of x."""
        return np.asarray((np.asarray(x, dtype=np.float64)[..., None] ** self.exponents) @ self.coefficients)


@checked
def power_law(
    x: ArrayLike, y: ArrayLike, exponents: Sequence[float] | None = None, *, low: float = 0.0, high: float = np.inf
) -> PowerLaw:
    """Fit a power law, or a sum of several of given exponents, such as z - z_J = z_0 d^0.5 + z_1 d^1, Boromand et al.
    eqs 13-14. Residuals are relative, so that every decade counts alike; a free law is a line through ln y. Points from
    `low` to `high` count, unless x or y is nan or not positive."""
    powers = None if exponents is None else finite_array("exponents", exponents, (None,))
    if powers is not None and not (len(powers) and np.abs(powers).max() <= _STEEPEST):
        raise InputError(f"exponents = {exponents!r}: give one or more, within {_STEEPEST:g} of 0, or None")
    a, b = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if a.ndim != 1 or a.shape != b.shape:
        raise InputError(f"x and y have shapes {a.shape} and {b.shape}: need two rows of the same length")
    kept = (a >= low) & (a <= high) & (a > 0) & (b > 0) & np.isfinite(a + b)
    a, b = a[kept], b[kept]
    if len(a) < (2 if powers is None else max(2, len(powers))):
        raise InputError(f"{len(a)} points from {low:g} to {high:g} are too few: widen the window")
    if powers is None:
        slope, height = np.polyfit(np.log(a), np.log(b), 1)
        powers, coefficients = np.array([slope]), np.exp([height])
    else:
        coefficients = np.linalg.lstsq(a[:, None] ** powers / b[:, None], b / b, rcond=None)[0]
    residual = ((a[:, None] ** powers) @ coefficients - b) / b
    return PowerLaw(coefficients, powers, float(a.min()), float(a.max()), float(np.sqrt(np.mean(residual**2))))


def fit_exponent(x: Array, y: Array) -> float:
    """Fit the exponent of y ~ x^e by a straight line through logarithms; nan where y is not positive everywhere."""
    kept = np.isfinite(x + y)
    if kept.sum() < 3 or (y[kept] <= 0).any():
        return float("nan")
    x, y = np.log(x[kept]), np.log(y[kept])
    x = x - x.mean()
    return float(x @ y / (x @ x))
