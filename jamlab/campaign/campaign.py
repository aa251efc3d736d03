"""A campaign from Python.

campaign = jamlab.open_campaign("campaign.toml")
campaign.run()
states = campaign.table("states")
"""

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jamlab.campaign.file import CampaignTable, read_campaign_file
from jamlab.campaign.folder import COPY, CampaignFolder
from jamlab.campaign.tasks import Batch, batches
from jamlab.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

    from jamlab.campaign.driver import Tell
    from jamlab.campaign.plan import Estimate


@dataclass(frozen=True)
class SweepStatus:
    """How far the tasks of one sweep, model and n are."""

    sweep: str
    model: str
    n: int
    tasks: int
    finished: int
    failed: int

    @property
    def left(self) -> int:
        """Tasks to do."""
        return self.tasks - self.finished - self.failed


@dataclass(frozen=True)
class Status:
    """How far a campaign is.

    Attributes:
        sweeps: one entry for each sweep, model and n.
        failures: failed task -> record with label, error and reason.
        damaged: finished task -> what is wrong with its file; None if files were not looked into.
        gaps: finished task -> states that it lacks, and why; None if files were not looked into.
        foreign: finished files that belong to no task of the campaign file, e.g. of seeds taken out again, or made with
            other defaults of jamlab.
    """

    sweeps: list[SweepStatus]
    failures: dict[str, dict[str, Any]]
    damaged: dict[str, str] | None
    gaps: dict[str, str] | None
    foreign: int

    @property
    def tasks(self) -> int:
        """All tasks; one that two sweeps share counts in both."""
        return sum(sweep.tasks for sweep in self.sweeps)

    @property
    def finished(self) -> int:
        """Tasks with a file."""
        return sum(sweep.finished for sweep in self.sweeps)

    @property
    def failed(self) -> int:
        """Tasks that cannot be done."""
        return sum(sweep.failed for sweep in self.sweeps)

    @property
    def left(self) -> int:
        """Tasks to do."""
        return sum(sweep.left for sweep in self.sweeps)


@dataclass(frozen=True)
class Run:
    """What one run did.

    Attributes:
        finished: tasks done now.
        failed: tasks that cannot be done, now.
        repaired: tasks whose files were damaged: where the damaged file is now, and what was wrong.
    """

    finished: int
    failed: int
    repaired: dict[str, str]


