"""A table of measurements is saved task by task: an interrupted one goes on, and a whole one can ship with jamlab.

A file is CSV below a first line of JSON, the provenance, and is packed if its name ends in .gz or .xz. Every task, such
as one packing under one method, gives some rows, and the provenance says how many; a task whose rows are all in the
file is not done again.
"""

import csv
import gzip
import io
import json
import lzma
import os
import subprocess
import time
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any, TypeVar

import pandas as pd
from threadpoolctl import threadpool_limits

from jamlab.errors import StorageError
from jamlab.processes.progress import Progress, no_progress
from jamlab.storage.atomic_file import atomic_file, check_target
from jamlab.storage.file_endings import check_ending
from jamlab.storage.verified_file import versions

SCHEMA = "jamlab-measured"
_FIRST = ("task", "took")  # columns of every table
_TEXT = ("task", "setting", "note")  # columns that are words even where all of them look like numbers

_PACK: dict[str, Callable[[bytes], bytes]] = {".gz": partial(gzip.compress, mtime=0), ".xz": lzma.compress}
_UNPACK: dict[str, Callable[[bytes], bytes]] = {".gz": gzip.decompress, ".xz": lzma.decompress}

Result = TypeVar("Result")
Row = Mapping[str, Any]
Task = Callable[[], Iterable[Row]]


@dataclass(frozen=True)
class MeasuredTable:
    """What was measured, and how."""

    # as many as the tasks gave; `task` is the name of the task, `took` the CPU seconds of all of it, with what it had
    # to prepare
    rows: pd.DataFrame
    # `facts` that all rows share; `sessions`, each with commit, date, versions and how many tasks; `rows`, how many
    # every task gave
    provenance: dict[str, Any]

    @property
    def tasks(self) -> set[str]:
        """Names of all tasks that were done, with all of their rows."""
        found = _count(self.rows)
        return {task for task, count in self.provenance["rows"].items() if found.get(task, 0) == count}

    @property
    def made(self) -> str:
        """One line: when, at which commits and with which versions."""
        sessions = self.provenance["sessions"]
        dates = sorted({one["date"] for one in sessions})
        commits = ", ".join(dict.fromkeys(one["commit"] for one in sessions))
        programs = ", ".join(f"{name} {version}" for name, version in sessions[-1]["versions"].items())
        return f"{dates[0] if len(dates) == 1 else f'{dates[0]} to {dates[-1]}'}, commit {commits}; {programs}"


def shipped_table(name: str) -> MeasuredTable:
    """Read the table of a study that ships with jamlab."""
    path = Path(str(resources.files("studies"))) / "tables" / f"{name}.csv.xz"
    if not path.is_file():
        raise StorageError(f"jamlab ships no table {name!r}: measure it, python -m studies run {name}")
    return read_table(path)


def read_table(path: Path) -> MeasuredTable:
    """Read a table."""
    table = _read(path)[0]
    found = _count(table.rows)
    for task, count in table.provenance["rows"].items():
        held = found.get(task, 0)
        if held != count:
            what = f"was cut short and holds {held} of {count} rows of task {task!r}"
            if held > count:
                what = f"holds {held} rows of task {task!r}, {count} expected"
            raise StorageError(f"{path} {what}: python -m studies run does that again")
    return table


def done_tasks(path: Path) -> set[str]:
    """Names of the tasks that a file holds whole; none if there is no file."""
    return _read(path)[0].tasks if path.exists() else set()


def measure_table(
    path: Path,
    columns: Sequence[str],
    tasks: Mapping[str, Task],
    facts: Mapping[str, Any],
    *,
    progress: Progress = no_progress,
) -> MeasuredTable:
    """Do the tasks that the file does not hold, on one core, and save after each; a row need not have all columns.
    `progress` is called before each task. A file with other facts, which all rows share, is refused and not gone on
    with."""
    check_ending(path, "packed table")
    check_target(path)
    names = [*_FIRST, *columns]
    cells, provenance = _begin(path, names, json.loads(json.dumps(dict(facts))))
    session: dict[str, Any] = {"commit": commit(), "date": datetime.now(UTC).date().isoformat(), "versions": versions()}
    sessions, held = provenance["sessions"], provenance["rows"]
    if not sessions or sessions[-1] | session != sessions[-1]:
        sessions.append(session | {"tasks": 0})
    for done, (name, task) in enumerate(tasks.items()):
        if name in held:
            continue
        progress(done / len(tasks), name)
        began = sum(os.times()[:4])  # of this process and of its children
        with one_core():
            rows = list(task())
        more = _cells(name, sum(os.times()[:4]) - began, rows, names)
        cells = pd.concat([cells, more])
        held[name] = len(rows)
        sessions[-1]["tasks"] += 1
        _write(path, cells, provenance)
    if not path.exists():
        _write(path, cells, provenance)
    return read_table(path)


