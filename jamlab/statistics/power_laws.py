"""Fit power laws near jamming; `jamlab.statistics.confidence` gives the intervals of what is fitted here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from jamlab.arrays import Array
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
    if exponents is not None:
        exponents = finite_array("exponents", exponents, (None,))
        if not (len(exponents) and np.abs(exponents).max() <= _STEEPEST):
            raise InputError(f"exponents = {exponents}: give one or more, within {_STEEPEST:g} of 0, or None")
    x, y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if x.ndim != 1 or x.shape != y.shape:
        raise InputError(f"x and y have shapes {x.shape} and {y.shape}: need two rows of the same length")
    kept = (x >= low) & (x <= high) & (x > 0) & (y > 0) & np.isfinite(x + y)
    x, y = x[kept], y[kept]
    if len(x) < max(2, 0 if exponents is None else len(exponents)):
        raise InputError(f"{len(x)} points from {low:g} to {high:g} are too few: widen the window")
    if exponents is None:
        slope, height = np.polyfit(np.log(x), np.log(y), 1)
        powers, coefficients = np.array([slope]), np.exp([height])
    else:
        powers = np.asarray(exponents)
        coefficients = np.linalg.lstsq(x[:, None] ** powers / y[:, None], y / y, rcond=None)[0]
    residual = ((x[:, None] ** powers) @ coefficients - y) / y
    return PowerLaw(coefficients, powers, float(x.min()), float(x.max()), float(np.sqrt(np.mean(residual**2))))


def fit_exponent(x: Array, y: Array) -> float:
    """Fit the exponent of y ~ x^e by a straight line through logarithms; nan where y is not positive everywhere."""
    kept = np.isfinite(x + y)
    if kept.sum() < 3 or (y[kept] <= 0).any():
        return float("nan")
    x, y = np.log(x[kept]), np.log(y[kept])
    x = x - x.mean()
    return float(x @ y / (x @ x))
