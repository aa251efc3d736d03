"""Collect task files into tidy tables, and average over packings with bootstrap intervals.

Packings are independent, states of one packing are not. So the values of each packing in a group are first replaced by
their mean, and the bootstrap draws whole packings.
"""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from jamlab.arrays import Array
from jamlab.campaign.folder import CampaignFolder
from jamlab.campaign.observables import OBSERVABLES, TABLES, Onset
from jamlab.campaign.task_file import TaskFile, read_task_file
from jamlab.checks import check_choice
from jamlab.errors import InputError
from jamlab.measure import COLUMNS
from jamlab.statistics.bootstrap import bootstrap
from jamlab.statistics.confidence import CONFIDENCE

if TYPE_CHECKING:
    import pandas as pd

STATISTICS: dict[str, Any] = {"mean": np.mean, "median": np.median}
_DIGITS = 5  # numbers that agree to so many digits are one group: a pressure is met to 1e-6
NEAR = 5e-3  # of a value, within which a state is at it: half a step of 0.01 in rho
_MOST_BINS = 12  # a column with no more values than that is not binned
_WIDE = 30.0  # ratio of the largest to the smallest value from which bins are equal in ratio
DISTANCES = ("d_rho", "d_phi")  # from onset; columns that `Campaign.aggregate` adds to "states"
_WHO = ("task", "model", "n", "seed", "ensemble")
_LAW = ("gamma", "ka", "delta", "eps", "nv_small")  # of droplets
TABLE_COLUMNS: dict[str, tuple[str, ...]] = {
    "states": (
        *_WHO,
        *("units", "state", "onset", "onset_phi", "target_pressure", "converged", *COLUMNS),
        *(*_LAW, "contact", "wall_time"),
    ),
    "onset": (*_WHO, *Onset.columns),
    **{name: (*_WHO, *observable.columns) for name, observable in OBSERVABLES.items()},
}
STATE_COLUMNS = (*TABLE_COLUMNS["states"], *DISTANCES)  # names that no observable of the user's own may have


def table(folder: CampaignFolder, names: Iterable[str], name: str) -> "pd.DataFrame":
    """Collect one table from finished tasks, sorted by model, n and seed; "states" has the columns of the user's own
    observables too, nan where a task lacks them."""
    import pandas as pd

    check_choice("table", name, TABLES)
    parts: list[dict[str, Any]] = []
    own: dict[str, str] = {}
    for task in names:
        file = read_task_file(folder.task_file(task), None if name == "states" else name)
        columns = _states(file) | _own(file, own) if name == "states" else _columns(file, name)
        if columns:
            p = file.parameters
            parts.append({"task": task, "model": p.model, "n": p.n, "seed": p.seed, "ensemble": p.ensemble, **columns})
    parts.sort(key=lambda part: tuple(part[key] for key in ("model", "n", "seed", "task")))
    frames = {}
    for column in (*TABLE_COLUMNS[name], *sorted(own)):
        values = [
            np.broadcast_to(np.asarray(part.get(column, np.nan) if column in own else part[column]), _row_count(part))
            for part in parts
        ]
        frames[column] = np.concatenate(values) if values else np.empty(0)
    return pd.DataFrame(frames)


def _row_count(part: dict[str, Any]) -> int:
    return next(len(values) for values in part.values() if isinstance(values, np.ndarray))


def _columns(file: TaskFile, name: str) -> dict[str, Any]:
    """Columns of the table of one task; what the file does not hold comes from the task and its states."""
    stored = file.tables.get(name)
    if stored is None:
        return {}
    observable = next(o for o in file.parameters.tables if o.name == name)
    known = observable.constants()
    found: dict[str, Any] = {}
    for column in observable.columns:
        if column in stored:
            found[column] = stored[column]
        elif column == "law":
            found[column] = np.where(stored["stokes"], "stokes", "contact")
        elif column == "seconds":
            found[column] = file.seconds
        elif column == "onset":
            found[column] = file.onset[0]
        else:
            found[column] = known[column] if column in known else file.observables[column][stored["state"]]
    return found


def _states(file: TaskFile) -> dict[str, Any]:
    law = file.parameters.force_law if file.parameters.model == "dp" else {}
    rho_j, phi_j = file.onset
    return {
        "units": file.units,
        "state": np.arange(len(file.converged)),
        "onset": rho_j,
        "onset_phi": phi_j,
        "target_pressure": file.target_pressure,
        "converged": file.converged,
        **{name: file.observables[name] for name in COLUMNS},
        **{name: law.get(name, np.nan) for name in _LAW},
        "contact": str(law.get("contact", "")),
        "wall_time": file.wall_time,
    }


def _own(file: TaskFile, known: dict[str, str]) -> dict[str, Any]:
    """Return the columns of the user's own observables, and note in `known` which observable each belongs to."""
    found: dict[str, Any] = {}
    for observable, columns in file.tables.items():
        if ":" in observable:
            for column in columns:
                if known.setdefault(column, observable) != observable:
                    raise InputError(
                        f"{observable} and {known[column]} both have a column {column!r}: take one sweep at a time"
                    )
            found |= columns
    return found


def states_at(frame: "pd.DataFrame", column: str, value: float) -> "pd.DataFrame":
    """Choose the rows of the state of each packing whose column is nearest to a value, and within 0.5 % of it."""
    check_choice("column", column, frame.columns)
    if "state" not in frame.columns or frame[column].dtype.kind not in "iuf":
        raise InputError(f"{column} = {value:g}: a table with states is needed, and a column of numbers")
    distance = (frame[column].astype(np.float64) - value).abs()
    inside = frame[distance <= NEAR * abs(value)]
    if not len(inside):
        found = frame[column].astype(np.float64)
        raise InputError(
            f"{column} = {value:g}: no state lies within {NEAR:.1%} of it; they reach from {found.min():.6g} to"
            f" {found.max():.6g}: give another value, or a sweep with a state there"
        )
    nearest = frame.loc[distance[inside.index].groupby(inside["task"]).idxmin(), ["task", "state"]]
    return inside.merge(nearest, on=["task", "state"])


