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

from jamlab.errors import StorageError
from jamlab.processes.progress import Progress, no_progress
from jamlab.storage.atomic_file import atomic_file, check_target
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
    def seconds(self) -> float:
        """CPU seconds that the tasks with rows took."""
        return float(self.rows.groupby("task")["took"].first().sum())

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
    path = Path(str(resources.files("jamlab.studies"))) / "tables" / f"{name}.csv.xz"
    if not path.is_file():
        raise StorageError(f"jamlab ships no table {name!r}: measure it, jamlab study run {name}")
    return read_table(path)


def read_table(path: Path) -> MeasuredTable:
    """Read a table."""
    table = _read(path)
    found = _count(table.rows)
    for task, count in table.provenance["rows"].items():
        held = found.get(task, 0)
        if held != count:
            what = f"was cut short and holds {held} of {count} rows of task {task!r}"
            if held > count:
                what = f"holds {held} rows of task {task!r}, {count} expected"
            raise StorageError(f"{path} {what}: jamlab study run does that again")
    return table


def _read(path: Path) -> MeasuredTable:
    return _parse(_text_of(path), str(path))


def _text_of(path: Path) -> str:
    try:
        return _UNPACK.get(path.suffix, bytes)(path.read_bytes()).decode()
    except (OSError, EOFError, UnicodeDecodeError, zlib.error, lzma.LZMAError) as error:
        reason = getattr(error, "strerror", None) or error
        raise StorageError(f"cannot read {path}: {reason}; give a table of jamlab study run") from error


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
    check_target(path)
    writer = _Writer(path, [*_FIRST, *columns], facts)
    for done, (name, task) in enumerate(tasks.items()):
        if name in writer.tasks:
            continue
        progress(done / len(tasks), name)
        began = _cpu_time()
        with one_core():
            rows = list(task())
        writer.add(name, _cpu_time() - began, rows)
    writer.save()
    return read_table(path)


@contextmanager
def one_core() -> Iterator[None]:
    """Pin this process, with the threads of every library in it, to one core."""
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


def _cpu_time() -> float:
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system


def done_tasks(path: Path) -> set[str]:
    """Names of the tasks that a file holds whole; none if there is no file."""
    return _read(path).tasks if path.exists() else set()


class _Writer:
    """The text of a table, and the file that follows it."""

    def __init__(self, path: Path, columns: Sequence[str], facts: Mapping[str, Any]) -> None:
        self._path, self._columns = path, list(columns)
        self._body = io.StringIO()
        self.tasks: set[str] = set()
        sessions: list[dict[str, Any]] = []
        counts: dict[str, int] = {}
        facts = json.loads(json.dumps(dict(facts)))
        if path.exists():
            before = _read(path)
            other_columns = len(before.rows) > 0 and list(before.rows.columns) != self._columns
            if before.provenance["facts"] != facts or other_columns:
                raise StorageError(f"{path} is another measurement: remove it, or choose another folder")
            self.tasks |= before.tasks
            _, rows, _ = _whole_records(_text_of(path).partition("\n")[2])
            csv.writer(self._body, lineterminator="\n").writerows(row for row in rows if row[0] in self.tasks)
            sessions, counts = before.provenance["sessions"], before.provenance["rows"]
        today = datetime.now(UTC).date().isoformat()
        self._session: dict[str, Any] = {"commit": commit(), "date": today, "versions": versions(), "tasks": 0}
        if sessions and sessions[-1] | {"tasks": 0} == self._session:
            self._session = sessions.pop()
        sessions = [*sessions, self._session]
        held = {task: counts[task] for task in counts if task in self.tasks}
        self._provenance: dict[str, Any] = {"schema": SCHEMA, "version": 1, "facts": facts, "sessions": sessions}
        self._provenance["rows"] = held

    def add(self, task: str, took: float, rows: Iterable[Row]) -> None:
        lines = csv.writer(self._body, lineterminator="\n")
        rows = list(rows)
        self._provenance["rows"][task] = len(rows)
        for row in rows:
            full = {"task": task, "took": took, **row}
            if unknown := full.keys() - set(self._columns):
                raise ValueError(f"columns {sorted(unknown)} of task {task} are not among {self._columns}")
            lines.writerow([_text(full.get(name)) for name in self._columns])
        self.tasks.add(task)
        self._session["tasks"] += 1
        self.save()

    def save(self) -> None:
        if self._path.exists() and not self._session["tasks"]:
            return  # nothing new
        head = io.StringIO()
        csv.writer(head, lineterminator="\n").writerow(self._columns)
        text = f"# {json.dumps(self._provenance)}\n{head.getvalue()}{self._body.getvalue()}"
        with atomic_file(self._path) as temporary:
            temporary.write_bytes(_PACK.get(self._path.suffix, bytes)(text.encode()))


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


def _parse(text: str, name: str) -> MeasuredTable:
    first, _, body = text.partition("\n")
    header, records, cut = _whole_records(body)
    try:
        provenance = json.loads(first.removeprefix("# "))
        known = provenance["schema"] == SCHEMA and provenance["version"] == 1
        if not header and "rows" in provenance:
            header = list(_FIRST)  # cut before its first row: what is missing is known by name
        whole = io.StringIO()
        csv.writer(whole, lineterminator="\n").writerows([header, *records])
        whole.seek(0)
        rows = pd.read_csv(whole, dtype=dict.fromkeys(_TEXT, str), keep_default_na=False, na_values=["nan"])
    except (ValueError, KeyError, TypeError) as error:
        raise StorageError(f"{name} is no table of jamlab study run: {error}") from error
    if not known:
        raise StorageError(f"{name}: schema {provenance['schema']!r} {provenance['version']} is not known here")
    if "task" not in rows:
        raise StorageError(f"{name} is no table of jamlab study run: it has no column of tasks")
    if "rows" not in provenance:  # written before rows were counted
        provenance["rows"] = _count(rows) | dict.fromkeys(provenance.pop("empty", []), 0)
        if cut and len(rows):
            provenance["rows"][rows["task"].iloc[-1]] += 1
    if unnamed := sorted(_count(rows).keys() - provenance["rows"].keys()):
        raise StorageError(f"{name} holds rows of task {unnamed[0]!r}, which its first line does not name: remove them")
    return MeasuredTable(rows, provenance)


def _count(rows: pd.DataFrame) -> dict[str, int]:
    """How many rows there are of each task."""
    return {str(task): int(count) for task, count in rows["task"].value_counts(sort=False).items()}


def _whole_records(body: str) -> tuple[list[str], list[list[str]], bool]:
    """Header and rows of a table without a last one that was cut, and whether there was one. The last one is whole if
    its line ends, outside of quotes, which come in pairs, and it has as many fields as the header. Without a whole
    header there are no rows."""
    records = [record for record in csv.reader(io.StringIO(body)) if record]  # a blank line is none
    ended = body.endswith("\n") and body.count('"') % 2 == 0
    cut = bool(records) and not (ended and len(records[-1]) == len(records[0]))
    if cut:
        records.pop()
    return (records[0] if records else []), records[1:], cut


def _text(value: Any) -> str:
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else " ".join(str(value).splitlines())
