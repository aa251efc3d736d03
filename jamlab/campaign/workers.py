"""What a worker does in one call: the tasks of a chunk, one after the other, each with its outcome.

Every worker is a separate process, because neither LAMMPS nor its MPI can run several tasks in threads. It finds the
folder of the campaign on a file system that it shares with the driver (`driver.py`), marks there what it is at
(`marks.py`), and writes there what it makes.
"""

import errno
import math
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from jamlab.campaign.deaths import kind_of_end, record_death, sweep, why_it_fails
from jamlab.campaign.folder import CampaignFolder
from jamlab.campaign.marks import Mark, marked
from jamlab.campaign.observable import TableColumns, load_function, measure_own
from jamlab.campaign.states import make_states, read_stored
from jamlab.campaign.tables import STATE_COLUMNS
from jamlab.campaign.task_file import TaskContent, describe_gaps
from jamlab.campaign.tasks import Batch, Task
from jamlab.engine.installation import lammps_class
from jamlab.errors import EngineError, InputError, StorageError
from jamlab.measure import numbers_of
from jamlab.processes.cores import available_cores, cores_given
from jamlab.storage.atomic_file import check_target
from jamlab.storage.verified_file import versions


def count_workers(wanted: int | None, ranks: int) -> int:
    """Number of workers whose tasks have so many threads; by default as many as the cores of this process hold."""
    if wanted is not None:
        return wanted
    if ranks > (cores := available_cores()):
        raise InputError(f"ranks = {ranks}: this process may use {cores} cores: lower ranks, or give --workers")
    return cores // ranks


FINISHED, FAILED, FULL = "finished", "failed", "full"
_NO_SPACE = (errno.ENOSPC, errno.EDQUOT)


class Outcome(NamedTuple):
    """How a task ended. `state`: "finished", "failed" (the reason is in `failed/`) or "full" (the folder cannot be
    written, so no task can run); `line`: the task, and what went wrong, as text to show; `seconds`: wall time, nan if
    the workers died; `gaps`: the states that a finished task lacks, and why, "" if none."""

    state: str
    line: str
    seconds: float
    gaps: str = ""


class Call(NamedTuple):
    """What a worker is sent."""

    folder: str  # of the campaign
    chunk: Batch
    first: str  # name of its first task
    stored: Mapping[str, Sequence[str]]  # task -> finished tasks with the same packings
    modules: Sequence[str]  # folders with modules of the user's own observables
    attempt: str  # <share>.<run>.<count>
    rate: float  # 1/s, at which workers are killed that do other tasks, see `deaths.py`


def run_chunk(call: Call, report: Callable[..., None]) -> list[Outcome]:
    """Run the tasks of a chunk whose files do not exist, with the packings that are stored.

    Args:
        call: which, and where.
        report: is not called: a mark in the folder says what this worker is at.

    Returns:
        Outcomes in the order of the tasks, up to the first one that is "full".
    """
    folder = _folder_at(call.folder)
    if wrong := _wrong_place(folder, call):
        return [Outcome(FULL, wrong, 0.0)]
    try:
        with marked(folder.path, call.attempt) as (at, earlier):
            hopeless = _blame(folder, call, earlier)
            again = bool(earlier)
            return run_tasks(folder, call.chunk, call.stored, call.modules, at=at, hopeless=hopeless, again=again)
    except StorageError as error:  # of the mark
        return [Outcome(FULL, str(error), math.nan)]


def _wrong_place(folder: CampaignFolder, call: Call) -> str:
    """Why this worker is not one of this run; "" if it is."""
    for _ in range(_LOOKS):
        if folder.is_held_by(call.attempt):
            break
        time.sleep(_PAUSE)
    else:
        return f"{platform.node()} sees another folder as {call.folder}, or another run in it: {_REMEDY}"
    if next(call.chunk.names()) != call.first:
        return f"{platform.node()} has another version of jamlab: install the same one as for the driver"
    return ""


_REMEDY = "give workers the file system of the driver, and begin no other run there"
_LOOKS, _PAUSE = 6, 0.5  # s: for so long a network file system may show what was there before


def _blame(folder: CampaignFolder, call: Call, marks: list[Mark]) -> dict[str, str]:
    """Record the ends of workers that began the same call before, which their engine made again by itself; return which
    tasks are to fail by that, and why."""
    names = list(call.chunk.names())
    blamed = {}
    for mark in marks:
        task = names[0] if len(names) == 1 else mark.task
        if task in names:
            record_death(folder.path, task, kind_of_end(mark, time.time()), mark)
            sweep(folder.path, mark)
            blamed[task] = why_it_fails(folder.path, task, call.rate)
    return {task: reason for task, reason in blamed.items() if reason is not None}


