"""Records of workers that died at a task, in the folder of a campaign, and what follows from them.

A record is the file `deaths/<task>.<kind>.<mark>`, which only one process can make: a mark (`marks.py`) is recorded
once. They count over all runs and shares until the task is finished, or run again with `--retry-failed`.

| kind        | the worker                                                     | the task fails after  |
|-------------|----------------------------------------------------------------|-----------------------|
| death       | died: killed, crashed, or out of memory                        | more than 5, see below|
| walltime    | died as its job ended, having had nearly all of it for the task| more than 1           |
| cut         | was told to end, or died as its job ended, after less          | more than 20          |
| interrupted | is gone with the program that ran the campaign                 | never                 |

Where workers are killed all the time, whatever they do, a long task may see more than five of them die. So such deaths
count only if they are more than chance gives: with the rate at which workers are killed at tasks that end after all,
and in the seconds that this one has run, so many would come less often than `_CHANCE`. Crashes always count.
"""

import json
import math
import os
import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from jamlab.campaign.marks import Mark, read_marks, remove
from jamlab.storage.atomic_file import is_gone, make_folder, remove_temporaries
from jamlab.storage.scratch_folder import remove_scratch_folders
from jamlab.storage.system_errors import using

DEATHS = "deaths"
DEATH, WALLTIME, CUT, INTERRUPTED = "death", "walltime", "cut", "interrupted"
MOST = {DEATH: 5, WALLTIME: 1, CUT: 20}  # times that a task survives
_CERTAIN = 30  # deaths after which a task fails, however many there are elsewhere
_CHANCE = 1e-4  # below which so many deaths are no chance
_CAUSES = 3  # that a failure names, the most frequent ones
_JOB_ENDS = 60.0  # s before the end of a job, or a tenth of it, from which on it may end its processes
_NEARLY_ALL = 0.9  # of a job: so much of it the next one cannot give much more of


def kind_of_end(mark: Mark, now: float) -> str:
    """Why the worker of a mark is gone; `now`: s since 1970."""
    if mark.crash:
        return DEATH
    if mark.job_ends is not None:
        length, had = mark.job_ends - mark.process_began, min(now, mark.job_ends) - mark.began
        if mark.was_told_to_end or now > mark.job_ends - min(_JOB_ENDS, length / 10):
            return WALLTIME if had >= _NEARLY_ALL * length else CUT
    return CUT if mark.was_told_to_end else DEATH


def record_death(folder: Path, task: str, kind: str, mark: Mark, cause: str = "") -> None:
    """Record the end of the worker of a mark, once, whoever does it; `cause`: what its engine says. The mark stays."""
    target = folder / DEATHS / f"{task}.{kind}.{mark.path.name}"
    length = mark.job_ends - mark.process_began if mark.job_ends is not None else None
    said = {"cause": ", ".join(filter(None, (cause, mark.crash))), "job": length, "seconds": lasted(mark)}
    said |= {"crashed": bool(mark.crash), "trace": mark.trace}
    make_folder(target.parent)
    with using(target), suppress(FileExistsError), open(target, "x", encoding="utf-8") as file:
        json.dump(said, file)


def is_recorded(folder: Path, mark: Mark) -> bool:
    """Whether the end of the worker of a mark is recorded."""
    return any(name.endswith(f".{mark.path.name}") for name in _names(folder))


def end_run(folder: Path, run: str) -> None:
    """Remove the marks that a run leaves at its orderly end, which are no fault of the tasks; a task that has had
    nearly all of the job that ends it is recorded."""
    now = time.time()
    for mark in read_marks(folder, lambda name: name.startswith(f"{run}.")):
        if mark.task is not None and kind_of_end(mark, now) == WALLTIME:
            record_death(folder, mark.task, WALLTIME, mark, "the end of its job")
        remove([mark.path])
        if is_gone(mark.host, mark.process):
            sweep(folder, mark)


def sweep(folder: Path, mark: Mark) -> None:
    """Remove what the dead worker of a mark was writing."""
    for part in ("tasks", "failed"):
        remove_temporaries(folder / part, mark.host, mark.process)
    if is_gone(mark.host, mark.process):  # on this machine
        remove_scratch_folders(mark.process)


