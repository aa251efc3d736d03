"""Hand out the tasks of a campaign to workers, and decide what follows when one of them dies.

Whatever ends a worker, and whatever engine has started it: a chunk that it never began goes out again; of one that it
began, the task that it was at is charged (`deaths.py`) and goes out alone, and the others go out in two halves, so that
a task that ends its workers again and again is found and no other one fails.
"""

import itertools
import math
import os
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from functools import partial

from jamlab.campaign.chunks import Cutter
from jamlab.campaign.deaths import (
    DEATH,
    INTERRUPTED,
    WALLTIME,
    Kills,
    counts,
    forget_deaths,
    is_recorded,
    kind_of_end,
    record_death,
    sweep,
    why_it_fails,
)
from jamlab.campaign.folder import CampaignFolder
from jamlab.campaign.marks import Mark, has_marks, marks_of, read_marks, remove
from jamlab.campaign.plan import seconds_each
from jamlab.campaign.tasks import Batch, Task, states_name
from jamlab.campaign.workers import FAILED, FINISHED, FULL, Call, Outcome, run_chunk
from jamlab.errors import EngineError, StorageError, warn
from jamlab.processes.death import Death
from jamlab.processes.side_by_side import Crew, crew
from jamlab.storage.atomic_file import is_gone, is_here

_MOST_UNBEGUN = 12  # calls lost in a row, for each worker, that nobody had begun: workers cannot start at all
_FEW_WORKERS = 8  # of which it takes account
_MOST_BROKEN = 3  # the same where their engine ended them, for each call that it may have at a time
_MANY_DEATHS = 3  # of workers at a task, from which on it waits for all others: they show how often workers are killed
_DYING, _LOOK = 2.0, 0.05  # s that workers of this machine have to follow their driver, which they look for
_PATIENCE = 2.0  # s without news of any task, after which who looks on hears how far the run is
_MANY_RUNS = 3  # that ended at a task, from which on a warning says so


def drive(
    folder: CampaignFolder,
    chosen: list[Batch],
    names: set[str],
    where: int | Executor,
    modules: Sequence[str],
    run: str,
    tell: Callable[[Outcome], None],
    follow: Callable[[Cutter, Crew], None],
    idle: Callable[[], None],
) -> None:
    """Run tasks in so many workers, or in those of an executor, and tell each outcome.

    Args:
        folder: which `run` holds, the name that its lock gives.
        chosen: batches, the most expensive first.
        names: of their tasks that run.
        where: number of processes of this machine, or an executor (PEP 3148).
        modules: folders with modules of the user's own observables.
        tell: called in this process with each outcome.
        follow: called once, with what knows the times of tasks, and the workers.
        idle: called every few seconds in which no task ends.

    Raises:
        StorageError: the folder cannot be written, or a worker sees another one.
        EngineError: workers cannot be started, or cannot run tasks.
    """
    _take_over(folder, run)
    names = names - _settle(folder, chosen, names, tell)
    with crew(run_chunk, where) as workers:
        driver = _Driver(folder, workers, chosen, names, modules, run, tell, idle)
        follow(driver.cutter, workers)
        driver.drive()
    if found := counts(folder.path):
        forget_deaths(folder.path, found.keys() & folder.finished())