def run_tasks(
    folder: CampaignFolder,
    chunk: Batch,
    stored: Mapping[str, Sequence[str]],
    modules: Sequence[str] = (),
    *,
    at: Callable[[str], None] = lambda task: None,
    hopeless: Mapping[str, str] = MappingProxyType({}),
    again: bool = True,
) -> list[Outcome]:
    """Run tasks unless their files exist, and write what they give when all have ended.

    Args:
        folder, chunk, stored, modules: see `Call`.
        at: called with the name of each task as it begins.
        hopeless: task -> why it fails without being run.
        again: whether workers may have finished some of the tasks, and not only all or none of them.

    Returns:
        Outcomes in the order of the tasks, up to the first one that is "full".
    """
    outcomes: dict[str, Outcome] = {}
    made: list[TaskContent] = []
    finished = _finished(folder, list(chunk.names()), again)
    with cores_given(chunk.ranks):  # one core a rank, as a worker has one thread
        for task in chunk.tasks():
            if task.name in finished:
                outcomes[task.name] = Outcome(FINISHED, task.parameters.label, 0.0)
                continue
            how = stored.get(task.name, ()), modules, at, hopeless
            outcomes[task.name], content = _run_task(folder, task, *how, is_first=not made)
            if content is not None:
                made.append(content)
            if outcomes[task.name].state == FULL:
                break
    outcomes |= _keep(folder, made, outcomes)
    return list(outcomes.values())


def _finished(folder: CampaignFolder, names: list[str], again: bool) -> set[str]:
    """Which tasks are finished, such as by a worker whose answer was lost."""
    if len(names) > 1 and again:
        return folder.finished_of(names)
    # to list the folder of a hundred thousand files would take longer than the tasks
    return set(names) if folder.file_of_all(names).exists() else set()


@cache  # what it knows of files of several tasks stays
def _folder_at(path: str) -> CampaignFolder:
    return CampaignFolder(Path(path))


def _run_task(
    folder: CampaignFolder,
    task: Task,
    stored: Sequence[str],
    modules: Sequence[str],
    at: Callable[[str], None],
    hopeless: Mapping[str, str],
    *,
    is_first: bool,
) -> tuple[Outcome, TaskContent | None]:
    """Run a task; returns its outcome if what is made can be kept, and what is made."""
    began, label = time.perf_counter(), task.parameters.label
    try:
        at(task.name)
        if task.name in hopeless:
            raise EngineError(hopeless[task.name])
        if is_first:
            check_target(folder.task_file(task.name))  # before the work, not after
        if not stored:
            lammps_class(), versions()  # half a second, once in a worker: `plan` takes times from single tasks
            began = time.perf_counter()
        content = _make(folder, task, began, stored, modules)
    except (Exception, SystemExit) as error:  # whatever it is, it belongs to this task alone and must not stop others
        return _outcome_of(folder, task, error, time.perf_counter() - began), None
    gaps = describe_gaps(task.parameters, content.states.missing)
    return Outcome(FINISHED, label, time.perf_counter() - began, gaps), content


def _outcome_of(folder: CampaignFolder, task: Task, error: BaseException, seconds: float) -> Outcome:
    """The outcome of a task that raised an error."""
    label = task.parameters.label
    if isinstance(error, StorageError):
        return Outcome(FULL, str(error), seconds)
    if isinstance(error, OSError) and error.errno in _NO_SPACE:
        return Outcome(FULL, f"no space for {label}: {error}; make room", seconds)
    if isinstance(error, SystemExit):
        error = EngineError(f"a called function exited: sys.exit({error.code!r})")
    try:
        folder.record_failure(task, error)
    except StorageError as full:
        return Outcome(FULL, str(full), seconds)
    return Outcome(FAILED, f"{label}: {error}", seconds)


def _keep(folder: CampaignFolder, made: list[TaskContent], outcomes: Mapping[str, Outcome]) -> dict[str, Outcome]:
    """Write what tasks gave; returns their outcomes."""
    before = {content.task.name: outcomes[content.task.name] for content in made}
    if not made:
        return before
    began = time.perf_counter()
    try:
        folder.keep(made)
    except Exception as error:  # such as of an observable whose values no file can hold
        if len(made) == 1 or isinstance(error, StorageError):
            return {c.task.name: _outcome_of(folder, c.task, error, before[c.task.name].seconds) for c in made}
        return {name: outcome for c in made for name, outcome in _keep(folder, [c], before).items()}
    each = (time.perf_counter() - began) / len(made)
    return {name: outcome._replace(seconds=outcome.seconds + each) for name, outcome in before.items()}


def _make(
    folder: CampaignFolder, task: Task, began: float, stored: Sequence[str], modules: Sequence[str]
) -> TaskContent:
    """Make and measure the packings of a task."""
    parameters = task.parameters
    functions = {name: load_function(name, modules) for name in parameters.own}
    measured, tables, before = {}, {}, 0.0
    if found := read_stored(folder, stored, parameters):
        file, states = found
        measured, tables, before = file.observables, file.tables, file.seconds
    else:
        states = make_states(parameters, task.ranks)
    measured = measured or numbers_of(states.packings, workers=None)
    count = len(states.packings)
    known: TableColumns = {name: measured[name] for name in ("rho", "phi", "pressure")}
    known |= {"state": np.arange(count), "target_pressure": np.array(states.target_pressures)}
    known["rho_J"] = np.full(count, measured["rho"][0] if parameters.from_onset else np.nan)
    for name, wanted in parameters.observables.items():
        if name not in tables:
            tables[name] = wanted.measure(states, known)
    taken = {*STATE_COLUMNS, *(column for name in functions if name in tables for column in tables[name])}
    for name in functions:
        if name not in tables:
            tables[name] = measure_own(name, functions[name], states.packings, taken)
            taken |= tables[name].keys()
    seconds = before + time.perf_counter() - began
    return TaskContent(task, states, measured, tables, seconds)
