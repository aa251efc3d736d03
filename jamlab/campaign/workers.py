"""Run tasks side by side in processes of this machine, one task each at a time.

Every worker is a separate process, because neither LAMMPS nor its MPI can run several tasks in threads. Workers are
connected by pipes, so that nobody else can reach them, and end when the driver dies (`jamlab.processes.child`).
"""

import errno
import itertools
import os
import time
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Self

from threadpoolctl import threadpool_limits

from jamlab.campaign.file import STATES
from jamlab.campaign.folder import CampaignFolder, write_task_file
from jamlab.campaign.observable import load_function, measure_own, stack
from jamlab.campaign.plan import wanted_batches
from jamlab.campaign.states import StoredStates, make_states, read_stored, shared_tables
from jamlab.campaign.tables import STATE_COLUMNS
from jamlab.campaign.tasks import Batch, Task
from jamlab.errors import EngineError, InputError, StorageError
from jamlab.measure import measure
from jamlab.packing.quantities import COLUMNS
from jamlab.processes.cores import available_cores, cores_given
from jamlab.processes.side_by_side import Children
from jamlab.storage.atomic_file import check_target

_MOST_DEATHS = 5  # workers that may die during one task before it counts as the cause: some are killed otherwise
_EARLY_DEATHS = 12  # in a row and per worker, before they have begun anything: they cannot start at all


def count_workers(wanted: int | None, ranks: int) -> int:
    """Number of workers whose tasks have so many threads; by default as many as the cores of this process hold."""
    if wanted is not None:
        return wanted
    if ranks > (cores := available_cores()):
        raise InputError(f"ranks = {ranks}: this process may use {cores} cores: lower ranks, or give --workers")
    return cores // ranks


class Crew:
    """Workers; one that dies is replaced, and its task runs again."""

    def __init__(self, count: int) -> None:
        self.width = count
        self._children = Children(_carry, count)
        self._begun: set[str] = set()
        self._deaths: Counter[str] = Counter()
        self._early = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._children.__exit__(*error)

    def submit(self, name: str, arguments: tuple[Any, ...]) -> None:
        """Have a task run by the next worker that is free, with these arguments of `run_task`."""
        self._children.submit(name, arguments)

    def wait(self) -> "tuple[str, Outcome | None]":
        """Wait for the next task that ends; its name and outcome, None if its workers died again and again."""
        while True:
            name, kind, content = self._children.wait()
            if kind == "result":
                return name, content
            if kind == "error":
                raise EngineError(f"workers cannot run a task: {content}") from content
            if kind == "report":
                self._begun.add(name)
                self._early = 0
                continue
            arguments, code = content
            if name in self._begun:
                self._deaths[name] += 1
                if self._deaths[name] > _MOST_DEATHS:
                    return name, None
            else:
                self._early += 1
                if self._early > _EARLY_DEATHS * self.width:
                    raise EngineError(f"workers die as soon as they start, the last with exit code {code}: see stderr")
            self._begun.discard(name)
            self._children.submit(name, arguments, first=True)


def _carry(arguments: tuple[Any, ...], report: Callable[..., None]) -> "Outcome":
    """Run a task in a worker, after the driver has heard that the worker is up."""
    report()
    return run_task(*arguments)


FINISHED, FAILED, FULL = "finished", "failed", "full"
_NO_SPACE = (errno.ENOSPC, errno.EDQUOT)
_PER_WORKER = 2  # one that runs and one that waits, so that no worker waits for the driver


class Outcome(NamedTuple):
    """How a task ended. `state`: "finished", "failed" (the reason is in `failed/`) or "full" (the folder cannot be
    written, so no task can run); `line`: the task, and what went wrong, as text to show; `seconds`: wall time, nan if
    the workers died."""

    state: str
    line: str
    seconds: float