class _Driver:
    """Hands out chunks until all tasks have ended."""

    def __init__(
        self,
        folder: CampaignFolder,
        workers: Crew,
        chosen: list[Batch],
        names: set[str],
        modules: Sequence[str],
        run: str,
        tell: Callable[[Outcome], None],
        idle: Callable[[], None],
    ) -> None:
        self._folder, self._workers, self._modules, self._run = folder, workers, modules, run
        self._tell, self._idle = tell, idle
        self._place = str(folder.path.resolve())
        self.cutter = Cutter(chosen, names, lambda: workers.workers, seconds_each(chosen, folder))
        self._under_way: dict[str, Batch] = {}  # by attempt
        self._number = itertools.count(1)
        self._unbegun = 0  # calls lost in a row that nobody had begun
        same = Counter(batch.packings_key for batch in chosen)
        self._shared = {key for key, count in same.items() if count > 1}  # of batches that make the same packings
        self._busy: set[str] = set()  # what the names of tasks under way share with others of the same packings
        self._stored = _stored(folder, names)
        self._kills = Kills()
        self._last: deque[Batch] = deque()  # tasks that wait for all others

    def drive(self) -> None:
        """Hand out and hear of chunks."""
        self._fill()
        while self._under_way:
            attempt, kind, content = self._workers.wait(_PATIENCE)
            if kind == "nothing":
                self._idle()
            if kind == "error":
                raise EngineError(f"workers cannot run a task: {content}") from content
            if kind == "death":
                self._bury(attempt, content)
            elif kind == "result":
                self._unbegun = 0
                self._end(self._under_way.pop(attempt), content)
            self._fill()

    def _fill(self) -> None:
        while len(self._under_way) < self._workers.width:
            chunk = self.cutter.next(self._busy) or (self._last.popleft() if self._last else None)
            if chunk is None:
                return
            self._submit(chunk)

    def _submit(self, chunk: Batch, *, first: bool = False) -> None:
        attempt, stored, task = f"{self._run}.{next(self._number)}", {}, next(chunk.names())
        if self._stored or chunk.packings_key in self._shared:
            states = {name: states_name(name) for name in chunk.names()}
            stored = {name: self._stored[state] for name, state in states.items() if state in self._stored}
            self._busy |= set(states.values()) if chunk.packings_key in self._shared else set()
        self._under_way[attempt] = chunk
        call = Call(self._place, chunk, task, stored, self._modules, attempt, self._kills.rate)
        self._workers.submit(attempt, call, first=first)

    def _end(self, chunk: Batch, outcomes: Sequence[Outcome]) -> None:
        """Tell how the tasks of a chunk ended, and let others have their packings."""
        shared = chunk.packings_key in self._shared
        for seed, outcome in zip(chunk.seeds, outcomes, strict=False):  # the last one may be "full"
            if outcome.state == FULL:
                raise StorageError(f"{outcome.line}; then `jamlab campaign resume` runs the remaining tasks")
            if shared:
                name = chunk.name_of(seed)
                self._busy.discard(states_name(name))
                if outcome.state == FINISHED:
                    self._stored.setdefault(states_name(name), []).append(name)
            self._kills.end(partial(chunk.name_of, seed), outcome.seconds)
            self._tell(outcome)
        self.cutter.learn(chunk, sum(outcome.seconds for outcome in outcomes))

    def _bury(self, attempt: str, death: Death) -> None:
        """Decide what follows from the death of the worker of an attempt."""
        chunk = self._under_way.pop(attempt)
        marks = marks_of(self._folder.path, attempt)
        seeds = {chunk.name_of(seed): seed for seed in chunk.seeds}
        ended = self._ended(chunk, seeds)
        known = bool(marks) and death.alone  # else it never began, or nobody knows whose fault it is
        alone = self._charge(chunk, seeds, marks, death, ended) if known else []
        remove(mark.path for mark in marks)
        for mark in marks:
            sweep(self._folder.path, mark)
        if known or ended:
            self._unbegun = 0
        else:
            self._lose(death)
        for name, outcome in ended.items():
            self._end(chunk.part([seeds[name]]), [outcome])
        rest = [seed for name, seed in seeds.items() if name not in ended and seed not in alone]
        half = (len(rest) + 1) // 2 if known else len(rest)
        for part in (rest[half:], rest[:half], *([seed] for seed in alone)):  # the last one is the first in line
            if len(part) == 1 and self._kills.of(chunk.name_of(part[0])) >= _MANY_DEATHS:
                self._last.append(chunk.part(part))
            elif part:
                self._submit(chunk.part(part), first=True)

    def _ended(self, chunk: Batch, seeds: dict[str, int]) -> dict[str, Outcome]:
        """Outcomes of the tasks of a chunk that ended before their worker died."""
        ended = {}
        finished = self._folder.finished_of(seeds)
        gaps = self._folder.gaps(finished) if finished else {}
        for name, seed in seeds.items():
            if name in finished:
                ended[name] = Outcome(FINISHED, _task(chunk, seed).parameters.label, math.nan, gaps.get(name, ""))
            elif self._folder.failure_file(name).exists():
                said = self._folder.failure(name)
                ended[name] = Outcome(FAILED, f"{said['label']}: {said['reason']}", math.nan)
        return ended

    def _charge(
        self, chunk: Batch, seeds: dict[str, int], marks: list[Mark], death: Death, ended: dict[str, Outcome]
    ) -> list[int]:
        """Charge the tasks that dead workers were at; returns the seeds of those that run again, and adds the outcomes
        of those that fail by it. Those whose workers died many times wait for all others."""
        again: list[int] = []
        for mark in marks:
            name = next(iter(seeds)) if len(seeds) == 1 else mark.task
            if name not in seeds or name in ended:
                continue
            task = _task(chunk, seeds[name])
            if reason := self._why_it_fails(task, mark, death):
                self._folder.record_failure(task, EngineError(reason))
                ended[name] = Outcome(FAILED, f"{task.parameters.label}: {reason}", math.nan)
            elif task.parameters.seed not in again:
                again.append(task.parameters.seed)
        return [seed for seed in again if chunk.name_of(seed) not in ended]

    def _why_it_fails(self, task: Task, mark: Mark, death: Death) -> str | None:
        """Charge a task with the death of its worker; why it fails by that, None if it may run again."""
        kind = kind_of_end(mark, time.time())
        record_death(self._folder.path, task.name, kind, mark, death.cause)
        if kind == DEATH:
            self._kills.kill(task.name, mark)
        if death.code is not None and death.code >= 0 and not mark.was_told_to_end:
            return f"its worker died with {death.cause}"
        return why_it_fails(self._folder.path, task.name, self._kills.rate)

    def _lose(self, death: Death) -> None:
        """Take note of a call that was lost before it began, or with others."""
        self._unbegun += 1
        most = _MOST_UNBEGUN * min(self._workers.workers, _FEW_WORKERS)
        if not death.alone:
            most = _MOST_BROKEN * self._workers.width
        if self._unbegun > most:
            if not has_marks(self._folder.path, self._run):
                raise EngineError(f"workers die as soon as they start, the last by {death.cause}: see stderr")
            self._unbegun = 0


