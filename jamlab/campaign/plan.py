"""Say how far a campaign is, and how many seconds of its cores, bytes on disk and files the remaining tasks take.

The time and size of the tasks that are left follow from the finished tasks of the same sweep, model and n; `run` with
`pilot` does one of each. Before one is finished, the time is estimated from the work of a task and the table of
`cost.py`, which another machine measured. A task whose packings are stored costs what the stored one did not measure. A
task of several ranks holds as many cores all its time, also while one of them measures.
"""

import itertools
from array import array
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from jamlab.campaign.chunks import count_chunks, is_alone
from jamlab.campaign.cost import estimate_task
from jamlab.campaign.file import site_count
from jamlab.campaign.folder import CampaignFolder, Share
from jamlab.campaign.tasks import Batch, seeds_before, states_name
from jamlab.processes.cores import available_cores

_SAMPLES = 8  # finished tasks to average over; reading more would slow down `plan`
_FILE = 20_000  # bytes that a file of several tasks takes beside what it holds of each; measured
_READ = 1_000  # finished tasks to average over at the start of a run


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
    # for the tasks left: seconds of cores, bytes on disk and files; None in `status`, and before a task of this kind is
    # finished: the number of files where it depends on the time of a task, the seconds of packings without an estimate
    seconds: float | None = None
    bytes: int | None = None
    files: int | None = None
    estimated: bool = False  # `seconds` is an estimate, since no task of this kind is finished
    without: tuple[str, ...] = ()  # what an estimate leaves out, since its cost is not known


