"""Say how far a campaign is, and what is left of it will take: seconds of its cores and bytes on disk.

With `until`, seeds are added until the mean over packings is known to a standard error. For each sweep, model and n,
the first eight seeds run. From their values at the last state of each packing follows the standard error s / sqrt(k) of
the mean over k packings, s being their standard deviation, and hence the number of seeds that the wanted error takes:
k (error / wanted)^2, where the column farthest from its aim counts. As s is uncertain for few packings, the number
grows by a quarter at least and doubles at most, until the error is met or no seed is left.

The number depends on the finished tasks alone, not on when and where they ran, so a run that was stopped goes on with
the same seeds. Packings that failed, did not converge or have no value (nan) are left out of the mean.

Finished tasks of the same sweep, model and n are the best guide. Where there are none, the time is interpolated between
means over seeds that were measured part by part on one core of 2026, with the default force laws and sizes;
`machine_speed` says how much longer the machine at hand takes, and each observable what measuring it takes. With other
laws or sizes the time is not known before a task is finished. Tasks whose states another finished task holds only cost
what they measure. A task of several ranks holds as many cores all its
time, also while one of them measures.
"""

import math
import time
from collections.abc import Collection, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from jamlab.campaign.file import STATES
from jamlab.campaign.folder import CampaignFolder, read_last_state, read_seconds
from jamlab.campaign.observable import Points
from jamlab.campaign.states import StoredStates, shared_tables
from jamlab.campaign.tasks import Batch, Parameters, Task
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import InputError, StorageError
from jamlab.measure import measure
from jamlab.packing.packing import Packing
from jamlab.processes.cores import available_cores

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
                state = read_last_state(folder.task_file(name))
                for column, found in values.items():
                    if column not in state:
                        raise InputError(
                            f"until.{column} of sweep {batch.sweep}: table states has no such column: use one of "
                            f"{', '.join(state)}"
                        )
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
        known_by_now = (batch.sweep, batch.parameters.model, batch.parameters.n, *counts, batch.until, reached.errors)
        times = _read_times(folder, names & finished) if verify else []
        spent = (sum((wall for wall, _ in times), 0.0), sum((cpu for _, cpu in times), 0.0)) if verify else (None, None)
        sweeps.append(SweepStatus(*known_by_now, *spent))
    failures = {name: record for name, record in folder.failures().items() if name in known}
    damaged = folder.damages(known & finished) if verify else None
    gaps = folder.gaps((known & finished) - damaged.keys()) if damaged is not None else None
    totals = (len(wanted), len(wanted & finished), len(wanted & failed))
    return Status(sweeps, *totals, failures, damaged, gaps, len(finished - known))


def _read_times(folder: CampaignFolder, names: Iterable[str]) -> list[tuple[float, float]]:
    """Wall and CPU time of finished tasks, s; a damaged file is left out: `run` will find it and run it again."""
    times = []
    for name in names:
        with suppress(StorageError):
            times.append(read_seconds(folder.task_file(name)))
    return times


_SAMPLES = 8  # finished tasks to average over; reading more would slow down `plan`

_ONSET_TIME: dict[str, Points] = {
    "sp": ((32, 0.24), (64, 0.4), (128, 0.85), (256, 3.1), (1024, 60.0)),
    "dp": ((8, 1.4), (16, 2.3), (32, 3.8), (64, 14.0), (128, 33.0), (256, 200.0)),
}
_STABILIZED_ONSET_TIME: Points = ((32, 0.65), (64, 1.0), (128, 1.4))  # where the box is sheared too
_STATE_TIME: dict[str, Points] = {  # of a compression
    "sp": ((32, 0.003), (64, 0.009), (128, 0.03), (256, 0.08), (1024, 0.6)),
    "dp": ((8, 0.043), (16, 0.075), (32, 0.12), (64, 0.24), (128, 0.9), (256, 3.4)),
}
_PACK_PRESSURES = (1e-2, 1e-5)  # between which log t is linear in log p: softer packings converge more slowly
_PACK_TIME: dict[str, tuple[Points, Points]] = {  # at these pressures
    "fixed-box": (
        ((32, 0.042), (128, 0.057), (512, 0.11), (2048, 0.5), (32768, 120.0)),
        ((32, 0.07), (128, 0.16), (512, 0.6), (2048, 13.0), (32768, 480.0)),
    ),
    "shear-stabilized": (
        ((32, 0.042), (128, 0.067), (512, 0.12), (2048, 1.5)),
        ((32, 0.07), (128, 0.14), (512, 1.1), (2048, 13.0)),
    ),
}
_DECOMPRESS_TIME: Points = ((32, 0.15), (512, 0.22), (2048, 1.6), (32768, 130.0))  # half a decade down, near onset
_RANKED_SHARE = 0.95  # of the time to make a large packing, which FIRE takes, shared out to threads
_STATES_TIME: dict[str, Points] = {  # to measure table "states"
    "sp": ((32, 0.0045), (128, 0.008), (512, 0.02), (2048, 0.065)),
    "dp": ((16, 0.017), (32, 0.029), (64, 0.055)),
}

DRIVING = 1.2  # CPU of a campaign over that of its parts: Dask and files; 1.6, 1.6 and 1.2 on a machine at full load
WORKER_SECONDS = 2.0  # CPU to start one worker, which loads LAMMPS and the solvers

_CRYSTAL = 12  # disks along each side of the packing on which the machine is timed
_MEASUREMENTS = 30
_CRYSTAL_TIME = 0.27  # s that these took where the times above were measured

_FILE_BYTES = 60_000  # names and headers of HDF5
_STATE_BYTES = 700  # observables, box and provenance of a frame
_POSITION_BYTES = 24  # of a disk or vertex: x, y and z = 0 in float64


