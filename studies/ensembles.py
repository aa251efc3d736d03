"""Select rows of packings of one kind, arrange them at the same places, and average them with intervals."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from jamlab.arrays import Array
from jamlab.errors import ConvergenceError, InputError
from jamlab.statistics.bootstrap import Interval
from jamlab.statistics.bootstrap import bootstrap as resample
from jamlab.statistics.power_laws import power_law
from studies.claims import as_interval, name_choice

Varied = tuple[Interval | None, dict[str, Interval]]  # a number, and what it is under other defensible choices

PROTOCOL = ("units", "ensemble", "gamma", "ka", "delta", "eps", "nv_small", "contact")
RESAMPLES = 200  # give the ends of a 95 % interval to about 5 % of its width
FEWEST = 5  # packings of an interval: below, the spread itself is not known
ENOUGH = 20  # packings of a size that may stand for the paper's: an interval from five is three times as wide
bootstrap = partial(resample, resamples=RESAMPLES, least=FEWEST)
_PACKING = ["model", "n", "seed"]
SHARE = 0.5  # of the packings must reach a place, else its mean is that of a selection


def add_distances(states: pd.DataFrame) -> pd.DataFrame:
    """Add distances from the onset of its own packing to each state; leave out states that are not jammed minima.

    Columns added: d_rho, d_phi, d_z: rho, phi and z minus their values at onset; overlap: phi - rho; lost: 1 - <a>/a_J,
    the fraction of their area that particles lose, from rho/phi since phi times the cell's area is constant; excess:
    A - 1 for disks, A - A_J for polygons; u: energy per particle. Tables with these columns are returned unchanged.
    """
    if "lost" in states:
        return states
    s = select_usual(states[states["onset"].notna()])  # packings at a pressure have none, and other units
    first = s[s["state"] == 0].set_index(_PACKING)[["z", "shape"]].add_suffix("_J")
    s = s.join(first, on=_PACKING)
    s = s[s["converged"].astype(bool) & s["z"].notna()]
    return s.assign(
        d_rho=s["rho"] - s["onset"],
        d_phi=s["phi"] - s["onset_phi"],
        d_z=s["z"] - s["z_J"],
        overlap=s["phi"] - s["rho"],
        lost=1 - s["rho"] / s["phi"] * s["onset_phi"] / s["onset"],
        excess=np.where(s["model"] == "sp", s["shape"] - 1, s["shape"] - s["shape_J"]),
        u=s["energy"] / s["n"],
    )


def select_usual(
    table: pd.DataFrame, names: Sequence[str] = PROTOCOL, by: str | None = "model", *, of: pd.DataFrame | None = None
) -> pd.DataFrame:
    """Select the rows whose values of some columns are those that most rows have together, by default those that tell
    protocols apart; for each value of `by` anew. With `of` its rows decide, each column after the one before."""
    if of is not None:
        for name in names:
            of = select_usual(of, [name], None)
            table = table[table[name].isin(of[name])]
        return table
    names = [name for name in names if name in table]
    if not names or table.empty:
        return table
    number = table.groupby(names, dropna=False).ngroup()
    usual = number.mode()[0] if by is None else number.groupby(table[by]).transform(lambda part: part.mode()[0])
    return table[number == usual].reset_index(drop=True)


def enough(table: pd.DataFrame, by: str, least: int = FEWEST) -> list[Any]:
    """List the values of a column that enough packings have, ascending; those with the most packings if none has."""
    packings = table.groupby(by)["seed"].nunique()
    return sorted(packings.index[packings >= min(least, packings.max())].tolist())


def select_followed(states: pd.DataFrame) -> pd.DataFrame:
    """Leave out packings that were not compressed beyond onset, of sizes where others were, and those without an onset.
    The first serve the table of onsets; among curves they would count as packings that reach no place."""
    states = states[states["d_phi"].notna()]
    several = states.groupby(_PACKING)["state"].transform("size") > 1
    return states[several | ~several.groupby([states["model"], states["n"]]).transform("any")]


def sizes(table: pd.DataFrame, model: str) -> list[int]:
    """List the system sizes of a model, ascending."""
    return sorted(int(n) for n in table.loc[table["model"] == model, "n"].unique())


def sampled_sizes(table: pd.DataFrame, model: str) -> list[int]:
    """List the system sizes with 20 packings or more, ascending; all sizes if none has. A larger size that is only
    begun would take the place of one with a hundred packings, with an interval that tells nothing."""
    return enough(table[table["model"] == model], "n", ENOUGH)


def nearest_size(table: pd.DataFrame, model: str, wanted: int) -> int:
    """Pick the size with enough packings that is nearest to the paper's, by ratio."""
    found = sampled_sizes(table, model)
    if not found:
        raise InputError(
            f"no {model} packing among the states: run a campaign with model {model}, or use another source"
        )
    return min(found, key=lambda n: abs(np.log(n / wanted)))


