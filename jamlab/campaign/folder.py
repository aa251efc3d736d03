"""Keep the files of a campaign in a folder. They are the only record; there is no database.

| name                  | content                                                                            |
|-----------------------|------------------------------------------------------------------------------------|
| campaign.toml         | copy of the campaign file of the last run                                          |
| campaign.<k>.toml     | copies of files of the same name that ran here before, the first one first         |
| tasks/<task>.h5       | a finished task (task_file.py), renamed to this name after its content was flushed |
| tasks/chunk-<...>.h5  | several finished tasks (chunk_file.py); one that stands in two files is one        |
| failed/<task>.json    | a failed task, with the reason; run again only with `--retry-failed`               |
| damaged/<...>.<k>.h5  | a file of `tasks` that was found damaged and moved aside                           |
| running/, deaths/     | marks of the calls under way (marks.py), records of dead workers (deaths.py)       |
| jobs/                 | what jobs of a batch system printed (jamlab.clusters); empty files are removed    |
| keys.<...>/           | keys of the workers of such a run, which only its user can read (jamlab.clusters)   |
| lock.<k>-of-<n>       | held by flock while share k of n runs here; the kernel frees it when it dies; says |
|                       | which run it is, so that workers see whether they are in the same folder           |
"""

import errno
import fcntl
import json
import os
import tomllib
import traceback
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from jamlab.campaign.campaign_text import COPY
from jamlab.campaign.chunk_file import (
    alike,
    is_chunk,
    label_of_stem,
    names_in_chunk,
    opened_chunk,
    read_chunk,
    stem_of,
    write_chunk_file,
)
from jamlab.campaign.deaths import end_run, forget_deaths
from jamlab.campaign.marks import RUNNING, count_marks
from jamlab.campaign.task_file import (
    TaskContent,
    TaskFile,
    TaskRows,
    array_bytes,
    damage,
    read_task_file,
    rows_of_task,
    write_task_file,
    write_whole,
)
from jamlab.campaign.tasks import Task, is_task_name
from jamlab.errors import InputError, StorageError, warn
from jamlab.packing.hdf5 import read_all_hdf5
from jamlab.packing.packing import Packing
from jamlab.storage.atomic_file import atomic_file, check_target, make_folder
from jamlab.storage.system_errors import system_said, using
from jamlab.storage.verified_file import label_of

_FEW = 20  # tasks whose files are looked for one by one, and not in a list of all
_NO_LOCKS = (errno.ENOLCK, errno.ENOTSUP, errno.ENOSYS)  # of file systems that lock nothing

Share = tuple[int, int]  # (k, n): every n-th task from the k-th on, k from 1 to n
WHOLE: Share = (1, 1)


