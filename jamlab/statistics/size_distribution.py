"""Fit distributions of sizes, as of avalanches: a power law from a least size on, with or without a cutoff.

Of the density p(s) ~ s^-tau exp(-s/s_c), s >= s_min, the parameters of largest likelihood match the means of log s and
of s; without cutoff tau = 1 + 1/<log(s/s_min)>. Where no least size is given, it is the one from which on the law is
closest to the data, by the distance of Kolmogorov and Smirnov.

Source: A. Clauset, C. R. Shalizi & M. E. J. Newman, SIAM Review 51, 661 (2009), eqs 3.1 and 3.9, table 2.1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from jamlab.arrays import Array, ArrayLike
from jamlab.checks import checked, finite_array, is_number
from jamlab.errors import ConvergenceError, InputError


@dataclass(frozen=True)
class SizeFit:
    """How a distribution of sizes is fitted."""

    fewest: int = 10  # sizes of a fit
    kept: int = 50  # sizes that a least size which is chosen leaves, or a fifth of all
    candidates: int = 25  # least sizes that are tried
    nodes: int = 200  # of Gauss and Legendre, over the logarithm of the size
    reach: float = 60.0  # sizes over the cutoff that are integrated to
    steps: int = 200  # of Newton
    # growth of the mean log-likelihood at the end, and where its rounding hides more
    digits: float = 1e-20
    rounding: float = 1e-10
    shortest: float = 1e-6  # part of a Newton step
    widest: float = 1e-9  # least size over the cutoff, below which there is no cutoff


SIZE_FIT = SizeFit()


@dataclass(frozen=True)
class SizeLaw:
    """p(s) ~ s^-exponent exp(-s/cutoff) for s >= least.

    Attributes:
        exponent: tau.
        cutoff: s_c; infinite for a power law.
        least: s_min.
        count: number of sizes fitted.
        distance: largest difference of the cumulative distributions of law and data.
    """

    exponent: float
    cutoff: float
    least: float
    count: int
    distance: float

    def beyond(self, sizes: ArrayLike) -> Array:
        """Share of the sizes above `least` that lie beyond some."""
        s = np.maximum(np.asarray(sizes, dtype=np.float64) / self.least, 1.0)
        if not np.isfinite(self.cutoff):
            return np.asarray(s ** (1 - self.exponent))
        b = self.least / self.cutoff
        whole = _moments(self.exponent, b, 0.0)[0]
        return np.array([_moments(self.exponent, b, float(u))[0] for u in np.log(s).ravel()]).reshape(s.shape) / whole


@checked
def fit_sizes(sizes: ArrayLike, least_size: float | None = None, *, truncated: bool = True) -> SizeLaw:
    """Fit a distribution of sizes by maximum likelihood.

    Args:
        sizes: (m,) positive.
        least_size: smallest size of the fit. Default: from the closest law, among 25 that leave 50 sizes or a fifth.
        truncated: whether large sizes are cut off exponentially.

    Raises:
        InputError: sizes that are not positive, fewer than ten above `least_size`, or all of one size.

    Example:
        >>> from jamlab.statistics.size_distribution import fit_sizes
        >>> sizes = (1 - (np.arange(1000) + 0.5) / 1000) ** (-1 / 0.5)  # of p ~ s^-1.5, s >= 1
        >>> round(fit_sizes(sizes, least_size=1.0, truncated=False).exponent, 2)
        1.5
    """
    s = np.sort(finite_array("sizes", sizes, (None,)))
    if len(s) and s[0] <= 0:
        raise InputError(f"sizes: {s[0]:g} is not positive: leave it out")
    if least_size is not None:
        if not (is_number(least_size) and least_size > 0):
            raise InputError(f"least_size = {least_size!r}: give a positive size, or None")
        return _fit(s[s >= least_size], least_size, truncated)
    left = max(min(SIZE_FIT.kept, len(s)), len(s) // 5)
    places = np.unique(np.linspace(0, max(len(s) - left, 0), SIZE_FIT.candidates).astype(int))
    laws = [_fit(s[place:], float(s[place]) if len(s) else 1.0, truncated) for place in places]
    return min(laws, key=lambda law: law.distance)


def _fit(s: Array, least: float, truncated: bool) -> SizeLaw:
    """The law through sizes (m,), ascending, from the least one on."""
    if len(s) < SIZE_FIT.fewest:
        raise InputError(
            f"{len(s)} sizes from {least:g} on: a distribution needs {SIZE_FIT.fewest} or more; give more runs, or a "
            "smaller least_size"
        )
    logs = np.log(s / least)
    if logs[-1] <= 0:
        raise InputError(f"all {len(s)} sizes are {s[0]:g}: a distribution needs sizes that differ")
    exponent, b = 1 + 1 / float(logs.mean()), 0.0
    if truncated:
        exponent, b = _most_likely(float(logs.mean()), float(s.mean() / least), exponent, float(s.max() / least))
    law = SizeLaw(exponent, least / b if b else float("inf"), least, len(s), 0.0)
    below, steps = 1 - law.beyond(s), np.arange(len(s) + 1) / len(s)
    distance = float(max(np.abs(below - steps[1:]).max(), np.abs(below - steps[:-1]).max()))
    return SizeLaw(law.exponent, law.cutoff, least, len(s), distance)


def _most_likely(log: float, mean: float, steep: float, largest: float) -> tuple[float, float]:
    """Exponent and s_min/s_c whose means of log s and s, over s_min, are those given, by Newton steps on the
    likelihood, which is concave; s_min/s_c is 0 where it grows towards no cutoff. `steep`: exponent without cutoff."""
    point = np.array([min(steep, 1.5), 1 / largest])
    value = _likelihood(point, log, mean)
    for _ in range(SIZE_FIT.steps):
        _, means, spread = _moments(float(point[0]), float(point[1]), 0.0)
        slope = means - (log, mean)
        step = np.linalg.solve(spread, slope)
        gain = float(slope @ step)  # twice what the likelihood may still grow by
        part = min(1.0, 0.9 * point[1] / -step[1]) if step[1] < 0 else 1.0
        while part > SIZE_FIT.shortest and (found := _likelihood(point + part * step, log, mean)) < value:
            part *= 0.5
        if gain < SIZE_FIT.digits or part <= SIZE_FIT.shortest:
            break
        point, value = point + part * step, found
        if point[1] < SIZE_FIT.widest:
            return steep, 0.0
    if gain < SIZE_FIT.rounding:
        return float(point[0]), float(point[1])
    raise ConvergenceError(f"no cutoff of sizes was found beside exponent {point[0]:.3g}: give truncated=False")


def _likelihood(point: Array, log: float, mean: float) -> float:
    """Mean log-likelihood of a size."""
    return float(-point @ (log, mean) - np.log(_moments(float(point[0]), float(point[1]), 0.0)[0]))


@cache
def _nodes() -> tuple[Array, Array]:
    x, weights = np.polynomial.legendre.leggauss(SIZE_FIT.nodes)
    return 0.5 * (x + 1), 0.5 * weights


def _moments(exponent: float, b: float, low: float) -> tuple[float, Array, Array]:
    """Integral of s^-exponent exp(-b s) from s = exp(low) on; means (2,) and covariance (2, 2) of log s and s there."""
    x, weights = _nodes()
    high = np.log(np.exp(low) + SIZE_FIT.reach / b)
    u = low + (high - low) * x
    s = np.exp(u)
    density = weights * (high - low) * np.exp((1 - exponent) * u - b * s)
    whole = density.sum()
    values = np.array([u, s])
    means = values @ density / whole if whole else np.full(2, np.nan)
    apart = values - means[:, None]
    return float(whole), means, (apart * density) @ apart.T / whole if whole else np.eye(2)
