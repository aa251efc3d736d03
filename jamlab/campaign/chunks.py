"""Cut the tasks of a campaign into chunks: the seeds that a worker gets in one call, and writes to one file.

A call and a file cost the driver, the scheduler and the disk a few milliseconds and 50 kB, which is more than a packing
of 16 disks. So the tasks of a sweep of many seeds are handed out in chunks that take about ten seconds. The time of a
task is known from the finished tasks of the same sweep, model and n; if none is finished, the first tasks go alone.
Towards the end chunks become smaller, so that no worker is left alone with a long one.
"""

import math
from array import array
from collections import Counter, deque
from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from dataclasses import dataclass

from jamlab.campaign.file import site_count
from jamlab.campaign.keys import highest
from jamlab.campaign.tasks import Batch, Parameters, seeds_before, states_name


@dataclass(frozen=True)
class ChunkRules:
    """How large chunks are, where a sweep does not say so."""

    fewest: int = 1_000  # seeds of a sweep from which on there are chunks; below, each task has a file of its own
    seconds: float = 10.0  # a chunk takes: a thousand times what the call and the file cost
    shortest: float = 1.0  # s of the last chunks: so long workers may wait for each other at the end
    parts: int = 4  # a chunk is at most the work left for each worker, divided by this: times of seeds may differ
    growth: int = 16  # times as many tasks as their time is known of: the first few may be untypical
    first: int = 64  # tasks that go alone before a time is known, or two for each worker: a cluster takes more at once
    sampled: int = 8  # finished tasks that a time given stands for; `plan` averages over so many
    bytes: int = 100_000_000  # of the packings of a chunk, which a worker holds in memory


RULES = ChunkRules()
LARGEST = highest("chunk")  # seeds, which are all lost if its worker dies


class Cutter:
    """Cuts tasks into chunks, one after the other, in the order of the batches.

    Args:
        chosen: batches, the most expensive first.
        names: of the tasks to cut; a task that two batches share is cut once.
        workers: returns the number of workers, which may change.
        seconds: name of a batch -> seconds that one of its tasks takes, where known.
    """

    def __init__(
        self, chosen: Iterable[Batch], names: Container[str], workers: Callable[[], int], seconds: Mapping[str, float]
    ) -> None:
        queues = list(_queues(list(chosen), names, seconds))
        self._of = {queue.batch.name: queue for queue in queues}
        self._queues = [queue for queue in queues if len(queue)]
        self._workers = workers
        self._done = 0.0  # s of tasks that have ended

    def __len__(self) -> int:
        """Number of tasks that no chunk has held so far."""
        return sum(map(len, self._queues))

    def next(self, busy: Container[str] = frozenset()) -> Batch | None:
        """Cut the next chunk.

        Args:
            busy: what the names of tasks under way share with tasks of the same packings (`states_name`); tasks with
                these packings are put off.

        Returns:
            A batch of one or more seeds. None: no task is left, or all that are left are put off until others end.
        """
        for queue in self._queues:
            if seeds := queue.take(self._size(queue), busy):
                if not len(queue):
                    self._queues.remove(queue)
                return queue.batch.part(seeds)
        return None

    def learn(self, chunk: Batch, seconds: float) -> None:
        """Take note that a chunk, or a part of one, has ended, and of the seconds that it took; nan where they are not
        known."""
        self._of[chunk.name].note(len(chunk.seeds), seconds)
        self._done += seconds if math.isfinite(seconds) else 0.0

    def seconds_of(self, batch: str) -> float | None:
        """Mean time, s, of a task of the batch with this name; None where none is known."""
        return self._of[batch].each

    def share_done(self) -> float:
        """Share of the work that has ended, 0 to 1, by the times of the tasks; nan where they are not known."""
        left = sum(queue.work_left(each, 0) for queue, each in self._guessed())
        return self._done / (self._done + left) if self._done + left else 1.0

    def seconds_left(self) -> float:
        """Wall time, s, until all tasks have ended, with as many workers as there are; nan where it is not known."""
        workers = max(1, self._workers())
        work = [queue.work_left(each, workers) for queue, each in self._guessed()]
        last = max((queue.last_left(each) for queue, each in self._guessed()), default=0.0)
        return max(sum(work) / workers, last)

    def _guessed(self) -> "Iterator[tuple[_Queue, float]]":
        """Yield batches with tasks that have not ended, and the mean time of a task; where none has ended, the time of
        the previous batch, in proportion to the sites of a packing."""
        before: _Queue | None = None
        for queue in self._of.values():
            each = queue.each
            if each is not None:
                before = queue
            elif before is not None and before.each is not None:
                each = before.each * _sites(queue.batch.parameters) / _sites(before.batch.parameters)
            if len(queue) or queue.open:
                yield queue, math.nan if each is None else each

    def _size(self, queue: "_Queue") -> int:
        """Number of tasks of the next chunk of a batch; 0 if first the time of a task should be known."""
        if is_alone(queue.batch):
            return 1
        if queue.each is None and queue.batch.chunk is None:
            return int(queue.open < max(RULES.first, 2 * self._workers()))
        left = sum(len(other) * (other.each or 0.0) for other in self._queues)
        size = chunk_size(queue.batch, queue.each or 0.0, left, self._workers())
        return size if queue.batch.chunk else min(size, RULES.growth * queue.tasks)


def is_alone(batch: Batch) -> bool:
    """Whether each task of a batch is a call and a file of its own."""
    return batch.chunk == 1 or (batch.chunk is None and len(batch.seeds) < RULES.fewest)


