"""Keep the files of a campaign in a folder. They are the only record; there is no database.

| name                  | content                                                                            |
|-----------------------|------------------------------------------------------------------------------------|
| campaign.toml         | copy of the campaign file of the last run                                          |
| tasks/<task>.h5       | a finished task, renamed to this name after its content was flushed to disk        |
| failed/<task>.json    | a failed task, with the reason; run again only with `--retry-failed`               |
| damaged/<task>.<k>.h5 | a file that was found damaged and moved aside                                      |
| lock, lock.<k>-of-<n> | held by flock while share k of n runs here; the kernel frees them when it dies     |

A task has an HDF5 file: frames and observables as in `jamlab.packing.hdf5`, and tables.

Beside the layout of `jamlab.packing.hdf5`, version 2 of the campaign schema adds

| name                      | type           | content                                                               |
|---------------------------|----------------|-----------------------------------------------------------------------|
| /campaign task            | str            | name of the task, a hash of its parameters                            |
| /campaign parameters      | str            | these parameters, JSON                                                |
| /campaign jamlab_campaign | int            | 2                                                                     |
| /campaign missing         | str            | JSON list: states that could not be made, and the reasons             |
| /campaign seconds, host   | float, str     | wall time and machine: content that may differ between runs           |
| /campaign cpu_seconds     | float          | CPU time of all its ranks, too                                        |
| /campaign/converged       | (F,) bool      | one per frame                                                         |
| /campaign/target_pressure | (F,) float64   | one per frame, nan in a compression                                   |
| /tables/<table>/<column>  | (rows,)        | `stored` of observables.py; `state` is the frame                     |
| /tables/<module:function> | (F,) float64   | columns of a user's own observable, one row per frame                 |

The checksum at the start of the file (`jamlab.storage.verified_file`) carries the name of the task.
"""

import errno
import fcntl
import hashlib
import json
import os
import time
import traceback
import warnings
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from jamlab.campaign.observable import Columns, TaskStates
from jamlab.campaign.tasks import TASK_VERSION, Parameters, Task
from jamlab.errors import InputError, StorageError
from jamlab.packing.hdf5 import file_image
from jamlab.storage.atomic_file import atomic_file, check_target, make_folder, remove_abandoned, system_said
from jamlab.storage.verified_file import add_checksum, checksum, opened

_ONSET = ("rho_J", "phi_J")


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
    # seconds, cpu_seconds: wall and CPU time of the whole task
    seconds: float
    cpu_seconds: float
    onset: tuple[float, float]  # rho_J and phi_J; nan for packings that were not compressed from onset
    missing: list[dict[str, str]]  # `state` and `reason` of each state that could not be made

    @property
    def gaps(self) -> str:
        """Which states it lacks, and why they could not be made; "" if none."""
        lines = "; ".join(f"{gap['state']}: {gap['reason']}" for gap in self.missing)
        return lines and f"{self.parameters.label} lacks {lines}"


def write_task_file(
    path: Path,
    task: Task,
    states: TaskStates,
    measured: Mapping[str, NDArray[np.float64]],
    tables: Mapping[str, Columns],
    seconds: float,
    cpu_seconds: float,
) -> None:
    """Write a finished task; the file is written completely or not at all."""

    def extend(file: Any) -> None:
        group = file.create_group("campaign")
        group.attrs.update(task=task.name, parameters=task.parameters.model_dump_json())
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
        raise StorageError(f"cannot read {path}: {system_said(error, 'check its permissions')}") from error
    if found is None:
        return "empty" if empty else "not a task file of this jamlab"
    if found.label != f"task {task}":
        return f"holds {found.label}"
    return None if found.matches else "its checksum does not match: truncated or changed"


def read_task_file(path: Path, table: str | None = None) -> TaskFile:
    """Read everything except the positions; with `table`, that table alone, or none if there is no such table: columns
    of the user's own observables are of "states"."""
    with _campaign(path) as (file, parameters):
        group, provenance = file["campaign"], file["parameters/provenance"].asstr()[()]
        onset = [float(file[f"tables/onset/{name}"][0]) if "tables/onset" in file else np.nan for name in _ONSET]
        return TaskFile(
            task=group.attrs["task"],
            parameters=parameters,
            units=file["parameters"].attrs["units"],
            observables={name: element["value"][()] for name, element in file["observables"].items()},
            tables={
                name: {column: values[()] for column, values in stored.items()}
                for name, stored in file.get("tables", {}).items()
                if table in (None, "states" if ":" in name else name)
            },
            converged=group["converged"][()],
            target_pressure=group["target_pressure"][()],
            wall_time=np.array([json.loads(text).get("wall_time", np.nan) for text in provenance]),
            seconds=float(group.attrs["seconds"]),
            cpu_seconds=float(group.attrs["cpu_seconds"]),
            onset=(onset[0], onset[1]),
            missing=json.loads(group.attrs["missing"]),
        )


