"""One finished task in one HDF5 file: frames and observables as in `jamlab.packing.hdf5`, and tables.

Beside the layout of `jamlab.packing.hdf5`, version 3 of the campaign schema adds

| name                      | type           | content                                                               |
|---------------------------|----------------|-----------------------------------------------------------------------|
| /campaign task            | str            | name of the task, a hash of its parameters                            |
| /campaign parameters      | str            | these parameters, JSON                                                |
| /campaign jamlab_campaign | int            | 3                                                                     |
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
from jamlab.packing.hdf5 import file_image
from jamlab.storage.atomic_file import atomic_file
from jamlab.storage.system_errors import system_said
from jamlab.storage.verified_file import add_checksum, checksum, opened


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


def describe_gaps(parameters: Parameters, missing: list[dict[str, str]]) -> str:
    """Which states a task lacks, and why they could not be made; "" if none."""
    lines = "; ".join(f"{gap['state']}: {gap['reason']}" for gap in missing)
    return lines and f"{parameters.label} lacks {lines}"


def write_task_file(path: Path, content: TaskContent) -> None:
    """Write a finished task; the file is written completely or not at all."""
    task, states = content.task, content.states

    def extend(file: Any) -> None:
        group = file.create_group("campaign")
        group.attrs.update(task=task.name, parameters=task.parameters.model_dump_json())
        group.attrs.update(jamlab_campaign=TASK_VERSION, missing=json.dumps(states.missing))
        group.attrs["seconds"] = content.seconds
        group["converged"] = np.array(states.converged)
        group["target_pressure"] = np.array(states.target_pressures)
        for name, columns in content.tables.items():
            table = file.create_group(f"tables/{name}")
            for column, values in columns.items():
                table[column] = values.astype("S") if values.dtype.kind == "U" else values

    image = add_checksum(file_image(states.packings, content.measured, extend), f"task {task.name}")
    with atomic_file(path) as temporary:
        temporary.write_bytes(image)


def damage(path: Path, task: str) -> str | None:
    """Describe the damage of the file of a task; None if it is intact."""
    if path.exists() and not path.is_file():
        return "a folder or a device, not a file"
    try:
        found = checksum(path)
        empty = path.stat().st_size == 0
    except OSError as error:
        raise StorageError(f"cannot read {path}: {system_said(error, 'check its permissions')}") from error
    if found is None:
        return "empty" if empty else "not a task file of this jamlab"
    label, matches = found
    if label != f"task {task}":
        return f"holds {label}"
    return None if matches else "its checksum does not match: truncated or changed"


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
        return TaskFile(
            task=group.attrs["task"],
            parameters=parameters,
            units=file["parameters"].attrs["units"],
            observables={name: element["value"][()] for name, element in file["observables"].items()},
            tables={
                name: {column: _column(values[()]) for column, values in stored.items()}
                for name, stored in file.get("tables", {}).items()
                if table in (None, "states" if name in parameters.own else name)
            },
            converged=group["converged"][()],
            target_pressure=group["target_pressure"][()],
            seconds=float(group.attrs["seconds"]),
            missing=json.loads(group.attrs["missing"]),
        )


def _column(values: NDArray[Any]) -> NDArray[Any]:
    return values.astype(str) if values.dtype.kind == "S" else values
