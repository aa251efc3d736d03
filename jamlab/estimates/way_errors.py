"""How far the mean over packings made in one way lies from that of another, how they scatter, and what they cost.

Between the levels of the table the difference of two means is a polynomial in rho, fitted by weighted least squares.
Its degree is the one that predicts left-out levels best, and what it misses beyond their own errors widens its error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.legendre import legvander

from jamlab.arrays import Array
from jamlab.estimates.way_table import ONSET, WayRecord

_HIGHEST_DEGREE = 4
_FEWEST_TAILED = 100  # for moduli: G is far below zero near an instability, and few packings show none of these
_FEWEST = 12  # packings of a way: the errors of fewer are known too badly to choose among ways by them
_LEAST_ERROR = 0.5  # of a difference over that of its means: levels share their packings, and curves are no laws
_QUANTUM = {"z": 2.0, "void_sides": 1.0}  # over n: least step of what is counted; packings of equal z still scatter


@dataclass(frozen=True)
class Difference:
    """Difference of two ensemble means.

    Attributes:
        value: mean of the first way minus that of the reference.
        error: standard error.
        freedom: degrees of freedom of it.
    """

    value: float
    error: float
    freedom: float


@dataclass(frozen=True)
class Scatter:
    """What one packing of a way gives and costs at rho.

    Attributes:
        deviation: standard deviation from packing to packing.
        freedom: degrees of freedom of it.
        share: of the seeds that give a value.
        seconds: CPU time of a seed.
    """

    deviation: float
    freedom: float
    share: float
    seconds: float


def scatter(record: WayRecord, quantity: str, rho: float) -> Scatter:
    """Scatter, yield and cost of a way at rho, between the levels of its table."""
    values = record.values[quantity]
    if quantity == ONSET:
        good = values[np.isfinite(values)]
        seconds = float(record.seconds[:, 0].mean())
        return Scatter(float(good.std(ddof=1)), _skewed(len(good)), len(good) / len(values), seconds)
    count = np.isfinite(values).sum(axis=0)
    log_deviation = np.interp(rho, record.levels, np.log(deviations(record, quantity)))
    share = float(np.interp(rho, record.levels, count / len(values)))
    seconds = float(np.interp(rho, record.levels, record.seconds.mean(axis=0)))
    freedom = _skewed(float(np.interp(rho, record.levels, count)))
    return Scatter(float(np.exp(log_deviation)), freedom, share, seconds)


def relative_cost(record: WayRecord, other: WayRecord, quantity: str, rho: float) -> float:
    """CPU time of a packing over that of the same packing made in another way, over the seeds that both have."""
    _, one, two = np.intersect1d(record.seeds, other.seeds, return_indices=True)
    ratio = record.seconds[one].sum(axis=0) / other.seconds[two].sum(axis=0)
    return float(ratio[0] if quantity == ONSET else np.interp(rho, record.levels, ratio))


def _skewed(packings: float) -> float:
    """Degrees of freedom: half of the usual ones, as the scatter of skewed quantities is known less well."""
    return 0.5 * (packings - 1)


def is_known(record: WayRecord, reference: WayRecord, quantity: str) -> bool:
    """Whether a way has enough packings in the table for its difference from the reference to have an error."""
    fewest = _FEWEST_TAILED if quantity in ("g", "b") else _FEWEST
    if record is reference:
        return True
    if min(len(record.seeds), len(reference.seeds)) < fewest:
        return False
    present = np.isfinite(record.values[quantity]).sum(axis=0)  # near 0.84 few packings jam
    return bool(present.min() > 1 and deviations(record, quantity).min() > 0)


def difference(record: WayRecord, reference: WayRecord, quantity: str, rho: float) -> Difference:
    """Mean over packings of one way minus that of a reference, at rho."""
    freedom = _skewed(min(len(record.seeds), len(reference.seeds)))
    if quantity == ONSET:
        one, two = (_mean(r.values[ONSET])[0] for r in (record, reference))
        variance = sum(float(_covariance(r, ONSET)[0, 0]) for r in (record, reference))
        return Difference(float(one - two), variance**0.5, freedom)
    offsets = _mean(record.values[quantity]) - _mean(reference.values[quantity])
    covariance = _covariance(record, quantity) + _covariance(reference, quantity)
    expected = _smooth(record.levels, np.diag(covariance))
    degree, misfit = _fitting_degree(record.levels, offsets, covariance, expected)
    weights = _weights(record.levels, expected, rho, degree)
    variance = misfit * float(weights @ covariance @ weights)
    least = _LEAST_ERROR**2 * float(np.interp(rho, record.levels, np.diag(covariance)))
    return Difference(float(weights @ offsets), max(variance, least) ** 0.5, freedom)


def _fitting_degree(levels: Array, offsets: Array, covariance: Array, expected: Array) -> tuple[int, float]:
    """Degree of the polynomial that predicts left-out levels best, and its misfit.

    The misfit is Birge's ratio: mean square of what is missed over what the errors of the means explain, at least 1.
    """
    found = []
    for degree in range(_HIGHEST_DEGREE + 1):
        missed, explained = [], []
        for k in range(1, len(levels) - 1):  # not the ends: the polynomial is never used beyond them
            kept = np.arange(len(levels)) != k
            weights = np.insert(_weights(levels[kept], expected[kept], levels[k], degree), k, -1.0)
            missed.append(float(weights @ offsets) ** 2)
            explained.append(float(weights @ covariance @ weights))
        score = np.mean(missed / expected[1:-1])
        found.append((float(score), degree, max(1.0, float(np.mean(np.divide(missed, explained))))))
    _, degree, misfit = min(found)
    return degree, misfit


def _weights(levels: Array, variances: Array, rho: float, degree: int) -> Array:
    """(k,) weights of the levels in a weighted least-squares polynomial at rho."""
    middle, width = 0.5 * (levels[0] + levels[-1]), 0.5 * (levels[-1] - levels[0])
    powers = legvander((levels - middle) / width, degree)
    weighted = powers.T / variances
    return np.asarray(np.linalg.solve(weighted @ powers, legvander((rho - middle) / width, degree)[0]) @ weighted)


def _smooth(levels: Array, variances: Array) -> Array:
    """Variances as a smooth function of rho: a level whose packings are alike by chance must not draw the fit."""
    return np.asarray(np.exp(Polynomial.fit(levels, np.log(variances), 2)(levels)))


def deviations(record: WayRecord, quantity: str) -> Array:
    """(k,) standard deviation from packing to packing at every level."""
    found = np.nanstd(record.values[quantity], axis=0, ddof=1)
    return np.asarray(np.maximum(found, 0.5 * _QUANTUM.get(quantity, 0.0) / record.way.n))


def _mean(values: Array) -> Array:
    return np.asarray(np.nanmean(values, axis=0))


def _covariance(record: WayRecord, quantity: str) -> Array:
    """(k, k) covariance of the means over packings at the levels; a packing counts where it has a value."""
    values = record.values[quantity]
    present = np.isfinite(values)
    centred = np.where(present, values - _mean(values), 0.0)
    count = present.sum(axis=0)
    per_packing = np.sqrt(count * np.maximum(count - 1, 1))
    found = centred.T @ centred / np.outer(per_packing, per_packing)
    np.fill_diagonal(found, deviations(record, quantity) ** 2 / count)
    return np.asarray(found)
