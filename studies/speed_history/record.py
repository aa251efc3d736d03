"""A record is what fixed work cost at one commit: one JSON file, measured in processes of their own."""

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from jamlab.errors import InputError, StorageError
from jamlab.processes.progress import Progress, told
from jamlab.storage.atomic_file import atomic_file, make_folder
from studies.speed_history import works
from studies.tables import one_core

# Records are small (6 kB), text, and hold ratios to plain work of the same process: those of other machines compare
RECORDS = Path(__file__).with_name("records")
PROCESSES = 3  # memory is laid out anew in each, which moves times by some per cent
PROGRAM = Path(works.__file__)


@dataclass(frozen=True)
class Record:
    """What fixed work cost at one commit."""

    commit: str  # short name
    committed: str  # date of the commit, ISO 8601
    measured: str  # date of the measurement
    machine: str  # processor, as the system names it
    python: str
    numpy: str
    works: dict[str, dict[str, list[Any]]]  # name -> ratios to plain work, one list a process; seconds; found

    @property
    def name(self) -> str:
        """Name of its file."""
        return f"{self.commit}.json"

    @property
    def when(self) -> datetime:
        """Time of the commit."""
        return datetime.fromisoformat(self.committed)


def commit_of(folder: Path, *, needed: bool = True) -> tuple[str, str]:
    """Short name and date of the commit of a checkout; `-dirty` after a name if files differ from it. `needed`: refuse
    what is no checkout, which else is "no commit" of the present."""
    asked = ["describe", "--always", "--dirty", "--exclude", "*"], ["log", "-1", "--format=%cI"]
    found = [
        subprocess.run(["git", *words], cwd=folder, capture_output=True, text=True, check=False) for words in asked
    ]
    if any(one.returncode for one in found):
        if not needed:
            return "no commit", datetime.now(UTC).isoformat()
        raise InputError(f"{folder} is no checkout of jamlab: install jamlab with `pip install -e .` in a clone")
    return found[0].stdout.strip(), found[1].stdout.strip()


def measure_record(
    python: str = sys.executable,
    processes: int = PROCESSES,
    repeats: int = works.REPEATS,
    only: Sequence[str] = (),
    progress: Progress | None = None,
) -> Record:
    """Measure all works, or those that are named, with the jamlab of a Python."""
    runs: list[dict[str, Any]] = []
    for count in range(processes):
        told(progress)(count / processes, f"process {count + 1} of {processes}")
        words = [python, "-P", "-W", "ignore", str(PROGRAM), str(repeats), *only]
        with one_core():
            done = subprocess.run(words, capture_output=True, text=True, env=os.environ | {"OMP_NUM_THREADS": "1"})
        if done.returncode:
            raise InputError(f"{python} cannot run {PROGRAM.name}: {done.stderr.strip().splitlines()[-1]}")
        runs.append(json.loads(done.stdout.splitlines()[-1]))
    commit, committed = commit_of(Path(runs[0]["jamlab"]), needed=not only)
    today = datetime.now(UTC).date().isoformat()
    return Record(commit, committed, today, processor(), runs[0]["python"], runs[0]["numpy"], _merged(runs))


def _merged(runs: Sequence[dict[str, Any]]) -> dict[str, dict[str, list[Any]]]:
    """What processes found of each work, with five digits; `found` is what the first one found."""
    merged: dict[str, dict[str, list[Any]]] = {}
    for name in runs[0]["works"]:
        each = [run["works"][name] for run in runs]
        ratios = [[float(f"{ratio:.5g}") for ratio in one["ratios"]] for one in each]
        seconds = [float(f"{min(one['seconds']):.4g}") for one in each]
        merged[name] = {"ratios": ratios, "seconds": seconds, "found": [each[0]["found"]]}
    return merged


def processor() -> str:
    """Name of the processor, as the system gives it."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), sys.platform)


def write_record(record: Record, folder: Path = RECORDS) -> Path:
    """Write a record as JSON, one work a line."""
    make_folder(folder)
    head = {name: value for name, value in asdict(record).items() if name != "works"}
    rows = ",\n".join(f"  {json.dumps(name)}: {json.dumps(row)}" for name, row in record.works.items())
    with atomic_file(folder / record.name) as path:
        path.write_text(f'{json.dumps(head)[:-1]}, "works": {{\n{rows}\n}}}}\n', encoding="utf-8")
    return folder / record.name


def read_records(folder: Path = RECORDS) -> list[Record]:
    """Read all records of a folder."""
    found = []
    for path in sorted(folder.glob("*.json")):
        try:
            found.append(Record(**json.loads(path.read_text(encoding="utf-8"))))
        except (OSError, ValueError, TypeError) as error:
            raise StorageError(f"{path} is no record ({error}): remove it, or measure it again") from error
    return found
