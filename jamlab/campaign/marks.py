"""Marks of the calls under way in the folder of a campaign: what a worker was at, and how it ended.

Before a worker begins a chunk it makes a file in `running/`, which only one process can make, and writes which task it
is at. It removes the mark when the chunk has ended in order. So a mark whose worker is gone names the task to blame,
whatever engine started the worker; and a task without a mark never began.

| in the file                 | content                                                                          |
|-----------------------------|----------------------------------------------------------------------------------|
| first `_WIDTH` bytes        | JSON, overwritten in place: task, when it began (s since 1970), host, process id,|
|                             | when the process began and when its job will end, where the batch system says so |
| then, if the process crashed| "Fatal Python error", the signal, and the line of Python, by `faulthandler`      |
| or was told to end (SIGTERM)| the line of Python alone                                                         |

Its name is `<share>.<run>.<count>.<beginning>`: the first three name an attempt, which is a call that the driver made;
an engine may begin it more than once.
"""

import faulthandler
import functools
import itertools
import json
import math
import os
import platform
import re
import signal
import time
from collections.abc import Callable, Container, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jamlab.storage.system_errors import using

RUNNING = "running"
_WIDTH = 320  # bytes: a name, five numbers and 64 letters of a host
_NAME = re.compile(r"\d+-of-\d+\.[0-9a-f]+\.\d+\.\d+")
_FATAL = "Fatal Python error"  # so `faulthandler` begins what it says of a crash
_STACK = ("Stack", "Current thread")  # and of a signal for which it is registered
_IMPORTED = time.time()


@dataclass(frozen=True)
class Mark:
    """What a mark says."""

    path: Path
    task: str | None  # name; None if the machine of the worker was lost before that reached the disk
    host: str  # of the worker, "" if not known
    process: int  # of the worker, 0 if not known
    began: float  # s since 1970: this task; nan if not known
    process_began: float  # s since 1970: its worker, about when its job began; nan if not known
    job_ends: float | None  # s since 1970: the walltime of its job, where the batch system says it
    trace: str  # what `faulthandler` said
    changed: float  # s since 1970, by the file system

    @property
    def crash(self) -> str:
        """How its process crashed: the signal and the line of Python; "" if it did not."""
        if not self.trace.startswith(_FATAL):
            return ""
        lines = [line.strip() for line in self.trace.splitlines()]
        places = [line for line in lines if line.startswith("File ")]
        return ", ".join([lines[0].removeprefix(f"{_FATAL}: "), *places[:1]])

    @property
    def was_told_to_end(self) -> bool:
        """Whether its process got SIGTERM."""
        return self.trace.startswith(_STACK)


@contextmanager
def marked(folder: Path, attempt: str) -> Iterator[tuple[Callable[[str], None], list[Mark]]]:
    """Have a mark in `running/` while a worker runs an attempt.

    Returns:
        A function to call with the name of each task as it begins, and the marks of earlier beginnings of the same
        attempt, whose workers are gone.

    Raises:
        StorageError: the folder is full or cannot be written.
    """
    with using(folder / RUNNING):
        descriptor, path, earlier = _make(folder / RUNNING / attempt)

    def at(task: str) -> None:
        with using(path):
            os.pwrite(descriptor, _line(task), 0)

    try:
        with using(path):
            os.pwrite(descriptor, b" " * (_WIDTH - 1) + b"\n", 0)
            os.lseek(descriptor, _WIDTH, os.SEEK_SET)  # where `faulthandler` writes
        with _last_words(descriptor):
            yield at, [mark for mark in map(_read_if_there, earlier) if mark]
    except Exception:
        remove([path, *earlier])
        raise
    else:
        remove([path, *earlier])
    finally:
        os.close(descriptor)  # what ends the process leaves the mark


def marks_of(folder: Path, attempt: str) -> list[Mark]:
    """Read the marks that workers left of an attempt, the first one first; none if it never began."""
    stem, paths = f"{attempt}.", [folder / RUNNING / name for name in _names(folder) if name.startswith(f"{attempt}.")]
    first = folder / RUNNING / f"{stem}1"  # which a network file system looks up, while its list may be an old one
    found = map(_read_if_there, sorted({first, *paths}, key=lambda path: (len(path.name), path.name)))
    return [mark for mark in found if mark]


