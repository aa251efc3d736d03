"""Open, run and read a campaign from Python, and export its tables.

campaign = jamlab.open_campaign("campaign.toml")
campaign.run()
states = campaign.table("states")
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from jamlab.arguments.choices import TableFormat, TableName
from jamlab.arrays import ArrayLike
from jamlab.campaign.driver import drive
from jamlab.campaign.file import CampaignTable
from jamlab.campaign.folder import WHOLE, CampaignFolder, Share
from jamlab.campaign.observable import load_function
from jamlab.campaign.observables import TABLES
from jamlab.campaign.plan import Status, SweepStatus, longest_first, plan, share_names, status
from jamlab.campaign.running import Running
from jamlab.campaign.standing import CampaignRun, Meter, Standing
from jamlab.campaign.tables import DISTANCES, TableParts, aggregate, in_parts, table, warned_if_none
from jamlab.campaign.tasks import Batch, batches, task_names
from jamlab.campaign.workers import FAILED, FINISHED, Outcome, count_workers
from jamlab.checks import check_choice, checked
from jamlab.errors import InputError, warn
from jamlab.hints import Hinted
from jamlab.packing.packing import Packing
from jamlab.processes.progress import Progress, Tell, told
from jamlab.statistics.confidence import CONFIDENCE
from jamlab.storage.atomic_file import atomic_file, check_target, make_folder
from jamlab.storage.table_file import IN_PARTS, TABLE_FORMATS, check_table_format

if TYPE_CHECKING:
    import pandas as pd

    from jamlab.clusters.cluster import Cluster


class _How(NamedTuple):
    """Arguments of `Campaign.run`."""

    workers: int | Executor | None
    share: Share
    only: list[str] | None
    retry_failed: bool
    pilot: bool
    verify: bool
    progress: Tell
    done: Callable[[Outcome], None]


def _tell_nobody(outcome: Outcome) -> None:
    pass


def _check_run(workers: int | Executor | None, share: Share) -> None:
    """Refuse `workers` or `share` out of range."""
    k, n = share
    if not 1 <= k <= n:
        raise InputError(f"share = {k}/{n}: give K/N with 1 <= K <= N")
    if isinstance(workers, int) and workers < 1:
        raise InputError(f"workers = {workers}: must be 1 or more")


@dataclass(frozen=True)
class Campaign(Hinted):
    r"""A campaign: its file and the folder of its tasks. Made by `open_campaign`.

    Attributes:
        file: the campaign file.
        text: content of the file when it was opened.
        content: values of the file by key.
        folder: holds the files of the tasks.

    Example:
        >>> from pathlib import Path
        >>> sweep = '[[sweep]]\nname = "disks"\nmodel = "sp"\nn = 16\nseeds = 4\npressures = [1e-2, 1e-3]\n'
        >>> _ = Path("small.toml").write_text(f'name = "small"\n{sweep}')
        >>> [(line.sweep, line.n, line.tasks) for line in jamlab.open_campaign("small.toml").plan()]
        [('disks', 16, 4)]
    """

    file: Path
    text: str
    content: CampaignTable
    folder: CampaignFolder

    def __repr__(self) -> str:
        sweeps = ", ".join(sweep.name for sweep in self.content.sweep)
        return f"Campaign({str(self.file)!r}, folder={str(self.folder.path)!r}, sweeps: {sweeps})"

    @property
    def name(self) -> str:
        """Name of the campaign."""
        return self.content.name

    @checked
    def status(self, *, verify: bool = False) -> Status:
        """Count finished, failed and remaining tasks by the names of files.

        Args:
            verify: also read every finished file: check its checksum, and list the states that it lacks.

        Raises:
            InputError: the folder cannot be read.
        """
        return status(batches(self.content), self.folder, verify)

    @checked
    def plan(self, only: Iterable[str] | None = None) -> list[SweepStatus]:
        """Count the tasks of each sweep, model and n, without running anything.

        Time and disk space follow from the finished tasks of the same kind; `run` with `pilot` does one of each. Before
        one is finished, the time is an estimate (`estimated`), which leaves out the names in `without`.

        Args:
            only: names of sweeps; by default all.

        Raises:
            InputError: the campaign has no sweep of a name in `only`.
        """
        return plan(batches(self.content, only), self.folder)

    @checked
    def run(
        self,
        workers: int | Executor | None = None,
        *,
        share: Share = WHOLE,
        only: Iterable[str] | None = None,
        retry_failed: bool = False,
        pilot: bool = False,
        verify: bool = True,
        progress: Progress | None = None,
        done: Callable[[Outcome], None] | None = None,
    ) -> CampaignRun:
        """Run all tasks that are neither finished nor failed.

        Args:
            workers: number of processes on this machine; default: cores divided by the largest `ranks` of the sweeps.
                Or an executor (PEP 3148), such as a cluster, whose workers see the folder under the same path.
            share: (k, n): run every n-th task only, from the k-th on, so that n processes on any machines that share
                the folder, such as jobs of an array, run all of them.
            only: names of sweeps; by default all.
            retry_failed: run tasks again that failed before.
            pilot: run one task of each sweep, model and n of which none is finished, so that `plan` knows its time.
            verify: first read the finished files; damaged ones are moved aside and their tasks run again.
            progress: called as tasks end, at most five times a second, and every few seconds meanwhile, with the share
                of the work that is done, and a line: the tasks finished and failed, the rate, and the time left.
            done: called after each task with its outcome: `state` ("finished" or "failed"), `line` and `seconds`.

        Raises:
            InputError: `workers` or `share` out of range, an observable of your own that cannot be imported, or a
                folder of another campaign.
            StorageError: the folder cannot be written, or another process runs the same tasks in it.
            EngineError: the workers cannot be started, or their executor is broken. Run again to resume.
        """
        _check_run(workers, share)
        only = None if only is None else [*only]
        how = _How(workers, share, only, retry_failed, pilot, verify, told(progress), done or _tell_nobody)
        return self._run(how, Meter())

    @checked
    def start(
        self,
        workers: int | Executor | None = None,
        *,
        share: Share = WHOLE,
        only: Iterable[str] | None = None,
        retry_failed: bool = False,
        pilot: bool = False,
        verify: bool = True,
        progress: Progress | None = None,
        done: Callable[[Outcome], None] | None = None,
    ) -> Running:
        """Run all tasks that are neither finished nor failed in the background, such as from a notebook.

        Errors of the run are raised where it is awaited: `await running`, or `running.wait()`. The run ends with this
        process.

        Args:
            workers: see `run`. The default takes all cores of this machine, also of those that other runs use.
            share: see `run`.
            only: see `run`.
            retry_failed: see `run`.
            pilot: see `run`.
            verify: see `run`.
            progress: see `run`; called in another thread.
            done: see `run`; called in another thread.

        Raises:
            InputError: `workers` or `share` out of range, or an unknown name of a sweep.
        """
        _check_run(workers, share)
        only = None if only is None else [*only]
        how = _How(workers, share, only, retry_failed, pilot, verify, told(progress), done or _tell_nobody)
        batches(self.content, how.only)
        place = CampaignFolder(self.folder.path.absolute())
        here = replace(self, file=self.file.absolute(), folder=place)  # whatever folder another cell goes to
        return Running(self.name, partial(here._run, how))

    def _run(self, how: _How, meter: Meter) -> CampaignRun:
        """Run tasks, and let a meter follow."""
        chosen = longest_first(batches(self.content, how.only))
        if how.pilot:
            known = self.folder.finished()
            chosen = [batch.first(1) for batch in chosen if not known or known.isdisjoint(batch.names())]
        whole = how.share == WHOLE  # a million names take a second and 100 MB
        mine = task_names(chosen) if whole else share_names(batches(self.content), how.share)
        if not whole and (how.only or how.pilot):
            mine &= task_names(chosen)
        self.folder.prepare()
        with self.folder.lock(how.share) as run:
            self.folder.keep_copy(self.text, self.name)
            damages = self.folder.damages(self.folder.finished() & mine) if how.verify else {}
            repaired = {name: f"{why}; moved to {self.folder.move_aside(name)}" for name, why in damages.items()}
            if how.retry_failed:
                self.folder.forget_failures(self.folder.failed() & mine)
            counts, gaps = self._drive(chosen, mine, run, how, meter)
            left = len((mine if whole else task_names(chosen)) - self._ended())
        return CampaignRun(counts[FINISHED], counts[FAILED], repaired, left, gaps)

    @checked
    def cluster(
        self,
        scheduler: str,
        jobs: int | None = None,
        *,
        only: Iterable[str] | None = None,
        tell: Callable[[str], None] = warn,
    ) -> AbstractContextManager[Cluster]:
        """Open workers of a cluster for `run`, through Dask (`pip install 'jamlab[dask]'`), until the block ends.

        Queue, account, memory and walltime of jobs stand in Dask's file `~/.config/dask/jobqueue.yaml`. Jobs that end
        are replaced while there are tasks. A job has a worker for every `ranks` of the cores in that file, by default
        one worker.

        Args:
            scheduler: "slurm", "pbs", "sge", "lsf", "oar", "moab" or "htcondor"; or the address of a Dask scheduler
                ("tcp://host:8786"), or its scheduler file.
            jobs: largest number of jobs of the batch system at a time.
            only: names of sweeps that will be run; by default all.
            tell: called with a line when jobs wait, are refused or end early, also from other threads. Default: a
                warning.

        Returns:
            A context manager of the workers: `executor`, to be handed to `run`, and `dashboard`, the address of Dask's
            pages or None.

        Raises:
            InputError: there is no Dask, no such scheduler, or the settings of the site cannot be.
            EngineError: the batch system refuses all jobs, or the scheduler is gone; when the block ends.

        Example:
            with campaign.cluster("slurm", jobs=20) as cluster:
                campaign.run(cluster.executor)
        """
        from jamlab.clusters.cluster import cluster_executor  # its asyncio would make every command slower

        return cluster_executor(scheduler, jobs, self.folder.path, self._ranks(only), tell)

    @checked
    def job_script(self, scheduler: str, *, only: Iterable[str] | None = None) -> str:
        """Return the script of a job as `cluster` would send it to a batch system; nothing is sent.

        Args:
            scheduler: "slurm", "pbs", "sge", "lsf", "oar", "moab" or "htcondor".
            only: names of sweeps that will be run; by default all.

        Raises:
            InputError: there is no Dask, no such batch system, or the settings of the site cannot be.
        """
        from jamlab.clusters.cluster import job_script

        return job_script(scheduler, self.folder.path, self._ranks(only))

    def _ranks(self, only: Iterable[str] | None) -> int:
        """Cores that a task may need."""
        return max(batch.ranks for batch in batches(self.content, only))

    def _drive(
        self, chosen: list[Batch], mine: set[str], run: str, how: _How, meter: Meter
    ) -> tuple[Counter[str], list[str]]:
        """Run the tasks `mine` by as many workers as hold the cores of the largest number of ranks, or by those of an
        executor; returns the number of outcomes of each state, and the gaps."""
        counts: Counter[str] = Counter()
        gaps: list[str] = []
        finished, failed = (len(mine & names) for names in (self.folder.finished(), self.folder.failed()))
        meter.begin(len(mine), finished, failed)

        def tell(outcome: Outcome) -> None:
            counts[outcome.state] += 1
            if outcome.gaps:
                gaps.append(outcome.gaps)
            meter.count(outcome)
            how.done(outcome)
            meter.look(show)

        def show(standing: Standing) -> None:
            silent = "" if counts.total() else ", no worker has answered yet"
            how.progress(standing.share, f"{standing}{silent}")

        if finished + failed == len(mine):
            return counts, gaps
        meter.look(show)
        place = self.file.parent.resolve()
        modules = [str(place), str(place.parent)] if place == self.folder.path.resolve() else [str(place)]
        for function in sorted({name for batch in chosen for name in batch.parameters.own}):
            load_function(function, modules)  # what cannot be imported is named before any work begins
        where = how.workers
        if not isinstance(where, Executor):
            where = count_workers(where, max(batch.ranks for batch in chosen))
        try:
            left = mine - self._ended()
            drive(self.folder, chosen, left, where, modules, run, tell, meter.follow, lambda: meter.look(show))
        except KeyboardInterrupt:
            if not meter.interrupted:  # but by Ctrl-C
                raise
            meter.stopped = True
        finally:
            meter.end()
        return counts, gaps

    def _ended(self) -> set[str]:
        return self.folder.finished() | self.folder.failed()

    @checked
    def table(self, name: TableName = "states", sweep: str | None = None) -> pd.DataFrame:
        """Collect one tidy table from all finished tasks.

        Args:
            name: "states", "onset", or an observable of the sweeps, such as "spectra"; columns are in
                `jamlab.campaign.tables.TABLE_COLUMNS`; "states" also has the columns of your own observables. Tasks of
                one model that differ in units, force law or sizes have these as further columns.
            sweep: take the tasks of this sweep only.

        Raises:
            InputError: there is no such table or sweep.
            StorageError: a file is damaged; `run` repairs it.
        """
        return table(self.folder, self.finished(sweep), name)

    @checked
    def aggregate(
        self,
        values: Sequence[str],
        by: Sequence[str] = ("model", "n"),
        *,
        table: TableName = "states",
        sweep: str | None = None,
        converged: bool = True,
        along: str | None = None,
        bins: ArrayLike | None = None,
        confidence: float = CONFIDENCE,
    ) -> pd.DataFrame:
        """Average over packings, with bootstrap intervals; see `jamlab.campaign.tables.aggregate`.

        Args:
            values: columns to average.
            by: columns that define the groups.
            table: to take them from. Where it has the columns of which they are made, there are two more here,
                d_rho = rho - rho_J and d_phi = phi - phi_J.
            sweep: take the tasks of this sweep only.
            converged: leave out rows that did not converge.
            along: a further column, cut into bins.
            bins: edges of these bins, ascending; each holds its lower edge, not its upper one.
            confidence: level of the intervals.

        Raises:
            InputError: a table, sweep or column does not exist, a number is out of range, or packings that differ in
                more than `by`, such as in their force law, would be averaged.
            StorageError: a file is damaged.
        """
        parts = TableParts(self.folder, table, [warned_if_none(self.finished(sweep), self.folder)], values)
        (frame,) = parts
        for distance, (end, begin) in DISTANCES.items():
            if end in frame and begin in frame:
                frame[distance] = frame[end] - frame[begin]
        if converged:
            if "converged" not in frame:  # its rows converged as far as their states did
                states = self._rows_of("states", sweep)[["task", "state", "converged"]]
                frame = frame.merge(states, "left", ["task", "state"])
            frame = frame[frame["converged"].astype(bool)]
        return aggregate(frame, values, by, along=along, bins=bins, confidence=confidence, kinds=parts.kinds)

    def _rows_of(self, name: str, sweep: str | None = None) -> pd.DataFrame:
        """A table as by `table`, without a warning of negative moduli, some of which nobody may want."""
        (frame,) = TableParts(self.folder, name, [self.finished(sweep)], ())
        return frame

    @checked
    def export(
        self,
        out: str | os.PathLike[str],
        tables: Iterable[TableName] = (),
        sweep: str | None = None,
        *,
        format: TableFormat = "csv",
        overwrite: bool = True,
    ) -> list[Path]:
        """Write tables for other programs, a file each.

        For "csv" and "tsv" 5000 tasks at a time are in memory, for the other formats one table.

        Args:
            out: folder of the files, which is made if it is missing.
            tables: their names, see `table`; by default all that have rows.
            sweep: take the tasks of this sweep only.
            format: "csv"; "tsv", with tabs; "json", a list of rows, in which null stands for nan; "h5", HDF5 with a
                dataset for each column; or "parquet", which needs pyarrow.
            overwrite: False: where one of the files is there, none is written.

        Returns:
            Paths of the files.

        Raises:
            InputError: there is no such table, sweep or format, or its library is not installed.
            StorageError: a file cannot be written, or is there and may not be replaced.
        """
        check_table_format(format)
        names, written = list(dict.fromkeys(tables)), list[Path]()
        for name in names:
            check_choice("table", name, TABLES)
        with ExitStack() as stack:  # at whose end all files get their names
            chosen = batches(self.content, None if sweep is None else [sweep])
            parts = in_parts(chosen, self.folder.finished()) if format in IN_PARTS else [self.finished(sweep)]
            for name in names or TABLES:
                path, temporary = Path(out) / f"{name}.{format}", None
                for frame in TableParts(self.folder, name, parts):
                    if temporary is None and (len(frame) or names):
                        make_folder(Path(out))
                        check_target(path, replace=overwrite)
                        temporary = stack.enter_context(atomic_file(path))
                        TABLE_FORMATS[format](frame, temporary)
                        written.append(path)
                    elif temporary is not None:
                        IN_PARTS[format](frame, temporary)
        return written

    @checked
    def finished(self, sweep: str | None = None) -> list[str]:
        """List the names of the finished tasks, of all sweeps or of one, in the order of the campaign file and of the
        seeds: neighbours stand in the same file, which is read once."""
        done, chosen = self.folder.finished(), batches(self.content, None if sweep is None else [sweep])
        return list(dict.fromkeys(name for batch in chosen for name in batch.names() if name in done))

    @checked
    def packings(self, task: str) -> list[Packing]:
        """Read the packings of a finished task, frame by frame.

        Raises:
            StorageError: there is no such file, or it is damaged; `run` repairs it.
        """
        return self.folder.packings(task)