def has(table: pd.DataFrame, model: str) -> bool:
    """Whether there are packings of a model."""
    return bool((table["model"] == model).any())


def average(values: Array) -> Array:
    """Average (places,) over packings (axis 0); nan where no packing has a value."""
    known = np.isfinite(values)
    if known.all():  # as they mostly are, in a third of the time
        return np.asarray(values.sum(axis=0) / len(values))
    count = known.sum(axis=0)
    total = np.where(known, values, 0.0).sum(axis=0)
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


def side_by_side(found: Iterable[Interval]) -> Interval:
    """Join numbers (m,) with the ends of their intervals."""
    return Interval(*np.array([[float(f.value), float(f.low), float(f.high)] for f in found]).T)


def unmeasured() -> Varied:
    """Give the number, and the family, that data without packings have."""
    return None, {}


def part_of(varied: Varied, k: int) -> Varied:
    """Take the k-th of several numbers, and its family."""
    found, every = varied
    return None if found is None else found[k], {choice: other[k] for choice, other in every.items()}


def vary_bootstrap(
    groups: Sequence[Array],
    statistic: Callable[..., ArrayLike],
    *choices: Mapping[str, Any],
    reduce: Callable[[list[Array]], Sequence[Any]] = lambda drawn: [drawn],
    resamples: int = RESAMPLES,
) -> tuple[Interval, dict[str, Interval]]:
    """Compute a statistic of groups of packings with its interval, and its family: what it is with its interval, of the
    same resamples, under other defensible choices, keywords of it such as {"low": 0.02}. The family stands written in
    the code; choices without a value, or without a fit, are left out. The statistic takes what `reduce` gives of the
    groups, once a resample."""

    def every(drawn: list[Array]) -> Array:
        reduced = reduce(drawn)
        values = [np.asarray(statistic(*reduced), dtype=np.float64)]
        for choice in choices:
            values.append(np.full_like(values[0], np.nan))
            with suppress(ConvergenceError, InputError):
                values[-1] = np.asarray(statistic(*reduced, **choice), dtype=np.float64)
        return np.array(values)

    found = bootstrap(groups, every, resamples=resamples)
    known = [k for k, value in enumerate(found.value[1:]) if np.isfinite(value).all()]
    return found[0], {name_choice(choices[k]): found[k + 1] for k in known}


def power_over(
    x: Sequence[float] | Array, drawn: Sequence[Array], values: Callable[[Sequence[Array]], ArrayLike]
) -> Varied:
    """Fit the exponent in x (m,) of values (m,) that groups of packings have, with its interval; and without the first
    and without the last place, as any power holds there too. None and nothing with less than two places."""

    def exponent(y: Array, first: int = 0, last: int | None = None) -> float:
        return float(power_law(x[first:last], y[first:last]).exponents[0])

    if len(x) < 2:
        return None, {}
    choices: tuple[dict[str, int], ...] = ({"first": 1}, {"last": -1}) if len(x) > 2 else ()
    return vary_bootstrap(drawn, exponent, *choices, reduce=lambda groups: [np.asarray(values(groups))])


def scaled(found: Interval, factor: ArrayLike) -> Interval:
    """Multiply a number and the ends of its interval."""
    by = np.asarray(factor, dtype=np.float64)
    return Interval(found.value * by, found.low * by, found.high * by)