def chunk_size(batch: Batch, each: float, left: float, workers: int) -> int:
    """Number of tasks of a chunk.

    Args:
        batch: whose tasks have no file of their own.
        each: time of a task, s, which a number of tasks that the sweep gives does not depend on.
        left: time of all tasks that are left, of this batch and others, s.
        workers: number of them.
    """
    most = max(1, min(LARGEST, RULES.bytes // _most_bytes(batch.parameters)))
    if batch.chunk is not None:
        return min(batch.chunk, most)
    share = left / (RULES.parts * max(1, workers))
    seconds = max(RULES.shortest, min(RULES.seconds, share))
    return max(1, min(most, int(seconds / max(each, seconds / LARGEST))))


def count_chunks(batch: Batch, tasks: int, each: float | None, workers: int) -> int | None:
    """Expected number of chunks of so many tasks of a batch; None where the time of a task is needed and not known."""
    if is_alone(batch):
        return tasks
    if batch.chunk is None and each is None:
        return None
    count, left = 0, tasks
    while left > 0:
        left -= chunk_size(batch, each or 0.0, left * (each or 0.0), workers)
        count += 1
    return count


class _Queue:
    """Tasks of a batch that no chunk has held so far, and the time of those that have ended."""

    def __init__(self, batch: Batch, positions: "array[int]", alone: bool, seconds: float | None) -> None:
        self.batch = batch
        self._positions, self._at = positions, 0  # in the seeds of the batch: eight bytes a task
        self._put_off: deque[int] = deque()
        self._alone = alone  # no other batch has the same packings
        self.tasks = 0 if seconds is None else RULES.sampled  # whose time is known
        self._seconds = 0.0 if seconds is None else RULES.sampled * seconds
        self.open = 0  # tasks that were handed out and have not ended
        self._size = 1  # tasks of the last chunk

    def __len__(self) -> int:
        return len(self._positions) - self._at + len(self._put_off)

    @property
    def each(self) -> float | None:
        """Mean time of a task, s."""
        return self._seconds / self.tasks if self.tasks else None

    def note(self, tasks: int, seconds: float) -> None:
        """Add the time of tasks that have ended."""
        self.open = max(0, self.open - tasks)
        if math.isfinite(seconds):
            self.tasks += tasks
            self._seconds += seconds

    def work_left(self, each: float, workers: int) -> float:
        """Seconds of one worker that the tasks take that have not ended; of those that run, half is done."""
        return (len(self) + self.open - min(self.open, workers * self._size) / 2) * each

    def last_left(self, each: float) -> float:
        """Wall time, s, of a chunk that runs or is left: no number of workers makes it shorter."""
        return min(len(self) + self.open, self._size) * each / 2

    def take(self, most: int, busy: Container[str]) -> list[int] | range:
        """Remove the next seeds, at most so many, whose packings nobody makes at present."""
        if self._alone:
            taken = self._positions[self._at : self._at + most].tolist()
            self._at += len(taken)
        else:
            taken = self._take_free(most, busy)
        self.open += len(taken)
        self._size = len(taken) or self._size
        if not taken or taken[-1] - taken[0] != len(taken) - 1:
            return [self.batch.seeds[place] for place in taken]
        return self.batch.seeds[taken[0] : taken[-1] + 1]  # of a range a range, which is sent in a few bytes

    def _take_free(self, most: int, busy: Container[str]) -> list[int]:
        taken: list[int] = []

        def sort_in(place: int) -> None:
            name = states_name(self.batch.name_of(self.batch.seeds[place]))
            (self._put_off if name in busy else taken).append(place)

        while len(taken) < most and self._at < len(self._positions):
            self._at += 1
            sort_in(self._positions[self._at - 1])
        for _ in range(len(self._put_off)):
            if len(taken) < most:
                sort_in(self._put_off.popleft())
        return sorted(taken)


def _queues(chosen: list[Batch], names: Container[str], seconds: Mapping[str, float]) -> Iterator[_Queue]:
    """Yield the tasks to cut of each batch."""
    same_packings = Counter(batch.packings_key for batch in chosen)
    for batch, before in zip(chosen, seeds_before(chosen), strict=True):
        wanted = (place for place, s in enumerate(batch.seeds) if s not in before and batch.name_of(s) in names)
        alone = same_packings[batch.packings_key] == 1
        yield _Queue(batch, array("Q", wanted), alone, seconds.get(batch.name))


def _most_bytes(parameters: Parameters) -> int:
    """Bytes in memory of the packings of one task and of what is measured of them, at most."""
    values = 8 + 4 * (len(parameters.observables) + len(parameters.own))  # of a site, in a state
    return int(_most_states(parameters) * (8 * values * _sites(parameters) + 4_000))


def _sites(parameters: Parameters) -> float:
    """Disks or vertices of a packing."""
    return site_count(parameters.n, parameters.model, parameters.law)


_LOOSEST = 0.5  # rho and phi of an onset, which lies above


def _most_states(parameters: Parameters) -> int:
    """Number of states of one task, at most, but for those that a bisection adds."""
    how = parameters.compress
    if how is None:
        return len(parameters.pressures or parameters.phi or (0,))
    near = 0.0 if how.first_step is None else how.per_decade * (1 + math.log10(how.step / how.first_step))
    way = how.above_onset or 0.0 if how.to is None else how.to - _LOOSEST
    return math.ceil(max(0.0, way) / how.step + near) + 1
