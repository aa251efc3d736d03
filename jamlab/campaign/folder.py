"""Keep the files of a campaign in a folder. They are the only record; there is no database.

| name                  | content                                                                            |
|-----------------------|------------------------------------------------------------------------------------|
| campaign.toml         | copy of the campaign file of the last run                                          |
| campaign.<k>.toml     | copies of files of the same name that ran here before, the first one first         |
| tasks/<task>.h5       | a finished task, renamed to this name after its content was flushed to disk        |
| failed/<task>.json    | a failed task, with the reason; run again only with `--retry-failed`               |
| damaged/<task>.<k>.h5 | a file that was found damaged and moved aside                                      |
| lock.<k>-of-<n>       | held by flock while share k of n runs here; the kernel frees it when it dies       |

A task has an HDF5 file: frames and observables as in `jamlab.packing.hdf5`, and tables.

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

import errno
import fcntl
import json
import os
import tomllib
import traceback
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from jamlab.campaign.observable import TableColumns, TaskStates
from jamlab.campaign.tasks import TASK_VERSION, Parameters, Task
from jamlab.errors import InputError, StorageError, warn
from jamlab.packing.hdf5 import file_image
from jamlab.storage.atomic_file import atomic_file, check_target, make_folder
from jamlab.storage.system_errors import system_said
from jamlab.storage.verified_file import add_checksum, checksum, opened


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


def write_task_file(
    path: Path,
    task: Task,
    states: TaskStates,
    measured: Mapping[str, NDArray[np.float64]],
    tables: Mapping[str, TableColumns],
    seconds: float,
) -> None:
    """Write a finished task; the file is written completely or not at all."""

    def extend(file: Any) -> None:
        group = file.create_group("campaign")
        group.attrs.update(task=task.name, parameters=task.parameters.model_dump_json())
        group.attrs.update(jamlab_campaign=TASK_VERSION, missing=json.dumps(states.missing))
        group.attrs["seconds"] = seconds
        group["converged"] = np.array(states.converged)
        group["target_pressure"] = np.array(states.target_pressures)
        for name, columns in tables.items():
            table = file.create_group(f"tables/{name}")
            for column, values in columns.items():
                table[column] = values.astype("S") if values.dtype.kind == "U" else values

    _write(path, add_checksum(file_image(states.packings, measured, extend), f"task {task.name}"))


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


COPY = "campaign.toml"
_NO_LOCKS = (errno.ENOLCK, errno.ENOTSUP, errno.ENOSYS)  # of file systems that lock nothing

Share = tuple[int, int]  # (k, n): every n-th task from the k-th on, k from 1 to n
WHOLE: Share = (1, 1)


@dataclass(frozen=True)
class CampaignFolder:
    """The folder of a campaign."""

    path: Path  # need not exist until something is written

    def task_file(self, name: str) -> Path:
        """Return the path of a finished task, whether or not it exists yet."""
        return self.path / "tasks" / f"{name}.h5"

    def failure_file(self, name: str) -> Path:
        """Return the path of the record of a failed task, whether or not it exists."""
        return self.path / "failed" / f"{name}.json"

    def finished(self) -> set[str]:
        """List the names of the finished tasks, without opening a file."""
        return self._names("tasks", ".h5")

    def failed(self) -> set[str]:
        """List the names of the failed tasks."""
        return self._names("failed", ".json") - self.finished()

    def failures(self) -> dict[str, dict[str, Any]]:
        """Read the records of the failed tasks: label, error, reason, parameters."""
        records = {}
        for name in sorted(self.failed()):
            try:
                records[name] = json.loads(self.failure_file(name).read_text(encoding="utf-8"))
            except (OSError, ValueError):  # damaged: all that is left to know is that it failed
                records[name] = {"label": name, "error": "unknown", "reason": "its record is damaged"}
        return records

    def record_failure(self, task: Task, error: BaseException) -> None:
        """Record why a task failed."""
        trace = "".join(traceback.format_exception(error))
        record = {"label": task.parameters.label, "error": type(error).__name__, "reason": str(error), "trace": trace}
        record["parameters"] = task.parameters.model_dump_json()
        with atomic_file(self.failure_file(task.name)) as temporary:
            temporary.write_text(json.dumps(record, indent=1), encoding="utf-8")

    def forget_failures(self, names: Iterable[str]) -> None:
        """Delete the records of failed tasks, so that they are run again."""
        with _changing(self.path / "failed"):
            for name in names:
                self.failure_file(name).unlink(missing_ok=True)

    def damages(self, names: Iterable[str]) -> dict[str, str]:
        """Read every byte of finished tasks; return task -> damage of its file."""
        found = ((name, damage(self.task_file(name), name)) for name in sorted(names))
        return {name: reason for name, reason in found if reason is not None}

    def read(self, names: Iterable[str]) -> dict[str, TaskFile]:
        """Read finished tasks without their tables; a damaged file is left out: `run` finds it, and runs it again."""
        found = {}
        for name in sorted(names):
            with suppress(StorageError):
                found[name] = read_task_file(self.task_file(name), "")
        return found

    def move_aside(self, name: str) -> Path:
        """Move a damaged file to `damaged/`, so that its task is run again."""
        place = self.path / "damaged"
        with _changing(place):
            place.mkdir(exist_ok=True)
            k = 1
            while (target := place / f"{name}.{k}.h5").exists():
                k += 1
            os.replace(self.task_file(name), target)
        return target

    def prepare(self) -> None:
        """Make the folders of tasks and failures."""
        for part in ("tasks", "failed"):
            make_folder(self.path / part)

    @contextmanager
    def lock(self, share: Share = WHOLE) -> Iterator[None]:
        """Keep other processes out that would run the same tasks, until the block ends: the same share, and shares of
        another number. The lock of a process that dies is released."""
        own = self.path / "lock.{}-of-{}".format(*share)
        with ExitStack() as stack:
            with _changing(own):
                file = stack.enter_context(open(own, "a+"))
                others = [p for p in self.path.glob("lock.*-of-*") if p.suffix.rpartition("-")[2] != str(share[1])]
                try:
                    busy = [] if _flock(file) else [own]
                    for other in others:
                        with open(other, "a+") as opened_too:
                            busy += [] if _flock(opened_too) else [other]
                except OSError as error:
                    if error.errno not in _NO_LOCKS:
                        raise
                    said = f"{self.path}: {os.strerror(error.errno)}"
                    warn(f"{said}: nothing keeps a second run out, so run each share once")
                    busy = []
            if busy:
                said = f"another process runs in {self.path} and holds {busy[0].name}"
                raise StorageError(f"{said}: wait until it ends, or run another share")
            yield

    def keep_copy(self, text: str, name: str) -> None:
        """Keep the text of the campaign file in the folder, where `open_campaign(folder)` finds it, beside those that
        ran here before; another campaign is refused."""
        copy = self.path / COPY
        check_target(copy)
        content = text.encode()
        with _changing(copy):
            known = copy.read_bytes() if copy.exists() else content
            earlier = list(self.path.glob(f"{copy.stem}.*{copy.suffix}"))
            kept = {path.read_bytes() for path in earlier if path.is_file()}
        if (other := _name_of(known)) not in (None, name):
            raise InputError(
                f"{self.path} holds the campaign {other!r}, not {name!r}: give another folder, or the same name"
            )
        if known != content and known not in kept:
            _write(copy.with_suffix(f".{len(earlier) + 1}{copy.suffix}"), known)
        if known != content or not copy.exists():
            _write(copy, content)

    def _names(self, part: str, ending: str) -> set[str]:
        try:
            entries = os.listdir(self.path / part)
        except FileNotFoundError:
            return set()
        except OSError as error:
            said = system_said(error, "check it and its permissions")
            raise InputError(f"cannot read the folder {self.path / part}: {said}") from error
        return {entry[: -len(ending)] for entry in entries if entry.endswith(ending) and not entry.startswith(".")}


def _write(path: Path, content: bytes) -> None:
    with atomic_file(path) as temporary:
        temporary.write_bytes(content)


def _name_of(content: bytes) -> str | None:
    """Name in a campaign file; None where it is no such file."""
    try:
        name = tomllib.loads(content.decode()).get("name")
    except (ValueError, RecursionError):
        return None
    return name if isinstance(name, str) else None


@contextmanager
def _changing(path: Path) -> Iterator[None]:
    """Turn errors of the file system into StorageError."""
    try:
        yield
    except OSError as error:
        raise StorageError(f"cannot change {path}: {system_said(error, 'check its permissions')}") from error


def _flock(file: TextIO) -> bool:
    """Lock a file; whether no other process has it."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
