"""Feed tasks to workers, a bounded number at a time; a worker carries a task from its parameters to its file.

Whatever dies, the files in the folder are whole.
"""

import errno
import hashlib
import itertools
import os
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from threadpoolctl import threadpool_limits

from jamlab.campaign.file import STATES
from jamlab.campaign.folder import CampaignFolder, write_task_file
from jamlab.campaign.observable import load_function, measure_own, stack
from jamlab.campaign.plan import wanted_batches
from jamlab.campaign.states import StoredStates, make_states, read_stored, shared_tables
from jamlab.campaign.tables import STATE_COLUMNS
from jamlab.campaign.tasks import Batch, Task
from jamlab.campaign.workers import Crew
from jamlab.errors import EngineError, StorageError
from jamlab.measure import measure_all
from jamlab.packing.quantities import COLUMNS
from jamlab.processes.cores import cores_given
from jamlab.storage.atomic_file import check_target

FINISHED, FAILED, FULL = "finished", "failed", "full"
_NO_SPACE = (errno.ENOSPC, errno.EDQUOT)
_PER_WORKER = 2  # one that runs and one that waits, so that no worker waits for the driver


class Outcome(NamedTuple):
    """How a task ended. `state`: "finished", "failed" (the reason is in `failed/`) or "full" (the folder cannot be
    written, so no task can go on); `line`: the task, and what went wrong, as text to show; `seconds`: wall time, nan if
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
            place.check_target(file)  # before the work, not after
            check_target(file)
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
        measured = measure_all(states.packings)
    else:
        file, states = stored
        shared = shared_tables(task.parameters, file.parameters)
        known = {name: columns for name, columns in file.tables.items() if name in shared}
        before = file.seconds, file.cpu_seconds
        whole = STATES in shared and file.observables.keys() >= set(COLUMNS)  # else a jamlab before measured less
        measured = file.observables if whole else measure_all(states.packings)
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
    stored: StoredStates,
    modules: Sequence[str],
    tell: Callable[[Outcome], None],
) -> None:
    """Run what is left of some batches, then the seeds that `until` adds, and tell each outcome; the folder is
    locked."""
    place = str(folder.path.resolve())
    under_way: dict[str, Task] = {}

    def fill(tasks: Iterator[Task]) -> None:
        for task in itertools.islice(tasks, max(0, _PER_WORKER * crew.width - len(under_way))):
            key = task_key(folder, task)
            under_way[key] = task
            source = stored.source(task.parameters)
            crew.submit(key, (run_task, place, task, source and source.name, modules))

    before: list[Batch] = []
    while (wanted := wanted_batches(chosen, folder)) != before:
        before, tasks = wanted, remaining_tasks(wanted, folder.finished() | folder.failed())
        fill(tasks)
        while under_way:
            key, outcome = crew.wait()
            task = under_way.pop(key)
            if outcome is None:
                reason = EngineError(f"{task.parameters.label}: {crew.cause}")
                folder.record_failure(task, reason)
                outcome = Outcome(FAILED, str(reason), float("nan"))
            if outcome.state == FULL:
                raise StorageError(f"{outcome.line}; then `jamlab campaign resume` runs what is left")
            if outcome.state == FINISHED:
                if not (file := folder.task_file(task.name)).exists():
                    raise EngineError(
                        f"a worker says that {task.parameters.label} is finished, but {file} is not there: workers must"
                        " see the folder of the campaign under the same path"
                    )
                stored.add(task)
            tell(outcome)
            fill(tasks)


def task_key(folder: CampaignFolder, task: Task) -> str:
    """Name a task at a scheduler that several campaigns may share: each has to make the file in its own folder."""
    place = hashlib.sha256(str(folder.path.resolve()).encode()).hexdigest()
    return f"jamlab-{place[:16]}-{task.name}"