def line_in_inverse(n: Sequence[float], groups: Sequence[Array]) -> tuple[float, float]:
    """Fit a line to means over 1/n, each weighted by its standard error; its value at 1/n = 0 and its slope."""
    errors = np.array([values.std(ddof=1) / len(values) ** 0.5 for values in groups])
    if not (errors > 0).all():
        return float("nan"), float("nan")
    slope, limit = np.polyfit(1 / np.array(n), [values.mean() for values in groups], 1, w=1 / errors)
    return float(limit), float(slope)


@dataclass(frozen=True)
class Ensemble:
    """Values of each packing at the same places."""

    # x, y: (packings, places); nan where a packing does not reach a place
    x: Array
    y: Array

    @property
    def whole(self) -> "Ensemble":
        """Cut the curve to the places that nearly all packings reach: elsewhere a mean is that of a selection."""
        count = np.isfinite(self.y).sum(axis=0)
        kept = count >= 0.9 * count.max()
        return Ensemble(self.x[:, kept], self.y[:, kept])

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

    def interval(self, statistic: Callable[..., ArrayLike]) -> Interval:
        """Compute a statistic of the mean curve, x and y (places,), with its interval; nan if no law fits."""
        return as_interval(self.varied(statistic)[0])

    def varied(self, statistic: Callable[..., ArrayLike], *choices: Mapping[str, Any]) -> Varied:
        """Compute a statistic of the mean curve, and its family of choices, keywords of it; None if no law fits."""
        x, least = np.fmax.reduce(self.x), np.fmin.reduce(self.x)
        try:
            if np.array_equal(x, least, equal_nan=True):  # fixed places: half as many numbers to draw
                return vary_bootstrap([self.y], statistic, *choices, reduce=lambda drawn: (x, average(drawn[0])))
            return vary_bootstrap([self.curves], statistic, *choices, reduce=lambda drawn: mean_curve(drawn[0]))
        except (ConvergenceError, InputError):
            return unmeasured()


def mean_curve(curves: Array) -> tuple[Array, Array]:
    """Average x and y (places,) of curves (packings, places, 2)."""
    return average(curves[..., 0]), average(curves[..., 1])


def ensemble(states: pd.DataFrame, model: str, n: int, x: str, y: str, places: ArrayLike) -> Ensemble:
    """Interpolate each packing of one model and size at the same places (places,), ascending, of a column x >= 0 of
    states of `add_distances`, within its first and last state; places that few packings reach are left out. A bin would
    average states at different x, and miss a place between two states; [B] averages at fixed distances."""
    rows = (states["n"] == n).to_numpy() & (states["model"] == model).to_numpy(dtype=bool)
    seeds, across, values = (states[name].to_numpy(dtype=np.float64)[rows] for name in ("seed", x, y))
    known = np.isfinite(across) & np.isfinite(values)
    at, packing = np.asarray(places, dtype=np.float64), np.unique(seeds[known], return_inverse=True)[1]
    found = interpolate(packing, across[known], values[known], at)
    found = found[np.isfinite(found).any(axis=1)]
    if not len(found):
        return Ensemble(np.full((1, 1), np.nan), np.full((1, 1), np.nan))
    kept = np.isfinite(found).sum(axis=0) >= max(SHARE * len(found), min(FEWEST, len(found)))
    found = found[:, kept]
    return Ensemble(np.where(np.isfinite(found), at[kept], np.nan), found)