def run_task(folder: str, task: Task, source: str | None = None, modules: Sequence[str] = ()) -> Outcome:
    """Run a task unless its file exists, with the states of a finished task `source`; `modules` are folders with
    modules of the user's own observables."""
    began, used = time.perf_counter(), cpu_seconds()

    def end(state: str, line: str) -> Outcome:
        return Outcome(state, line, time.perf_counter() - began)

    place, label = CampaignFolder(Path(folder)), task.parameters.label
    file = place.task_file(task.name)
    try:
        if not file.exists():
            check_target(file)  # before the work, not after
            with threadpool_limits(1), cores_given(task.ranks):  # one core a rank: LAMMPS, BLAS and PARDISO alike
                _make_file(place, task, (began, used), source, modules)
        return end(FINISHED, label)
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


def cpu_seconds() -> float:
    """CPU time of this process and of the ranks it waited for."""
    return sum(os.times()[:4])


def _make_file(
    folder: CampaignFolder, task: Task, began: tuple[float, float], source: str | None, modules: Sequence[str]
) -> None:
    functions = {name: load_function(name, modules) for name in task.parameters.own}
    stored = read_stored(folder, source) if source is not None else None
    if stored is None:
        states, known, before = make_states(task.parameters, task.ranks), {}, (0.0, 0.0)
        measured = measure(states.packings)
    else:
        file, states = stored
        shared = shared_tables(task.parameters, file.parameters)
        known = {name: columns for name, columns in file.tables.items() if name in shared}
        before = file.seconds, file.cpu_seconds
        whole = STATES in shared and file.observables.keys() >= set(COLUMNS)  # else a jamlab before measured less
        measured = file.observables if whole else measure(states.packings)
    tables = dict(known)
    for wanted in task.parameters.tables:
        if wanted.name not in known:
            rows = wanted.measure(states, measured["pressure"], task.parameters.tolerances)
            tables[wanted.name] = stack(wanted.stored, rows)
    taken = {*STATE_COLUMNS, *(column for name in known.keys() & functions.keys() for column in known[name])}
    for name in sorted(functions.keys() - known.keys()):
        tables[name] = measure_own(name, functions[name], states.packings, taken)
        taken |= tables[name].keys()
    wall, cpu = before[0] + time.perf_counter() - began[0], before[1] + cpu_seconds() - began[1]
    write_task_file(folder.task_file(task.name), task, states, measured, tables, seconds=wall, cpu_seconds=cpu)


def remaining_tasks(batches: Iterable[Batch], skip: set[str]) -> Iterator[Task]:
    """Yield the tasks whose names are not in `skip`, each once."""
    seen = set(skip)
    for batch in batches:
        for task in batch.tasks():
            if task.name not in seen:
                seen.add(task.name)
                yield task


def drive(
    crew: Crew,
    folder: CampaignFolder,
    chosen: list[Batch],
    mine: Collection[str],
    stored: StoredStates,
    modules: Sequence[str],
    tell: Callable[[Outcome], None],
) -> None:
    """Run the remaining tasks of some batches that this process has to run, `mine`, then the seeds that `until` adds,
    and tell each outcome; the folder is locked."""
    place = str(folder.path.resolve())
    under_way: dict[str, Task] = {}

    def fill(tasks: Iterator[Task]) -> None:
        for task in itertools.islice(tasks, max(0, _PER_WORKER * crew.width - len(under_way))):
            under_way[task.name] = task
            source = stored.source(task.parameters)
            crew.submit(task.name, (place, task, source and source.name, modules))

    before: list[Batch] = []
    while (wanted := wanted_batches(chosen, folder)) != before:
        before, ended = wanted, folder.finished() | folder.failed()
        tasks = (task for task in remaining_tasks(wanted, ended) if task.name in mine)
        fill(tasks)
        while under_way:
            name, outcome = crew.wait()
            task = under_way.pop(name)
            if outcome is None:
                reason = EngineError(
                    f"{task.parameters.label}: its workers died again and again: killed, or out of memory"
                )
                folder.record_failure(task, reason)
                outcome = Outcome(FAILED, str(reason), float("nan"))
            if outcome.state == FULL:
                raise StorageError(f"{outcome.line}; then `jamlab campaign resume` runs the remaining tasks")
            if outcome.state == FINISHED:
                stored.add(task)
            tell(outcome)
            fill(tasks)
