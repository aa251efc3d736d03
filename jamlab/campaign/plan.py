"""Say how far a campaign is, and how many seconds of its cores and bytes on disk the remaining tasks take.

With `until`, seeds are added until the mean over packings is known to a standard error. For each sweep, model and n,
the first eight seeds run. From their values at the last state of each packing follows the standard error s / sqrt(k) of
the mean over k packings, s being their standard deviation, and hence the number of seeds that the wanted error takes:
k (error / wanted)^2, where the column farthest from its aim counts. As s is uncertain for few packings, the number
grows by a quarter at least and doubles at most, until the error is met or no seed is left.

The number depends on the finished tasks alone, not on when and where they ran, so a resumed run continues with
the same seeds. Packings that failed, did not converge or have no value (nan) are left out of the mean.

The time and size of the tasks that are left follow from the finished tasks of the same sweep, model and n. They are not
known before one is finished: `run` with `pilot` does one of each. A task whose states are stored costs what the stored
one did not measure. A task of several ranks holds as many cores all its time, also while one of them measures.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from jamlab.campaign.file import site_count
from jamlab.campaign.folder import CampaignFolder, Share, read_last_state
from jamlab.campaign.states import StoredStates
from jamlab.campaign.tasks import Batch, task_names
from jamlab.checks import check_choice
from jamlab.processes.cores import available_cores

FIRST_SEEDS = 8  # give the standard deviation to 1 / sqrt(2 (8 - 1)), a quarter
_LEAST_GROWTH, _MOST_GROWTH = 1.25, 2.0


class Precision(NamedTuple):
    """How well the means of one sweep, model and n are known."""

    seeds: int  # number of seeds that are wanted by now
    # column -> standard error of the mean over the packings so far; nan for fewer than two
    errors: dict[str, float]
    met: bool = False  # whether every error is as small as wanted


def precision(batch: Batch, folder: CampaignFolder, finished: set[str], failed: set[str]) -> Precision:
    """Say how many seeds of a batch with `until` are wanted, and how well its means are known."""
    if not batch.until:
        return Precision(len(batch.seeds), {})
    values: dict[str, list[float]] = {column: [] for column in batch.until}
    names = batch.names()
    wanted, done = min(FIRST_SEEDS, len(batch.seeds)), 0
    while True:
        for name in (next(names) for _ in range(wanted - done)):
            if name in finished:
                state = read_last_state(folder.task_file(name))
                for column, found in values.items():
                    check_choice("column of until:", column, state)
                    if state["converged"] and math.isfinite(state[column]):
                        found.append(state[column])
            elif name not in failed:
                return Precision(wanted, {column: standard_error(found) for column, found in values.items()})
        done, errors = wanted, {column: standard_error(found) for column, found in values.items()}
        met = all(errors[column] <= aim for column, aim in batch.until.items())
        if met or done == len(batch.seeds):
            return Precision(done, errors, met)
        ratio = max((errors[c] / aim) ** 2 if errors[c] >= 0 else _MOST_GROWTH for c, aim in batch.until.items())
        wanted = min(math.ceil(done * min(max(ratio, _LEAST_GROWTH), _MOST_GROWTH)), len(batch.seeds))


def wanted_batches(batches: Sequence[Batch], folder: CampaignFolder) -> list[Batch]:
    """Cut batches to the seeds that are wanted by now. Errors as in `precision`."""
    finished, failed = folder.finished(), folder.failed()
    return [batch.first(precision(batch, folder, finished, failed).seeds) for batch in batches]


def standard_error(values: Sequence[float]) -> float:
    """Standard error of the mean of independent values; nan for fewer than two."""
    return float(np.std(values, ddof=1) / np.sqrt(len(values))) if len(values) > 1 else math.nan


@dataclass(frozen=True)
class SweepStatus:
    """Progress of one sweep, model and n."""

    sweep: str  # its name
    model: str  # "sp" or "dp"
    n: int  # number of particles
    tasks: int  # number of tasks; with `until`, of those that are wanted by now
    finished: int  # number of tasks with a file
    failed: int  # number of tasks that failed
    most: int  # number of seeds that may be used
    until: dict[str, float]  # column -> wanted standard error of its mean; empty without `until`
    errors: dict[str, float]  # column -> standard error by now; nan for fewer than two packings

    @property
    def left(self) -> int:
        """Number of tasks neither finished nor failed."""
        return self.tasks - self.finished - self.failed


@dataclass(frozen=True)
class Status:
    """Progress of a campaign: `tasks`, `finished` and `failed` of all `sweeps`, a task that several share being one.

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
    failures: dict[str, dict[str, Any]]
    damaged: dict[str, str] | None
    gaps: dict[str, str] | None
    foreign: int

    @property
    def left(self) -> int:
        """Number of tasks neither finished nor failed."""
        return self.tasks - self.finished - self.failed