def _stored(folder: CampaignFolder, names: set[str]) -> dict[str, list[str]]:
    """Finished tasks that hold packings of some tasks, by what their names share."""
    found: dict[str, list[str]] = {}
    if finished := folder.finished():
        wanted = set(map(states_name, names))
        for name in finished:
            if states_name(name) in wanted:
                found.setdefault(states_name(name), []).append(name)
    return found


def _task(batch: Batch, seed: int) -> Task:
    return next(batch.part([seed]).tasks())


def _take_over(folder: CampaignFolder, run: str) -> None:
    """Turn the marks that dead runs have left into records: no task is charged with the end of the driver."""
    share = run.partition(".")[0]

    def is_dead(name: str) -> bool:
        other = name.partition(".")[0]  # shares of another number cannot run at the same time
        return other == share or other.rpartition("-")[2] != share.rpartition("-")[2]

    patience = time.monotonic() + _DYING
    for mark in read_marks(folder.path, is_dead):
        name = mark.task
        if name is not None and not (folder.has_ended(name) or is_recorded(folder.path, mark)):
            long = mark.was_told_to_end and kind_of_end(mark, mark.changed) == WALLTIME
            record_death(
                folder.path, name, WALLTIME if long else INTERRUPTED, mark, "the end of its job" if long else ""
            )
        remove([mark.path])
        if _is_gone(mark, patience):
            sweep(folder.path, mark)


def _is_gone(mark: Mark, patience: float) -> bool:
    """Whether the worker of a mark has ended, which one of this machine does soon after its driver; `patience`: time of
    the clock until which that is waited for."""
    while not (gone := is_gone(mark.host, mark.process)) and time.monotonic() < patience:
        if not is_here(mark.host) or mark.process == os.getpid():
            break
        time.sleep(_LOOK)
    return gone


def _settle(folder: CampaignFolder, chosen: list[Batch], names: set[str], tell: Callable[[Outcome], None]) -> set[str]:
    """Record and tell which tasks fail by the deaths of earlier runs; returns their names. Those that ended with many
    runs are named in a warning."""
    found = counts(folder.path)
    failed: set[str] = set()
    if found:
        forget_deaths(folder.path, found.keys() & folder.finished())
    for task in _tasks(chosen, found.keys() & names):
        reason = why_it_fails(folder.path, task.name)
        if reason is not None:
            folder.record_failure(task, EngineError(reason))
            tell(Outcome(FAILED, f"{task.parameters.label}: {reason}", math.nan))
            failed.add(task.name)
        elif (runs := found[task.name][INTERRUPTED]) >= _MANY_RUNS:
            said = f"{task.parameters.label}: {runs} runs were killed while it was under way"
            warn(f"{said}: does it take longer than a job, or more memory than it has?")
    return failed


def _tasks(chosen: list[Batch], names: set[str]) -> Iterator[Task]:
    """Yield a few of the tasks."""
    left = set(names)
    for batch in chosen if left else ():
        for seed in batch.seeds:
            if (name := batch.name_of(seed)) in left:
                left.remove(name)
                yield _task(batch, seed)