def _begin(path: Path, columns: list[str], facts: dict[str, Any]) -> tuple[pd.DataFrame, dict[str, Any]]:
    """Cells, as text, and provenance of the tasks that a file holds whole."""
    if not path.exists():
        provenance = {"schema": SCHEMA, "version": 1, "facts": facts, "sessions": [], "rows": {}}
        return pd.DataFrame(columns=columns, dtype=str), provenance
    before, cells = _read(path)
    if before.provenance["facts"] != facts or list(cells) != columns:
        raise StorageError(f"{path} is another measurement: remove it, or choose another folder")
    held = {task: count for task, count in before.provenance["rows"].items() if task in before.tasks}
    return cells[cells["task"].isin(held)], before.provenance | {"rows": held}


def _cells(task: str, took: float, rows: Iterable[Row], columns: list[str]) -> pd.DataFrame:
    """Rows of a task, as text."""
    full = [{"task": task, "took": took, **row} for row in rows]
    if unknown := {name for row in full for name in row} - set(columns):
        raise ValueError(f"columns {sorted(unknown)} of task {task} are not among {columns}")
    return pd.DataFrame([[_text(row.get(name)) for name in columns] for row in full], columns=columns, dtype=str)


def _write(path: Path, cells: pd.DataFrame, provenance: Mapping[str, Any]) -> None:
    text = "\n".join([f"# {json.dumps(provenance)}", cells.to_csv(index=False, lineterminator="\n")])
    with atomic_file(path) as temporary:
        temporary.write_bytes(_PACK.get(path.suffix, bytes)(text.encode()))


@contextmanager
def one_core() -> Iterator[None]:
    """Pin this process, with the threads of every library in it, to one core; where that is not possible (macOS), have
    them use one thread."""
    if not hasattr(os, "sched_setaffinity"):
        with threadpool_limits(1):
            yield
        return
    allowed = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {sorted(allowed)[os.getpid() % len(allowed)]})  # runs side by side take different cores
    try:
        yield
    finally:
        os.sched_setaffinity(0, allowed)


def shortest(run: Callable[[], Result], *, runs: int = 20, budget: float = 1.0) -> tuple[float, Result]:
    """Measure the shortest CPU time of a function, over all its threads, and return it with the last result. On one
    core this equals the wall time on a machine without other load. No run begins after `budget` seconds."""
    best, spent = float("inf"), 0.0
    for _ in range(runs):
        began = time.process_time()
        result = run()
        took = time.process_time() - began
        best, spent = min(best, took), spent + took
        if spent > budget:
            break
    return best, result


def commit() -> str:
    """Short name of the commit of this checkout, `-dirty` if it was changed since; "unknown" outside of one."""
    here = Path(__file__)
    words = (["ls-files", "--error-unmatch", here.name], ["describe", "--always", "--dirty", "--exclude", "*"])
    try:
        for word in words:
            done = subprocess.run(["git", *word], cwd=here.parent, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return done.stdout.strip()


def _read(path: Path) -> tuple[MeasuredTable, pd.DataFrame]:
    """A table, and its cells as text; a line without its end, or with fewer cells than the first, is none."""
    try:
        first, _, body = _UNPACK.get(path.suffix, bytes)(path.read_bytes()).decode().partition("\n")
    except (OSError, EOFError, UnicodeDecodeError, zlib.error, lzma.LZMAError) as error:
        reason = getattr(error, "strerror", None) or error
        raise StorageError(f"cannot read {path}: {reason}; give a table of python -m studies run") from error
    whole = body[: body.rfind("\n") + 1]
    try:
        provenance = json.loads(first.removeprefix("# "))
        if (kind := (provenance["schema"], provenance["version"])) != (SCHEMA, 1):
            raise ValueError(f"schema {kind[0]!r} {kind[1]} is not known here")
        how: dict[str, Any] = {"keep_default_na": False, "na_values": ["nan"]}
        header, *lines = csv.reader(io.StringIO(whole), strict=True)
        cells = pd.DataFrame([line for line in lines if len(line) == len(header)], columns=header, dtype=str)
        rows = pd.read_csv(io.StringIO(cells.to_csv(index=False)), dtype=dict.fromkeys(_TEXT, str), **how)
        found = _count(rows)
    except (ValueError, KeyError, TypeError, csv.Error) as error:
        raise StorageError(f"{path} is no table of python -m studies run: {error}") from error
    # files of version 0.2.0 do not say how many rows there are
    expected = provenance.setdefault("rows", found | dict.fromkeys(provenance.pop("empty", []), 0))
    if unnamed := sorted(found.keys() - expected.keys()):
        raise StorageError(f"{path} holds rows of task {unnamed[0]!r}, which its first line does not name: remove them")
    return MeasuredTable(rows, provenance), cells


def _count(rows: pd.DataFrame) -> dict[str, int]:
    """How many rows there are of each task."""
    return {str(task): int(count) for task, count in rows["task"].value_counts(sort=False).items()}


def _text(value: Any) -> str:
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else " ".join(str(value).splitlines())