def task_seconds(parameters: Parameters, ranks: int = 1) -> float:
    """Estimate the wall time of one task whose packings are minimised by some threads, s."""
    making = _making_seconds(parameters)
    if ranks > 1:
        making *= 1 - _RANKED_SHARE + _RANKED_SHARE / ranks
    return making + measuring_seconds(parameters)


def _making_seconds(parameters: Parameters) -> float:
    size = parameters.size
    if parameters.pressures is not None:
        dense, soft = map(size.seconds, _PACK_TIME[parameters.ensemble])
        high, low = _PACK_PRESSURES
        share = np.log(np.array(parameters.pressures) / high) / np.log(low / high)
        each = dense * (soft / dense) ** share
        if parameters.decompress:
            half_decades = -2 * np.diff(np.log10(parameters.pressures))
            each[1:] = size.seconds(_DECOMPRESS_TIME) * np.maximum(half_decades, 1)
        return float(np.sum(each))
    if parameters.phi is not None:  # a quench each, which takes the longest near onset
        return size.states * size.seconds(_PACK_TIME["fixed-box"][0])
    sheared = parameters.ensemble == "shear-stabilized" and size.model == "sp"
    onset = _STABILIZED_ONSET_TIME if sheared else _ONSET_TIME[size.model]
    return size.seconds(onset) + (size.states - 1) * size.seconds(_STATE_TIME[size.model])


def measuring_seconds(parameters: Parameters, known: Collection[str] = ()) -> float:
    """Estimate the time to measure the states of one task, s, without the observables that are known."""
    size = parameters.size
    seconds = sum(o.seconds(size) for o in parameters.observables if o.name not in known)
    return seconds + size.states * size.seconds(_STATES_TIME[size.model]) * (STATES not in known)


@cache
def machine_speed() -> float:
    """CPU time of measurements of a crystal of disks on this machine, over that where times were measured. It takes a
    few tenths of a second. Other programs that run now slow it down just as they slow down tasks."""
    rows = np.arange(_CRYSTAL)
    height = np.sqrt(0.75)
    x = np.add.outer(0.5 * (rows % 2), rows).ravel()
    y = np.repeat(rows * height, _CRYSTAL)
    box = _CRYSTAL * np.diag([1.0, height])
    shrink = 0.99  # so that neighbours overlap
    crystal = Packing("sp", shrink * box, shrink * np.column_stack([x, y]), {"eps": 1.0}, diameters=np.ones(len(x)))
    with threadpool_limits(1):
        measure(crystal)  # loads the solvers
        began = time.process_time()
        for _ in range(_MEASUREMENTS):
            measure(crystal)
    return (time.process_time() - began) / _CRYSTAL_TIME


@dataclass(frozen=True)
class Estimate:
    """Estimated cost of one sweep, model and n."""

    sweep: str  # its name
    model: str  # "sp" or "dp"
    n: int  # number of particles
    # number of tasks; with `until` the most there may be, or, once the standard errors are met, those needed
    tasks: int
    left: int  # number of tasks neither finished nor failed; one that an earlier sweep has too is counted there
    stored: int  # number of tasks left whose states another finished task holds
    states: int  # number of packings in each task
    seconds: float  # of cores, for the tasks left; functions of the user's own count nothing
    bytes: int  # on disk, for the tasks left
    measured: bool  # whether the time is that of finished tasks of the same kind
    # whether it is known at all: `seconds` of a force law or sizes that nobody has timed are those of the default ones
    known: bool
    until: dict[str, float]  # column -> wanted standard error; empty without `until`
    ranks: int  # threads of each task, hence cores of a worker


def plan(batches: list[Batch], folder: CampaignFolder, everything: list[Batch]) -> list[Estimate]:
    """Estimate the cost of each sweep, model and n, with states of finished tasks among all batches of the campaign."""
    finished, failed = folder.finished(), folder.failed()
    held = StoredStates(folder, everything) if finished else None
    lines, counted = [], finished | failed
    for batch in batches:
        reached = precision(batch, folder, finished, failed)
        wanted = batch.first(reached.seeds) if reached.met else batch
        left = [task for task in wanted.tasks() if task.name not in counted]
        counted |= {task.name for task in left}
        names = [name for name in batch.names() if name in finished]
        times = _read_times(folder, names[:_SAMPLES])
        seconds = float(np.mean([wall for wall, _ in times])) if times else None
        lines.append(_estimate(wanted, left, seconds, held))
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
    size = parameters.size
    rows = sum(o.rows(size) * sum(kind.itemsize for kind in o.stored.values()) for o in parameters.observables)
    each_file = int(_FILE_BYTES + size.states * (_POSITION_BYTES * size.sites + _STATE_BYTES + rows))
    counts = (len(batch.seeds), len(left), len(stored), size.states)
    known = seconds is not None or len(left) == len(stored) or _is_timed(parameters)
    cost = (total * batch.ranks, len(left) * each_file, seconds is not None and not stored, known)
    return Estimate(batch.sweep, parameters.model, parameters.n, *counts, *cost, batch.until, batch.ranks)


def _is_timed(parameters: Parameters) -> bool:
    """Whether times were measured with such a force law and sizes; numbers of vertices are counted."""
    usual, law = defaults(parameters.model), parameters.force_law
    changed = {name for name, value in law.items() if value != usual.get(name)} - {"nv_small", "nv_large"}
    return parameters.sizes is None and not changed


def total_time(lines: list[Estimate], workers: int | None = None) -> tuple[float, float, int]:
    """Wall time, s, core time, s, and the cores at work at most, of all sweeps, those with more ranks first; by default
    with as many workers as fit into the cores of this process."""
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
