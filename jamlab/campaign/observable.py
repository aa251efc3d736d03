"""What an observable of a campaign is: one class with all that files, names of tasks, tables, plans and plots need.

A subclass says which keys a sweep gives for it (its fields), which columns a task file holds (`stored`) and a table
shows (`columns`), how the states of a task are measured (`measure`), on what the result depends (`depends_on`), what
that costs (`seconds`, `rows`), and how axes are labelled (`labels`). `observables.py` lists all of them.
"""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.campaign.file_values import DampingLaws, FileTable, Tolerances
from jamlab.packing.packing import Packing

Row = dict[str, Any]  # column -> a number, or an array: as many rows as it is long
Columns = dict[str, NDArray[Any]]
Schema = dict[str, np.dtype[Any]]
Points = tuple[tuple[int, float], ...]  # (n, seconds)

FLOAT, WHOLE, FLAG = np.dtype(np.float64), np.dtype(np.int64), np.dtype(np.bool_)
STATE = {"state": WHOLE, "pressure": FLOAT, "target_pressure": FLOAT}  # the frame of a row, and its pressure at rest
LAW = {"stokes": FLAG, "beta": FLOAT, "eta_f": FLOAT}
VERTICES = 14.5  # per droplet with the default law, of which times were measured: the mean of small and large ones


def floats(*names: str) -> Schema:
    """Columns of floating-point numbers."""
    return dict.fromkeys(names, FLOAT)


@dataclass(frozen=True)
class TaskStates:
    """States of one task."""

    packings: list[Packing]  # frame by frame; in a compression the first is the onset itself
    target_pressures: list[float]  # one per packing, in units of k; nan where there is none
    converged: list[bool]  # one per packing: at a minimum within the tolerances, and at its packing fraction
    missing: list[dict[str, str]]  # one entry per state that could not be made: `state`, as text, and `reason`


@dataclass(frozen=True)
class Measured:
    """States with their pressures at rest, of which observables make rows."""

    states: TaskStates
    pressure: Array
    tolerances: Tolerances

    def each(self) -> list[tuple[int, Packing, Row]]:
        """List the states by number, each with the columns that begin its rows."""
        targets = self.states.target_pressures
        return [
            (k, packing, {"state": k, "pressure": self.pressure[k], "target_pressure": targets[k]})
            for k, packing in enumerate(self.states.packings)
        ]


@dataclass(frozen=True)
class Size:
    """What the cost of a task depends on beside its observables."""

    model: str  # "sp" or "dp"
    n: int  # number of particles
    sites: float  # number of coordinate pairs of a packing: disks, or vertices
    states: int  # number of packings

    def seconds(self, points: Points) -> float:
        """Interpolate times of packings, linear in log n and log t; beyond the last point, extrapolate. Droplets count
        by their vertices: 8 droplets of 29 vertices take as long as 16 of 14.5."""
        n = self.n if self.model == "sp" else self.sites / VERTICES
        x, y = np.log(np.array(points)).T
        slope = (y[-1] - y[-2]) / (x[-1] - x[-2])
        beyond = max(0.0, np.log(n) - x[-1]) * slope
        return float(np.exp(np.interp(np.log(n), x, y) + beyond))


class Observable(FileTable):
    """What a sweep asks to measure, with the values of its keys; a table of this name."""

    name: ClassVar[str]  # in `observables` of a sweep, and of its table
    # columns in a file of a task, with their types; `state` is the frame that a row belongs to
    stored: ClassVar[Schema]
    # of the table that users see; what a file does not hold is taken from its task or its states
    columns: ClassVar[tuple[str, ...]]
    before: ClassVar[tuple[str, ...]] = ()  # columns of the table that a file does not hold
    needs: ClassVar[str] = "frequencies"  # what a sweep must give for the keys without default
    only: ClassVar[str] = ""  # the one model that it is for; "" for both
    labels: ClassVar[dict[str, str]] = {}  # column -> label of its axis in plots

    @classmethod
    def __pydantic_init_subclass__(cls, **_: Any) -> None:
        if "columns" not in cls.__dict__ and hasattr(cls, "stored"):
            cls.columns = (*cls.before, *("law" if name == "stokes" else name for name in cls.stored))

    @classmethod
    def required(cls) -> list[str]:
        """Keys that a sweep must give."""
        return [key for key, field in cls.model_fields.items() if field.is_required()]

    def check(self, sites: float) -> None:
        """Raise ValueError for packings of so many sites that cannot be measured."""

    @abstractmethod
    def measure(self, of: Measured) -> list[Row]:
        """Measure the states of a task, row by row; an unstable packing has nan or no row."""

    def depends_on(self, tolerances: Tolerances) -> Any:
        """On what the rows of given states depend: two that are equal have the same table."""
        return self

    def constants(self) -> Row:
        """Columns of the table with one value for all rows, which no file holds."""
        return {}

    @abstractmethod
    def seconds(self, size: Size) -> float:
        """Estimate the time to measure all states of a task, s."""

    def rows(self, size: Size) -> float:
        """Estimate the number of rows for each state, where it matters for the size of files."""
        return 0


class Driven(Observable):
    """An observable with damping laws."""

    damping: DampingLaws = DampingLaws(contact=[1.0])

    def check(self, sites: float) -> None:
        if not self.damping.count:
            raise ValueError(f"observable {self.name!r} needs a damping law: add contact or stokes to damping")


def measure_tables(observables: list[Observable], of: Measured, known: Mapping[str, Columns]) -> dict[str, Columns]:
    """Measure the table of every observable that is not among the known ones; those are returned as they are."""
    return {**known, **{o.name: _stack(o.stored, o.measure(of)) for o in observables if o.name not in known}}


def _stack(schema: Schema, rows: list[Row]) -> Columns:
    """Concatenate rows to columns; numbers in a row are repeated to the length of its arrays."""
    lengths = [max(np.size(value) for value in row.values()) for row in rows]
    columns: Columns = {}
    for name, kind in schema.items():
        parts = [np.broadcast_to(row[name], length) for row, length in zip(rows, lengths, strict=True)]
        columns[name] = np.concatenate(parts).astype(kind) if parts else np.empty(0, kind)
    return columns
