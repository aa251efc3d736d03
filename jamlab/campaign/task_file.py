"""One finished task in one HDF5 file: frames and observables as in `jamlab.packing.hdf5`, and tables.

Beside the layout of `jamlab.packing.hdf5`, version 4 of the campaign schema adds

| name                      | type           | content                                                               |
|---------------------------|----------------|-----------------------------------------------------------------------|
| /campaign task            | str            | name of the task, a hash of its parameters                            |
| /campaign parameters      | str            | these parameters, JSON                                                |
| /campaign jamlab_campaign | int            | 4                                                                     |
| /campaign missing         | str            | JSON list: states that could not be made, and the reasons             |
| /campaign seconds         | float          | wall time: content that may differ between runs                       |
| /campaign/converged       | (F,) bool      | one per frame                                                         |
| /campaign/target_pressure | (F,) float64   | one per frame, nan in a compression                                   |
| /tables/<table>/<column>  | (rows,)        | `columns` of observables.py; `state` is the frame                     |
| /tables/<module:function> | (F,) float64   | columns of a user's own observable, one row per frame                 |

The checksum at the start of the file (`jamlab.storage.verified_file`) carries the name of the task.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from jamlab.campaign.observable import TableColumns, TaskStates
from jamlab.campaign.tasks import TASK_VERSION, Parameters, Task
from jamlab.errors import StorageError
from jamlab.packing.hdf5 import file_image, observable_of, observable_place
from jamlab.storage.atomic_file import atomic_file
from jamlab.storage.system_errors import system_said
from jamlab.storage.verified_file import add_checksum, checksum, opened

_CAMPAIGN, _TABLES = "campaign/", "tables/"  # places in the layout
_ATTRIBUTES = ("missing", "seconds")  # of the group


@dataclass(frozen=True)
class TaskContent:
    """What a finished task leaves, to be written."""

    task: Task
    states: TaskStates
    measured: Mapping[str, NDArray[np.float64]]  # observable -> (frames,)
    tables: Mapping[str, TableColumns]  # table -> column -> (rows,)
    seconds: float  # wall time of the whole task


@dataclass(frozen=True)
class TaskFile:
    """What tables need of a file."""

    task: str  # name
    parameters: Parameters  # of the task
    units: str  # of all frames
    observables: dict[str, NDArray[np.float64]]  # name -> (frames,)
    tables: dict[str, TableColumns]  # table -> column -> (rows,)
    converged: NDArray[np.bool_]  # (frames,)
    target_pressure: NDArray[np.float64]  # (frames,)
    seconds: float  # wall time of the whole task
    missing: list[dict[str, str]]  # `state` and `reason` of each state that could not be made

    @property
    def gaps(self) -> str:
        """Which states it lacks, and why they could not be made; "" if none."""
        return describe_gaps(self.parameters, self.missing)


@dataclass(frozen=True)
class TaskRows:
    """What a table needs of tasks that differ only by the seed, in columns of all of them, one task after another."""

    tasks: list[str]  # names
    seeds: list[int]
    parameters: Parameters  # of all, but for the seed
    units: str
    frames: NDArray[np.int64]  # of each task
    observables: dict[str, NDArray[np.float64]]  # name -> (frames of all,)
    converged: NDArray[np.bool_]  # (frames of all,)
    target_pressure: NDArray[np.float64]  # (frames of all,)
    tables: dict[str, TableColumns]  # table -> column -> (rows of all,)
    rows: dict[str, NDArray[np.int64]]  # table -> rows of each task

    def take(self, chosen: NDArray[np.bool_]) -> "TaskRows":
        """Some of the tasks."""
        if chosen.all():
            return self
        frames = np.repeat(chosen, self.frames)
        tables = {}
        for name, columns in self.tables.items():
            rows = np.repeat(chosen, self.rows[name])
            tables[name] = {column: values[rows] for column, values in columns.items()}
        return TaskRows(
            tasks=[task for task, wanted in zip(self.tasks, chosen, strict=True) if wanted],
            seeds=[seed for seed, wanted in zip(self.seeds, chosen, strict=True) if wanted],
            parameters=self.parameters,
            units=self.units,
            frames=self.frames[chosen],
            observables={name: values[frames] for name, values in self.observables.items()},
            converged=self.converged[frames],
            target_pressure=self.target_pressure[frames],
            tables=tables,
            rows={name: counts[chosen] for name, counts in self.rows.items()},
        )


def describe_gaps(parameters: Parameters, missing: list[dict[str, str]]) -> str:
    """Which states a task lacks, and why they could not be made; "" if none."""
    lines = "; ".join(f"{gap['state']}: {gap['reason']}" for gap in missing)
    return lines and f"{parameters.label} lacks {lines}"


def own_record(content: TaskContent) -> dict[str, Any]:
    """What a file holds of a task beside its packings and what is measured of them, by its place in the layout."""
    states = content.states
    tables = {
        f"{_TABLES}{name}/{column}": values.astype("S") if values.dtype.kind == "U" else values
        for name, columns in content.tables.items()
        for column, values in columns.items()
    }
    return {
        f"{_CAMPAIGN}missing": json.dumps(states.missing),
        f"{_CAMPAIGN}seconds": content.seconds,
        f"{_CAMPAIGN}converged": np.array(states.converged),
        f"{_CAMPAIGN}target_pressure": np.array(states.target_pressures),
        **tables,
    }


def write_task_file(path: Path, content: TaskContent) -> None:
    """Write a finished task; the file is written completely or not at all."""
    task, record = content.task, own_record(content)

    def extend(file: Any) -> None:
        group = file.create_group("campaign")
        group.attrs.update(task=task.name, parameters=task.parameters.model_dump_json(), jamlab_campaign=TASK_VERSION)
        for name in _ATTRIBUTES:
            group.attrs[name] = record.pop(f"{_CAMPAIGN}{name}")
        for place in (place for place in record if place.startswith(_CAMPAIGN)):
            file[place] = record[place]
        for name, columns in content.tables.items():
            table = file.create_group(f"{_TABLES}{name}")
            for column in columns:
                table[column] = record[f"{_TABLES}{name}/{column}"]

    image = add_checksum(file_image(content.states.packings, content.measured, extend), f"task {task.name}")
    write_whole(path, image)


def write_whole(path: Path, image: bytes) -> None:
    """Write a file completely or not at all."""
    with atomic_file(path) as temporary:
        temporary.write_bytes(image)


def array_bytes(path: Path) -> int:
    """Bytes of all arrays of a file, without what HDF5 needs for each."""
    with opened(path) as file:
        sizes: list[int] = []
        file.visititems(lambda name, node: sizes.append(getattr(node, "nbytes", 0)))
    return sum(sizes)


def damage(path: Path, label: str) -> str | None:
    """Describe the damage of a file in the folder of tasks; None if it is intact and has this label."""
    if path.exists() and not path.is_file():
        return "a folder or a device, not a file"
    try:
        found = checksum(path)
        empty = path.stat().st_size == 0
    except OSError as error:
        raise StorageError(f"cannot read {path}: {system_said(error, 'check its permissions')}") from error
    if found is None:
        return "empty" if empty else "not a task file of this jamlab"
    if found[0] != label:
        return f"holds {found[0]}"
    return None if found[1] else "its checksum does not match: truncated or changed"


def read_task_file(path: Path, table: str | None = None) -> TaskFile:
    """Read everything except the positions; with `table`, that table alone, or none if there is no such table: columns
    of the user's own observables are of "states"."""
    with opened(path) as file:
        if "campaign" not in file:
            raise StorageError(f"{path} holds packings, but not a task of a campaign: move it elsewhere")
        group = file["campaign"]
        if group.attrs["task"] != path.stem:
            raise StorageError(f"{path} holds task {group.attrs['task']}: `run` repairs it")
        try:
            parameters = Parameters.model_validate_json(group.attrs["parameters"])
        except ValidationError as error:
            raise StorageError(f"{path} has parameters of another version of jamlab: {error!s:.200}") from error
        record = {f"{_CAMPAIGN}{name}": group.attrs[name] for name in _ATTRIBUTES}
        record |= {f"{_CAMPAIGN}{name}": group[name][()] for name in ("converged", "target_pressure")}
        record["parameters/units"] = file["parameters"].attrs["units"]
        record |= {observable_place(name): element["value"][()] for name, element in file["observables"].items()}
        for name, stored in file.get("tables", {}).items():
            if is_in_table(name, table, parameters):
                record |= {f"{_TABLES}{name}/{column}": values[()] for column, values in stored.items()}
        return task_of_record(group.attrs["task"], parameters, record)


