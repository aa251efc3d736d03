"""What an observable of a campaign is: one class with all that files, names of tasks, tables and plots need.

A subclass says which keys a sweep gives for it (its fields), which columns its table has (`columns`) and how a state
is measured in one of several ways (`one`, `cases`). `observables.py` lists all of them. Observables of the user's own
are functions `module:function` that take a packing and return numbers.
"""

import importlib
import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.machinery import PathFinder
from types import ModuleType
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_serializer, model_validator

from jamlab.campaign.keys import within
from jamlab.errors import ConvergenceError, InputError, JamlabError
from jamlab.packing.model import Model
from jamlab.packing.packing import Packing
from jamlab.registry import Registry
from jamlab.rheology.drag_law import DRAGS, DragLaw, make_law
from jamlab.type_variables import T

LARGEST_NUMBER = 1e100  # frequencies and drag are squared and multiplied: 1e150 would overflow

Row = dict[str, Any]  # column -> a number, or an array: as many rows as it is long
TableColumns = dict[str, NDArray[Any]]


class FileTable(BaseModel):
    """A TOML table without unknown keys and without conversion of text to numbers."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


def as_list(value: Any) -> Any:
    """Take a single value for a list of one."""
    return value if isinstance(value, list) else [value]


def distinct(value: list[T]) -> list[T]:
    """Refuse a list that names something twice, or nothing."""
    if repeated := [entry for k, entry in enumerate(value) if entry in value[:k]]:
        raise ValueError(f"{repeated[0]!r} is listed twice: leave one out")
    if not value:
        raise ValueError("the list is empty: give at least one")
    return value


def _space_evenly_in_log(value: Any) -> Any:
    if isinstance(value, dict):
        grid = LogGrid.model_validate(value)
        omega = np.geomspace(grid.lowest, grid.highest, grid.points)
        return [float(f"{w:.12g}") for w in omega]  # equal on every machine: task names depend on it
    return value


def ascending(values: list[float]) -> list[float]:
    """Sort numbers, so that their order in the file does not enter the names of tasks."""
    return sorted(map(float, values))


def descending(values: list[float]) -> list[float]:
    """Sort numbers, the largest first, see `ascending`."""
    return sorted(map(float, values), reverse=True)


Positive = Annotated[float, Field(gt=0, le=LARGEST_NUMBER)]
NotNegative = Annotated[float, Field(ge=0, le=LARGEST_NUMBER)]
# a list, or { lowest, highest, points } for even spacing in the logarithm
Grid = Annotated[list[T], BeforeValidator(_space_evenly_in_log), Field(min_length=1), AfterValidator(ascending)]
Frequencies = Grid[Positive]
OneOrMore = Annotated[list[T], BeforeValidator(as_list), AfterValidator(distinct)]
Prestress = Annotated[OneOrMore[bool], AfterValidator(sorted)]


class LogGrid(FileTable):
    """{ lowest, highest, points }: numbers of equal ratio."""

    lowest: Positive
    highest: Positive
    points: Annotated[int, within("points")]

    @model_validator(mode="after")
    def _check_order(self) -> "LogGrid":
        if self.lowest >= self.highest:
            raise ValueError(f"lowest = {self.lowest:g} is not below highest = {self.highest:g}: swap them")
        return self


Named = dict[str, float | str]  # parameters of a drag law by name


class DampingLaws(FileTable):
    """Drag laws: beta of contact damping, eta_f of Stokes drag, and tables of the parameters of any other registered
    law; one spectrum for each."""

    contact: Annotated[list[NotNegative], AfterValidator(ascending)] = []
    stokes: Annotated[list[NotNegative], AfterValidator(ascending)] = []
    others: dict[str, list[Named]] = {}  # by the name of the law, which stands in its place in the file

    @model_validator(mode="before")
    @classmethod
    def _take_others(cls, given: Any) -> Any:
        if not isinstance(given, dict) or "others" in given:
            return given
        names = [name for name in given if name not in cls.model_fields and name in DRAGS.names()]
        others = {name: as_list(given[name]) for name in names}
        return {name: value for name, value in given.items() if name not in others} | {"others": others}

    @model_validator(mode="after")
    def _check_others(self) -> "DampingLaws":
        for name, tables in self.others.items():
            for numbers in distinct(tables):
                make_law(name, numbers)  # InputError is a ValueError
        return self

    @model_serializer(mode="wrap")
    def _leave_out_none(self, dump: Callable[["DampingLaws"], dict[str, Any]]) -> dict[str, Any]:
        """Part of the names of tasks; tasks without other laws keep their names."""
        return {name: value for name, value in dump(self).items() if value or name != "others"}

    def with_columns(self, alpha: float = 1.0) -> list[tuple[DragLaw, Row]]:
        """List the laws, contact damping with this power of the velocity, each with its columns in a table."""
        none, laws = {"beta": np.nan, "eta_f": np.nan, "alpha": np.nan}, list[tuple[DragLaw, Row]]()
        for beta in self.contact:
            law = make_law("contact", {"beta": beta, "alpha": alpha})
            laws.append((law, none | {"damping": law.name, "beta": beta, "alpha": alpha}))
        for eta_f in self.stokes:
            law = make_law("stokes", {"eta_f": eta_f})
            laws.append((law, none | {"damping": law.name, "eta_f": eta_f}))
        for law in (make_law(name, numbers) for name, tables in self.others.items() for numbers in tables):
            own = {f"{law.name}_{name}": getattr(law, name) for name in law.parameters()}
            laws.append((law, none | {"damping": law.name} | own))
        return laws


# columns of the state of a row: the frame, its pressure at rest, and the one aimed at; of its damping law
STATE, DAMPING = ("state", "pressure", "target_pressure"), ("damping", "beta", "eta_f")


@dataclass(frozen=True)
class TaskStates:
    """States of one task."""

    packings: list[Packing]  # frame by frame; in a compression the first is the onset itself
    target_pressures: list[float]  # one per packing, in units of k; nan where there is none
    converged: list[bool]  # one per packing: at a minimum within the tolerances, and at its packing fraction
    missing: list[dict[str, str]]  # one entry per state that could not be made: `state`, as text, and `reason`


class Observable(FileTable):
    """What a sweep asks to measure, with the values of its keys; a table of this name."""

    name: ClassVar[str]  # in `observables` of a sweep, and of its table
    columns: ClassVar[tuple[str, ...]]  # of its table
    needs: ClassVar[str] = "frequencies"  # what a sweep must give for the keys without default
    refusal: ClassVar[type[JamlabError]] = ConvergenceError  # of a packing that is not jammed, or unstable

    @staticmethod
    def serves(kind: Model[Any]) -> bool:
        """Whether it is for packings of a model."""
        return True

    def check(self, sites: float) -> None:
        """Raise ValueError for packings of so many sites that cannot be measured."""

    def measure(self, states: TaskStates, known: Mapping[str, NDArray[Any]]) -> TableColumns:
        """Measure the states of a task, row by row; of every state some columns are known."""
        rows: list[Row] = []
        for k, packing in enumerate(states.packings):
            state = {name: values[k] for name, values in known.items()}
            for how, columns in self.cases():
                try:
                    found = self.one(packing, **how)
                except self.refusal:
                    found = self.refused()
                for row in found:
                    good = states.converged[k] & row.get("converged", False)
                    rows.append(state | columns | row | {"converged": good})
        return stack([*self.columns, *self.more_columns()], rows)

    def more_columns(self) -> list[str]:
        """Columns that depend on the sweep."""
        return []

    def cases(self) -> list[tuple[dict[str, Any], Row]]:
        """Ways in which each state is measured: arguments of `one`, and columns that tell them apart."""
        return [({}, {})]

    def amount(self) -> float:
        """Work that a state is, in units that take about the same time, see `jamlab.campaign.cost`."""
        return len(self.cases())

    def one(self, packing: Packing, **how: Any) -> list[Row]:
        """Measure a state in one way; its rows without the columns of state and way."""
        raise NotImplementedError

    def refused(self) -> list[Row]:
        """Rows of a state that `one` refuses; what they lack is nan, and not converged."""
        return []


class Driven(Observable):
    """An observable with damping laws."""

    damping: DampingLaws = DampingLaws(contact=[1.0])

    def check(self, sites: float) -> None:
        if not self.laws():
            raise ValueError(
                f"observable {self.name!r} needs a drag law: add contact, stokes or another one to damping"
            )
        for law, _ in self.laws():  # which refuse what they cannot have
            self.check_law(law)

    def laws(self) -> list[tuple[DragLaw, Row]]:
        """Drag laws, each with its columns."""
        return self.damping.with_columns()

    def more_columns(self) -> list[str]:
        """Parameters of laws that are neither contact damping nor Stokes drag."""
        known = {*DAMPING, "alpha"}
        return list(dict.fromkeys(name for _, row in self.laws() for name in row if name not in known))

    def check_law(self, law: DragLaw) -> None:
        """Raise ValueError for a law that no state can be driven by."""

    def cases(self) -> list[tuple[dict[str, Any], Row]]:
        return [({"law": law}, columns) for law, columns in self.laws()]


def stack(names: Iterable[str], rows: list[Row]) -> TableColumns:
    """Concatenate rows to columns; numbers in a row are repeated to the length of its arrays, and missing ones nan."""
    lengths = [max(np.size(value) for value in row.values()) for row in rows]
    columns: TableColumns = {}
    for name in names:
        parts = [np.broadcast_to(row.get(name, np.nan), length) for row, length in zip(rows, lengths, strict=True)]
        columns[name] = np.concatenate(parts) if parts else np.empty(0)
    return columns


Function = Callable[[Packing], Any]

DECLARED: Registry[Function] = Registry("jamlab.observables", "observable")  # of other packages, by name


_State = tuple[str | None, int, int]  # where a module is found, and when and how long its file was written
_sources: dict[str, _State] = {}  # of modules of observables, as they were imported


def _import_as_it_is(name: str) -> ModuleType:
    """Import a module, and once more if its file, or the place where it is found, is another one than before: a worker
    of a cluster may be older than the file, and serve several campaigns."""
    if name in _sources and _state_of(name) != _sources[name]:
        top = name.partition(".")[0]
        for each in [each for each in sys.modules if each == top or each.startswith(f"{top}.")]:
            del sys.modules[each]
    module = importlib.import_module(name)
    _sources[name] = _state_of(name)
    return module


def _state_of(name: str) -> _State:
    found = PathFinder.find_spec(name.partition(".")[0])
    place = getattr(sys.modules.get(name), "__file__", None)
    if place is None or not os.path.exists(place):
        return (found.origin if found else None), 0, 0
    file = os.stat(place)
    return (found.origin if found else None), file.st_mtime_ns, file.st_size


def load_function(observable: str, folders: Sequence[str]) -> Function:
    """Import the function of an observable `module:function`, from the folders first, or of an entry point's name."""
    if ":" not in observable:
        return DECLARED.get(observable)
    module, _, name = observable.partition(":")
    before = list(sys.path)
    sys.path[:0] = folders
    importlib.invalidate_caches()
    try:
        found = _import_as_it_is(module)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # the module is the user's: whatever it raises is reported with its name
        said = f"{module}: {type(error).__name__}: {error}; it must lie in {' or '.join(folders)}"
        raise InputError(f"observable {observable}: cannot import {said}") from error
    finally:
        sys.path[:] = before
    function = getattr(found, name, None)
    if not callable(function):
        place = getattr(found, "__file__", module)
        raise InputError(f"observable {observable}: {place} has no function {name}: correct the name")
    return function  # type: ignore[no-any-return]