@dataclass(frozen=True)
class Status:
    """Progress of a campaign: `tasks`, `finished`, `failed` and `left` of all `sweeps`, a task that several share being
    one.

    Attributes:
        sweeps: one entry for each sweep, model and n.
        failures: failed task -> record with label, error and reason.
        damaged: name of a file: a finished task, or `chunk-...` of several -> damage; None if the files were not read.
        gaps: finished task -> states it lacks, and why; None if the files were not read.
        foreign: number of finished tasks that are none of the campaign file, e.g. because seeds were removed
            from it, or because the defaults of jamlab have changed.
        running: number of tasks that workers are at, of this campaign file and of others that run in its folder.
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
    running: int


def status(batches: list[Batch], folder: CampaignFolder, verify: bool) -> Status:
    """Count the tasks of batches; arguments and errors as in `Campaign.status`."""
    finished = folder.finished()
    counted = _count(batches, finished, folder.failed())
    failures = sorted({name for each in counted for name in each.failed})
    damaged, gaps = None, None
    if verify:
        names = list({each.batch.name_of(each.batch.seeds[k]): None for each in counted for k in each.finished})
        damaged, gaps = folder.damages(names), folder.gaps(names)
    tasks, known, left = (sum(column) for column in zip(*((c.new, c.known, len(c.left)) for c in counted), strict=True))
    return Status(
        [_line(each, 0) for each in counted],
        tasks,
        known,
        tasks - known - left,
        left,
        {name: folder.failure(name) for name in failures},
        damaged,
        gaps,
        len(finished) - known,
        folder.count_running(),
    )


@dataclass
class _Counted:
    """The tasks of a batch, by their places in its seeds: eight bytes a task."""

    batch: Batch
    new: int = 0  # tasks that no batch before has
    known: int = 0  # finished ones among these
    finished: "array[int]" = field(default_factory=lambda: array("Q"))
    failed: list[str] = field(default_factory=list)  # names
    left: "array[int]" = field(default_factory=lambda: array("Q"))  # that no batch before has


def _count(batches: list[Batch], finished: set[str], failed: set[str]) -> list[_Counted]:
    found = []
    for batch, before in zip(batches, seeds_before(batches), strict=True):
        found.append(each := _Counted(batch))
        for place, (seed, name) in enumerate(zip(batch.seeds, batch.names(), strict=True)):
            new = seed not in before
            each.new += new
            if name in finished:
                each.finished.append(place)
                each.known += new
            elif name in failed:
                each.failed.append(name)
            elif new:
                each.left.append(place)
    return found


def _line(counted: _Counted, stored: int, **cost: Any) -> SweepStatus:
    batch = counted.batch
    counts = (len(batch.seeds), len(counted.finished), len(counted.failed), len(counted.left), stored)
    return SweepStatus(batch.sweep, batch.parameters.model, batch.parameters.n, batch.ranks, *counts, **cost)


def plan(batches: list[Batch], folder: CampaignFolder, *, samples: int = _SAMPLES) -> list[SweepStatus]:
    """Count the tasks of each sweep, model and n, and what those left take, by at most so many files of each."""
    finished = folder.finished()
    counted = _count(batches, finished, folder.failed())
    same = Counter(batch.packings_key for batch in batches)
    others = len(finished) > sum(each.known for each in counted)  # files of other tasks, which may hold packings
    held: dict[str, str] | None = None
    lines = []
    for each in counted:
        stored: list[str] = []
        if each.left and (others or same[each.batch.packings_key] > 1):
            held = held or {states_name(name): name for name in sorted(finished)}
            states = (states_name(each.batch.name_of(each.batch.seeds[place])) for place in each.left)
            stored = sorted(held[name] for name in states if name in held)
        lines.append(_line(each, len(stored), **_cost(each, stored, folder, samples)))
    return lines


def _cost(counted: _Counted, stored: list[str], folder: CampaignFolder, samples: int) -> dict[str, Any]:
    """What the tasks of a batch take that are left, `stored` of which find their packings in these files."""
    batch, left = counted.batch, len(counted.left)
    if not left:
        return {"seconds": 0.0, "bytes": 0, "files": 0}
    workers = max(1, available_cores() // batch.ranks)
    step = max(1, len(counted.finished) // samples)  # evenly, since the first ones may be untypical
    done = [batch.name_of(batch.seeds[k]) for k in counted.finished[::step][:samples]]
    whole = folder.read(done)  # without those that are damaged
    times = [file.seconds for file in whole.values()]
    if not times:
        files = count_chunks(batch, left, None, workers)
        guess = estimate_task(batch)
        if guess.making is None:
            return {"files": files}
        seconds = guess.making * (left - len(stored)) + guess.measuring * left
        return {"seconds": seconds, "files": files, "estimated": True, "without": guess.without}
    spared = [file.seconds for file in folder.read(stored[:samples]).values()]
    one = float(np.mean(times))
    work = one * left - min(float(np.mean(spared or [0])), one) * len(stored)
    files = count_chunks(batch, left, work / left, workers)
    size = float(np.mean([folder.bytes_of(name, together=not is_alone(batch)) for name in whole])) * left
    size += 0 if is_alone(batch) else _FILE * (files or 0)
    return {"seconds": work * batch.ranks, "bytes": int(size), "files": files}


def seconds_each(batches: list[Batch], folder: CampaignFolder) -> dict[str, float]:
    """Mean wall time, s, of the tasks left of each batch, by its name, where tasks of the same kind are finished."""
    if not folder.finished():
        return {}
    samples = max(1, min(_SAMPLES, _READ // len(batches)))
    lines = plan(batches, folder, samples=samples)
    return {
        batch.name: line.seconds / line.ranks / line.left
        for batch, line in zip(batches, lines, strict=True)
        if line.left and line.seconds is not None and not line.estimated
    }


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
        return site_count(made.n, made.model, made.law)

    return sorted(batches, key=sites, reverse=True)


def share_names(batches: list[Batch], share: Share) -> set[str]:
    """Names of the tasks of share k of n: every n-th of all tasks of a campaign, the longest first, from the k-th on.
    They depend on the campaign file alone, so that no two shares have a task in common whatever is finished."""
    k, n = share
    ordered = longest_first(batches)
    tasks = (
        (batch, seed)
        for batch, before in zip(ordered, seeds_before(ordered), strict=True)
        for seed in batch.seeds
        if seed not in before
    )
    return {batch.name_of(seed) for batch, seed in itertools.islice(tasks, k - 1, None, n)}