@dataclass(frozen=True)
class CampaignFolder:
    """The folder of a campaign."""

    path: Path  # need not exist until something is written
    # file of several tasks -> their names, a line each: the name of such a file is a digest of its tasks
    _known: dict[str, str] = field(default_factory=dict, init=False, repr=False, compare=False)

    def task_file(self, name: str) -> Path:
        """Return the path of a finished task, whether or not it exists yet."""
        return self.path / "tasks" / f"{name}.h5"

    def file_of(self, name: str) -> Path:
        """Return the path of the file that holds a finished task; where none does, that of its own file."""
        alone = self.task_file(name)
        if alone.exists() or not is_task_name(name):  # a part of a name stands in every list
            return alone
        for chunks in (self._known, self._chunks()):  # what is known first: to list a folder takes long
            for file, text in chunks.items():
                if name in text and (path := self.path / "tasks" / file).exists():
                    return path
        return alone

    def files_of(self, names: Iterable[str]) -> dict[Path, list[str]]:
        """Find the files that hold finished tasks: path -> the tasks that are read from it. A task that
        none holds has the path of its own file."""
        wanted = set(names)
        few = len(wanted) <= _FEW
        alone = {name for name in wanted if self.task_file(name).exists()} if few else wanted & self._alone()
        left, found = wanted - alone, {}
        for file, text in self._chunks().items() if left else ():
            if here := [name for name in text.split() if name in left]:
                found[self.path / "tasks" / file] = here
                left.difference_update(here)
        return {self.task_file(name): [name] for name in sorted(alone | left)} | found

    def file_of_all(self, names: Sequence[str]) -> Path:
        """Return the path of the file that holds these tasks and no other one, whether or not it exists."""
        return self.task_file(names[0] if len(names) == 1 else stem_of(label_of(names)))

    def finished_of(self, names: Iterable[str]) -> set[str]:
        """Return those of some tasks that are finished."""
        return {name for path, tasks in self.files_of(names).items() if path.exists() for name in tasks}

    def keep(self, contents: Sequence[TaskContent]) -> list[Path]:
        """Write finished tasks; return the paths of the files: one for all that differ only by the seed and have tables
        of the same columns, and a file of its own for a task that is alone in this."""
        if len(contents) == 1:
            path = self.task_file(contents[0].task.name)
            write_task_file(path, contents[0])
            return [path]
        paths = []
        for chunk in alike(contents):
            several = len(chunk) > 1
            paths += [write_chunk_file(self.path / "tasks", chunk)] if several else self.keep([chunk[0].content])
        return paths

    def failure_file(self, name: str) -> Path:
        """Return the path of the record of a failed task, whether or not it exists."""
        return self.path / "failed" / f"{name}.json"

    def finished(self) -> set[str]:
        """List the names of the finished tasks, by the names of files, and those at the start of files of several."""
        return self._alone().union(*(text.split() for text in self._chunks().values()))

    def failed(self) -> set[str]:
        """List the names of the failed tasks."""
        failed = self._names("failed", ".json")
        return failed - self.finished() if failed else failed

    def failures(self) -> dict[str, dict[str, Any]]:
        """Read the records of the failed tasks: label, error, reason, parameters."""
        return {name: self.failure(name) for name in sorted(self.failed())}

    def failure(self, name: str) -> dict[str, Any]:
        """Read the record of a failed task."""
        with suppress(OSError, ValueError):
            record = json.loads(self.failure_file(name).read_text(encoding="utf-8"))
            if isinstance(record, dict):
                return record
        return {"label": name, "error": "unknown", "reason": "its record is damaged"}  # it is known that it failed

    def has_ended(self, name: str) -> bool:
        """Whether a task is finished or has failed."""
        return self.failure_file(name).exists() or self.file_of(name).exists()

    def record_failure(self, task: Task, error: BaseException) -> None:
        """Record why a task failed."""
        trace = "".join(traceback.format_exception(error))
        record = {"label": task.parameters.label, "error": type(error).__name__, "reason": str(error), "trace": trace}
        record["parameters"] = task.parameters.model_dump_json()
        with atomic_file(self.failure_file(task.name)) as temporary:
            temporary.write_text(json.dumps(record, indent=1), encoding="utf-8")

    def forget_failures(self, names: Iterable[str]) -> None:
        """Delete the records of failed tasks and of workers that died at them, so that they are run again."""
        names = list(names)
        forget_deaths(self.path, names)
        with using(self.path / "failed"):
            for name in names:
                self.failure_file(name).unlink(missing_ok=True)

    def damages(self, names: Iterable[str]) -> dict[str, str]:
        """Read every byte of the files of finished tasks; return file, without its ending, -> damage. A file of several
        tasks whose names are damaged belongs to all."""
        wanted, found = set(names), dict[str, str]()
        tasks = {name: [name] for name in sorted(wanted & self._alone())}
        tasks |= {Path(file).stem: text.split() for file, text in self._chunks(damaged=True).items()}
        for stem, inside in tasks.items():
            path = self.task_file(stem)
            if (inside and wanted.isdisjoint(inside)) or not path.exists():  # another share has moved it aside
                continue
            label = label_of_stem(stem) if is_chunk(stem) else f"task {stem}"
            if reason := damage(path, label):
                found[stem] = reason if len(inside) < 2 else f"{reason} ({len(inside)} tasks)"
        return found

    def read(self, names: Iterable[str]) -> dict[str, TaskFile]:
        """Read finished tasks without their tables; a damaged file is left out: `run` finds it, and runs it again."""
        found: dict[str, TaskFile] = {}
        for path, tasks in self.files_of(names).items():
            with suppress(StorageError):
                if is_chunk(path.stem):
                    with opened_chunk(path) as chunk:
                        found |= {name: chunk.task(name, "") for name in tasks}
                else:
                    found[tasks[0]] = read_task_file(path, "")
        return found

    def read_task(self, name: str) -> TaskFile:
        """Read a finished task without its packings; see `read_task_file`."""
        path = self.file_of(name)
        return read_chunk(path).task(name) if is_chunk(path.stem) else read_task_file(path)

    def packings(self, name: str) -> list[Packing]:
        """Read the packings of a finished task, frame by frame.

        Raises:
            StorageError: there is no such file, or it is damaged, or that of another task.
        """
        path = self.file_of(name)
        if is_chunk(path.stem):
            return read_chunk(path).packings(name)
        read_task_file(path, "")  # which refuses that of another task
        return read_all_hdf5(path)

    def rows(self, names: Iterable[str], table: str) -> Iterator[TaskRows]:
        """Read what a table needs of finished tasks, file by file."""
        for path, tasks in self.files_of(names).items():
            if is_chunk(path.stem):
                with opened_chunk(path) as chunk:
                    found, wanted = chunk.rows(table), set(tasks)
                yield found.take(np.array([task in wanted for task in found.tasks]))
            else:
                yield rows_of_task(read_task_file(path, table))

    def gaps(self, names: Iterable[str]) -> dict[str, str]:
        """Read which finished tasks lack states: task -> which, and why; a damaged file is left out."""
        found: dict[str, str] = {}
        for path, tasks in self.files_of(names).items():
            with suppress(StorageError):
                if is_chunk(path.stem):
                    with opened_chunk(path) as chunk:
                        wanted = set(tasks)
                        lacking = [chunk.task(name, "") for name in chunk.lacking() if name in wanted]
                else:
                    lacking = [read_task_file(path, "")]
                found |= {task.task: task.gaps for task in lacking if task.gaps}
        return found

    def bytes_of(self, name: str, *, together: bool) -> float:
        """Size on disk of a finished task; of a file of several its share. `together`: of a file of its own that size
        which it would have in a file of several, about."""
        path = self.file_of(name)
        if is_chunk(path.stem):
            return path.stat().st_size / len(names_in_chunk(path))
        return array_bytes(path) if together else path.stat().st_size

    def move_aside(self, name: str) -> Path:
        """Move a damaged file, as `damages` names it, to `damaged/`, so that its tasks are run again."""
        place = self.path / "damaged"
        with using(place):
            place.mkdir(exist_ok=True)
            k = 1
            while (target := place / f"{name}.{k}.h5").exists():
                k += 1
            with suppress(FileNotFoundError):  # another share has moved it aside
                os.replace(self.task_file(name), target)
        return target

    def prepare(self) -> None:
        """Make the folders of tasks, failures and marks."""
        for part in ("tasks", "failed", RUNNING):
            make_folder(self.path / part)

    @contextmanager
    def lock(self, share: Share = WHOLE) -> Iterator[str]:
        """Keep other processes out that would run the same tasks, until the block ends: the same share, and shares of
        another number. The lock of a process that dies is released. Gives `<share>.<run>`, the name of this run, which
        the lock holds meanwhile; then no worker of the run begins anything, and its marks go."""
        words = "{}-of-{}".format(*share)
        own, run = self.path / f"lock.{words}", f"{words}.{os.urandom(8).hex()}"
        with ExitStack() as stack:
            with using(own):
                file = stack.enter_context(open(own, "a+"))
                others = [p for p in self.path.glob("lock.*-of-*") if p.suffix.rpartition("-")[2] != str(share[1])]
                try:
                    busy = [] if _flock(file) else [own]
                    for other in others:
                        with open(other, "a+") as opened_too:
                            if _flock(opened_too):
                                opened_too.truncate(0)  # what is left of a dead run begins nothing
                            else:
                                busy.append(other)
                except OSError as error:
                    if error.errno not in _NO_LOCKS:
                        raise
                    said = f"{self.path}: {os.strerror(error.errno)}"
                    warn(f"{said}: nothing keeps a second run out, so run each share once")
                    busy = []
            if busy:
                said = f"another process runs in {self.path} and holds {busy[0].name}"
                first = "run another share" if busy[0] == own and share != WHOLE else "stop it"
                raise StorageError(f"{said}: {first}, or wait until it ends")
            try:
                _hold(own, file, run)
                yield run
            finally:
                with suppress(StorageError):  # a disk that failed has ended the run before
                    _hold(own, file, "")
                    end_run(self.path, run)

    def is_held_by(self, attempt: str) -> bool:
        """Whether the run of an attempt, `<share>.<run>.<count>`, holds the lock of this folder, as seen from here."""
        run = attempt.rpartition(".")[0]
        with suppress(OSError, UnicodeDecodeError):
            return (self.path / f"lock.{run.partition('.')[0]}").read_text() == run
        return False

    def count_running(self) -> int:
        """Number of tasks that workers of runs are at; marks of a run whose process is gone do not count."""
        runs = set()
        for lock in self.path.glob("lock.*-of-*"):
            with suppress(OSError, UnicodeDecodeError), open(lock, encoding="utf-8") as file:  # of one that has ended
                if (run := file.read()) and _is_locked(file):
                    runs.add(run)
        return count_marks(self.path, runs)

    def keep_copy(self, text: str, name: str) -> None:
        """Keep the text of the campaign file in the folder, where `open_campaign(folder)` finds it, beside those that
        ran here before; another campaign is refused."""
        copy = self.path / COPY
        check_target(copy)
        content = text.encode()
        with using(copy):
            known = copy.read_bytes() if copy.exists() else content
            earlier = list(self.path.glob(f"{copy.stem}.*{copy.suffix}"))
            kept = {path.read_bytes() for path in earlier if path.is_file()}
        if (other := _name_of(known)) not in (None, name):
            raise InputError(
                f"{self.path} holds the campaign {other!r}, not {name!r}: give another folder, or the same name"
            )
        if known != content and known not in kept:
            write_whole(copy.with_suffix(f".{len(earlier) + 1}{copy.suffix}"), known)
        if known != content or not copy.exists():
            write_whole(copy, content)

    def _chunks(self, *, damaged: bool = False) -> dict[str, str]:
        """The files of several tasks: name of the file -> names of the tasks, a line each; with `damaged` also those
        whose names are damaged, "" for these."""
        files = sorted(f"{name}.h5" for name in self._names("tasks", ".h5") if is_chunk(name))
        for gone in self._known.keys() - set(files):
            del self._known[gone]
        for file in files:
            if not self._known.get(file):  # what is damaged may be whole again
                path = self.path / "tasks" / file
                try:
                    names = names_in_chunk(path) if path.is_file() or not path.exists() else []
                except FileNotFoundError:  # another share has moved it aside
                    continue
                except OSError as error:
                    said = system_said(error, "check its permissions")
                    raise StorageError(f"cannot read {path}: {said}") from error
                self._known[file] = "\n".join(names)
        return {file: text for file in files if (text := self._known.get(file)) is not None and (text or damaged)}

    def _alone(self) -> set[str]:
        """Names of the tasks that have files of their own."""
        return {name for name in self._names("tasks", ".h5") if not is_chunk(name)}

    def _names(self, part: str, ending: str) -> set[str]:
        try:
            entries = os.listdir(self.path / part)
        except FileNotFoundError:
            return set()
        except OSError as error:
            said = system_said(error, "check it and its permissions")
            raise InputError(f"cannot read the folder {self.path / part}: {said}") from error
        return {entry[: -len(ending)] for entry in entries if entry.endswith(ending) and not entry.startswith(".")}


def _name_of(content: bytes) -> str | None:
    """Name in a campaign file; None where it is no such file."""
    try:
        name = tomllib.loads(content.decode()).get("name")
    except (ValueError, RecursionError):
        return None
    return name if isinstance(name, str) else None


def _hold(path: Path, file: TextIO, run: str) -> None:
    """Let a lock say which run it is, also to other machines."""
    with using(path):
        file.truncate(0)
        file.write(run)
        file.flush()
        os.fsync(file.fileno())


def _is_locked(file: TextIO) -> bool:
    """Whether a process holds the lock of a file, as far as its file system locks anything."""
    try:
        fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError:
        return True
    return False


def _flock(file: TextIO) -> bool:
    """Lock a file; whether no other process has it."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
