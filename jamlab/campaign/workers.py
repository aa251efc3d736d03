"""Run tasks side by side in processes of this machine, one task each at a time.

Every worker is a separate process, because neither LAMMPS nor its MPI can run several tasks in threads. Workers are
connected by pipes, so that nobody else can reach them, and end when the driver dies (`jamlab.processes.child`).
"""

import errno
import itertools
import signal
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from jamlab.campaign.folder import CampaignFolder
from jamlab.campaign.observable import TableColumns, load_function, measure_own
from jamlab.campaign.states import make_states, read_stored
from jamlab.campaign.tables import STATE_COLUMNS
from jamlab.campaign.task_file import TaskContent, describe_gaps
from jamlab.campaign.tasks import Task, states_name
from jamlab.errors import EngineError, InputError, StorageError
from jamlab.measure import numbers_of
from jamlab.processes.cores import available_cores, cores_given
from jamlab.processes.side_by_side import crew
from jamlab.storage.atomic_file import check_target


def count_workers(wanted: int | None, ranks: int) -> int:
    """Number of workers whose tasks have so many threads; by default as many as the cores of this process hold."""
    if wanted is not None:
        return wanted
    if ranks > (cores := available_cores()):
        raise InputError(f"ranks = {ranks}: this process may use {cores} cores: lower ranks, or give --workers")
    return cores // ranks


def _carry(arguments: tuple[Any, ...], report: Callable[..., None]) -> "Outcome":
    """Run a task in a worker, after the driver has heard that the worker is up."""
    report()
    return run_task(*arguments)


FINISHED, FAILED, FULL = "finished", "failed", "full"
_NO_SPACE = (errno.ENOSPC, errno.EDQUOT)


@dataclass(frozen=True)
class Deaths:
    """How many workers may die before a campaign stops."""

    most: int = 5  # workers that may be killed during one task before it counts as the cause
    early: int = 12  # in a row and per worker, before they have begun anything: they cannot start at all
    per_worker: int = 2  # one that runs and one that waits, so that no worker waits for the driver


DEATHS = Deaths()


class Outcome(NamedTuple):
    """How a task ended. `state`: "finished", "failed" (the reason is in `failed/`) or "full" (the folder cannot be
    written, so no task can run); `line`: the task, and what went wrong, as text to show; `seconds`: wall time, nan if
    the workers died; `gaps`: the states that a finished task lacks, and why, "" if none."""

    state: str
    line: str
    seconds: float
    gaps: str = ""


def run_task(folder: str, task: Task, stored: Sequence[str] = (), modules: Sequence[str] = ()) -> Outcome:
    """Run a task unless its file exists, with the packings of one of the finished tasks `stored`; `modules` are folders
    with modules of the user's own observables."""
    began = time.perf_counter()

    def end(state: str, line: str, gaps: str = "") -> Outcome:
        return Outcome(state, line, time.perf_counter() - began, gaps)

    place, label = CampaignFolder(Path(folder)), task.parameters.label
    file = place.task_file(task.name)
    gaps = ""
    try:
        if not file.exists():
            check_target(file)  # before the work, not after
            with threadpool_limits(1), cores_given(task.ranks):  # one core a rank: LAMMPS, BLAS and PARDISO alike
                missing = _make_file(place, task, began, stored, modules)
            gaps = describe_gaps(task.parameters, missing)
        return end(FINISHED, label, gaps)
    except StorageError as error:
        return end(FULL, str(error))
    except Exception as error:  # whatever it is, it belongs to this task alone and must not stop the others
        if isinstance(error, OSError) and error.errno in _NO_SPACE:
            return end(FULL, f"no space for {label}: {error}; make room")
        try:
            place.record_failure(task, error)
        except StorageError as full:
            return end(FULL, str(full))
        return end(FAILED, f"{label}: {error}")


