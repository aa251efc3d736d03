"""Fit power laws near jamming; `jamlab.statistics.confidence` gives the intervals of what is fitted here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from jamlab.arrays import Array, ArrayLike
from jamlab.checks import checked, finite_array
from jamlab.errors import InputError


@dataclass(frozen=True)
class Fit:
    """How a power law is fitted."""

    steepest: float = 100.0  # exponent that powers of sizes and of distances from onset bear in float64
    passes: int = 3  # of weights: a fourth moves coefficients by less than 1 % of their errors
    alone: float = 1e-9  # 1 - leverage of a point that decides a coefficient by itself
    steps: int = 100  # of Newton
    largest_power: float = 700.0  # of e in float64


FIT = Fit()


@dataclass(frozen=True)
class FittedPowerLaw:
    """y = sum of coefficients_k x^exponents_k.

    Errors allow each point its own scatter: they follow from the fits that leave out one point each. An interval of 95
    % is the value ± t errors, with Student's t of as many degrees of freedom as there are points more than coefficients
    and exponents that are fitted. Of synthetic data (3 to 60 points, scatter of 1 to 60 % of y, or of up to 30 % of the
    mean of y), 85 to 100 % of these intervals hold the truth.
    """

    # coefficients, exponents: (terms,)
    coefficients: Array
    exponents: Array
    # low, high: smallest and largest x fitted
    low: float
    high: float
    spread: float  # root mean square of the residuals over the fit
    # coefficients_stderr, exponents_stderr: standard errors; 0 of given exponents, nan where points are as many as what
    # is fitted, or one of them decides alone
    coefficients_stderr: Array
    exponents_stderr: Array

    def __call__(self, x: ArrayLike) -> Array:
        """y at x, of the shape of x."""
        return np.asarray((np.asarray(x, dtype=np.float64)[..., None] ** self.exponents) @ self.coefficients)


@checked
def fit_power_law(
    x: ArrayLike, y: ArrayLike, exponents: Sequence[float] | None = None, *, low: float = 0.0, high: float = np.inf
) -> FittedPowerLaw:
    """Fit a power law, or a sum of several of given exponents, such as z - z_J = z_0 d^0.5 + z_1 d^1, Boromand et al.
    eqs 13-14.

    Residuals are over the fit, so that every decade counts alike and the fit goes through the mean of data that
    scatter. Over the data, or in logarithms, it would come out too low. Values of y may be zero or negative. Where
    terms have opposite signs, residuals are over the sum of their magnitudes.

    Args:
        x, y: (m,) points; those where x is not positive, or x or y not finite, are left out.
        exponents: within 100 of 0, no two alike. Default: one free exponent.
        low, high: ends of the window of x.

    Returns:
        The law, with standard errors.

    Raises:
        InputError: too few points, exponents that they do not tell apart, or values of which so many are not positive
            that no power law of a free exponent goes through them.

    Example:
        >>> d = [1e-3, 1e-2, 1e-1]
        >>> from jamlab.statistics.power_laws import fit_power_law
        >>> fit_power_law(d, [0.12, 0.39, 1.25], (0.5, 1.0)).coefficients.round(2)
        array([3.81, 0.48])
        >>> from jamlab.statistics.power_laws import fit_power_law
        >>> fit_power_law(d, [0.12, 0.39, 1.25]).exponents.round(3)
        array([0.509])
    """
    powers = None if exponents is None else finite_array("exponents", exponents, (None,))
    if powers is not None and not (len(powers) and np.abs(powers).max() <= FIT.steepest):
        raise InputError(f"exponents = {exponents!r}: give one or more, within {FIT.steepest:g} of 0, or None")
    a, b = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if a.ndim != 1 or a.shape != b.shape:
        raise InputError(f"x and y have shapes {a.shape} and {b.shape}: need two rows of the same length")
    kept = (a >= low) & (a <= high) & (a > 0) & np.isfinite(a + b)
    a, b = a[kept], b[kept]
    if len(np.unique(a)) < (2 if powers is None else max(2, len(powers))):
        raise InputError(f"{len(np.unique(a))} places from {low:g} to {high:g} are too few: widen the window")
    if not b.any():
        raise InputError(f"y is 0 at all {len(b)} points: no power law goes through them")
    return _free(a, b) if powers is None else _given(a, b, powers)


def _given(x: Array, y: Array, powers: Array) -> FittedPowerLaw:
    """The coefficients of terms of given exponents, by least squares with weights from the previous fit."""
    middle = float(np.exp(np.log(x).mean()))  # makes terms alike in size
    terms = (x / middle)[:, None] ** powers
    height = (x / middle) ** powers.mean()
    for _ in range(FIT.passes):
        design = terms / height[:, None]
        found, _, rank, _ = np.linalg.lstsq(design, y / height, rcond=None)
        if rank < len(powers):
            raise InputError(f"exponents = {powers.tolist()}: {len(x)} points do not tell them apart, leave one out")
        last, height = height, terms @ np.abs(found)
    residual = y / last - design @ found
    unit = middle**-powers
    errors = np.sqrt(np.diag(_covariance(design, residual))) * unit
    spread = float(np.sqrt(np.mean((y / height - terms @ found / height) ** 2)))
    return FittedPowerLaw(found * unit, powers, float(x.min()), float(x.max()), spread, errors, np.zeros(len(powers)))


def _free(x: Array, y: Array) -> FittedPowerLaw:
    """The law c x^e of relative residuals whose sum, and whose sum over ln x, is 0: e is where the logarithm of the sum
    of y x^-e is least."""
    places = np.log(x)
    middle = places.mean()
    along = places - middle
    exponent = _flattest(along, y)
    factor = np.exp(-exponent * along)
    height = float(np.mean(y * factor))
    residual = y * factor / height - 1
    covariance = _covariance(np.column_stack([np.ones(len(x)), along]), residual)
    if abs(exponent * middle) > FIT.largest_power:
        raise InputError(f"the fitted exponent is {exponent:.3g}: its coefficient overflows, give x in another unit")
    coefficient = height * np.exp(-exponent * middle)
    errors = np.sqrt([[1, -middle] @ covariance @ [1, -middle], covariance[1, 1]])
    spread = float(np.sqrt(np.mean(residual**2)))
    ends = float(x.min()), float(x.max())
    return FittedPowerLaw(
        np.array([coefficient]), np.array([exponent]), *ends, spread, coefficient * errors[:1], errors[1:]
    )


def _flattest(along: Array, y: Array) -> float:
    """The exponent at which y over the power law has no slope. That of |y| is the only one, since its slope falls with
    the exponent; Newton steps lead from there to that of y."""
    scaled = y / np.abs(y).max()
    magnitude = np.abs(scaled)
    ends = (_slope(-FIT.steepest, along, magnitude)[0], _slope(FIT.steepest, along, magnitude)[0])
    if not ends[0] > 0 > ends[1]:
        raise InputError(
            f"no exponent within {FIT.steepest:g} of 0 fits {len(y)} points, {np.count_nonzero(y)} of them not 0: give "
            "points farther apart in x"
        )
    exponent = float(brentq(lambda e: _slope(e, along, magnitude)[0], -FIT.steepest, FIT.steepest, xtol=1e-13))
    if (y >= 0).all():
        return exponent
    for _ in range(FIT.steps):
        mean, bend = _slope(exponent, along, scaled)
        if not bend > 0:
            break
        exponent += float(np.clip(mean / bend, -1, 1))
        if abs(mean) <= 1e-8 * bend:  # the next step would be of its square
            return exponent
    raise InputError(
        f"{(y <= 0).sum()} of {len(y)} values are not positive, and no power law goes through them all: raise `low`, "
        "or give the exponents"
    )


def _slope(exponent: float, along: Array, y: Array) -> tuple[float, float]:
    """Slope of y over the power law in ln x, and how fast it falls with the exponent; nan of a mean below 0."""
    power = -exponent * along
    part = y * np.exp(power - power.max())
    if (total := part.sum()) <= 0:
        return np.nan, np.nan
    mean = part @ along / total
    return float(mean), float(part @ (along - mean) ** 2 / total)


def _covariance(design: Array, residual: Array) -> Array:
    """Covariance of a least-squares fit whose points scatter each by as much as it does (HC3, MacKinnon & White, J.
    Econometrics 29, 305 (1985)): nearly the covariance of the fits without one point."""
    points, fitted = design.shape
    inverse = np.linalg.inv(design.T @ design)
    free = 1 - np.einsum("mi,ij,mj->m", design, inverse, design)
    if points <= fitted or free.min() < FIT.alone:
        return np.full_like(inverse, np.nan)
    pull = inverse @ (design * (residual / free)[:, None]).T
    return np.asarray(pull @ pull.T)


def fit_exponent(x: Array, y: Array) -> float:
    """Fit the exponent of y ~ x^e by `power_law`; nan from fewer than three points, or where no such law is."""
    kept = np.isfinite(x + y)
    if kept.sum() < 3:
        return float("nan")
    try:
        return float(fit_power_law(x[kept], y[kept]).exponents[0])
    except InputError:
        return float("nan")
