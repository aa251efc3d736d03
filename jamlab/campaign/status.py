"""Count the tasks of a campaign that are finished, failed and left."""

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

from jamlab.campaign.folder import CampaignFolder
from jamlab.campaign.standard_error import precision
from jamlab.campaign.task_file import read_seconds
from jamlab.campaign.tasks import Batch
from jamlab.errors import StorageError


@dataclass(frozen=True)
class SweepStatus:
    """Progress of one sweep, model and n.

    Attributes:
        sweep: its name.
        model: "sp" or "dp".
        n: number of particles.
        tasks: number of tasks; with `until`, of those that are wanted by now.
        finished: number of tasks with a file.
        failed: number of tasks that failed.
        most: number of seeds that may be used.
        until: column -> wanted standard error of its mean; empty without `until`.
        errors: column -> standard error by now; nan for fewer than two packings.
        seconds, cpu_seconds: wall time and CPU time of the finished tasks, s; None if the files were not read, CPU time
            nan with files of jamlab 0.1.0 among them. A task that took its packings from another counts them too.
    """

    sweep: str
    model: str
    n: int
    tasks: int
    finished: int
    failed: int
    most: int
    until: dict[str, float]
    errors: dict[str, float]
    seconds: float | None = None
    cpu_seconds: float | None = None

    @property
    def left(self) -> int:
        """Number of tasks neither finished nor failed."""
        return self.tasks - self.finished - self.failed


@dataclass(frozen=True)
class Status:
    """Progress of a campaign.

    Attributes:
        sweeps: one entry for each sweep, model and n.
        failures: failed task -> record with label, error and reason.
        damaged: finished task -> damage of its file; None if the files were not read.
        gaps: finished task -> states it lacks, and why; None if the files were not read.
        foreign: number of finished files that belong to no task of the campaign file, e.g. because seeds were removed
            from it, or because the defaults of jamlab have changed.
    """

    sweeps: list[SweepStatus]
    failures: dict[str, dict[str, Any]]
    damaged: dict[str, str] | None
    gaps: dict[str, str] | None
    foreign: int

    @property
    def tasks(self) -> int:
        """Number of tasks; one that two sweeps share counts in both."""
        return sum(sweep.tasks for sweep in self.sweeps)

    @property
    def finished(self) -> int:
        """Number of tasks with a file."""
        return sum(sweep.finished for sweep in self.sweeps)

    @property
    def failed(self) -> int:
        """Number of tasks that failed."""
        return sum(sweep.failed for sweep in self.sweeps)

    @property
    def left(self) -> int:
        """Number of tasks neither finished nor failed."""
        return sum(sweep.left for sweep in self.sweeps)


def count_tasks(batches: Iterable[Batch], folder: CampaignFolder, verify: bool) -> Status:
    """Count the tasks of batches; arguments and errors as in `Campaign.status`."""
    finished, failed = folder.finished(), folder.failed()
    sweeps, known = [], set()
    for batch in batches:
        known |= set(batch.names())
        reached = precision(batch, folder, finished, failed)
        names = set(batch.first(reached.seeds).names())
        p = batch.parameters
        counts = (len(names), len(names & finished), len(names & failed), len(batch.seeds))
        line = SweepStatus(batch.sweep, p["model"], p["n"], *counts, batch.until, reached.errors)
        sweeps.append(_timed(line, folder, names & finished) if verify else line)
    failures = {name: record for name, record in folder.failures().items() if name in known}
    damaged = folder.damages(known & finished) if verify else None
    gaps = folder.gaps((known & finished) - damaged.keys()) if damaged is not None else None
    return Status(sweeps, failures, damaged, gaps, len(finished - known))


def _timed(line: SweepStatus, folder: CampaignFolder, names: set[str]) -> SweepStatus:
    """Add the times of tasks; those whose files are damaged count nothing."""
    wall = cpu = 0.0
    for name in names:
        with suppress(StorageError):
            seconds = read_seconds(folder.task_file(name))
            wall, cpu = wall + seconds[0], cpu + seconds[1]
    return replace(line, seconds=wall, cpu_seconds=cpu)