def choose_bins(values: Array) -> tuple[Array, bool]:
    """Edges of bins for a column, and whether they are equal in ratio. A column of a few values, such as target
    pressures, gets a bin for each of them. Others get twelve bins, equal in ratio where the positive values span more
    than a factor of 30; what lies at zero or below is then outside."""
    finite = values[np.isfinite(values)]
    if not len(finite):
        return np.array([0.0, 1.0]), False
    kinds = np.unique([float(f"{value:.5g}") for value in finite])  # a pressure is met to 1e-6
    up = kinds[kinds > 0]
    wide = len(up) > 1 and up[-1] > _WIDE * up[0]
    if len(kinds) <= _MOST_BINS:
        between = 0.5 * (kinds[1:] + kinds[:-1])
        return np.concatenate([[-np.inf], between, [np.inf]]), wide and len(up) == len(kinds)
    if wide:
        return np.geomspace(up[0], up[-1], _MOST_BINS + 1) * np.r_[1 - 1e-4, np.ones(_MOST_BINS - 1), 1 + 1e-4], True
    edges = np.linspace(finite.min(), finite.max(), _MOST_BINS + 1)
    edges[-1] = np.nextafter(edges[-1], np.inf)
    return edges, False


def aggregate(
    frame: "pd.DataFrame",
    values: Sequence[str],
    by: Sequence[str],
    *,
    along: str | None = None,
    bins: ArrayLike | None = None,
    statistic: str = "mean",
    confidence: float = CONFIDENCE,
    resamples: int = 1000,
) -> "pd.DataFrame":
    """Average the values of each group of rows, with intervals over packings; see `Campaign.aggregate`. What agrees to
    five digits in `by` is one value, given in full if all rows have the same, such as a frequency. Intervals of one
    packing are nan; `<value>_packings` counts those with a finite value."""
    import pandas as pd

    _check(frame, [*values, *by, *([along] if along else [])], along, bins, statistic, confidence, resamples)
    keys = {name: _round_keys(frame[name]) for name in by}
    if along is not None:
        numbers = frame[along].to_numpy(np.float64)
        edges = choose_bins(numbers)[0] if bins is None else np.asarray(bins, dtype=np.float64)
        place = np.digitize(numbers, edges) - 1
        inside = (place >= 0) & (place < len(edges) - 1)
        frame, keys = frame[inside], {name: key[inside] for name, key in keys.items()}
        keys["bin"] = pd.Series(place[inside], index=frame.index)
    if not len(frame):
        return pd.DataFrame()
    middle, rows = STATISTICS[statistic], []
    for group, part in frame.groupby(list(keys.values()), sort=True, dropna=False) if keys else [((), frame)]:
        _refuse_unlike(part)
        labels = group if isinstance(group, tuple) else (group,)
        row: dict[str, Any] = dict(zip(keys, labels, strict=True))
        row |= {name: part[name].iloc[0] for name in by if part[name].nunique() == 1}  # to all of its digits
        if along is not None:
            row[along] = float(part[along].mean())
        row["packings"] = part.groupby(["model", "n", "seed"]).ngroups
        for name in values:
            kept = part[np.isfinite(part[name].astype(np.float64))]
            packings = kept.groupby(["model", "n", "seed"])[name].mean().to_numpy(np.float64)
            row |= {name: np.nan, f"{name}_low": np.nan, f"{name}_high": np.nan, f"{name}_packings": len(packings)}
            if len(packings):
                found = bootstrap([packings], lambda g: middle(g[0]), resamples=resamples, level=confidence)
                row |= {name: float(found.value), f"{name}_low": float(found.low), f"{name}_high": float(found.high)}
        rows.append(row)
    return pd.DataFrame(rows)


def _round_keys(column: "pd.Series[Any]") -> "pd.Series[Any]":
    if column.dtype.kind != "f":
        return column
    return column.map(lambda value: float(f"{value:.{_DIGITS}g}"))


def _check(
    frame: "pd.DataFrame",
    columns: list[str],
    along: str | None,
    bins: ArrayLike | None,
    statistic: str,
    confidence: float,
    resamples: int,
) -> None:
    for name in columns:
        if name not in frame.columns:
            raise InputError(f"the table has no column {name!r}: use one of {', '.join(frame.columns)}")
    if along is None and bins is not None:
        raise InputError(f"bins = {bins!r}: name the column to cut into them, along = ...")
    if bins is not None:
        edges = np.asarray(bins, dtype=np.float64)
        if edges.ndim != 1 or len(edges) < 2 or not np.all(np.diff(edges) > 0):
            raise InputError(f"bins = {bins!r}: give two or more edges, ascending")
    check_choice("statistic", statistic, STATISTICS)
    if not 0 < confidence < 1:
        raise InputError(f"confidence = {confidence}: must lie between 0 and 1")
    if resamples < 1:
        raise InputError(f"resamples = {resamples}: must be 1 or more")


def _refuse_unlike(part: "pd.DataFrame") -> None:
    for name in ("ensemble", "units"):
        if name in part and part[name].nunique() > 1:
            found = " and ".join(sorted(map(str, part[name].unique())))
            raise InputError(f"a group holds packings of {name} {found}: add {name!r} to by, or take one sweep")
