"""How far the mean over packings made in one way lies from that of another, how they scatter, and what they cost.

All of it is known at the levels of the table. Between two of them it lies on the line that joins them; the error of a
difference of means grows by what a curve through more levels would bend away from that line.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array
from jamlab.estimates.ensemble_way import ONSET
from jamlab.estimates.quantiles import bend, between, neighbours
from jamlab.estimates.way_table import WayRecord

QUANTUM = {"z": 2.0, "void_sides": 1.0}  # over n: least step of what is counted; packings of equal z still scatter
_FEWEST = (
    100  # packings of a way: with 50, 24 of 32 intervals by 32 disks held; by others 83 to 100 %, some of few draws
)
_FEWEST_VALUES = 12  # of them that have the quantity, at the levels beside rho


@dataclass(frozen=True)
class Difference:
    """Difference of two ensemble means."""

    value: float  # mean of the first way minus that of the reference
    error: float  # standard error
    freedom: float  # degrees of freedom of it


@dataclass(frozen=True)
class Scatter:
    """What one packing of a way gives and costs at rho."""

    deviation: float  # standard deviation from packing to packing
    freedom: float  # degrees of freedom of it
    share: float  # of the seeds that give a value
    seconds: float  # CPU time of a seed


def scatter(record: WayRecord, quantity: str, rho: float) -> Scatter:
    """Scatter, yield and cost of a way at rho, between the levels of its table."""
    levels, count = _levels(record, quantity), _count(record, quantity)
    deviation = math.exp(between(levels, np.log(deviations(record, quantity)), rho))
    share = between(levels, count / len(record.seeds), rho)
    seconds = between(levels, record.seconds.mean(axis=0), rho)
    return Scatter(deviation, _skewed(between(levels, count, rho)), share, seconds)


def is_known(record: WayRecord, reference: WayRecord, quantity: str, rho: float) -> bool:
    """Whether both have enough packings in the table beside rho for their difference to have an error."""
    fewest = _FEWEST if record is not reference else _FEWEST_VALUES
    left, right, _ = neighbours(_levels(record, quantity), rho)
    return all(
        len(one.seeds) >= fewest
        and min(_count(one, quantity)[[left, right]]) >= _FEWEST_VALUES
        and min(deviations(one, quantity)[[left, right]]) > 0
        for one in (record, reference)
    )


def difference(record: WayRecord, reference: WayRecord, quantity: str, rho: float) -> Difference:
    """Mean over packings of one way minus that of a reference, at rho; both share the levels of their table."""
    levels = _levels(record, quantity)
    means, variances = zip(*(_mean(one, quantity) for one in (record, reference)), strict=True)
    offsets = means[0] - means[1]
    error = math.hypot(between(levels, np.sqrt(sum(variances)), rho), bend(levels, offsets, rho))
    freedom = _skewed(min(len(record.seeds), len(reference.seeds)))
    return Difference(between(levels, offsets, rho), error, freedom)


def deviations(record: WayRecord, quantity: str) -> Array:
    """(k,) standard deviation from packing to packing at every level; nan where fewer than two have a value."""
    values = record.values[quantity]
    count = _count(record, quantity)
    squares = np.nansum((values - _sum(values) / np.maximum(count, 1)) ** 2, axis=0)
    found = np.sqrt(squares / np.maximum(count - 1, 1))
    return np.where(count > 1, np.maximum(found, 0.5 * QUANTUM.get(quantity, 0.0) / record.way.n), np.nan)


def _levels(record: WayRecord, quantity: str) -> Array:
    return record.levels[:1] if quantity == ONSET else record.levels


def _mean(record: WayRecord, quantity: str) -> tuple[Array, Array]:
    """(k,) means at the levels, and their variances; nan where none has a value."""
    count = np.where(_count(record, quantity) > 0, _count(record, quantity), np.nan)
    return _sum(record.values[quantity]) / count, deviations(record, quantity) ** 2 / count


def _sum(values: Array) -> Array:
    return np.asarray(np.nansum(values, axis=0))


def _count(record: WayRecord, quantity: str) -> Array:
    return np.asarray(np.isfinite(record.values[quantity]).sum(axis=0, dtype=np.float64))


def _skewed(packings: float) -> float:
    """Degrees of freedom: half of the usual ones, as the scatter of skewed quantities is known less well."""
    return 0.5 * (packings - 1)
