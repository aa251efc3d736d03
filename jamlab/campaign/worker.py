"""Carry one task from its parameters to its file. Runs in a worker process, which returns an outcome to the driver."""

import errno
import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from threadpoolctl import threadpool_limits

from jamlab.campaign.folder import CampaignFolder
from jamlab.campaign.tasks import Task
from jamlab.errors import StorageError
from jamlab.processes.cores import cores_given
from jamlab.storage.atomic_file import check_target

FINISHED, FAILED, FULL = "finished", "failed", "full"
_NO_SPACE = (errno.ENOSPC, errno.EDQUOT)


class Outcome(NamedTuple):
    """How a task ended.

    Attributes:
        state: "finished", "failed" (the reason is in `failed/`) or "full" (the folder cannot be written, so no task can
            go on).
        line: the task, and what went wrong, as text to show.
        seconds: wall time; nan if the workers died.
    """

    state: str
    line: str
    seconds: float


def run_task(
    folder: str,
    name: str,
    parameters: dict[str, Any],
    source: str | None = None,
    modules: Sequence[str] = (),
    ranks: int = 1,
) -> Outcome:
    """Run a task unless its file exists.

    Args:
        folder: of the campaign, the same path on every machine.
        name: of the task.
        parameters: of the task.
        source: finished task whose states are those of this one.
        modules: folders that hold modules of the user's own observables.
        ranks: MPI ranks, hence cores, that the task may use.
    """
    began, used = time.perf_counter(), cpu_seconds()

    def end(state: str, line: str) -> Outcome:
        return Outcome(state, line, time.perf_counter() - began)

    place, task = CampaignFolder(Path(folder)), Task(name, parameters, ranks)
    try:
        if not place.task_file(name).exists():
            place.check_target(place.task_file(name))  # before the work, not after
            check_target(place.task_file(name))
            with threadpool_limits(1), cores_given(ranks):  # one core a rank: LAMMPS, BLAS and PARDISO alike
                _make_file(place, task, (began, used), source, modules)
        return end(FINISHED, task.label)
    except StorageError as error:
        return end(FULL, str(error))
    except Exception as error:  # whatever it is, it belongs to this task alone and must not stop the others
        if isinstance(error, OSError) and error.errno in _NO_SPACE:
            return end(FULL, f"no space for {task.label}: {error}")
        try:
            place.record_failure(task, error)
        except StorageError as full:
            return end(FULL, str(full))
        return end(FAILED, f"{task.label}: {error}")


def cpu_seconds() -> float:
    """CPU time of this process and of the ranks it waited for."""
    return sum(os.times()[:4])


def _make_file(
    folder: CampaignFolder, task: Task, began: tuple[float, float], source: str | None, modules: Sequence[str]
) -> None:
    from jamlab.campaign.measurements import measure_tables
    from jamlab.campaign.own_observables import load_function, measure_own, own_observables
    from jamlab.campaign.states import make_states
    from jamlab.campaign.stored_states import read_stored, shared_tables
    from jamlab.campaign.tables import STATE_COLUMNS
    from jamlab.campaign.task_file import write_task_file
    from jamlab.measure import COLUMNS, measure_all

    functions = {name: load_function(name, modules) for name in own_observables(task.parameters["observables"])}
    stored = read_stored(folder, source) if source is not None else None
    if stored is None:
        states, known, before = make_states(task.parameters, task.ranks), {}, (0.0, 0.0)
        measured = measure_all(states.packings)
    else:
        file, states = stored
        shared = {"onset", *shared_tables(task.parameters, file.parameters)}
        known = {name: columns for name, columns in file.tables.items() if name in shared}
        before = file.seconds, file.cpu_seconds
        whole = file.observables.keys() >= set(COLUMNS)  # else written by a jamlab that measured less
        measured = file.observables if whole else measure_all(states.packings)
    tables = measure_tables(task.parameters, states, measured["pressure"], known)
    taken = {*STATE_COLUMNS, *(column for name in known.keys() & functions.keys() for column in known[name])}
    for name in sorted(functions.keys() - known.keys()):
        tables[name] = measure_own(name, functions[name], states.packings, taken)
        taken |= tables[name].keys()
    wall, cpu = before[0] + time.perf_counter() - began[0], before[1] + cpu_seconds() - began[1]
    write_task_file(folder.task_file(task.name), task, states, measured, tables, seconds=wall, cpu_seconds=cpu)
