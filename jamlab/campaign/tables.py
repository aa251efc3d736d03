"""Collect task files into tidy tables, and average over packings with bootstrap intervals.

Packings are independent, states of one packing are not. So the values of each packing in a group are first replaced by
their mean, and the bootstrap draws whole packings.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from jamlab.arrays import Array
from jamlab.campaign.folder import CampaignFolder, TaskFile, read_task_file
from jamlab.campaign.observables import OBSERVABLES, TABLES, Onset
from jamlab.campaign.tasks import as_column
from jamlab.checks import check_choice
from jamlab.errors import InputError
from jamlab.packing.quantities import COLUMNS
from jamlab.statistics.confidence import CONFIDENCE, bootstrap

if TYPE_CHECKING:
    import pandas as pd


_RESAMPLES = 1000  # the ends of a 95 % interval to a tenth of its width
_DIGITS = 5  # numbers that agree to so many digits are one group: a pressure is met to 1e-6
_MOST_BINS = 12  # a column with no more values than that is not binned
_WIDE = 30.0  # ratio of the largest to the smallest value from which bins are equal in ratio
DISTANCES = ("d_rho", "d_phi")  # from onset; columns that `Campaign.aggregate` adds to "states"
# protocol, definitions: versions of what made the packings, and of what the table shows of them
_WHO = ("task", "model", "n", "seed", "ensemble", "protocol", "definitions")
_PACKING = ["model", "n", "seed"]  # columns that tell packings of a sweep apart
_LAW = {"dp": ("gamma", "ka", "delta", "eps", "nv_small"), "sp": ("exponent", "stickiness")}
TABLE_COLUMNS: dict[str, tuple[str, ...]] = {
    "states": (
        *_WHO,
        *("units", "state", "onset", "onset_phi", "target_pressure", "converged", *COLUMNS),
        *(*_LAW["dp"], *_LAW["sp"], "contact", "wall_time"),
    ),
    "onset": (*_WHO, *Onset.columns),
    **{name: (*_WHO, *observable.columns) for name, observable in OBSERVABLES.items()},
}
STATE_COLUMNS = (*TABLE_COLUMNS["states"], *DISTANCES)  # names that no observable of the user's own may have


def table(folder: CampaignFolder, names: Iterable[str], name: str) -> pd.DataFrame:
    """Collect one table from finished tasks, sorted by model, n and seed; "states" has the columns of the user's own
    observables too, nan where a task lacks them."""
    import pandas as pd

    check_choice("table", name, TABLES)
    parts: list[pd.DataFrame] = []
    own: dict[str, str] = {}
    for task in names:
        file = read_task_file(folder.task_file(task), name)
        columns = _states(file) | _own(file, own) if name == "states" else _columns(file, name)
        if columns:
            p = file.parameters
            who: dict[str, Any] = {"task": task, **{key: getattr(p, key) for key in _WHO[1:5]}}
            who |= {"protocol": as_column(p.protocol_names, p.protocol)}
            who |= {"definitions": as_column(p.definition_names(name), p.definitions)}
            parts.append(pd.DataFrame(who | columns))
    wanted = [*TABLE_COLUMNS[name], *sorted(own)]
    if not parts:
        return pd.DataFrame({column: np.empty(0) for column in wanted})
    rows = pd.concat(parts).sort_values(["model", "n", "seed", "task"], kind="stable", ignore_index=True)
    return rows[wanted]


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
    model, law = file.parameters.model, file.parameters.force_law
    rho_j, phi_j = file.onset
    return {
        "units": file.units,
        "state": np.arange(len(file.converged)),
        "onset": rho_j,
        "onset_phi": phi_j,
        "target_pressure": file.target_pressure,
        "converged": file.converged,
        **{name: file.observables.get(name, np.nan) for name in COLUMNS},  # of an earlier version: measured less
        **{name: law.get(name, np.nan) if own == model else np.nan for own, names in _LAW.items() for name in names},
        "contact": str(law.get("contact", "")) if model == "dp" else "",
        "wall_time": file.wall_time,
    }


def _own(file: TaskFile, known: dict[str, str]) -> dict[str, Any]:
    """Return the columns of the user's own observables, and note in `known` which observable each belongs to."""
    found: dict[str, Any] = {}
    for observable, columns in file.tables.items():
        if ":" in observable:
            for column in columns:
                if known.setdefault(column, observable) != observable:
                    both = f"{observable} and {known[column]}"
                    raise InputError(f"{both} have a column {column!r}: select one sweep")
            found |= columns
    return found


