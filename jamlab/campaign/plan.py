"""Say how far a campaign is, and how many seconds of its cores and bytes on disk the remaining tasks take.

The time and size of the tasks that are left follow from the finished tasks of the same sweep, model and n. They are not
known before one is finished: `run` with `pilot` does one of each. A task whose packings are stored costs what the
stored one did not measure. A task of several ranks holds as many cores all its time, also while one of them measures.
"""

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

from jamlab.campaign.file import site_count
from jamlab.campaign.folder import CampaignFolder, Share
from jamlab.campaign.tasks import Batch, states_name, task_names
from jamlab.processes.cores import available_cores

_SAMPLES = 8  # finished tasks to average over; reading more would slow down `plan`


@dataclass(frozen=True)
class SweepStatus:
    """Progress of one sweep, model and n, and the expected cost of the tasks that are left."""

    sweep: str  # its name
    model: str  # its name
    n: int  # number of particles
    ranks: int  # threads of each task, hence cores of a worker
    tasks: int  # number of tasks
    finished: int  # number of tasks with a file
    failed: int  # number of tasks that failed
    left: int  # number of tasks neither finished nor failed; one that an earlier sweep has too is counted there
    stored: int  # number of tasks left whose packings another finished task holds
    # seconds of cores, bytes on disk: for the tasks left; None before a task of this kind is finished, and in `status`
    seconds: float | None = None
    bytes: int | None = None


@dataclass(frozen=True)
class Status:
    """Progress of a campaign: `tasks`, `finished`, `failed` and `left` of all `sweeps`, a task that several share being
    one.

    Attributes:
        sweeps: one entry for each sweep, model and n.
        failures: failed task -> record with label, error and reason.
        damaged: finished task -> damage of its file; None if the files were not read.
        gaps: finished task -> states it lacks, and why; None if the files were not read.
        foreign: number of finished files that belong to no task of the campaign file, e.g. because seeds were removed
            from it, or because the defaults of jamlab have changed.
    """

    sweeps: list[SweepStatus]
    tasks: int
    finished: int
    failed: int
    left: int
    failures: dict[str, dict[str, Any]]
    damaged: dict[str, str] | None
    gaps: dict[str, str] | None
    foreign: int


def status(batches: list[Batch], folder: CampaignFolder, verify: bool) -> Status:
    """Count the tasks of batches; arguments and errors as in `Campaign.status`."""
    finished, failed, known = folder.finished(), folder.failed(), task_names(batches)
    files = folder.read(known & finished) if verify else {}
    sweeps = plan(batches, folder, cost=False)
    failures = {name: record for name, record in folder.failures().items() if name in known}
    damaged = folder.damages(known & finished) if verify else None
    gaps = {name: file.gaps for name, file in files.items() if file.gaps} if verify else None
    totals = (len(known), len(known & finished), len(known & failed), sum(sweep.left for sweep in sweeps))
    return Status(sweeps, *totals, failures, damaged, gaps, len(finished - known))


def plan(batches: list[Batch], folder: CampaignFolder, *, cost: bool = True) -> list[SweepStatus]:
    """Count the tasks of each sweep, model and n, and what those left take, by all files of the folder."""
    finished, failed = folder.finished(), folder.failed()
    held = {states_name(name): name for name in sorted(finished)}
    lines, counted = [], finished | failed
    for batch in batches:
        names = set(batch.names())
        left = names - counted
        counted |= left
        stored = sorted(held[states] for states in map(states_name, left) if states in held)
        seconds, size = (None, None) if left else (0.0, 0)
        done = [name for name in batch.names() if name in finished][:_SAMPLES]
        if cost and left and (times := [file.seconds for file in folder.read(done).values()]):
            spared = [file.seconds for file in folder.read(stored[:_SAMPLES]).values()]
            each = float(np.mean(times))
            seconds = (each * len(left) - min(float(np.mean(spared or [0])), each) * len(stored)) * batch.ranks
            size = int(np.mean([folder.task_file(name).stat().st_size for name in done])) * len(left)
        counts = (len(names), len(names & finished), len(names & failed), len(left), len(stored))
        who = (batch.sweep, batch.parameters.model, batch.parameters.n, batch.ranks)
        lines.append(SweepStatus(*who, *counts, seconds, size))
    return lines


def total_time(lines: list[SweepStatus], workers: int | None = None) -> tuple[float | None, float | None, int]:
    """Wall time, s, core time, s, and the cores at work at most, of all sweeps; by default with as many workers as fit
    into the cores of this process. Times are None if that of a sweep is."""
    ranks = max((line.ranks for line in lines), default=1)
    # where a task has more ranks than there are cores, its time is that on a machine of its own
    count = workers or max(1, available_cores() // ranks)
    times = [line.seconds for line in lines if line.seconds is not None]
    if len(times) < len(lines):
        return None, None, count * ranks
    return sum(t / line.ranks for t, line in zip(times, lines, strict=True)) / count, sum(times), count * ranks


def longest_first(batches: list[Batch]) -> list[Batch]:
    """Order batches by disks and vertices of a packing, so that no worker is left alone with a long task at the end."""

    def sites(batch: Batch) -> float:
        made = batch.parameters
        return site_count(made.n, made.model, made.force_law)

    return sorted(batches, key=sites, reverse=True)


def share_names(batches: list[Batch], share: Share) -> set[str]:
    """Names of the tasks of share k of n: every n-th of all tasks of a campaign, the longest first, from the k-th on.
    They depend on the campaign file alone, so that no two shares have a task in common whatever is finished."""
    k, n = share
    names = dict.fromkeys(name for batch in longest_first(batches) for name in batch.names())
    return set(itertools.islice(names, k - 1, None, n))
