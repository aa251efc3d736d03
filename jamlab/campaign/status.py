"""How far a campaign is: tasks finished, failed and left, and how well means over packings are known.

With `until`, seeds are added until the mean over packings is known to a standard error. For each sweep, model and n,
the first eight seeds run. From their values at the last state of each packing follows the standard error s / sqrt(k) of
the mean over k packings, s being their standard deviation, and hence the number of seeds that the wanted error takes:
k (error / wanted)^2, where the column farthest from its aim counts. As s is uncertain for few packings, the number
grows by a quarter at least and doubles at most, until the error is met or no seed is left.

The number depends on the finished tasks alone, not on when and where they ran, so a run that was stopped goes on with
the same seeds. Packings that failed, did not converge or have no value (nan) are left out of the mean.
"""

import math
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from jamlab.campaign.folder import CampaignFolder
from jamlab.campaign.task_file import read_last_state, read_seconds
from jamlab.campaign.tasks import Batch
from jamlab.errors import InputError, StorageError

FIRST_SEEDS = 8  # give the standard deviation to 1 / sqrt(2 (8 - 1)), a quarter
_LEAST_GROWTH, _MOST_GROWTH = 1.25, 2.0


@dataclass(frozen=True)
class Precision:
    """How well the means of one sweep, model and n are known."""

    seeds: int  # number of seeds that are wanted by now
    # column -> standard error of the mean over the packings so far; nan for fewer than two
    errors: dict[str, float] = field(default_factory=dict)
    met: bool = False  # whether every error is as small as wanted


def precision(batch: Batch, folder: CampaignFolder, finished: set[str], failed: set[str]) -> Precision:
    """Say how many seeds of a batch with `until` are wanted, and how well its means are known."""
    if not batch.until:
        return Precision(len(batch.seeds))
    values: dict[str, list[float]] = {column: [] for column in batch.until}
    names = batch.names()
    wanted, done = min(FIRST_SEEDS, len(batch.seeds)), 0
    while True:
        for name in (next(names) for _ in range(wanted - done)):
            if name in finished:
                _take(values, batch, folder, name)
            elif name not in failed:
                return Precision(wanted, _standard_errors(values))
        done, errors = wanted, _standard_errors(values)
        met = all(errors[column] <= aim for column, aim in batch.until.items())
        if met or done == len(batch.seeds):
            return Precision(done, errors, met)
        wanted = min(_next_count(done, errors, batch.until), len(batch.seeds))


def wanted_batches(batches: Sequence[Batch], folder: CampaignFolder) -> list[Batch]:
    """Cut batches to the seeds that are wanted by now. Errors as in `precision`."""
    finished, failed = folder.finished(), folder.failed()
    return [batch.first(precision(batch, folder, finished, failed).seeds) for batch in batches]


def _take(values: dict[str, list[float]], batch: Batch, folder: CampaignFolder, name: str) -> None:
    state = read_last_state(folder.task_file(name))
    for column, found in values.items():
        if column not in state:
            raise InputError(
                f"until.{column} of sweep {batch.sweep}: table states has no such column: use one of {', '.join(state)}"
            )
        if state["converged"] and math.isfinite(state[column]):
            found.append(state[column])


def _standard_errors(values: dict[str, list[float]]) -> dict[str, float]:
    return {column: standard_error(found) for column, found in values.items()}


def standard_error(values: Sequence[float]) -> float:
    """Standard error of the mean of independent values; nan for fewer than two."""
    return float(np.std(values, ddof=1) / np.sqrt(len(values))) if len(values) > 1 else math.nan


def _next_count(count: int, errors: dict[str, float], until: dict[str, float]) -> int:
    """Number of seeds to go to from `count`."""
    ratio = max((errors[column] / aim) ** 2 if errors[column] >= 0 else _MOST_GROWTH for column, aim in until.items())
    return math.ceil(count * min(max(ratio, _LEAST_GROWTH), _MOST_GROWTH))


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
    # seconds, cpu_seconds: wall time and CPU time of the finished tasks, s; None if the files were not read, CPU time
    # nan with files of jamlab 0.1.0 among them. A task that took its packings from another counts them too.
    seconds: float | None = None
    cpu_seconds: float | None = None

    @property
    def left(self) -> int:
        """Number of tasks neither finished nor failed."""
        return self.tasks - self.finished - self.failed


@dataclass(frozen=True)
class Status:
    """Progress of a campaign."""

    sweeps: list[SweepStatus]  # one entry for each sweep, model and n
    # tasks, finished, failed: numbers of all sweeps; a task that several of them share is one
    tasks: int
    finished: int
    failed: int
    failures: dict[str, dict[str, Any]]  # failed task -> record with label, error and reason
    damaged: dict[str, str] | None  # finished task -> damage of its file; None if the files were not read
    gaps: dict[str, str] | None  # finished task -> states it lacks, and why; None if the files were not read
    # number of finished files that belong to no task of the campaign file, e.g. because seeds were removed from it, or
    # because the defaults of jamlab have changed.
    foreign: int

    @property
    def left(self) -> int:
        """Number of tasks neither finished nor failed."""
        return self.tasks - self.finished - self.failed


def count_tasks(batches: Iterable[Batch], folder: CampaignFolder, verify: bool) -> Status:
    """Count the tasks of batches; arguments and errors as in `Campaign.status`."""
    finished, failed = folder.finished(), folder.failed()
    sweeps: list[SweepStatus] = []
    known: set[str] = set()
    wanted: set[str] = set()
    for batch in batches:
        known |= set(batch.names())
        reached = precision(batch, folder, finished, failed)
        names = set(batch.first(reached.seeds).names())
        wanted |= names
        counts = (len(names), len(names & finished), len(names & failed), len(batch.seeds))
        line = SweepStatus(
            batch.sweep, batch.parameters.model, batch.parameters.n, *counts, batch.until, reached.errors
        )
        sweeps.append(_timed(line, folder, names & finished) if verify else line)
    failures = {name: record for name, record in folder.failures().items() if name in known}
    damaged = folder.damages(known & finished) if verify else None
    gaps = folder.gaps((known & finished) - damaged.keys()) if damaged is not None else None
    totals = (len(wanted), len(wanted & finished), len(wanted & failed))
    return Status(sweeps, *totals, failures, damaged, gaps, len(finished - known))


def _timed(line: SweepStatus, folder: CampaignFolder, names: set[str]) -> SweepStatus:
    """Add the times of tasks; those whose files are damaged count nothing."""
    wall = cpu = 0.0
    for name in names:
        with suppress(StorageError):
            seconds = read_seconds(folder.task_file(name))
            wall, cpu = wall + seconds[0], cpu + seconds[1]
    return replace(line, seconds=wall, cpu_seconds=cpu)
