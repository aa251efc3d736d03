"""Records of workers that died at a task, in the folder of a campaign, and what follows from them.

A record is the file `deaths/<task>.<kind>.<mark>`, which only one process can make: a mark (`marks.py`) is recorded
once. They count over all runs and shares until the task is finished, or run again with `--retry-failed`.

| kind        | the worker                                                     | the task fails after  |
|-------------|----------------------------------------------------------------|-----------------------|
| death       | died: killed, crashed, or out of memory                        | more than 5           |
| walltime    | died as its job ended, having had nearly all of it for the task| more than 1           |
| cut         | was told to end, or died as its job ended, after less          | more than 20          |
| interrupted | is gone with the program that ran the campaign                 | never                 |
"""

import json
import os
import time
from collections import Counter
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from jamlab.campaign.marks import Mark, read_marks, remove, writing
from jamlab.storage.atomic_file import make_folder

DEATHS = "deaths"
DEATH, WALLTIME, CUT, INTERRUPTED = "death", "walltime", "cut", "interrupted"
MOST = {DEATH: 5, WALLTIME: 1, CUT: 20}  # times that a task survives; some workers are killed by chance
_JOB_ENDS = 60.0  # s before the end of a job from which on it ends its processes
_NEARLY_ALL = 0.9  # of a job: so much of it the next one cannot give much more of


def kind_of(mark: Mark, now: float) -> str:
    """Why the worker of a mark is gone; `now`: s since 1970."""
    if mark.crash:
        return DEATH
    if mark.job_ends is not None and now > mark.job_ends - _JOB_ENDS:
        had = min(now, mark.job_ends) - mark.began
        return WALLTIME if had >= _NEARLY_ALL * (mark.job_ends - mark.process_began) else CUT
    return CUT if mark.was_told_to_end else DEATH


def record(folder: Path, task: str, kind: str, mark: Mark, cause: str = "") -> None:
    """Record the end of the worker of a mark, once, whoever does it; `cause`: what its engine says. The mark stays."""
    target = folder / DEATHS / f"{task}.{kind}.{mark.path.name}"
    length = mark.job_ends - mark.process_began if mark.job_ends is not None else None
    said = {"cause": ", ".join(filter(None, (cause, mark.crash))), "job": length, "trace": mark.trace}
    make_folder(target.parent)
    with writing(target), suppress(FileExistsError), open(target, "x", encoding="utf-8") as file:
        json.dump(said, file)


def is_recorded(folder: Path, mark: Mark) -> bool:
    """Whether the end of the worker of a mark is recorded."""
    return any(name.endswith(f".{mark.path.name}") for name in _names(folder))


def end_run(folder: Path, run: str) -> None:
    """Remove the marks that a run leaves at its orderly end, which are no fault of the tasks; a task that has had
    nearly all of the job that ends it is recorded."""
    now = time.time()
    for mark in read_marks(folder, lambda name: name.startswith(f"{run}.")):
        if mark.task is not None and kind_of(mark, now) == WALLTIME:
            record(folder, mark.task, WALLTIME, mark, "the end of its job")
        remove([mark.path])


def why_it_fails(folder: Path, task: str) -> str | None:
    """Why a task is to fail by its records; None if it may run again."""
    records = [name for name in _names(folder) if name.startswith(f"{task}.")]
    for kind, most in MOST.items():
        of_kind = [name for name in records if _parse(name)[1] == kind]
        if len(of_kind) > most:
            return _describe(kind, [_said(folder / DEATHS / name) for name in of_kind])
    return None


def counts(folder: Path) -> dict[str, Counter[str]]:
    """Number of records of each task, by kind."""
    found: dict[str, Counter[str]] = {}
    for name in _names(folder):
        task, kind = _parse(name)
        found.setdefault(task, Counter())[kind] += 1
    return found


def forget_deaths(folder: Path, tasks: Iterable[str]) -> None:
    """Delete the records of tasks."""
    wanted = set(tasks)
    for name in _names(folder) if wanted else ():
        if _parse(name)[0] in wanted:
            with writing(folder / DEATHS / name):
                (folder / DEATHS / name).unlink(missing_ok=True)


def _names(folder: Path) -> list[str]:
    with writing(folder / DEATHS):
        try:
            return sorted(name for name in os.listdir(folder / DEATHS) if name.count(".") > 1)
        except FileNotFoundError:
            return []


def _parse(name: str) -> tuple[str, str]:
    task, kind, _ = name.split(".", 2)
    return task, kind


def _said(path: Path) -> dict[str, object]:
    """Content of a record; {} if it is damaged."""
    with suppress(OSError, ValueError):
        said = json.loads(path.read_bytes())
        if isinstance(said, dict):
            return said
    return {}


def _describe(kind: str, records: list[dict[str, object]]) -> str:
    """Say how often the workers of a task ended, and how."""
    causes = Counter(str(record.get("cause") or "an unknown cause") for record in records)
    how = f"{len(records)} times, by {next(iter(causes))}"
    if len(causes) > 1:
        how = ", ".join(f"{count} times by {cause}" for cause, count in causes.most_common())
    if kind == WALLTIME:
        jobs = [job for record in records if isinstance(job := record.get("job"), float)]
        length = f" ({max(jobs):.0f} s)" if jobs else ""
        return f"it takes longer than the walltime{length}: its worker ended with its job {how}"
    if kind == CUT:
        return f"its worker was told to end {how}: give jobs more time, or the task less to do"
    return f"its worker died {how}; tasks that crash, or need more memory than there is, end so"
