"""Fit power laws near jamming: exponents fixed or free.

`jamlab.statistics.confidence` gives the intervals of what is fitted here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.errors import ConvergenceError, InputError

_GRID = np.linspace(-2.0, 2.0, 41)  # exponents less the mean slope, searched where two terms become one
_APART, _CANCEL = 0.02, 20.0  # two terms are one if exponents are nearer, and coefficients so many times the sum
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
    points: int  # number of points fitted
    spread: float  # root mean square of the residuals, relative or in standard errors
    worst: float  # largest residual, in the same unit

    def __call__(self, x: ArrayLike) -> Array:
        """y at x, of the shape of x."""
        return np.asarray((np.asarray(x, dtype=np.float64)[..., None] ** self.exponents) @ self.coefficients)


@checked
def power_law(
    x: ArrayLike,
    y: ArrayLike,
    exponents: Sequence[float | None] = (None,),
    *,
    error: ArrayLike | None = None,
    low: float = 0.0,
    high: float = np.inf,
) -> PowerLaw:
    """Fit one power law or a sum of several, such as z - z_J = z_0 d^0.5 + z_1 d^1, Boromand et al. eqs 13-14;
    exponents None are fitted. Without errors residuals are relative, so that every decade counts alike, and a single
    free law is a line through ln y. Points are left out if they are nan, or if x or the error (without errors: y) is
    not positive."""
    if len(exponents) == 0:
        raise InputError("a power law needs an exponent: give (None,) for one free exponent")
    for e in exponents:
        if e is not None and not abs(e) <= _STEEPEST:
            raise InputError(f"exponents = {exponents!r}: must lie within {_STEEPEST:g} of 0, or be None")
    x, y = _same_length(x, y)
    unit = y if error is None else _same_length(x, error)[1]
    kept = (x >= low) & (x <= high) & (x > 0) & (unit > 0) & np.isfinite(x + y + unit)
    x, y, unit = x[kept], y[kept], unit[kept]
    free = [k for k, e in enumerate(exponents) if e is None]
    if len(x) < max(len(exponents) + len(free), 2):
        raise InputError(
            f"{len(x)} points from {low:g} to {high:g} for {len(exponents)} power law(s): widen the window"
        )
    powers = np.array([np.nan if e is None else e for e in exponents])
    up = y > 0
    slope = np.polyfit(np.log(x[up]), np.log(y[up]), 1) if up.sum() > 1 else np.array([1.0, 0.0])
    if free and len(powers) == 1 and error is None:
        powers, coefficients = slope[:1], np.exp(slope[1:])
    else:
        if free:
            powers = _fit_exponents(x, y, unit, powers, free, float(slope[0]))
        coefficients = _fit_coefficients(x, y, unit, powers)
    residual = ((x[:, None] ** powers) @ coefficients - y) / unit
    spread, worst = float(np.sqrt(np.mean(residual**2))), float(np.abs(residual).max())
    low, high = float(x.min()), float(x.max())
    return PowerLaw(coefficients, powers, low, high, len(x), spread, worst)


def _fit_coefficients(x: Array, y: Array, unit: Array, powers: Array) -> Array:
    """Least squares in (model - y)/unit for given exponents."""
    return np.asarray(np.linalg.lstsq(x[:, None] ** powers / unit[:, None], y / unit, rcond=None)[0])


def _fit_exponents(x: Array, y: Array, unit: Array, powers: Array, free: list[int], slope: float) -> Array:
    """Find the free exponents by variable projection (Golub & Pereyra 1973): given them, coefficients are linear."""

    def fill_in(values: Array) -> Array:
        out = powers.copy()
        out[free] = values
        return out

    def residual(values: Array) -> Array:
        trial = fill_in(values)
        return np.asarray(((x[:, None] ** trial) @ _fit_coefficients(x, y, unit, trial) - y) / unit)

    # terms start apart from each other, on both sides of the mean slope: exponents 0.5 and 1 are 0.5 apart
    start = slope + 0.4 * (np.arange(len(free)) - 0.5 * (len(free) - 1))
    start += 0.1 * np.any(np.isclose(powers[:, None], start), axis=0)  # two equal terms would be one
    found = least_squares(residual, start, x_scale=0.1)
    if found.success and len(free) == 2 and _merged(fill_in(found.x), x, y, unit):
        pairs = [np.array(pair) for pair in combinations(slope + _GRID, 2)]
        best = min(pairs, key=lambda pair: float(np.sum(residual(pair) ** 2)))
        found = least_squares(residual, best, x_scale=0.01)
    if not found.success or _merged(fill_in(found.x), x, y, unit):
        why = f"two terms became one, of exponents {found.x.round(4)}" if found.success else found.message
        raise ConvergenceError(f"free exponents not found ({why}): narrow the window or fix one")
    return fill_in(found.x)


def _merged(powers: Array, x: Array, y: Array, unit: Array) -> bool:
    """Whether two terms have become x^a ln x: exponents alike, and coefficients that take each other away."""
    near = np.abs(np.subtract.outer(powers, powers)) + np.eye(len(powers)) < _APART
    largest = np.abs(_fit_coefficients(x, y, unit, powers) * x[:, None] ** powers).max(axis=1)
    return bool(near.any() and np.median(largest / np.abs(y)) > _CANCEL)


def _same_length(x: ArrayLike, y: ArrayLike) -> tuple[Array, Array]:
    a, b = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if a.ndim != 1 or a.shape != b.shape:
        raise InputError(f"x and y have shapes {a.shape} and {b.shape}: need two rows of the same length")
    return a, b


def fit_exponent(x: Array, y: Array) -> float:
    """Fit the exponent of y ~ x^e by a straight line through logarithms; nan where y is not positive everywhere."""
    kept = np.isfinite(x + y)
    if kept.sum() < 3 or (y[kept] <= 0).any():
        return float("nan")
    x, y = np.log(x[kept]), np.log(y[kept])
    x = x - x.mean()
    return float(x @ y / (x @ x))
