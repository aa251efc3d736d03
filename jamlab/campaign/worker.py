"""One task from its parameters to its file. Runs in a worker process; the driver gets a few words back."""

import errno
import time
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from jamlab.campaign.folder import CampaignFolder
from jamlab.campaign.tasks import Task
from jamlab.errors import StorageError
from jamlab.packing.atomic_file import check_target

FINISHED, FAILED, FULL = "finished", "failed", "full"
_NO_SPACE = (errno.ENOSPC, errno.EDQUOT)


def run_task(folder: str, name: str, parameters: dict[str, Any]) -> tuple[str, str, float]:
    """Do a task, unless its file is there.

    Args:
        folder: of the campaign, the same path on every machine.
        name: of the task.
        parameters: of the task.

    Returns:
        "finished", "failed" (the reason is in `failed/`) or "full" (the folder cannot be written: no task can go on);
        a line for people; seconds.
    """
    began = time.perf_counter()
    place, task = CampaignFolder(Path(folder)), Task(name, parameters)
    try:
        if not place.task_file(name).exists():
            check_target(place.task_file(name))  # before the work, not after
            with threadpool_limits(1):  # one task, one core: LAMMPS, BLAS and PARDISO alike
                _do(place, task, began)
        return FINISHED, task.label, time.perf_counter() - began
    except StorageError as error:
        return FULL, str(error), time.perf_counter() - began
    except Exception as error:  # whatever it is, it belongs to this task alone and must not stop the others
        if isinstance(error, OSError) and error.errno in _NO_SPACE:
            return FULL, f"no space for {task.label}: {error}", time.perf_counter() - began
        try:
            place.record_failure(task, error)
        except StorageError as full:
            return FULL, str(full), time.perf_counter() - began
        return FAILED, f"{task.label}: {error}", time.perf_counter() - began


def _do(folder: CampaignFolder, task: Task, began: float) -> None:
    from jamlab.campaign.measurements import sweep_tables
    from jamlab.campaign.states import sweep_states
    from jamlab.campaign.task_file import write_task_file
    from jamlab.measure import table

    states = sweep_states(task.parameters)
    measured = table(states.packings)
    tables = sweep_tables(task.parameters, states, measured["pressure"])
    write_task_file(folder.task_file(task.name), task, states, measured, tables, seconds=time.perf_counter() - began)