def read_parameters(path: Path) -> Parameters:
    """Read the parameters alone. Errors as in `read_task_file`."""
    with _campaign(path) as (_, parameters):
        return parameters


def read_last_state(path: Path) -> dict[str, float]:
    """Read the row of table "states" of the last frame: observables and `converged`. Errors as in `read_task_file`."""
    file = read_task_file(path, "states")
    columns = {**file.observables, "converged": file.converged}
    for own in file.tables.values():
        columns |= own
    return {name: float(values[-1]) for name, values in columns.items()}


@contextmanager
def _campaign(path: Path) -> Iterator[tuple[Any, Parameters]]:
    with opened(path) as file:
        if "campaign" not in file:
            raise StorageError(f"{path} holds packings, but not a task of a campaign: move it elsewhere")
        try:
            parameters = Parameters.model_validate_json(file["campaign"].attrs["parameters"])
        except ValidationError as error:
            raise StorageError(f"{path} has parameters of another version of jamlab: {error!s:.200}") from error
        yield file, parameters


COPY = "campaign.toml"
_NO_LOCKS = (errno.ENOLCK, errno.ENOTSUP, errno.ENOSYS)  # of file systems that lock nothing
_PATIENCE = 10.0  # s in which another process has said which shares run here

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

    def sweep_up(self) -> None:
        """Remove the half-written files of killed workers; those of workers that run stay."""
        for part in ("tasks", "failed"):
            remove_abandoned(self.path / part)

    @contextmanager
    def lock(self, text: str, share: Share = WHOLE) -> Iterator[None]:
        """Keep other processes out that would run the same tasks, until the block ends: the same share, shares of
        another number, and shares of another campaign file than this text. The lock of a process that dies is
        released."""
        k, n = share
        asked = f"{n} shares of a campaign file with SHA-256 {hashlib.sha256(text.encode()).hexdigest()}"
        with _lock_file(self.path / f"lock.{k}-of-{n}") as own, _lock_file(self.path / "lock") as common:
            with _changing(self.path):
                try:
                    free = _flock(own, fcntl.LOCK_EX)
                except OSError as error:
                    if error.errno not in _NO_LOCKS:
                        raise
                    said = f"{self.path}: {os.strerror(error.errno)}"
                    warnings.warn(f"{said}: nothing keeps a second run out, so run each share once", stacklevel=4)
                else:
                    if not free:
                        raise StorageError(f"{_read(own) or 'another process'} runs in {self.path}: wait for it")
                    _write(own, f"share {k} of {n} by process {os.getpid()} on {os.uname().nodename}")
                    self._agree(common, asked)
            yield

    def _agree(self, common: TextIO, asked: str) -> None:
        """Share the lock of all shares: the first one writes what they run, the others must ask for the same."""
        end = time.monotonic() + _PATIENCE
        while True:
            if _flock(common, fcntl.LOCK_EX):
                _write(common, asked)
            shared = _flock(common, fcntl.LOCK_SH)
            if shared and _read(common) == asked:
                return
            if shared or time.monotonic() > end:
                said = _read(common) or "another process"
                raise StorageError(f"{said} runs in {self.path}, not {asked}: wait for the end, or stop it")
            time.sleep(0.05)

    def keep_copy(self, text: str) -> None:
        """Keep the text of the campaign file in the folder, where `open_campaign(folder)` finds it."""
        copy = self.path / COPY
        check_target(copy)
        content = text.encode()
        with _changing(copy):
            known = copy.read_bytes() if copy.exists() else None
        if content != known:
            with atomic_file(copy) as temporary:
                temporary.write_bytes(content)

    def _names(self, part: str, ending: str) -> set[str]:
        try:
            entries = os.listdir(self.path / part)
        except FileNotFoundError:
            return set()
        except OSError as error:
            said = system_said(error, "check it and its permissions")
            raise InputError(f"cannot read the folder {self.path / part}: {said}") from error
        return {entry[: -len(ending)] for entry in entries if entry.endswith(ending) and not entry.startswith(".")}


@contextmanager
def _changing(path: Path) -> Iterator[None]:
    """Turn errors of the file system into StorageError."""
    try:
        yield
    except OSError as error:
        raise StorageError(f"cannot change {path}: {system_said(error, 'check its permissions')}") from error


@contextmanager
def _lock_file(path: Path) -> Iterator[TextIO]:
    """Open a file to be locked."""
    with _changing(path):
        file = open(path, "a+", encoding="utf-8", errors="replace")
    with file:
        yield file


def _flock(file: TextIO, how: int) -> bool:
    """Lock a file, or change its lock; whether no other process has it."""
    try:
        fcntl.flock(file, how | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _write(file: TextIO, text: str) -> None:
    file.truncate(0)
    file.write(text)
    file.flush()


def _read(file: TextIO) -> str:
    file.seek(0)
    return file.read().strip()