def lasted(mark: Mark) -> float:
    """Seconds from when the task of a mark began until now, where its worker is found dead; 0 if it is not known."""
    return max(0.0, time.time() - mark.began) if math.isfinite(mark.began) else 0.0


class Kills:
    """How often workers are killed in a run, whatever they do: those of tasks that ended after all. Tasks that never
    end tell nothing about the others."""

    def __init__(self) -> None:
        self._of: dict[str, list[float]] = {}  # task that has not ended -> seconds of each attempt that was killed
        self._seconds, self._times = 0.0, 0

    def kill(self, task: str, mark: Mark) -> None:
        """Add a worker that died at a task."""
        self._of.setdefault(task, []).append(lasted(mark))

    def of(self, task: str) -> int:
        """How many workers died at a task that has not ended."""
        return len(self._of.get(task, ()))

    def end(self, task: Callable[[], str], seconds: float) -> None:
        """Take note of the end of a task, after so many seconds; nan if it never ended in order."""
        lost = self._of.pop(task(), []) if self._of else []
        if math.isfinite(seconds):
            self._seconds += seconds + sum(lost)
            self._times += len(lost)

    @property
    def rate(self) -> float:
        """Workers killed per second of work."""
        return self._times / self._seconds if self._seconds else 0.0


def why_it_fails(folder: Path, task: str, rate: float = math.inf) -> str | None:
    """Why a task is to fail by its records; None if it may run again. `rate`, 1/s: at which workers are killed that
    do other tasks, inf if it is not known."""
    records = [name for name in _names(folder) if name.startswith(f"{task}.")]
    for kind, most in MOST.items():
        of_kind = [_said(folder / DEATHS / name) for name in records if _parse(name)[1] == kind]
        if len(of_kind) > most and not (kind == DEATH and _is_chance(of_kind, rate)):
            return _describe(kind, of_kind)
    return None


def _is_chance(records: Sequence[dict[str, Any]], rate: float) -> bool:
    """Whether workers may have died so often because many do."""
    killed = [record for record in records if not record.get("crashed")]
    if len(records) > _CERTAIN or len(records) - len(killed) > MOST[DEATH]:
        return False
    if not math.isfinite(rate):
        return True
    expected = rate * sum(float(record.get("seconds", 0.0)) for record in killed)
    return expected > 0 and _tail(len(killed), expected) > _CHANCE


def _tail(count: int, mean: float) -> float:
    """Probability of so many events or more, of the distribution of Poisson."""
    return 1 - sum(math.exp(k * math.log(mean) - mean - math.lgamma(k + 1)) for k in range(count))


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
            with using(folder / DEATHS / name):
                (folder / DEATHS / name).unlink(missing_ok=True)


def _names(folder: Path) -> list[str]:
    with using(folder / DEATHS):
        try:
            return sorted(name for name in os.listdir(folder / DEATHS) if name.count(".") > 1)
        except FileNotFoundError:
            return []


def _parse(name: str) -> tuple[str, str]:
    task, kind, _ = name.split(".", 2)
    return task, kind


def _said(path: Path) -> dict[str, Any]:
    """Content of a record; {} if it is damaged."""
    with suppress(OSError, ValueError):
        said = json.loads(path.read_bytes())
        if isinstance(said, dict):
            return said
    return {}


def _describe(kind: str, records: list[dict[str, Any]]) -> str:
    """Say how often the workers of a task ended, and how."""
    causes = Counter(str(record.get("cause") or "an unknown cause") for record in records)
    how = f"{len(records)} times, by {next(iter(causes))}"
    if len(causes) > 1:
        each = [(f"{count} times" if count > 1 else "once", cause) for cause, count in causes.most_common(_CAUSES)]
        how = f"{len(records)} times, of which " + ", ".join(f"{times} by {cause}" for times, cause in each)
    if kind == WALLTIME:
        jobs = [job for record in records if isinstance(job := record.get("job"), float)]
        length = f" ({max(jobs):.0f} s)" if jobs else ""
        return f"it takes longer than the walltime{length}: its worker ended with its job {how}"
    if kind == CUT:
        return f"its worker was told to end {how}: give jobs more time, or the task less to do"
    return f"its worker died {how}; tasks that crash, or need more memory than there is, end so"
