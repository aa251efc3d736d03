"""Feed tasks to workers, a bounded number at a time; whatever dies, the files in the folder are whole."""

import itertools
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from jamlab.campaign.folder import CampaignFolder
from jamlab.campaign.standard_error import wanted_batches
from jamlab.campaign.stored_states import StoredStates
from jamlab.campaign.tasks import Batch, Task
from jamlab.campaign.worker import FAILED, FINISHED, FULL, Outcome, run_task
from jamlab.campaign.workers import resources
from jamlab.errors import EngineError, StorageError

if TYPE_CHECKING:
    from distributed import Client, Future

_PER_WORKER = 2  # one that runs and one that waits, so that no worker waits for the driver


@dataclass(frozen=True)
class CampaignRun:
    """What one run of a campaign did.

    Attributes:
        finished: number of tasks finished in this run.
        failed: number of tasks that failed in this run; their reasons are in the folder.
        repaired: task whose file was damaged -> what was wrong, and where that file is now.
    """

    finished: int
    failed: int
    repaired: dict[str, str] = field(default_factory=dict)


def remaining_tasks(batches: Iterable[Batch], skip: set[str]) -> Iterator[Task]:
    """Yield the tasks whose names are not in `skip`, each once."""
    seen = set(skip)
    for batch in batches:
        for task in batch.tasks():
            if task.name not in seen:
                seen.add(task.name)
                yield task


def drive(
    client: "Client",
    folder: CampaignFolder,
    tasks: Iterator[Task],
    progress: Callable[[Outcome], None] | None = None,
    *,
    expected: int = 1,
    stored: StoredStates | None = None,
    modules: Sequence[str] = (),
) -> CampaignRun:
    """Run tasks until none is left.

    Args:
        client: of the Dask scheduler.
        folder: of the campaign, locked.
        tasks: to run, preferably the longest first.
        progress: called after each task with its outcome.
        expected: number of workers to come, e.g. when their jobs start.
        stored: finished tasks whose states may be used again.
        modules: folders that hold modules of the user's own observables.

    Raises:
        StorageError: the folder cannot be written, e.g. the disk is full; running tasks are given up.
        EngineError: the workers cannot run jamlab, or the scheduler is lost.
    """
    from distributed import as_completed

    place = str(folder.path.resolve())
    under_way: dict[str, Task] = {}
    counts = {FINISHED: 0, FAILED: 0}
    ended = as_completed([], loop=client.loop)

    def fill() -> None:
        wanted = _PER_WORKER * max(expected, len(client.nthreads()))
        for task in itertools.islice(tasks, max(0, wanted - len(under_way))):
            key = f"jamlab-{task.name}"
            under_way[key] = task
            source = stored.source(task.parameters) if stored is not None else None
            work = (place, task.name, task.parameters, source and source.name, modules, task.ranks)
            ended.add(client.submit(run_task, *work, key=key, pure=False, resources=resources(task.ranks)))

    fill()
    for future in ended:
        task = under_way.pop(future.key)
        outcome = _outcome(future, folder, task)
        future.release()
        if outcome.state == FULL:
            raise StorageError(f"{outcome.line}; make room, then `jamlab campaign resume` goes on")
        counts[outcome.state] += 1
        if stored is not None and outcome.state == FINISHED:
            stored.add(task)
        if progress is not None:
            progress(outcome)
        fill()
    return CampaignRun(counts[FINISHED], counts[FAILED])


def drive_rounds(
    client: "Client",
    folder: CampaignFolder,
    chosen: list[Batch],
    progress: Callable[[Outcome], None] | None = None,
    expected: int = 1,
    stored: StoredStates | None = None,
    modules: Sequence[str] = (),
) -> CampaignRun:
    """Run what is left of some batches, then the seeds that `until` adds, round by round; see `drive`."""
    finished = failed = 0
    before: list[Batch] = []
    while (wanted := wanted_batches(chosen, folder)) != before:
        tasks = remaining_tasks(wanted, folder.finished() | folder.failed())
        done = drive(client, folder, tasks, progress, expected=expected, stored=stored, modules=modules)
        finished, failed, before = finished + done.finished, failed + done.failed, wanted
    return CampaignRun(finished, failed)


def _outcome(future: "Future", folder: CampaignFolder, task: Task) -> Outcome:
    from distributed.scheduler import KilledWorker

    if future.status == "finished":
        outcome: Outcome = future.result()
        return outcome
    if future.status != "error":
        raise EngineError(f"lost the Dask scheduler during {task.label}: start it again, then `jamlab campaign resume`")
    error = future.exception()
    if isinstance(error, KilledWorker):
        reason = EngineError(f"{task.label}: its workers died again and again: killed, or out of memory")
        folder.record_failure(task, reason)
        return Outcome(FAILED, str(reason), float("nan"))
    raise EngineError(
        f"workers cannot run {task.label}: {error}; they must have the driver's jamlab and see the folder {folder.path}"
    ) from error