def count_tasks(batches: list[Batch], folder: CampaignFolder, verify: bool) -> Status:
    """Count the tasks of batches; arguments and errors as in `Campaign.status`."""
    finished, failed, known = folder.finished(), folder.failed(), task_names(batches)
    files = folder.read(known & finished) if verify else {}
    sweeps: list[SweepStatus] = []
    wanted: set[str] = set()
    for batch in batches:
        reached = precision(batch, folder, finished, failed)
        names = set(batch.first(reached.seeds).names())
        wanted |= names
        counts = (len(names), len(names & finished), len(names & failed), len(batch.seeds))
        sweeps.append(SweepStatus(*batch.who, *counts, batch.until, reached.errors))
    failures = {name: record for name, record in folder.failures().items() if name in known}
    damaged = folder.damages(known & finished) if verify else None
    gaps = {name: file.gaps for name, file in files.items() if file.gaps} if verify else None
    totals = (len(wanted), len(wanted & finished), len(wanted & failed))
    return Status(sweeps, *totals, failures, damaged, gaps, len(finished - known))


_SAMPLES = 8  # finished tasks to average over; reading more would slow down `plan`


@dataclass(frozen=True)
class SweepPlan:
    """Expected cost of one sweep, model and n."""

    sweep: str  # its name
    model: str  # "sp" or "dp"
    n: int  # number of particles
    # number of tasks; with `until` the most there may be, or, once the standard errors are met, those needed
    tasks: int
    left: int  # number of tasks neither finished nor failed; one that an earlier sweep has too is counted there
    stored: int  # number of tasks left whose states another finished task holds
    seconds: float | None  # of cores, for the tasks left; None before a task of this kind is finished
    bytes: int | None  # on disk, for the tasks left
    until: dict[str, float]  # column -> wanted standard error; empty without `until`
    ranks: int  # threads of each task, hence cores of a worker


def plan(batches: list[Batch], folder: CampaignFolder, everything: list[Batch]) -> list[SweepPlan]:
    """Plan each sweep, model and n, with states of finished tasks among all batches of the campaign."""
    finished, failed = folder.finished(), folder.failed()
    held = StoredStates(folder, everything) if finished else None
    lines, counted = [], finished | failed
    for batch in batches:
        reached = precision(batch, folder, finished, failed)
        wanted = batch.first(reached.seeds) if reached.met else batch
        left = [task for task in wanted.tasks() if task.name not in counted]
        counted |= {task.name for task in left}
        stored = [source.name for task in left if held and (source := held.source(task.parameters)) is not None]
        done = [name for name in batch.names() if name in finished][:_SAMPLES]
        seconds, size = (None, None) if left else (0.0, 0)
        if left and (times := [file.seconds for file in folder.read(done).values()]):
            spared = [file.seconds for file in folder.read(stored[:_SAMPLES]).values()]
            each = float(np.mean(times))
            seconds = (each * len(left) - min(float(np.mean(spared or [0])), each) * len(stored)) * batch.ranks
            size = int(np.mean([folder.task_file(name).stat().st_size for name in done])) * len(left)
        counts = (len(wanted.seeds), len(left), len(stored))
        lines.append(SweepPlan(*batch.who, *counts, seconds, size, batch.until, batch.ranks))
    return lines


def total_time(lines: list[SweepPlan], workers: int | None = None) -> tuple[float | None, float | None, int]:
    """Wall time, s, core time, s, and the cores at work at most, of all sweeps, those with more ranks first; by default
    with as many workers as fit into the cores of this process. Times are None if that of a sweep is."""
    wall = work = 0.0
    most = 0
    for ranks in {line.ranks for line in lines}:
        seconds = sum(line.seconds or 0.0 for line in lines if line.ranks == ranks)
        # where a task has more ranks than there are cores, its time is that on a machine of its own
        count = workers or max(1, available_cores() // ranks)
        wall, work, most = wall + seconds / (count * ranks), work + seconds, max(most, count * ranks)
    known = all(line.seconds is not None for line in lines)
    return wall if known else None, work if known else None, most


def longest_first(batches: list[Batch]) -> list[Batch]:
    """Order batches by disks and vertices of a packing, so that no worker is left alone with a long task at the end."""
    return sorted(batches, key=lambda batch: -site_count(batch.parameters.n, batch.parameters.force_law))


def share_names(batches: list[Batch], share: Share) -> set[str]:
    """Names of the tasks of share k of n: every n-th of all tasks of a campaign, the longest first, from the k-th on.
    They depend on the campaign file alone, so that no two shares have a task in common whatever is finished."""
    k, n = share
    names = dict.fromkeys(name for batch in longest_first(batches) for name in batch.names())
    return set(itertools.islice(names, k - 1, None, n))
