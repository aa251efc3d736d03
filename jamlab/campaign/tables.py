"""Collect task files into tidy tables, and average over packings with bootstrap intervals.

Packings are independent, states of one packing are not. So the values of each packing in a group are first replaced by
their mean, and the bootstrap draws whole packings.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from jamlab.arrays import ArrayLike, Indices
from jamlab.campaign.folder import CampaignFolder
from jamlab.campaign.observable import DAMPING, TableColumns
from jamlab.campaign.observables import OBSERVABLES, TABLES
from jamlab.campaign.task_file import TaskRows
from jamlab.campaign.tasks import Batch
from jamlab.checks import check_choice, name_meant
from jamlab.errors import InputError, warn
from jamlab.laws.parameter import UNITS
from jamlab.mechanics.negative_moduli import NegativeRows
from jamlab.models.disks import DISKS
from jamlab.models.droplets import DROPLETS
from jamlab.packing.kinds import MODELS
from jamlab.packing.quantities import COLUMNS
from jamlab.statistics.confidence import CONFIDENCE, bootstrap

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Grouping:
    """Rows that are averaged."""

    resamples: int = 1000  # the ends of a 95 % interval to a tenth of its width
    digits: int = 5  # numbers that agree to so many digits are one group: a pressure is met to 1e-6


GROUPING = Grouping()
LONGEST_SIZES = 40  # characters of sizes in a table; longer ones are told apart by a hash
MODULI = ("g", "g_x", "b", "g0")  # columns that may be negative where a packing is unstable
TASKS_AT_A_TIME = 5_000  # of `TableParts`: a spectrum of 100 frequencies of each takes 100 MB

CONTROLS = ("omega", "rate", "amplitude", "target_pressure")  # what is set for each row
_DRIVEN = ("alpha", "prestress", "background_drag")
DISTANCES = {"d_rho": ("rho", "rho_J"), "d_phi": ("phi", "phi_J")}  # columns that `Campaign.aggregate` adds
# protocol, definitions: versions of what made the packings, and of what the table shows of them
_WHO = ("task", "model", "n", "seed", "ensemble", "protocol", "definitions")
_PACKING = ["model", "n", "seed"]  # columns that tell packings of a sweep apart
_LAW = {each.name: each.law_columns for each in (DROPLETS, DISKS)}
_OF_LAWS = (*_LAW[DROPLETS.name], *_LAW[DISKS.name], "contact")
TABLE_COLUMNS: dict[str, tuple[str, ...]] = {
    "states": (
        *_WHO,
        *("units", "start", "state", "rho_J", "phi_J", "target_pressure", "converged", *COLUMNS),
        *_OF_LAWS,
    ),
    "onset": (*_WHO, "start", "rho_J", "phi_J", "z_J", "rattlers", "converged"),
    **{name: (*_WHO, *observable.columns) for name, observable in OBSERVABLES.items()},
}
STATE_COLUMNS = (*TABLE_COLUMNS["states"], "sizes", *DISTANCES)  # names that no observable of the user's own may have


def table(folder: CampaignFolder, names: Iterable[str], name: str) -> pd.DataFrame:
    """Collect one table from finished tasks, sorted by model, n and seed; "states" has the columns of the user's own
    observables too, nan where a task lacks them."""
    (rows,) = TableParts(folder, name, [warned_if_none(list(names), folder)])
    return rows


def warned_if_none(names: list[str], folder: CampaignFolder) -> list[str]:
    """Give back the names of finished tasks, with a warning if there are none."""
    if not names:
        missing = "" if folder.path.is_dir() else ", which does not exist: check the folder, or run the campaign"
        warn(f"no task is finished in {folder.path}{missing}")
    return names


def in_parts(batches: Iterable[Batch], finished: set[str]) -> list[list[str]]:
    """List the finished tasks of batches in the order of the rows of tables, so many together as are in memory at a
    time."""
    alike: dict[tuple[str, int], list[Batch]] = {}
    for batch in batches:
        alike.setdefault((batch.parameters.model, batch.parameters.n), []).append(batch)
    names: list[str] = []
    for _, some in sorted(alike.items(), key=lambda entry: entry[0]):
        pairs = {(seed, batch.name_of(seed)) for batch in some for seed in batch.seeds}
        names += [name for _, name in sorted(pairs) if name in finished]
    return [names[k : k + TASKS_AT_A_TIME] for k in range(0, len(names), TASKS_AT_A_TIME)] or [[]]


class TableParts:
    """The rows of a table of some tasks at a time; all parts have the columns and types of the whole table.

    Tasks of one model that differ in their units, force law or sizes have these as further columns.

    Args:
        folder: of the tasks.
        name: of the table.
        parts: names of tasks. Of several parts, all rows are read twice, first for the columns.
        warned: moduli of which a negative one is worth a warning.
    """

    def __init__(
        self,
        folder: CampaignFolder,
        name: str,
        parts: Sequence[Sequence[str]],
        warned: Collection[str] = MODULI,
    ):
        check_choice("table", name, TABLES)
        self._folder, self._name, self._parts, self._warned = folder, name, parts, warned
        self._kinds: dict[tuple[str, str], set[str]] = {}  # model and column of `_kind` -> its values
        self._own: dict[str, str] = {}  # columns of the user's own observables -> observable
        self._of_laws: dict[str, None] = {}  # columns of parameters of laws, of which each sweep has its own

    def __iter__(self) -> Iterator[pd.DataFrame]:
        import pandas as pd

        negative = NegativeRows()
        if len(self._parts) == 1:
            rows = self._rows(self._parts[0], negative)
            negative.tell(f"rows of {self._name!r}")
            wanted = self._wanted()
            frame = pd.DataFrame({column: np.empty(0) for column in wanted}) if rows is None else rows[wanted]
            units = {value for (_, name), values in self._kinds.items() if name == "units" for value in values}
            frame.attrs = {"units": units.pop()} if len(units) == 1 else {}
            yield frame
            return
        firsts = [rows.head(1) for part in self._parts if (rows := self._rows(part, negative)) is not None]
        negative.tell(f"rows of {self._name!r}")
        types = pd.concat(firsts)[self._wanted()].dtypes.to_dict() if firsts else {}
        for part in self._parts:
            if (rows := self._rows(part, NegativeRows())) is not None:
                yield rows.reindex(columns=list(types)).astype(types)

    def _wanted(self) -> list[str]:
        known = [*TABLE_COLUMNS[self._name], *self._of_laws]
        several = dict.fromkeys(name for (_, name), values in self._kinds.items() if len(values) > 1)
        return [*known, *(name for name in several if name not in known), *sorted(self._own)]

    @property
    def kinds(self) -> tuple[str, ...]:
        """Columns of what tasks are made of, once the rows are read; a table of measured values may use such a name for
        another quantity, as "correlation" does with delta."""
        measured = OBSERVABLES[self._name].columns if self._name in OBSERVABLES else ()
        return tuple(dict.fromkeys(name for _, name in self._kinds if name not in measured))

    def _rows(self, names: Sequence[str], negative: NegativeRows) -> pd.DataFrame | None:
        """The rows of some tasks, with the columns that these have; None without rows."""
        import pandas as pd

        parts: list[pd.DataFrame] = []
        for file in self._folder.rows(names, self._name):
            columns, counts = self._columns(file)
            if columns and counts.any():
                who: dict[str, Any] = {key: getattr(file.parameters, key) for key in _WHO[1:]}
                who["task"] = np.repeat(np.array(file.tasks, dtype=object), counts)
                who["seed"] = np.repeat(file.seeds, counts)
                kind = _kind(file)
                for each, value in kind.items():
                    self._kinds.setdefault((file.parameters.model, each), set()).add(str(value))
                parts.append(pd.DataFrame(who | kind | columns))
        if not parts:
            return None
        rows = pd.concat(parts).sort_values(["model", "n", "seed", "task"], kind="stable", ignore_index=True)
        negative.count({each: rows[each] for each in MODULI if each in self._wanted() and each in self._warned})
        return rows

    def _columns(self, file: TaskRows) -> tuple[dict[str, Any], Indices]:
        """The columns of a file, but for the tasks', and the number of rows of each task."""
        known = TABLE_COLUMNS[self._name]
        if self._name == "onset":
            return _onset(file), np.ones_like(file.frames)
        if self._name == "states":
            self._of_laws |= dict.fromkeys(each for each in _of_named_law(file) if each not in known)
            return _states(file) | _own(file, self._own), file.frames
        columns = file.tables.get(self._name, {})
        self._of_laws |= dict.fromkeys(each for each in columns if each not in known)
        return columns, file.rows.get(self._name, np.zeros_like(file.frames))


