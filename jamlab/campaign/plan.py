"""Estimate what a campaign will take before it runs: seconds of its cores and bytes on disk.

A task of several ranks holds as many cores all its time, also while one of them measures.

Finished tasks of the same sweep, model and n are the best guide. Where there are none, the time is interpolated between
the measured points of `cost.py`, scaled by a calibration on this machine. Tasks whose states another finished task
holds only cost what they measure.
"""

from dataclasses import dataclass

import numpy as np

from jamlab.campaign.cost import (
    DRIVING,
    WORKER_SECONDS,
    machine_speed,
    measuring_seconds,
    state_count,
    task_bytes,
    task_seconds,
)
from jamlab.campaign.folder import CampaignFolder
from jamlab.campaign.standard_error import precision
from jamlab.campaign.stored_states import StoredStates, shared_tables
from jamlab.campaign.task_file import read_seconds
from jamlab.campaign.tasks import Batch, Task
from jamlab.errors import StorageError
from jamlab.processes.cores import available_cores

_SAMPLES = 8  # finished tasks to average over; reading more would slow down `plan`


@dataclass(frozen=True)
class Estimate:
    """Estimated cost of one sweep, model and n.

    Attributes:
        sweep: its name.
        model: "sp" or "dp".
        n: number of particles.
        tasks: number of tasks; with `until` the most there may be, or, once the standard errors are met, those needed.
        left: number of tasks neither finished nor failed.
        stored: number of tasks left whose states another finished task holds.
        states: number of packings in each task.
        seconds: of cores, for the tasks left; functions of the user's own count nothing.
        bytes: on disk, for the tasks left.
        measured: whether the time is that of finished tasks of the same kind.
        until: column -> wanted standard error; empty without `until`.
        ranks: MPI ranks of each task, hence cores of a worker.
    """

    sweep: str
    model: str
    n: int
    tasks: int
    left: int
    stored: int
    states: int
    seconds: float
    bytes: int
    measured: bool
    until: dict[str, float]
    ranks: int


def plan(batches: list[Batch], folder: CampaignFolder, everything: list[Batch]) -> list[Estimate]:
    """Estimate the cost of each sweep, model and n.

    Args:
        batches: to estimate.
        folder: of the campaign.
        everything: all batches of the campaign, among whose finished tasks states are looked for.
    """
    finished, failed = folder.finished(), folder.failed()
    held = StoredStates(folder, everything) if finished else None
    lines = []
    for batch in batches:
        reached = precision(batch, folder, finished, failed)
        wanted = batch.first(reached.seeds) if reached.met else batch
        left = [task for task in wanted.tasks() if task.name not in finished and task.name not in failed]
        names = [name for name in batch.names() if name in finished]
        lines.append(_estimate(wanted, left, _mean_seconds(folder, names[:_SAMPLES]), held))
    return lines


def _estimate(batch: Batch, left: list[Task], seconds: float | None, held: StoredStates | None) -> Estimate:
    parameters = batch.parameters
    sources = [held.source(task.parameters) for task in left] if held is not None else []
    stored = [source for source in sources if source is not None]
    total = 0.0
    if len(left) > len(stored):
        each = task_seconds(parameters, batch.ranks) * DRIVING * machine_speed() if seconds is None else seconds
        total += (len(left) - len(stored)) * each
    for source in stored:
        shared = shared_tables(parameters, source.parameters)
        total += measuring_seconds(parameters, shared) * DRIVING * machine_speed()
    return Estimate(
        batch.sweep,
        parameters["model"],
        parameters["n"],
        len(batch.seeds),
        len(left),
        len(stored),
        state_count(parameters),
        total * batch.ranks,
        len(left) * task_bytes(parameters),
        seconds is not None and not stored,
        batch.until,
        batch.ranks,
    )


def total_time(lines: list[Estimate], workers: int | None = None) -> tuple[float, float, int]:
    """Wall time, s, core time, s, and the cores at work at most, of all sweeps; those with more ranks run first.

    Args:
        lines: of `plan`.
        workers: number of worker processes, by default as many as fit into the cores of this process.
    """
    wall = work = 0.0
    most = 0
    for ranks in {line.ranks for line in lines}:
        seconds = sum(line.seconds for line in lines if line.ranks == ranks)
        # where a task has more ranks than there are cores, its time is that on a machine of its own
        count = workers or max(1, available_cores() // ranks)
        if any(line.left for line in lines if line.ranks == ranks):
            seconds += WORKER_SECONDS * count
        wall, work, most = wall + seconds / (count * ranks), work + seconds, max(most, count * ranks)
    return wall, work, most


def longest_first(batches: list[Batch]) -> list[Batch]:
    """Order batches by the time of their tasks, so that no worker is left alone with a long one at the end."""
    return sorted(batches, key=lambda batch: -task_seconds(batch.parameters, batch.ranks))


def _mean_seconds(folder: CampaignFolder, names: list[str]) -> float | None:
    seconds = []
    for name in names:
        try:
            seconds.append(read_seconds(folder.task_file(name))[0])
        except StorageError:  # damaged: `run` will find it and run it again
            continue
    return float(np.mean(seconds)) if seconds else None