def measure_own(
    observable: str, function: Function, packings: Sequence[Packing], taken: Iterable[str]
) -> dict[str, NDArray[np.float64]]:
    """Measure each packing with a function of the user's own, which returns a number, for the column `function`, or a
    dict of numbers, the same keys every time; columns (packings,) may not bear a taken name."""
    rows: list[dict[str, float]] = []
    for k, packing in enumerate(packings):
        try:
            found = function(packing)
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # the function is the user's: whatever it raises, sys.exit too, bears its name
            said = f"{type(error).__name__}: {error}; return nan where it has no value"
            raise InputError(f"observable {observable} failed for state {k}: {said}") from error
        row = found if isinstance(found, dict) else {observable.partition(":")[2] or observable: found}
        if not row or not all(_is_cell(column, value) for column, value in row.items()):
            said = (
                f"{found!r:.200} for state {k}: return a finite number or nan, or a dict of them whose keys are words"
            )
            raise InputError(f"observable {observable} returned {said}")
        if rows and row.keys() != rows[0].keys():
            said = f"{', '.join(row)} for state {k}, {', '.join(rows[0])} for state 0: return the same keys for all"
            raise InputError(f"observable {observable} returned columns {said}")
        rows.append({column: float(value) for column, value in row.items()})
    for column in rows[0]:
        if column in taken:
            raise InputError(f"observable {observable}: column {column!r} is taken: choose another name")
    return {column: np.array([row[column] for row in rows]) for column in rows[0]}


def _is_cell(column: Any, value: Any) -> bool:
    number = isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
    return number and not np.isinf(value) and isinstance(column, str) and column.isidentifier()
