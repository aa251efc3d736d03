"""Arrange rows of states as packings x bins, from which bands and fits with intervals are made."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from jamlab.errors import ConvergenceError, InputError
from jamlab.statistics.bootstrap import Interval, bootstrap

Array = NDArray[np.float64]
Statistic = Callable[[Array, Array], ArrayLike]

PROTOCOL = ("units", "ensemble", "gamma", "ka", "delta", "contact")
RESAMPLES = 200  # give the ends of a 95 % interval to about 5 % of its width
_PACKING = ["model", "n", "seed"]
SHARE = 0.5  # of the packings must reach a bin, else its mean is that of a selection


def add_distances(states: pd.DataFrame) -> pd.DataFrame:
    """Add distances from the onset of its own packing to each state; leave out states that are not jammed minima.

    Columns added: d_rho, d_phi, d_z: rho, phi and z minus their values at onset; overlap: phi - rho; lost: 1 - <a>/a_J,
    the fraction of their area that particles lose, from rho/phi since phi times the cell's area is constant; excess:
    A - 1 for disks, A - A_J for polygons; u: energy per particle. Tables with these columns are returned unchanged.
    """
    if "lost" in states:
        return states
    s = select_usual(states)
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


def select_usual(table: pd.DataFrame) -> pd.DataFrame:
    """Select the rows of the protocol (units, ensemble, parameters) that is most frequent for each model."""
    names = [name for name in PROTOCOL if name in table]
    if not names or table.empty:
        return table
    parts = []
    for _, part in table.groupby("model"):
        number = part.groupby(names, dropna=False).ngroup()
        parts.append(part[number == number.mode()[0]])
    return pd.concat(parts, ignore_index=True)


def sizes(table: pd.DataFrame, model: str) -> list[int]:
    """System sizes of a model, ascending."""
    return sorted(int(n) for n in table.loc[table["model"] == model, "n"].unique())


def nearest_size(table: pd.DataFrame, model: str, wanted: int) -> int:
    """Pick the size at hand that is nearest to the paper's, by ratio.

    Raises:
        InputError: there is no packing of the model.
    """
    found = sizes(table, model)
    if not found:
        raise InputError(
            f"no {model} packing among the states: run a campaign with model {model}, or use another source"
        )
    return min(found, key=lambda n: abs(np.log(n / wanted)))


def has(table: pd.DataFrame, model: str) -> bool:
    """Whether there are packings of a model."""
    return bool((table["model"] == model).any())


@dataclass(frozen=True)
class Ensemble:
    """Means of each packing in each bin.

    Attributes:
        x, y: (packings, bins); nan where a packing has no state in a bin.
    """

    x: Array
    y: Array

    @property
    def mean(self) -> tuple[Array, Array]:
        """(bins,) ensemble averages."""
        return average(self.x), average(self.y)

    def band(self, transform: Callable[[Array], Array] = lambda y: y) -> tuple[Array, Interval]:
        """(bins,) mean x, and mean y with its interval."""
        found = bootstrap([self.y], lambda g: transform(average(g[0])), resamples=RESAMPLES)
        return average(self.x), found

    @property
    def error(self) -> Array:
        """Standard error (bins,) of the mean of y; a bin with one packing takes the smallest spread of all bins."""
        known = np.isfinite(self.y)
        centred = np.where(known, self.y - average(self.y), 0.0)
        count = known.sum(axis=0)
        spread = np.sqrt((centred**2).sum(axis=0) / np.maximum(count - 1, 1))
        some = spread[spread > 0]
        return np.asarray(
            np.where(spread > 0, spread, some.min() if len(some) else 1.0) / np.sqrt(np.maximum(count, 1))
        )

    def interval(self, statistic: Statistic) -> Interval | None:
        """Statistic of the mean curve (x, y) with its interval; None if there are too few points or no law fits."""
        both = np.stack([self.x, self.y], axis=-1)

        def of(groups: list[Array]) -> ArrayLike:
            return statistic(average(groups[0][..., 0]), average(groups[0][..., 1]))

        try:
            return bootstrap([both], of, resamples=RESAMPLES)
        except (ConvergenceError, InputError):
            return None


def average(values: Array) -> Array:
    """Average (bins,) over packings (axis 0); nan where no packing has a value."""
    known = np.isfinite(values)
    count = known.sum(axis=0)
    total = np.where(known, values, 0.0).sum(axis=0)
    return np.asarray(np.divide(total, count, out=np.full(total.shape, np.nan), where=count > 0))


def ensemble(states: pd.DataFrame, model: str, n: int, x: str, y: str, edges: ArrayLike) -> Ensemble:
    """Arrange packings x bins of one model and size; bins that fewer than half of the packings reach are left out.

    Args:
        states: see `derive`.
        x, y: columns.
        edges: (bins + 1,) of x, ascending.
    """
    part = states[(states["model"] == model) & (states["n"] == n)][["seed", x, y]].dropna()
    edges = np.asarray(edges, dtype=np.float64)
    bins = np.searchsorted(edges, part[x].to_numpy(), side="right") - 1
    part = part.assign(bin=bins)[(bins >= 0) & (bins < len(edges) - 1)]
    if part.empty:
        return Ensemble(np.full((1, 1), np.nan), np.full((1, 1), np.nan))
    means = part.groupby(["seed", "bin"], sort=True)[[x, y]].mean().unstack("bin")
    mx, my = means[x].to_numpy(dtype=np.float64), means[y].to_numpy(dtype=np.float64)
    kept = np.isfinite(my).sum(axis=0) >= max(SHARE * len(my), 1)
    return Ensemble(mx[:, kept], my[:, kept])


def log_edges(low: float, high: float, per_decade: int = 5) -> Array:
    """Edges of bins of equal ratio."""
    return np.asarray(np.geomspace(low, high, round(per_decade * np.log10(high / low)) + 1))


def near_onset(last: float = 1.0) -> Array:
    """Edges of bins of a distance to onset: of equal ratio up to 0.02, 0.01 wide from there on."""
    fine = log_edges(10**-6.1, 10**-1.7)
    return np.concatenate([fine[:-1], np.arange(0.025, last, 0.01)])


def groups_by(table: pd.DataFrame, by: str, value: str, keys: Sequence[float]) -> list[Array]:
    """Values of the packings of each key, one array per key."""
    return [table.loc[table[by] == key, value].dropna().to_numpy(dtype=np.float64) for key in keys]
