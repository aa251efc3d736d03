"""Tasks through workers, a bounded number at a time; whatever dies, the files that are there are whole."""

import itertools
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from jamlab.campaign.folder import CampaignFolder
from jamlab.campaign.tasks import Batch, Task
from jamlab.campaign.worker import FAILED, FINISHED, FULL, run_task
from jamlab.errors import EngineError, StorageError

Tell = Callable[[str, str, float], None]  # what happened to a task, a line about it, seconds it took

_PER_WORKER = 2  # submitted at once, so that no worker waits for the driver


@dataclass(frozen=True)
class Done:
    """What a run did.

    Attributes:
        finished: tasks done now.
        failed: tasks that cannot be done; their reasons are in the folder.
    """

    finished: int
    failed: int


def to_do(batches: Iterable[Batch], skip: set[str]) -> Iterator[Task]:
    """Tasks whose names are not in `skip`, each once; made one by one as they are needed."""
    seen = set(skip)
    for batch in batches:
        for seed in batch.seeds:
            name = batch.name_of(seed)
            if name not in seen:
                seen.add(name)
                yield Task(name, {**batch.parameters, "seed": seed})


def drive(
    client: Any, folder: CampaignFolder, tasks: Iterator[Task], tell: Tell | None = None, *, expected: int = 1
) -> Done:
    """Run tasks until none is left.

    Args:
        client: `distributed.Client`.
        folder: of the campaign, locked.
        tasks: what to do, best the longest first.
        tell: called after each task.
        expected: workers that will come, e.g. when their jobs start.

    Raises:
        StorageError: the folder cannot be written, e.g. the disk is full; what is under way is given up.
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
            ended.add(client.submit(run_task, place, task.name, task.parameters, key=key, pure=False))

    fill()
    for future in ended:
        state, line, seconds = _result(future, folder, under_way.pop(future.key))
        future.release()
        if state == FULL:
            raise StorageError(f"{line}; make room, then `jamlab campaign resume` goes on")
        counts[state] += 1
        if tell is not None:
            tell(state, line, seconds)
        fill()
    return Done(counts[FINISHED], counts[FAILED])


def _result(future: Any, folder: CampaignFolder, task: Task) -> tuple[str, str, float]:
    from distributed.scheduler import KilledWorker

    if future.status == "finished":
        outcome: tuple[str, str, float] = future.result()
        return outcome
    if future.status != "error":
        raise EngineError(f"lost the Dask scheduler during {task.label}: start it again, then `jamlab campaign resume`")
    error = future.exception()
    if isinstance(error, KilledWorker):
        reason = EngineError(f"{task.label}: its workers died again and again: killed, or out of memory")
        folder.record_failure(task, reason)
        return FAILED, str(reason), float("nan")
    raise EngineError(
        f"workers cannot run {task.label}: {error}; they need the jamlab of the driver and see the folder {folder.path}"
    ) from error