def table_of(place: str) -> tuple[str, str] | None:
    """The table and the column that a record holds at a place; None if there is none."""
    name, _, column = place.removeprefix(_TABLES).rpartition("/")
    return (name, column) if place.startswith(_TABLES) else None


def is_in_table(name: str, table: str | None, parameters: Parameters) -> bool:
    """Whether what is stored under a name belongs to a table; columns of the user's own observables are of "states"."""
    return table in (None, "states" if name in parameters.own else name)


def task_of_record(task: str, parameters: Parameters, record: Mapping[str, Any]) -> TaskFile:
    """What tables need of a record of the layout: that of its packings and `own_record`, or a part of it."""
    tables: dict[str, TableColumns] = {}
    for place, value in record.items():
        if (found := table_of(place)) is not None:
            tables.setdefault(found[0], {})[found[1]] = text_column(value)
    return TaskFile(
        task=task,
        parameters=parameters,
        units=record["parameters/units"],
        observables={name: record[place] for place in record if (name := observable_of(place)) is not None},
        tables=tables,
        converged=record[f"{_CAMPAIGN}converged"],
        target_pressure=record[f"{_CAMPAIGN}target_pressure"],
        seconds=float(record[f"{_CAMPAIGN}seconds"]),
        missing=json.loads(record[f"{_CAMPAIGN}missing"]),
    )


def rows_of_task(file: TaskFile) -> TaskRows:
    """One task alone."""
    return TaskRows(
        tasks=[file.task],
        seeds=[file.parameters.seed],
        parameters=file.parameters,
        units=file.units,
        frames=np.array([len(file.converged)]),
        observables=file.observables,
        converged=file.converged,
        target_pressure=file.target_pressure,
        tables=file.tables,
        rows={name: np.array([max(map(len, columns.values()), default=0)]) for name, columns in file.tables.items()},
    )


def text_column(values: NDArray[Any]) -> NDArray[Any]:
    """A column of a table as it is in memory."""
    return values.astype(str) if values.dtype.kind == "S" else values