def _onset(file: TaskRows) -> TableColumns:
    """The packing at onset, of every task that begins there."""
    if not file.parameters.from_onset:
        return {}
    first = _first(file)
    names = {"rho_J": "rho", "phi_J": "phi", "z_J": "z", "rattlers": "rattlers"}
    found = {column: file.observables[name][first] for column, name in names.items()}
    return found | {"converged": file.converged[first]}


def _first(file: TaskRows) -> Indices:
    """Where the frames of each task begin."""
    return np.cumsum(file.frames) - file.frames


def _states(file: TaskRows) -> dict[str, Any]:
    onset = _onset(file)
    return {
        "state": np.arange(len(file.converged)) - np.repeat(_first(file), file.frames),
        "rho_J": np.repeat(onset["rho_J"], file.frames) if onset else np.nan,
        "phi_J": np.repeat(onset["phi_J"], file.frames) if onset else np.nan,
        "target_pressure": file.target_pressure,
        "converged": file.converged,
        **{name: file.observables[name] for name in COLUMNS},
    }


def _kind(file: TaskRows) -> dict[str, Any]:
    """What the particles of some tasks are, and how those at onset started: never averaged over."""
    model, law, sizes = file.parameters.model, file.parameters.law, file.parameters.sizes
    if len(sizes) > LONGEST_SIZES:
        sizes = f"{sizes[:LONGEST_SIZES]}... ({hashlib.sha256(sizes.encode()).hexdigest()[:8]})"
    return {
        "units": file.units,
        "start": str(file.parameters.recipe.start or ""),
        **{name: law.get(name, np.nan) if own == model else np.nan for own, names in _LAW.items() for name in names},
        "contact": str(law.get("contact", "")),
        **_of_named_law(file),
        "sizes": sizes,
    }


