"""Tables of measurements, saved task by task: an interrupted measurement goes on, and its table can ship with jamlab.

A file is CSV below a first line of JSON, the provenance. Every task, such as one packing under one method, gives some
rows; a task whose rows are in the file is not done again.
"""

import csv
import io
import json
import os
import subprocess
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib import resources
from pathlib import Path
from typing import Any

import pandas as pd

from jamlab.benchmarks.cpu_time import one_core
from jamlab.errors import StorageError
from jamlab.packing.atomic_file import atomic_file, check_target
from jamlab.packing.versions import versions

SCHEMA = "jamlab-measured"
_FIRST = ("task", "took")  # columns of every table
_TEXT = ("task", "setting", "note")  # columns that are words even where all of them look like numbers

Row = Mapping[str, Any]
Task = Callable[[], Iterable[Row]]
Progress = Callable[[str, int, int], None]  # task, how many are done, of how many


@dataclass(frozen=True)
class MeasuredTable:
    """What was measured, and how.

    Attributes:
        rows: as many as the tasks gave; `task` is the name of the task, `took` the CPU seconds of all of it, with
            what it had to prepare.
        provenance: `facts` that all rows share; `sessions`, each with commit, date, versions and how many tasks;
            `empty`, tasks that gave no row.
    """

    rows: pd.DataFrame
    provenance: dict[str, Any]

    @property
    def tasks(self) -> set[str]:
        """Names of all tasks that were done."""
        return set(self.rows["task"]) | set(self.provenance["empty"])

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


def shipped_table(package: str, name: str) -> MeasuredTable:
    """Read NAME.csv from the folder `measured` of a package of jamlab.

    Raises:
        StorageError: the package holds no such table.
    """
    source = resources.files(package).joinpath("measured", f"{name}.csv")
    if not source.is_file():
        raise StorageError(f"jamlab ships no table {name!r} in {package}: measure it, jamlab chart --measure")
    return _parse(source.read_text(encoding="utf-8"), name)


def read_table(path: Path) -> MeasuredTable:
    """Read a table.

    Raises:
        StorageError: the file cannot be read or holds no such table.
    """
    try:
        return _parse(path.read_text(encoding="utf-8"), str(path))
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise StorageError(f"cannot read {path}: {reason}; give a table of jamlab chart --measure") from error


def measure_table(
    path: Path,
    columns: Sequence[str],
    tasks: Mapping[str, Task],
    facts: Mapping[str, Any],
    *,
    progress: Progress = lambda name, done, of: None,
) -> MeasuredTable:
    """Do the tasks that the file does not hold, on one core, and save after each.

    Args:
        path: CSV file, made or gone on with.
        columns: of the rows, besides `task` and `took`; a row need not have all.
        tasks: name -> function that measures and returns rows.
        facts: what all rows share, such as settings; a file with other facts is not gone on with.
        progress: called before each task.

    Raises:
        StorageError: the file cannot be written, or is another measurement.
        InputError: as raised by a task; what was measured before it is saved.
    """
    check_target(path)
    writer = _Writer(path, [*_FIRST, *columns], facts)
    for done, (name, task) in enumerate(tasks.items()):
        if name in writer.tasks:
            continue
        progress(name, done, len(tasks))
        began = _cpu_time()
        with one_core():
            rows = list(task())
        writer.add(name, _cpu_time() - began, rows)
    writer.save()
    return read_table(path)


def _cpu_time() -> float:
    """Seconds of this process and of its children that have ended."""
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system


def done_tasks(path: Path) -> set[str]:
    """Names of the tasks that a file holds; none if there is no file."""
    return read_table(path).tasks if path.exists() else set()


class _Writer:
    """The text of a table, and the file that follows it."""

    def __init__(self, path: Path, columns: Sequence[str], facts: Mapping[str, Any]) -> None:
        self._path, self._columns = path, list(columns)
        self._body = io.StringIO()
        self.tasks: set[str] = set()
        sessions: list[dict[str, Any]] = []
        empty: list[str] = []
        facts = json.loads(json.dumps(dict(facts)))
        if path.exists():
            before = read_table(path)
            if before.provenance["facts"] != facts or list(before.rows.columns) != self._columns:
                raise StorageError(f"{path} is another measurement: remove it, or choose another folder")
            self._body.write(path.read_text(encoding="utf-8").split("\n", 2)[2])
            self.tasks |= before.tasks
            sessions, empty = before.provenance["sessions"], before.provenance["empty"]
        today = datetime.now(UTC).date().isoformat()
        self._session: dict[str, Any] = {"commit": commit(), "date": today, "versions": versions(), "tasks": 0}
        if sessions and sessions[-1] | {"tasks": 0} == self._session:
            self._session = sessions.pop()
        sessions = [*sessions, self._session]
        self._provenance: dict[str, Any] = {
            "schema": SCHEMA,
            "version": 1,
            "facts": facts,
            "sessions": sessions,
            "empty": empty,
        }

    def add(self, task: str, took: float, rows: Iterable[Row]) -> None:
        lines = csv.writer(self._body, lineterminator="\n")
        rows = list(rows)
        if not rows:
            self._provenance["empty"] += [task]
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
        first = json.dumps(self._provenance)
        with atomic_file(self._path) as temporary:
            temporary.write_text(f"# {first}\n{head.getvalue()}{self._body.getvalue()}", encoding="utf-8")


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
    try:
        provenance = {"empty": []} | json.loads(first.removeprefix("# "))
        known = provenance["schema"] == SCHEMA and provenance["version"] == 1
        rows = pd.read_csv(io.StringIO(body), dtype=dict.fromkeys(_TEXT, str), keep_default_na=False, na_values=["nan"])
    except (ValueError, KeyError, TypeError) as error:
        raise StorageError(f"{name} is no table of jamlab chart --measure: {error}") from error
    if not known:
        raise StorageError(f"{name}: schema {provenance['schema']!r} {provenance['version']} is not known here")
    return MeasuredTable(rows, provenance)


def _text(value: Any) -> str:
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else str(value)