@dataclass(frozen=True)
class Campaign:
    """A campaign file and the folder of its tasks; made by `open_campaign`.

    Attributes:
        file: the campaign file.
        content: what it says.
        folder: with the files of the tasks.
    """

    file: Path
    content: CampaignTable
    folder: CampaignFolder

    @property
    def name(self) -> str:
        """Name of the campaign."""
        return self.content.name

    def status(self, *, verify: bool = False) -> Status:
        """How far it is, from the names of files alone.

        Args:
            verify: read every finished file and check its checksum.

        Raises:
            InputError: the folder cannot be read.
        """
        finished, failed = self.folder.finished(), self.folder.failed()
        sweeps, known = [], set()
        for batch in batches(self.content):
            names = set(batch.names())
            known |= names
            p = batch.parameters
            counts = (len(names), len(names & finished), len(names & failed))
            sweeps.append(SweepStatus(batch.sweep, p["model"], p["n"], *counts))
        failures = {name: record for name, record in self.folder.failures().items() if name in known}
        damaged = self.folder.damages(known & finished) if verify else None
        gaps = self.folder.gaps((known & finished) - damaged.keys()) if damaged is not None else None
        return Status(sweeps, failures, damaged, gaps, len(finished - known))

    def plan(self, only: Iterable[str] | None = None) -> "list[Estimate]":
        """Tasks, seconds of one core and bytes, without running anything.

        Raises:
            InputError: no sweep of a name in `only`.
        """
        from jamlab.campaign.plan import plan

        return plan(batches(self.content, only), self.folder)

    def run(
        self,
        workers: int | None = None,
        *,
        scheduler: str | None = None,
        slurm: bool = False,
        only: Iterable[str] | None = None,
        retry_failed: bool = False,
        verify: bool = True,
        tell: "Tell | None" = None,
    ) -> Run:
        """Do the tasks that are not done.

        Args:
            workers: processes on this machine, by default as many as it has cores; with `slurm`, jobs.
            scheduler: address of a running Dask scheduler instead.
            slurm: run on SLURM, with the options of the table `slurm` of the campaign file.
            only: names of sweeps.
            retry_failed: try tasks again that failed before.
            verify: read the files that are there first; damaged ones are moved aside and their tasks done again.
            tell: called after each task with "finished" or "failed", a line of text, and seconds.

        Raises:
            InputError: workers that cannot be had.
            StorageError: the folder is in use or cannot be written. Run again to go on.
            EngineError: the workers are lost. Run again to go on.
        """
        from jamlab.campaign.driver import Done, drive, to_do
        from jamlab.campaign.plan import longest_first
        from jamlab.campaign.workers import Workers

        chosen = longest_first(batches(self.content, only))
        where = Workers(workers, scheduler, slurm, self.content.slurm)
        self.folder.prepare()
        with self.folder.lock():
            self.folder.keep_copy(self.file)
            self.folder.sweep_up()
            names = _names(chosen)
            finished = self.folder.finished() & names
            repaired = {}
            for name, reason in self.folder.damages(finished).items() if verify else ():
                repaired[name] = f"{reason}; moved to {self.folder.move_aside(name)}"
            if retry_failed:
                self.folder.forget_failures(self.folder.failed() & names)
            skip = (finished - repaired.keys()) | self.folder.failed()
            if names <= skip:
                return Run(0, 0, repaired)
            with where.client() as client:
                done: Done = drive(client, self.folder, to_do(chosen, skip), tell, expected=where.expected)
        return Run(done.finished, done.failed, repaired)

    def table(self, name: str = "states", sweep: str | None = None) -> "pd.DataFrame":
        """One tidy table of all finished tasks: "states", "onset", "spectra", "quasistatic", "correlation", "voids".

        Args:
            name: of the table; columns: `jamlab.campaign.tables.TABLE_COLUMNS`.
            sweep: tasks of this sweep alone.

        Raises:
            InputError: no such table or sweep.
            StorageError: a file is damaged: `run` mends that.
        """
        from jamlab.campaign.tables import table

        return table(self.folder, self.finished(sweep), name)

    def aggregate(
        self,
        values: Sequence[str],
        by: Sequence[str] = ("model", "n"),
        *,
        table: str = "states",
        sweep: str | None = None,
        converged: bool = True,
        **how: Any,
    ) -> "pd.DataFrame":
        """Means over packings with bootstrap intervals, see `jamlab.campaign.aggregate.aggregate`.

        Args:
            values: columns to average.
            by: columns that make groups.
            table: "states" has two more columns here: d_rho = rho - onset and d_phi = phi - onset_phi.
            sweep: tasks of this sweep alone.
            converged: leave out rows that did not converge.
            how: `along`, `bins`, `statistic`, `confidence`, `resamples`.

        Raises:
            InputError: a table, sweep or column that is not there, or numbers out of range.
            StorageError: a file is damaged.
        """
        from jamlab.campaign.aggregate import aggregate

        frame = self.table(table, sweep)
        if table == "states":
            frame = frame.assign(d_rho=frame["rho"] - frame["onset"], d_phi=frame["phi"] - frame["onset_phi"])
        if converged and "converged" in frame.columns:
            frame = frame[frame["converged"].astype(bool)]
        return aggregate(frame, values, by, **how)

    def finished(self, sweep: str | None = None) -> list[str]:
        """Names of the finished tasks, of all sweeps or one."""
        chosen = batches(self.content, None if sweep is None else [sweep])
        return sorted(self.folder.finished() & _names(chosen))

    def packings(self, task: str) -> list[Any]:
        """The packings of a finished task, frame by frame."""
        from jamlab.packing.hdf5 import read_all

        return read_all(self.folder.task_file(task))


def open_campaign(path: str | os.PathLike[str], folder: str | os.PathLike[str] | None = None) -> Campaign:
    """Open a campaign by its TOML file, or by its folder.

    Args:
        path: the campaign file; or a folder in which a campaign has run.
        folder: where the tasks are, by default a folder of the campaign's name beside the file.

    Raises:
        InputError: the file says what no campaign can do, or the folder holds no campaign.
    """
    given = Path(path)
    if given.name == COPY and folder is None and (given.parent / "tasks").is_dir():  # the copy in a folder
        given = given.parent
    if given.is_dir():
        if folder is not None:
            raise InputError(f"{path} is a folder already: leave out folder = {folder}")
        if not (given / COPY).is_file():
            raise InputError(f"no campaign has run in the folder {path}: give the campaign file")
        return Campaign(given / COPY, read_campaign_file(given / COPY), CampaignFolder(given))
    content = read_campaign_file(given)
    return Campaign(given, content, CampaignFolder(Path(folder) if folder is not None else given.parent / content.name))


def _names(chosen: list[Batch]) -> set[str]:
    return {name for batch in chosen for name in batch.names()}
