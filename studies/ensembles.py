"""Average over packings: curves of each packing at the same places, and intervals from resampled packings."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator

from jamlab.arrays import Array
from jamlab.errors import ConvergenceError, InputError
from jamlab.statistics.confidence import STANDARD_ERRORS, Interval
from jamlab.statistics.confidence import bootstrap as resample

RESAMPLES = 200  # give the ends of a 95 % interval to about 5 % of its width
FEWEST = 5  # packings of an interval: below, the spread itself is not known
SHARE = 0.5  # of the packings must reach a place, otherwise its mean is over a selection
bootstrap = partial(resample, resamples=RESAMPLES, least=FEWEST)


def select(table: pd.DataFrame, **wanted: Any) -> pd.DataFrame:
    """Select the rows with these values, numbers to nine digits; a list stands for any of its values."""
    found = table
    for name, value in wanted.items():
        if isinstance(value, list | tuple):
            kept = found[name].isin(value)
        elif isinstance(value, float):
            kept = pd.Series(np.isclose(found[name], value, rtol=1e-9, atol=0.0), found.index)
        else:
            kept = found[name] == value
        found = found[kept]
    if found.empty:
        said = ", ".join(f"{name} = {value}" for name, value in wanted.items())
        raise InputError(f"no row with {said}: run a campaign that measures some, or use another source")
    return found


def sizes(table: pd.DataFrame, model: str) -> list[int]:
    """List the system sizes of a model, ascending."""
    return sorted(int(n) for n in table.loc[table["model"] == model, "n"].unique())


def groups_by(table: pd.DataFrame, by: str, value: str, keys: Iterable[float]) -> list[Array]:
    """List the values of the packings of each key, one array per key."""
    return [table.loc[table[by] == key, value].dropna().to_numpy(dtype=np.float64) for key in keys]


def of_packings(rows: pd.DataFrame, columns: str, value: str) -> tuple[Array, Array]:
    """Arrange rows as places (m,), such as rates, and values (packings, m); nan where a packing has none."""
    table = rows.pivot_table(index="seed", columns=columns, values=value, dropna=False)
    return table.columns.to_numpy(dtype=np.float64), table.to_numpy(dtype=np.float64)


def log_places(low: float, high: float, per_decade: int = 5) -> Array:
    """List places of equal ratio."""
    return np.asarray(np.geomspace(low, high, round(per_decade * np.log10(high / low)) + 1))


# means and medians ----------------------------------------------------------------------------------------------------


def average(values: Array) -> Array:
    """Average (places,) over packings (axis 0); nan where no packing has a value."""
    known = np.isfinite(values)
    if known.all():  # as they mostly are, in a third of the time
        return np.asarray(values.sum(axis=0) / len(values))
    count, total = known.sum(axis=0), np.where(known, values, 0.0).sum(axis=0)
    return np.asarray(np.divide(total, count, out=np.full(total.shape, np.nan), where=count > 0))


def median(values: Array) -> Array:
    """Find the median (places,) over packings (axis 0); nan where no packing has a value."""
    if np.isfinite(values).all():  # as they mostly are, in a tenth of the time
        return np.asarray(np.median(values, axis=0))
    known = np.isfinite(values).any(axis=0)
    out = np.full(values.shape[1:], np.nan)
    out[known] = np.nanmedian(values[:, known], axis=0)
    return out


def mean_over_packings(groups: Sequence[Array]) -> Interval:
    """Compute means (groups, ...) of groups of packings (packings, ...), nan where one has none, with intervals."""
    return bootstrap(groups, lambda drawn: np.array([average(values) for values in drawn]))


ONE_SIDED = 1.6448536269514722  # standard errors of one of two one-sided tests at 5 %


def equivalence_bound(found: Interval) -> float:
    """The smallest bound that two one-sided tests at 5 % find the difference below: |difference| + 1.645 errors."""
    error = (found.high - found.low) / (2 * STANDARD_ERRORS)
    return float(abs(found.value) + ONE_SIDED * error)


def scaled(found: Interval, factor: ArrayLike) -> Interval:
    """Multiply a number and the ends of its interval."""
    by = np.asarray(factor, dtype=np.float64)
    return Interval(found.value * by, found.low * by, found.high * by)


def side_by_side(found: Iterable[Interval]) -> Interval:
    """Join numbers (m,) with the ends of their intervals."""
    return Interval(*np.array([[float(f.value), float(f.low), float(f.high)] for f in found]).T)


def limit_of_sizes(n: Sequence[float], groups: Sequence[Array], exponent: float = 1.0) -> float:
    """Fit means over packings of several sizes by y = limit + amplitude N^-exponent, each weighted by its standard
    error; returns the limit, nan without errors."""
    means, errors = np.array([[v.mean(), v.std(ddof=1) / len(v) ** 0.5] for v in groups]).T
    if not (errors > 0).all():
        return float("nan")
    columns = np.column_stack([np.ones(len(means)), np.array(n, dtype=np.float64) ** -exponent]) / errors[:, None]
    return float(np.linalg.lstsq(columns, means / errors, rcond=None)[0][0])


# numbers of resampled packings ----------------------------------------------------------------------------------------


class Sample(NamedTuple):
    """Packings that a statistic is computed of."""

    groups: Sequence[Array]  # packings, drawn within their group
    reduce: Callable[[list[Array]], Sequence[Any]] = lambda drawn: [drawn]  # what the statistic takes, once a resample


def vary_bootstrap(
    sample: Sample, statistic: Callable[..., ArrayLike], *variants: Mapping[str, Any], resamples: int = RESAMPLES
) -> tuple[Interval, dict[str, Interval]]:
    """Compute a statistic with its interval, and under other defensible analyses, keywords of it such as
    {"low": 0.02}, on the same resamples; those without a value, or without a fit, are left out."""

    def every(drawn: list[Array]) -> Array:
        reduced = sample.reduce(drawn)
        values = [np.asarray(statistic(*reduced), dtype=np.float64)]
        for keywords in variants:
            values.append(np.full_like(values[0], np.nan))
            with suppress(ConvergenceError, InputError):
                values[-1] = np.asarray(statistic(*reduced, **keywords), dtype=np.float64)
        return np.array(values)

    found = bootstrap(sample.groups, every, resamples=resamples)
    known = [k for k, value in enumerate(found.value[1:]) if np.isfinite(value).all()]
    return found[0], {name_keywords(variants[k]): found[k + 1] for k in known}


def name_keywords(keywords: Mapping[str, Any]) -> str:
    """Name an analysis by its keywords, such as "low = 0.02"."""
    named = {k: getattr(v, "__name__", f"{v:g}" if isinstance(v, float) else v) for k, v in keywords.items()}
    return ", ".join(f"{k.replace('_', ' ')} = {v}" for k, v in named.items())


# curves of packings ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Ensemble:
    """Values of each packing at the same places."""

    # x, y: (packings, places); nan where a packing does not reach a place
    x: Array
    y: Array

    @property
    def mean(self) -> tuple[Array, Array]:
        """Average x and y (places,) over packings."""
        return average(self.x), average(self.y)

    @property
    def band(self) -> tuple[Array, Interval]:
        """Average x (places,), and y of y with its interval."""
        return average(self.x), mean_over_packings([self.y])[0]

    @property
    def curves(self) -> Array:
        """Stack x and y (packings, places, 2), the form that a bootstrap draws packings from."""
        return np.stack([self.x, self.y], axis=-1)

    def between(self, low: float, high: float) -> "Ensemble":
        """Cut the curve to the places whose mean x lies between two values."""
        x = average(self.x)
        kept = (x > low) & (x < high)
        return Ensemble(self.x[:, kept], self.y[:, kept])

    def sample(self, middle: Callable[[Array], Array] = average) -> Sample:
        """Give x and the mean y (places,) of drawn packings to a statistic, or another middle."""
        fixed = np.fmax.reduce(self.x)
        if np.array_equal(fixed, np.fmin.reduce(self.x), equal_nan=True):  # half as many numbers to draw
            return Sample([self.y], lambda drawn: (fixed, middle(drawn[0])))
        return Sample([self.curves], lambda drawn: (average(drawn[0][..., 0]), middle(drawn[0][..., 1])))


def interpolators(rows: pd.DataFrame, x: str, columns: Sequence[str], onset: bool) -> list[PchipInterpolator]:
    """Interpolate columns of each packing, monotonically in the root of x, of which laws near onset are smooth
    functions. Where one column is not known a state is left out of all.

    The state at onset itself, x = 0, counts with `onset` only: it is no neighbour of places that are all beyond it, as
    nothing is known on the way to the first state of a sweep. Packings with one state have no curve."""
    seed, across = (rows[name].to_numpy(dtype=np.float64) for name in ("seed", x))
    values = rows[list(columns)].to_numpy(dtype=np.float64)
    kept = np.isfinite(values).all(axis=1) & (across >= 0 if onset else across > 0)
    order = np.flatnonzero(kept)[np.lexsort((across[kept], seed[kept]))]
    found = []
    for part in np.split(order, np.flatnonzero(np.diff(seed[order])) + 1):
        part = part[np.diff(across[part], prepend=-1.0) > 0]  # the first of several at one place
        if len(part) > 1:
            found.append(PchipInterpolator(np.sqrt(across[part]), values[part], extrapolate=False))
    return found


def at_places(curves: Sequence[PchipInterpolator], places: ArrayLike, column: int = 0) -> Ensemble:
    """Evaluate a column of curves at places (places,), ascending, each within its first and last state; places that few
    packings reach are left out. A bin would average states at different x, and miss a place between two states."""
    at = np.asarray(places, dtype=np.float64)
    found = np.array([curve(np.sqrt(at))[:, column] for curve in curves]).reshape(-1, len(at))
    found = found[np.isfinite(found).any(axis=1)]
    if not len(found):
        return Ensemble(np.full((1, 1), np.nan), np.full((1, 1), np.nan))
    kept = np.isfinite(found).sum(axis=0) >= max(SHARE * len(found), min(FEWEST, len(found)))
    found = found[:, kept]
    return Ensemble(np.where(np.isfinite(found), at[kept], np.nan), found)
