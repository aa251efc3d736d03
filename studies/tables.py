"""Tables are CSV files, or Parquet where they are large, in one folder; its manifest says where each comes from."""

import hashlib
import io
import os
import subprocess
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import pandas as pd
from threadpoolctl import threadpool_limits

from jamlab.errors import StorageError
from jamlab.processes.progress import Progress, told
from jamlab.storage.atomic_file import atomic_file, make_folder

DATA = Path(__file__).parent / "data"  # what the studies ship
MANIFEST = "MANIFEST.csv"  # of a folder: file, rows, sha256, commit, date
_TEXT = ("task", "setting", "note")  # columns that are words even where all of them look like numbers

Result = TypeVar("Result")
Row = Mapping[str, Any]
Task = Callable[[], Iterable[Row]]


class AbsentTableError(StorageError):
    """A table that a folder does not have: another may serve in its place, which none may for a damaged one."""


def read_table(folder: Path, name: str) -> pd.DataFrame:
    """Read a table of a folder, without the rows of tasks that gave none; checked against the manifest."""
    path = next((path for end in ("csv", "parquet") if (path := folder / f"{name}.{end}").is_file()), None)
    if path is None:
        raise AbsentTableError(f"{folder} holds no table {name!r}: run the study or campaign that measures it")
    try:
        data = path.read_bytes()
        known = read_manifest(folder).get(path.name)
        if known and known["sha256"] != hashlib.sha256(data).hexdigest():
            raise ValueError(f"it is not the file of {known['date']} that {MANIFEST} names")
        if path.suffix == ".parquet":
            return pd.read_parquet(io.BytesIO(data))
        cells = pd.read_csv(io.BytesIO(data), dtype=str)
        measured = cells.drop(columns=["task", "took"], errors="ignore").notna().any(axis=1)
        table = pd.read_csv(io.StringIO(cells[measured].to_csv(index=False)), dtype=dict.fromkeys(_TEXT, str))
    except (OSError, ValueError) as error:
        raise StorageError(f"{path} cannot be read ({error}): restore it, or measure it again") from error
    return table.fillna(dict.fromkeys({*_TEXT} & {*table}, ""))


def read_manifest(folder: Path) -> dict[str, dict[str, str]]:
    """Read what is known of the files of a folder, by name; nothing without a manifest."""
    path = folder / MANIFEST
    return pd.read_csv(path, dtype=str, index_col="file").to_dict("index") if path.is_file() else {}  # type: ignore[return-value]


def write_table(folder: Path, name: str, table: pd.DataFrame, commits: str = "", *, kind: str = "csv") -> Path:
    """Write a table as CSV or Parquet, and its row of the manifest; `commits`: default, of this checkout."""
    path = folder / f"{name}.{kind}"
    with atomic_file(path) as temporary:
        if kind == "csv":
            table.to_csv(temporary, index=False, lineterminator="\n")
        else:
            floats = list(table.select_dtypes("float"))
            whole = [column for column in table if column not in floats]
            how: dict[str, Any] = {"compression_level": 19, "use_dictionary": whole}
            how["column_encoding"] = dict.fromkeys(floats, "BYTE_STREAM_SPLIT")
            table.to_parquet(temporary, index=False, compression="zstd", **how)
    known = read_manifest(folder)
    before = known.get(path.name, {}).get("commit", "") if not commits else ""
    names = " ".join(dict.fromkeys([*before.split(), *(commits or commit()).split()]))
    sha, date = hashlib.sha256(path.read_bytes()).hexdigest(), datetime.now(UTC).date().isoformat()
    known[path.name] = {"rows": str(len(table)), "sha256": sha, "commit": names, "date": date}
    write_manifest(folder, known)
    return path


def write_manifest(folder: Path, known: Mapping[str, Mapping[str, str]]) -> None:
    """Write what is known of the files of a folder, by name."""
    with atomic_file(folder / MANIFEST) as temporary:
        pd.DataFrame.from_dict(dict(known), orient="index").sort_index().to_csv(temporary, index_label="file")


def forget(folder: Path, name: str) -> None:
    """Remove a table and its row of the manifest, so that all of it is measured anew; nothing if there is none."""
    path = folder / f"{name}.csv"
    path.unlink(missing_ok=True)
    known = read_manifest(folder)
    if known.pop(path.name, None):
        write_manifest(folder, known)


def measure(folder: Path, name: str, tasks: Mapping[str, Task], progress: Progress | None = None) -> Path:
    """Do the tasks whose rows a table does not hold, each on one core, and add their rows as soon as it is done.

    Columns before the rows' own: `task`, its name; `took`, its CPU seconds with what it had to prepare. Numbers
    have six digits. A task without rows leaves a row with these two alone.
    """
    make_folder(folder)
    path = folder / f"{name}.csv"
    text: dict[str, Any] = {"dtype": str, "keep_default_na": False}
    table = pd.read_csv(path, **text) if path.exists() else pd.DataFrame({"task": [], "took": []}, dtype=str)
    done = set(table["task"])
    for count, (task, run) in enumerate(tasks.items()):
        if task in done:
            continue
        told(progress)(count / len(tasks), f"{name}: task {count + 1} of {len(tasks)}")
        began = sum(os.times()[:4])  # of this process and of its children
        with one_core():
            rows = [{"task": task, "took": 0.0, **row} for row in run()] or [{"task": task, "took": 0.0}]
        new = pd.DataFrame(rows).assign(took=sum(os.times()[:4]) - began)
        new = new.apply(lambda column: column.map(lambda v: " ".join(v.splitlines()) if isinstance(v, str) else v))
        cells = pd.read_csv(io.StringIO(new.to_csv(index=False, float_format="%.6g")), **text)
        table = pd.concat([table, cells], ignore_index=True).fillna("")
        write_table(folder, name, table)
    return path


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


@cache
def commit() -> str:
    """Short name of the commit that the process began with, `-dirty` if files differ from it; "unknown" without git."""
    words = ["git", "describe", "--always", "--dirty", "--exclude", "*"]
    try:
        done = subprocess.run(words, cwd=Path(__file__).parent, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return done.stdout.strip()