def read_marks(folder: Path, belongs: Callable[[str], bool] = lambda name: True) -> list[Mark]:
    """Read the marks whose file names belong to somebody."""
    found = (_read_if_there(folder / RUNNING / name) for name in _names(folder) if belongs(name))
    return [mark for mark in found if mark]


def remove(paths: Iterable[Path]) -> None:
    """Remove marks."""
    for path in paths:
        with using(path):
            path.unlink(missing_ok=True)


def has_marks(folder: Path, run: str) -> bool:
    """Whether an attempt of this run has begun and not ended."""
    return any(name.startswith(f"{run}.") for name in _names(folder))


def count_marks(folder: Path, runs: Container[str]) -> int:
    """Number of calls of some runs, `<share>.<run>`, that workers are at."""
    return sum(".".join(name.split(".")[:2]) in runs for name in _names(folder))


def _names(folder: Path) -> list[str]:
    with using(folder / RUNNING):
        try:
            return sorted(filter(_NAME.fullmatch, os.listdir(folder / RUNNING)))
        except FileNotFoundError:
            return []


def _read_if_there(path: Path) -> Mark | None:
    with using(path):
        try:
            content, changed = path.read_bytes(), path.stat().st_mtime
        except FileNotFoundError:  # its call ended
            return None
    said: dict[str, Any] = {}
    with suppress(ValueError):  # half-written, or lost with the machine of the worker
        found = json.loads(content[:_WIDTH])
        said = found if isinstance(found, dict) else {}
    return Mark(
        path=path,
        task=said.get("task"),
        host=said.get("host", ""),
        process=said.get("pid", 0),
        began=said.get("began", math.nan),
        process_began=said.get("process_began", math.nan),
        job_ends=said.get("job_ends"),
        trace=content[_WIDTH:].decode("utf-8", "replace").strip("\0 \n"),
        changed=changed,
    )


def _make(stem: Path) -> tuple[int, Path, list[Path]]:
    """Make the mark of the next beginning of an attempt; the server of a shared file system decides whose it is."""
    earlier: list[Path] = []
    for k in itertools.count(1):
        path = Path(f"{stem}.{k}")
        try:
            return os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_CLOEXEC, 0o666), path, earlier
        except FileExistsError:
            earlier.append(path)
    raise AssertionError


def _line(task: str) -> bytes:
    said = {"task": task, "began": round(time.time(), 3), "host": platform.node()[:64], "pid": os.getpid()}
    said |= {"process_began": round(_process_began(), 3), "job_ends": _job_ends()}
    return json.dumps(said).encode().ljust(_WIDTH - 1)[: _WIDTH - 1] + b"\n"


@functools.cache
def _process_began() -> float:
    """When this process began, s since 1970; where the system does not say it, when it read this module."""
    try:
        ticks = int(Path("/proc/self/stat").read_text().rpartition(")")[2].split()[19])
        return time.time() - time.clock_gettime(time.CLOCK_BOOTTIME) + ticks / os.sysconf("SC_CLK_TCK")
    except (OSError, ValueError, IndexError, AttributeError):  # no Linux
        return _IMPORTED


def _job_ends() -> float | None:
    """When the job of this process ends, s since 1970: as its script says, or SLURM."""
    for variable in ("JAMLAB_JOB_ENDS", "SLURM_JOB_END_TIME"):
        with suppress(KeyError, ValueError):
            return float(os.environ[variable])
    return None


@contextmanager
def _last_words(descriptor: int) -> Iterator[None]:
    """Have the process write where it was when it crashes or gets SIGTERM, meanwhile."""
    usual = faulthandler.is_enabled()
    faulthandler.enable(descriptor, all_threads=False)
    faulthandler.register(signal.SIGTERM, descriptor, all_threads=False, chain=True)
    try:
        yield
    finally:
        faulthandler.unregister(signal.SIGTERM)
        faulthandler.disable()
        if usual:
            faulthandler.enable(2)  # where a library or PYTHONFAULTHANDLER has it