def _make_file(
    folder: CampaignFolder, task: Task, began: float, stored: Sequence[str], modules: Sequence[str]
) -> list[dict[str, str]]:
    """Write the file of a task; return which states it lacks."""
    parameters = task.parameters
    functions = {name: load_function(name, modules) for name in parameters.own}
    measured, tables, before = {}, {}, 0.0
    if found := read_stored(folder, stored, parameters):
        file, states = found
        measured, tables, before = file.observables, file.tables, file.seconds
    else:
        states = make_states(parameters, task.ranks)
    measured = measured or numbers_of(states.packings)
    count = len(states.packings)
    known: TableColumns = {name: measured[name] for name in ("rho", "phi", "pressure")}
    known |= {"state": np.arange(count), "target_pressure": np.array(states.target_pressures)}
    known["onset"] = np.full(count, measured["rho"][0] if parameters.from_onset else np.nan)
    for name, wanted in parameters.observables.items():
        if name not in tables:
            tables[name] = wanted.measure(states, known)
    taken = {*STATE_COLUMNS, *(column for name in functions if name in tables for column in tables[name])}
    for name in functions:
        if name not in tables:
            tables[name] = measure_own(name, functions[name], states.packings, taken)
            taken |= tables[name].keys()
    seconds = before + time.perf_counter() - began
    folder.keep([TaskContent(task, states, measured, tables, seconds)])
    return states.missing


class _Dead:
    """Workers that died: of each task, and in a row before they had begun anything."""

    def __init__(self, most_early: int) -> None:
        self.of: Counter[str] = Counter()
        self._begun: set[str] = set()
        self._early, self._most_early = 0, most_early

    def begin(self, name: str) -> None:
        """Note that a worker has begun a task."""
        self._begun.add(name)
        self._early = 0

    def runs_again(self, name: str, code: int) -> bool:
        """Count the death of the worker of a task; whether the task runs again."""
        if name not in self._begun:
            self._early += 1
            if self._early > self._most_early:
                raise EngineError(f"workers die as soon as they start, the last with exit code {code}: see stderr")
            return True
        self._begun.discard(name)
        self.of[name] += 1
        return code < 0 and self.of[name] <= DEATHS.most


def _how(code: int, times: int) -> str:
    """In which way a process died so many times."""
    if code < 0:
        return f"{times} times, by signal {-code} ({signal.strsignal(-code)}): killed, out of memory, or crashed"
    return f"with exit code {code}: a called function exited"


def drive(
    folder: CampaignFolder,
    tasks: Iterator[Task],
    count: int,
    stored: dict[str, list[str]],
    modules: Sequence[str],
    tell: Callable[[Outcome], None],
) -> None:
    """Run tasks in so many workers, and tell each outcome; the folder is locked. `stored`: finished tasks by what their
    names share. A worker that dies is replaced, and its task runs again."""
    place = str(folder.path.resolve())
    under_way: dict[str, Task] = {}
    deaths = _Dead(DEATHS.early * count)
    with crew(_carry, count) as children:

        def fill() -> None:
            for task in itertools.islice(tasks, max(0, DEATHS.per_worker * count - len(under_way))):
                under_way[task.name] = task
                children.submit(task.name, (place, task, stored.get(states_name(task.name), ()), modules))

        fill()
        while under_way:
            name, kind, content = children.wait()
            if kind == "report":
                deaths.begin(name)
                continue
            if kind == "error":
                raise EngineError(f"workers cannot run a task: {content}") from content
            task, outcome = under_way[name], content
            if kind == "death":
                code = content.code
                if deaths.runs_again(name, code):
                    children.submit(name, content.item, first=True)
                    continue
                said = f"{task.parameters.label}: its worker died {_how(code, deaths.of[name])}"
                folder.record_failure(task, EngineError(said))
                outcome = Outcome(FAILED, said, float("nan"))
            if outcome.state == FULL:
                raise StorageError(f"{outcome.line}; then `jamlab campaign resume` runs the remaining tasks")
            if outcome.state == FINISHED:
                stored.setdefault(states_name(name), []).append(name)
            del under_way[name]
            tell(outcome)
            fill()