def _of_named_law(file: TaskRows) -> dict[str, Any]:
    """The force law that a sweep names, and those of its parameters that are no columns of every table; without a name
    those that the sweep gives beside what every packing of the model says."""
    law = file.parameters.law
    own = MODELS.get(file.parameters.model).parameters(None, law)
    others = [name for name, each in own.items() if name not in {*UNITS, "law", *_OF_LAWS} and not each.each]
    if "law" not in law:
        return {name: law[name] for name in others if name in law and own[name].default is not None}
    return {"law": law["law"], **{name: law.get(name, own[name].default) for name in others}}


def _own(file: TaskRows, known: dict[str, str]) -> dict[str, Any]:
    """Return the columns of the user's own observables, and note in `known` which observable each belongs to."""
    found: dict[str, Any] = {}
    for observable, columns in file.tables.items():
        if observable in file.parameters.own:
            for column in columns:
                if known.setdefault(column, observable) != observable:
                    both = f"{observable} and {known[column]}"
                    raise InputError(f"{both} have a column {column!r}: select one sweep")
            found |= columns
    return found


def aggregate(
    frame: pd.DataFrame,
    values: Sequence[str],
    by: Sequence[str],
    *,
    along: str | None = None,
    bins: ArrayLike | None = None,
    confidence: float = CONFIDENCE,
    kinds: Collection[str] = (),
) -> pd.DataFrame:
    """Average the values of each group of rows, with intervals over packings; see `Campaign.aggregate`. What agrees to
    five digits in `by` is one value, given in full if all rows have the same, such as a frequency. Intervals of one
    packing are nan; `<value>_packings` counts those with a finite value. `kinds`: columns that differ between packings
    that have no common mean, beside those of every table."""
    import pandas as pd

    _check_columns(frame, [*values, *([along] if along else [])], by)
    if (along is None) != (bins is None):
        raise InputError(f"along = {along!r}, bins = {bins!r}: give both, a column and the edges of its bins")
    if not 0 < confidence < 1:
        raise InputError(f"confidence = {confidence}: must lie between 0 and 1")
    keys = {name: frame[name] for name in by}
    for name, key in keys.items():
        if key.dtype.kind == "f":
            keys[name] = key.map(lambda value: float(f"{value:.{GROUPING.digits}g}"))
    if along is not None:
        place = _bins_of(frame[along], bins)
        inside = place >= 0
        frame, keys = frame[inside], {name: key[inside] for name, key in keys.items()}
        keys["bin"] = pd.Series(place[inside], index=frame.index)
    rows = []
    for group, part in frame.groupby(list(keys.values()), sort=True, dropna=False) if keys else [((), frame)]:
        _check_alike(part, kinds)
        _check_controls(part, values, along)
        row: dict[str, Any] = dict(zip(keys, group if isinstance(group, tuple) else (group,), strict=True))
        row |= {name: part[name].iloc[0] for name in by if part[name].nunique() == 1}  # to all of its digits
        if along is not None:
            row[along] = float(part[along].mean())
        row["packings"] = part.groupby(_PACKING).ngroups
        for name in values:
            row |= _mean(part, name, confidence)
        rows.append(row)
    columns = [*keys, *([along] if along else []), "packings"]
    columns += [f"{name}{end}" for name in values for end in ("", "_low", "_high", "_packings")]
    return pd.DataFrame(rows) if len(frame) else pd.DataFrame(columns=columns)