def choose_bins(values: Array) -> Array:
    """Edges of bins for a column. A column of a few values, such as target pressures, gets a bin for each of them.
    Others get twelve bins, equal in ratio where the positive values span more than a factor of 30; what lies at zero or
    below is then outside."""
    finite = values[np.isfinite(values)]
    if not len(finite):
        return np.array([0.0, 1.0])
    kinds = np.unique([float(f"{value:.5g}") for value in finite])  # a pressure is met to 1e-6
    if len(kinds) <= _MOST_BINS:
        return np.concatenate([[-np.inf], 0.5 * (kinds[1:] + kinds[:-1]), [np.inf]])
    up = kinds[kinds > 0]
    if len(up) > 1 and up[-1] > _WIDE * up[0]:
        return np.geomspace(up[0] * (1 - 1e-4), up[-1] * (1 + 1e-4), _MOST_BINS + 1)
    edges = np.linspace(finite.min(), finite.max(), _MOST_BINS + 1)
    edges[-1] = np.nextafter(edges[-1], np.inf)
    return edges


def aggregate(
    frame: pd.DataFrame,
    values: Sequence[str],
    by: Sequence[str],
    *,
    along: str | None = None,
    bins: ArrayLike | None = None,
    confidence: float = CONFIDENCE,
) -> pd.DataFrame:
    """Average the values of each group of rows, with intervals over packings; see `Campaign.aggregate`. What agrees to
    five digits in `by` is one value, given in full if all rows have the same, such as a frequency. Intervals of one
    packing are nan; `<value>_packings` counts those with a finite value."""
    import pandas as pd

    _require_columns(frame, [*values, *by, *([along] if along else [])])
    if along is None and bins is not None:
        raise InputError(f"bins = {bins!r}: give the column to divide into bins, along = ...")
    edges = None if bins is None else np.asarray(bins, dtype=np.float64)
    if edges is not None and (edges.ndim != 1 or len(edges) < 2 or not np.all(np.diff(edges) > 0)):
        raise InputError(f"bins = {bins!r}: give two or more edges, ascending")
    if not 0 < confidence < 1:
        raise InputError(f"confidence = {confidence}: must lie between 0 and 1")
    keys = {name: frame[name] for name in by}
    for name, key in keys.items():
        if key.dtype.kind == "f":
            keys[name] = key.map(lambda value: float(f"{value:.{_DIGITS}g}"))
    if along is not None:
        numbers = frame[along].to_numpy(np.float64)
        edges = choose_bins(numbers) if edges is None else edges
        place = np.digitize(numbers, edges) - 1
        inside = (place >= 0) & (place < len(edges) - 1)
        frame, keys = frame[inside], {name: key[inside] for name, key in keys.items()}
        keys["bin"] = pd.Series(place[inside], index=frame.index)
    rows = []
    for group, part in frame.groupby(list(keys.values()), sort=True, dropna=False) if keys else [((), frame)]:
        for name in ("ensemble", "units"):
            if name in part and part[name].nunique() > 1:
                found = " and ".join(sorted(map(str, part[name].unique())))
                raise InputError(f"a group mixes packings of {name} {found}: add {name!r} to by, or select one sweep")
        row: dict[str, Any] = dict(zip(keys, group if isinstance(group, tuple) else (group,), strict=True))
        row |= {name: part[name].iloc[0] for name in by if part[name].nunique() == 1}  # to all of its digits
        if along is not None:
            row[along] = float(part[along].mean())
        row["packings"] = part.groupby(_PACKING).ngroups
        for name in values:
            row |= _mean(part, name, confidence)
        rows.append(row)
    return pd.DataFrame(rows if len(frame) else [])


def _mean(part: pd.DataFrame, name: str, confidence: float) -> dict[str, Any]:
    """Mean of a column over packings, the ends of its interval, and the number of packings that have a value."""
    kept = part[np.isfinite(part[name].astype(np.float64))]
    packings = kept.groupby(_PACKING)[name].mean().to_numpy(np.float64)
    ends = (np.nan, np.nan, np.nan)
    if len(packings):
        mean = bootstrap([packings], lambda g: np.mean(g[0]), resamples=_RESAMPLES, level=confidence)
        ends = (float(mean.value), float(mean.low), float(mean.high))
    return dict(zip((name, f"{name}_low", f"{name}_high", f"{name}_packings"), (*ends, len(packings)), strict=True))


def _require_columns(frame: pd.DataFrame, names: Iterable[str]) -> None:
    for name in names:
        if name not in frame.columns:
            raise InputError(f"the table has no column {name!r}: use one of {', '.join(frame.columns)}")