def interpolate(curve: NDArray[np.intp], x: Array, y: Array, places: Array) -> Array:
    """Interpolate curves monotonically (PCHIP) in the root of x, of which laws near onset are smooth functions; returns
    (curves, places), nan outside of a curve. Points (m,) in any order belong to curves 0, 1, ...; of several at one x
    the first counts. The state at onset itself, x = 0, is no neighbour of places that are all beyond it: nothing is
    known on the way to the first state of a sweep. All curves at once, with the digits that scipy's PchipInterpolator
    gives one by one in twenty times the time."""
    found = np.full((curve.max(initial=-1) + 1, len(places)), np.nan)
    kept = np.flatnonzero(x > 0 if places[0] > 0 else x >= 0)
    order = kept[np.lexsort((x[kept], curve[kept]))]
    new = np.ones(len(order), dtype=bool)
    new[1:] = (np.diff(curve[order]) > 0) | (np.diff(x[order]) > 0)
    curve, x, y, at = curve[order][new], np.sqrt(x[order][new]), y[order][new], np.sqrt(places)
    if len(x) < 2:
        return found
    with np.errstate(divide="ignore", invalid="ignore"):  # of pieces from one curve to the next, which are not used
        width = np.diff(x)
        slope = np.diff(y) / width
        rise = _slopes_at_points(curve, width, slope)
        bend = (rise[:-1] + rise[1:] - 2 * slope) / width
        cubic, square = bend / width, (slope - rise[:-1]) / width - bend
    points = np.zeros((len(found), len(at) + 1), dtype=np.intp)  # of each curve up to each place
    np.add.at(points, (curve, np.searchsorted(at, x)), 1)
    points = points.cumsum(axis=1)
    size = points[:, -1]
    start = np.cumsum(size) - size
    inside = (size[:, None] > 1) & (points[:, :-1] > 0) & (at <= x[start + size - 1, None])
    row, place = np.nonzero(inside)
    piece = start[row] + np.minimum(points[row, place], size[row] - 1) - 1  # a curve's last point ends its last piece
    s = at[place] - x[piece]
    found[inside] = y[piece] + rise[piece] * s + square[piece] * (s * s) + cubic[piece] * (s * s * s)
    return found


def _slopes_at_points(curve: NDArray[np.intp], width: Array, slope: Array) -> Array:
    """Slopes (m,) of a PCHIP at its points: harmonic means of the pieces on both sides, Fritsch & Butland (1984), and
    at ends parabolas that keep the sign, Moler, Numerical Computing with Matlab (2004), ch. 3.6."""
    joined = np.diff(curve) == 0
    before, after = np.concatenate([[False], joined]), np.concatenate([joined, [False]])
    rise = np.zeros(len(curve))
    inner = np.flatnonzero(before & after)
    h, k, m, n = width[inner - 1], width[inner], slope[inner - 1], slope[inner]
    u, v = 2 * k + h, k + 2 * h
    rise[inner] = np.where(np.sign(m) * np.sign(n) > 0, 1 / ((u / m + v / n) / (u + v)), 0.0)
    first, last = np.flatnonzero(after & ~before), np.flatnonzero(before & ~after)
    many = last - first > 1
    rise[first[~many]] = rise[last[~many]] = slope[first[~many]]
    for ends, near, far in ((first[many], 0, 1), (last[many], -1, -2)):
        h, k, m, n = width[ends + near], width[ends + far], slope[ends + near], slope[ends + far]
        d = ((2 * h + k) * m - h * n) / (h + k)
        steep = (np.sign(m) != np.sign(n)) & (np.abs(d) > 3.0 * np.abs(m))
        rise[ends] = np.where(np.sign(d) != np.sign(m), 0.0, np.where(steep, 3.0 * m, d))
    return rise


def of_packings(rows: pd.DataFrame, columns: str, value: str) -> tuple[Array, Array]:
    """Arrange rows as places (m,), such as rates, and values (packings, m); nan where a packing has none."""
    table = rows.pivot_table(index="seed", columns=columns, values=value, dropna=False)
    return table.columns.to_numpy(dtype=np.float64), table.to_numpy(dtype=np.float64)


def nearest(values: Sequence[float], wanted: float) -> float:
    """Pick the value that is nearest to the one wanted."""
    return min(values, key=lambda value: abs(value - wanted))


def log_places(low: float, high: float, per_decade: int = 5) -> Array:
    """List places of equal ratio."""
    return np.asarray(np.geomspace(low, high, round(per_decade * np.log10(high / low)) + 1))


def from_onset(last: float = 0.43) -> Array:
    """List distances to onset: of equal ratio up to 0.02, 0.01 apart from there on."""
    return np.concatenate([log_places(1e-6, 10**-1.8), np.arange(0.02, last, 0.01)])


def groups_by(table: pd.DataFrame, by: str, value: str, keys: Sequence[float]) -> list[Array]:
    """List the values of the packings of each key, one array per key."""
    return [table.loc[table[by] == key, value].dropna().to_numpy(dtype=np.float64) for key in keys]