def _check_columns(frame: pd.DataFrame, numbers: Sequence[str], by: Sequence[str]) -> None:
    """Refuse columns that a table does not have, and means of columns without numbers."""
    for name in [*numbers, *by]:
        if name not in frame.columns:
            remedy = name_meant(name, frame.columns, f"use one of {', '.join(frame.columns)}")
            raise InputError(f"the table has no column {name!r}: {remedy}")
    for name in numbers:
        if frame[name].dtype.kind not in "biuf":
            raise InputError(f"column {name!r} holds no numbers: give it in by=, to group by it")


def _bins_of(column: pd.Series[Any], bins: ArrayLike | None) -> Indices:
    """(n,) the bin of each value, -1 outside of all."""
    edges = np.asarray(bins, dtype=np.float64)
    if edges.ndim != 1 or len(edges) < 2 or not np.all(np.diff(edges) > 0):
        raise InputError(f"bins = {bins!r}: give two or more edges, ascending")
    place = np.digitize(column.to_numpy(np.float64), edges) - 1
    return np.where(place < len(edges) - 1, place, -1)


def _check_alike(part: pd.DataFrame, kinds: Collection[str]) -> None:
    """Refuse a group of rows that were made or measured in different ways."""
    laws = tuple(f"{name}_" for name in part["damping"].unique()) if "damping" in part else ()
    # columns of what is never averaged over: which particles, in which box, driven how
    alike = dict.fromkeys(("model", "ensemble", *kinds, *DAMPING, *_DRIVEN))
    for name in (*alike, *(each for each in part if str(each).startswith(laws))):
        if name in part and part[name].nunique(dropna=False) > 1:
            found = " and ".join(sorted(map(str, part[name].unique())))
            raise InputError(f"a group mixes rows of {name} {found}: add {name!r} to by=, or select one sweep")


def _check_controls(part: pd.DataFrame, values: Sequence[str], along: str | None) -> None:
    """Refuse the mean over rows of one packing at several values of what was set, such as a frequency: it depends on
    which values were chosen. What is the same in all rows of a packing has a mean."""
    controls = [*CONTROLS, *(["stress"] if "final_strain" in part else [])]  # of creep
    for name in controls:
        if name in part and name != along and part[name].nunique(dropna=False) > 1:
            varied = [value for value in values if (part.groupby(_PACKING)[value].nunique() > 1).any()]
            if varied:
                found = f"{part[name].nunique(dropna=False)} values of {name}"
                raise InputError(f"a group mixes {found}: add {name!r} to by=, or give it in along= with bins=")


def _mean(part: pd.DataFrame, name: str, confidence: float) -> dict[str, Any]:
    """Mean of a column over packings, the ends of its interval, and the number of packings that have a value."""
    kept = part[np.isfinite(part[name].astype(np.float64))]
    packings = kept.groupby(_PACKING)[name].mean().to_numpy(np.float64)
    ends = (np.nan, np.nan, np.nan)
    if len(packings):
        mean = bootstrap([packings], lambda g: np.mean(g[0]), resamples=GROUPING.resamples, level=confidence)
        ends = (float(mean.value), float(mean.low), float(mean.high))
    return dict(zip((name, f"{name}_low", f"{name}_high", f"{name}_packings"), (*ends, len(packings)), strict=True))
