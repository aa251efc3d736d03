"""Write and read the HDF5 file of a task: frames and observables as in `jamlab.packing.hdf5`, and tables.

Beside the layout of `jamlab.packing.hdf5`, version 1 of the campaign schema adds

| name                      | type           | content                                                               |
|---------------------------|----------------|-----------------------------------------------------------------------|
| /campaign task            | str            | name of the task, a hash of its parameters                            |
| /campaign parameters      | str            | these parameters, JSON                                                |
| /campaign jamlab_campaign | int            | 1                                                                     |
| /campaign missing         | str            | JSON list: states that could not be made, and the reasons             |
| /campaign seconds, host   | float, str     | wall time and machine: content that may differ between runs           |
| /campaign cpu_seconds     | float          | CPU time of all its ranks, too; jamlab 0.1.0 did not count it         |
| /campaign/converged       | (F,) bool      | one per frame                                                         |
| /campaign/target_pressure | (F,) float64   | one per frame, nan in a compression                                   |
| /tables/<table>/<column>  | (rows,)        | `stored` of observables.py; `state` is the frame                     |
| /tables/<module:function> | (F,) float64   | columns of a user's own observable, one row per frame                 |

The checksum at the start of the file (`jamlab.storage.verified_file`) carries the name of the task.
"""

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.campaign.observable import Columns, TaskStates
from jamlab.campaign.tasks import TASK_VERSION, Parameters, Task
from jamlab.errors import StorageError
from jamlab.packing.hdf5 import file_image
from jamlab.storage.atomic_file import atomic_file
from jamlab.storage.verified_file import add_checksum, checksum, opened


@dataclass(frozen=True)
class TaskFile:
    """What tables need of a file."""

    task: str  # name
    parameters: Parameters  # of the task
    units: str  # of all frames
    observables: dict[str, NDArray[np.float64]]  # name -> (frames,)
    tables: dict[str, Columns]  # table -> column -> (rows,)
    converged: NDArray[np.bool_]  # (frames,)
    target_pressure: NDArray[np.float64]  # (frames,)
    wall_time: NDArray[np.float64]  # (frames,) seconds each state took
    # seconds, cpu_seconds: the whole task; CPU time nan in files of jamlab 0.1.0
    seconds: float
    cpu_seconds: float
    onset: tuple[float, float]  # rho_J and phi_J; nan for packings that were not compressed from onset


def write_task_file(
    path: Path,
    task: Task,
    states: TaskStates,
    measured: Mapping[str, NDArray[np.float64]],
    tables: Mapping[str, Columns],
    seconds: float,
    cpu_seconds: float,
) -> None:
    """Write a finished task; the file appears whole or not at all."""

    def extend(file: Any) -> None:
        group = file.create_group("campaign")
        group.attrs.update(task=task.name, parameters=json.dumps(task.parameters.record(), sort_keys=True))
        group.attrs.update(jamlab_campaign=TASK_VERSION, missing=json.dumps(states.missing))
        group.attrs.update(seconds=seconds, cpu_seconds=cpu_seconds, host=os.uname().nodename)
        group["converged"] = np.array(states.converged)
        group["target_pressure"] = np.array(states.target_pressures)
        for name, columns in tables.items():
            table = file.create_group(f"tables/{name}")
            for column, values in columns.items():
                table[column] = values

    content = add_checksum(file_image(states.packings, measured, extend), f"task {task.name}")
    with atomic_file(path) as temporary:
        temporary.write_bytes(content)


def damage(path: Path, task: str) -> str | None:
    """Describe the damage of the file of a task; None if it is intact."""
    if path.exists() and not path.is_file():
        return "a folder or a device, not a file"
    try:
        found = checksum(path)
        empty = path.stat().st_size == 0
    except OSError as error:
        raise StorageError(f"cannot read {path}: {error.strerror}; check the disk and its permissions") from error
    if found is None:
        return "empty" if empty else "not a task file of this jamlab"
    if found.label != f"task {task}":
        return f"holds {found.label}"
    return None if found.matches else "its checksum does not match: truncated or changed"


def read_task_file(path: Path, table: str | None = None) -> TaskFile:
    """Read everything except the positions; with `table`, that table alone."""
    with _campaign(path) as file:
        group, provenance = file["campaign"], file["parameters/provenance"].asstr()[()]
        return TaskFile(
            task=group.attrs["task"],
            parameters=_parameters(path, file),
            units=file["parameters"].attrs["units"],
            observables={name: element["value"][()] for name, element in file["observables"].items()},
            tables={
                name: {column: values[()] for column, values in stored.items()}
                for name, stored in file.get("tables", {}).items()
                if table in (None, name)
            },
            converged=group["converged"][()],
            target_pressure=group["target_pressure"][()],
            wall_time=np.array([json.loads(text).get("wall_time", np.nan) for text in provenance]),
            seconds=float(group.attrs["seconds"]),
            cpu_seconds=float(group.attrs.get("cpu_seconds", np.nan)),
            onset=_onset(file),
        )


def _onset(file: Any) -> tuple[float, float]:
    if "tables/onset" not in file:
        return np.nan, np.nan
    return float(file["tables/onset/rho_J"][0]), float(file["tables/onset/phi_J"][0])


def read_gaps(path: Path) -> tuple[Parameters, list[dict[str, str]]]:
    """Read the parameters, and `state` and `reason` of each missing state. Errors as in `read_task_file`."""
    with _campaign(path) as file:
        return _parameters(path, file), json.loads(file["campaign"].attrs["missing"])


def read_last_state(path: Path) -> dict[str, float]:
    """Read the row of table "states" of the last frame: observables and `converged`. Errors as in `read_task_file`."""
    with _campaign(path) as file:
        own = (columns for name, columns in file.get("tables", {}).items() if ":" in name)
        return {
            "converged": float(file["campaign/converged"][-1]),
            **{name: float(element["value"][-1]) for name, element in file["observables"].items()},
            **{column: float(values[-1]) for columns in own for column, values in columns.items()},
        }


def read_seconds(path: Path) -> tuple[float, float]:
    """Read the wall time and the CPU time of a task, s. Errors as in `read_task_file`."""
    with _campaign(path) as file:
        attributes = file["campaign"].attrs
        return float(attributes["seconds"]), float(attributes.get("cpu_seconds", np.nan))


@contextmanager
def _campaign(path: Path) -> Iterator[Any]:
    with opened(path) as file:
        if "campaign" not in file:
            raise StorageError(f"{path} holds packings, but not a task of a campaign: move it elsewhere")
        yield file


def _parameters(path: Path, file: Any) -> Parameters:
    try:
        return Parameters.from_record(json.loads(file["campaign"].attrs["parameters"]))
    except StorageError as error:
        raise StorageError(f"{path} holds {error}") from error
