"""Rows of a table of a campaign that belong together: chosen by name, and refused where they are of several kinds."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np

from jamlab.checks import name_meant
from jamlab.errors import InputError, warn
from jamlab.packing.kinds import MODELS

if TYPE_CHECKING:
    import pandas as pd

    from jamlab.packing.packing import Packing

SAME = 1e-5  # numbers that differ by less, relatively, are one: a pressure is met to 1e-6
LISTED = 6  # values that a message names


@runtime_checkable
class DataFrame(Protocol):
    """A table of pandas, which takes half a second to import."""

    @property
    def columns(self) -> Any:
        """Names of its columns."""

    @property
    def dtypes(self) -> Any:
        """Types of its columns."""


@runtime_checkable
class Campaign(Protocol):
    """What has the tables of a campaign: `jamlab.Campaign`."""

    def _rows_of(self, name: str) -> pd.DataFrame:
        """One of its tables, without a warning of negative moduli, some of which nobody may want."""

    def packings(self, task: str) -> list[Packing]:
        """The packings of a finished task, one for each of its states."""


Select = Mapping[str, str | float | bool]


def rows_of_one_kind(
    source: Any, table: str, select: Select | None, measured: Collection[str], needed: Collection[str]
) -> pd.DataFrame:
    """Rows of a campaign, or of a table of this name, that have the selected values.

    Args:
        source: campaign, or its table.
        table: its name.
        select: column -> its value in the rows that are wanted.
        measured: columns that may differ from row to row; all others have one value.
        needed: columns that the table must have.

    Raises:
        InputError: a column is missing, no row has the values, or rows are of several kinds; the error lists them.
    """
    frame: pd.DataFrame = source._rows_of(table) if isinstance(source, Campaign) else source
    if absent := [name for name in needed if name not in frame.columns]:
        raise InputError(f"the table has no column {absent[0]!r}: give a campaign, or its table {table!r}")
    if not len(frame):
        raise InputError(f"the table {table!r} has no rows: no task with this observable has finished")
    frame = selected(frame, select)
    differing = [name for name in frame.columns if name not in measured and frame[name].nunique(dropna=False) > 1]
    if differing:
        found = "; ".join(f"{name} = {_listed(frame[name].unique().tolist())}" for name in differing)
        first = {name: frame[name].tolist()[0] for name in differing if not frame[name].isna().any()}
        raise InputError(f"the rows of {table!r} are of several kinds: {found}. Choose one, such as select={first}")
    return frame


def selected(frame: pd.DataFrame, select: Select | None) -> pd.DataFrame:
    """Rows that have the selected values.

    Raises:
        InputError: no such column, or no row has the values.
    """
    for name, value in (select or {}).items():
        frame = frame[_has(frame, name, value)]
    return frame


def choice_among(rows: pd.DataFrame) -> str:
    """How to choose packings of one kind among the states of a campaign."""
    state = "state" if rows["target_pressure"].isna().any() else "target_pressure"
    what = (state, "n", "model", "ensemble", "exponent", "stickiness")
    several = [name for name in what if name in rows and rows[name].nunique(dropna=False) > 1]
    first = {name: rows[name].tolist()[0] for name in several}
    said = ", ".join(f"{name!r}: {value!r}" for name, value in first.items()).replace(": nan", ": float('nan')")
    return f"Choose by select{f', such as select={{{said}}}' * bool(said)}"


def check_packings_once(frame: pd.DataFrame, where: str) -> None:
    """Refuse rows of one kind in which a seed has two tasks: sweeps that measure different things of the same packings,
    each of which would count twice."""
    tasks = frame.groupby("seed")["task"].nunique()
    if (tasks > 1).any():
        seed = tasks.index[tasks > 1][0]
        raise InputError(
            f"{where}: seed {seed} has {tasks[seed]} tasks, of several sweeps with the same packings: give those of "
            "one sweep, campaign.table(name, sweep)"
        )


def packings_of(campaign: Campaign, select: Select | None) -> tuple[list[Packing], pd.DataFrame]:
    """The packings of a campaign whose rows in its table "states" have the selected values, and these rows. States
    that did not converge are left out, with a warning that counts them.

    Raises:
        InputError: no such column, or no state has the values, or none that converged.
    """
    frame = selected(campaign._rows_of("states"), select)
    kept = frame[frame["converged"].astype(bool)]
    if not len(kept):
        raise InputError(f"{len(frame)} states, of which none has converged: run the campaign")
    if missed := len(frame) - len(kept):
        warn(f"left out of the mean: {missed} of {len(frame)} states, which did not converge")
    found = []
    for task, rows in kept.groupby("task", sort=False):
        every = campaign.packings(str(task))
        found += [every[state] for state in rows["state"]]
    return found, kept


def _has(frame: pd.DataFrame, name: str, value: Any) -> Any:
    """Which rows have a value in a column; refuses a column that is not there, and a value that no row has."""
    if name == "sweep" and name not in frame.columns:
        raise InputError(
            "select: sweep is no column: choose by columns in which sweeps differ, such as n, ensemble or exponent "
            "(nan: the default), or give the table of one sweep: campaign.table(name, sweep=...)"
        )
    if name not in frame.columns:
        remedy = name_meant(name, frame.columns, f"use one of {', '.join(frame.columns)}")
        raise InputError(f"select: the table has no column {name!r}: {remedy}")
    column = frame[name]
    number = isinstance(value, int | float) and not isinstance(value, bool) and column.dtype.kind in "iuf"
    chosen = np.isclose(column, value, rtol=SAME, atol=0.0, equal_nan=True) if number else column == value
    if not chosen.any():
        raise InputError(f"select: no row has {name} = {value!r}; there is {_listed(column.unique().tolist())}")
    return chosen


def _listed(values: list[Any]) -> str:
    """Values in words, the first few of many."""
    said = [f"{each:.6g}" if isinstance(each, float) else str(each) for each in values[:LISTED]]
    return ", ".join(said) + (f" and {len(values) - LISTED} more" if len(values) > LISTED else "")


def stress_unit(frame: pd.DataFrame) -> str:
    """Name of the unit of stress of rows of one kind; "" where a table does not say its units."""
    units = frame["units"].iloc[0] if "units" in frame else frame.attrs.get("units")
    return MODELS.get(frame["model"].iloc[0]).unit_names[units].stress if units and "model" in frame else ""


def groups_of_numbers(column: Any) -> Any:
    """(n,) numbers of a column with those that are the same up to `SAME` made equal: to five digits."""
    return np.array([float(f"{value:.5g}") for value in np.asarray(column, dtype=np.float64)])
