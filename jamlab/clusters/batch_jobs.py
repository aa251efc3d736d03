"""Keep so many jobs of a batch system at work as there are tasks for, whatever becomes of each.

| a job                                       | what is done                                             |
|---------------------------------------------|----------------------------------------------------------|
| ends, by its walltime or otherwise          | another one is sent                                      |
| is refused                                  | sent again after 1, 2, 4, ... 60 s; refused again and    |
|                                             | again while no other job is there: the run ends          |
| vanishes from the queue before it began     | another one is sent                                      |
| ends before its workers reach the scheduler | another one is sent; after several in a row the run ends |
| has nothing to do                           | cancelled                                                |

All of it runs in the event loop of the scheduler.
"""

import asyncio
import math
import time
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from jamlab.clusters.batch_system import listed_jobs

_LOOK = 1.0  # s between two looks at the jobs
_AT_ONCE = 8  # jobs sent or cancelled side by side
_LONGEST_PAUSE = 60.0  # s between two attempts to send a job
_MOST_REFUSALS = 6  # in a row while no job is there: half a minute
_MOST_BARREN = 6  # jobs in a row that end before their workers reach the scheduler, while none is at work
_DOUBT = 4.0  # s after which the batch system is asked about a job whose workers are gone
_ASK_AGAIN = 5.0
_ASK_WAITING = 30.0  # s between two questions about jobs that wait: they are cheap for it, but not for nothing
_GIVEN_UP = 60.0  # s after which a job without workers is cancelled, if the batch system says nothing or that it runs
_IDLE = 60.0  # s without a task after which a job is cancelled
_SILENT = 60.0  # s without any job at work until the user hears of it
_CANCELLING = 15.0  # s that the end of a run waits for the batch system


@dataclass
class Job:
    """A job that was sent and has not ended, as far as is known."""

    handle: Any  # of dask_jobqueue: `start` sends it, `close` cancels it, `job_id`
    sent: float
    reached: bool = False  # its workers reached the scheduler
    gone: float | None = None  # since when it has none
    idle: float | None = None  # since when none of them has a task

    @property
    def number(self) -> str:
        """Number that the batch system gave it."""
        return str(self.handle.job_id).partition(".")[0]


@dataclass
class BatchJobs:
    """The jobs of one run."""

    most: int  # jobs at a time
    workers: int  # of a job
    make: Callable[[str], Any]  # a job of a name, to be sent
    at_work: Callable[[], Mapping[str, bool]]  # workers known to the scheduler: name -> whether it has a task
    tasks: Callable[[], int]  # that have not ended
    ask: Callable[[], Awaitable[str | None]]  # lists the jobs in the queue; None: no answer
    tell: Callable[[str], None]  # a line for the user
    fail: Callable[[str], None]  # ends the run, with the reason
    lists: str  # the command that lists the jobs
    jobs: dict[str, Job] = field(default_factory=dict)
    sent: set[str] = field(default_factory=set)  # numbers of all jobs so far
    _count: int = 0
    _refusals: int = 0  # in a row
    _in_vain: int = 0  # of these, the last ones, when no job was there
    _next: float = 0.0  # no job is sent before
    _barren: int = 0
    _asked: float = 0.0
    _silent: float | None = None  # since when no job has been at work; inf once the user has heard of it
    _told: set[str] = field(default_factory=set)
    _stopping: bool = False

    async def keep(self) -> None:
        """Look after the jobs until `stop`."""
        try:
            while not self._stopping:
                await self._look(time.monotonic())
                await asyncio.sleep(_LOOK)
        except Exception as error:  # whatever it is, a run whose jobs nobody keeps would wait for ever
            self.fail(f"jobs cannot be kept: {type(error).__name__}: {error}")

    async def stop(self) -> None:
        """Cancel all jobs; those that are being sent meanwhile as well."""
        self._stopping = True
        end = time.monotonic() + _CANCELLING
        left = list(self.jobs.values())
        while left and time.monotonic() < end:
            now, left = left[:_AT_ONCE], left[_AT_ONCE:]
            with suppress(TimeoutError):
                await asyncio.wait_for(self._cancel(now), max(0.1, end - time.monotonic()))
        self.jobs.clear()

    def _workers_of_jobs(self) -> dict[str, list[bool]]:
        """Job -> whether each of its workers has a task."""
        found: dict[str, list[bool]] = {}
        for worker, busy in self.at_work().items():
            if (name := worker.rsplit("-", 2)[0]) in self.jobs:
                found.setdefault(name, []).append(busy)
        return found

    async def _look(self, now: float) -> None:
        workers = self._workers_of_jobs()
        for name, job in self.jobs.items():
            self._note(job, workers.get(name, []), now)
        if workers:
            self._barren = 0
        await self._find_ended(now)
        wanted = min(self.most, -(-self.tasks() // self.workers))
        await self._cancel_idle(len(self.jobs) - wanted, now)
        if wanted > len(self.jobs) and now >= self._next and not self._stopping:
            await self._send(min(_AT_ONCE, wanted - len(self.jobs)), now)
        self._say_what_waits(bool(workers) or wanted == 0, now)

    def _note(self, job: Job, busy: list[bool], now: float) -> None:
        job.reached = job.reached or bool(busy)
        job.gone = None if busy or not job.reached else job.gone or now
        job.idle = None if any(busy) or not busy else job.idle or now

    async def _find_ended(self, now: float) -> None:
        """Ask the batch system about jobs of which the scheduler knows nothing."""
        doubtful = [job for job in self.jobs.values() if job.gone is not None and now - job.gone > _DOUBT]
        waiting = [job for job in self.jobs.values() if not job.reached and now - job.sent > _DOUBT]
        pause = _ASK_AGAIN if doubtful else _ASK_WAITING
        if not (doubtful or waiting) or now - self._asked < pause:
            return
        self._asked = now
        listed = await self.ask()
        known = None if listed is None else listed_jobs(listed)
        for name, job in list(self.jobs.items()):
            if known is not None and (job in doubtful or job in waiting) and job.number not in known:
                del self.jobs[name]
                self._count_barren(job)
            elif job in doubtful and job.gone is not None and now - job.gone > _GIVEN_UP:
                del self.jobs[name]
                await self._cancel([job])

    def _count_barren(self, job: Job) -> None:
        if job.reached:
            return
        self._barren += 1
        self._tell_once("job", f"job {job.number} ended before its workers reached the scheduler: another one is sent")
        if self._barren >= _MOST_BARREN and not any(other.reached for other in self.jobs.values()):
            self.fail(f"{self._barren} jobs in a row ended before their workers reached the scheduler")

    async def _cancel_idle(self, surplus: int, now: float) -> None:
        """Cancel jobs that are too many: those that wait, then those that have had nothing to do for some time."""
        idle = [(name, job) for name, job in self.jobs.items() if job.idle is not None and now - job.idle > _IDLE]
        waiting = [(name, job) for name, job in self.jobs.items() if not job.reached and now - job.sent > _IDLE]
        for name, job in [*waiting, *idle][: max(0, surplus)]:
            del self.jobs[name]
            await self._cancel([job])

    async def _send(self, count: int, now: float) -> None:
        handles = {}
        for _ in range(1 if self._refusals else count):
            self._count += 1
            name = f"jamlab-{self._count}"
            handles[name] = self.make(name)
        sent = await asyncio.gather(*(self._start(handle) for handle in handles.values()))
        refused = [said for said in sent if said is not None]
        for (name, handle), said in zip(handles.items(), sent, strict=True):
            if said is None:
                self.jobs[name] = Job(handle, now)
                self.sent.add(self.jobs[name].number)
        if not refused:
            self._refusals, self._in_vain, self._next = 0, 0, 0.0
            return
        self._refusals += 1
        self._in_vain = 0 if self.jobs else self._in_vain + 1
        self._next = now + min(_LONGEST_PAUSE, 2.0 ** ((self._in_vain or self._refusals) - 1))
        if self._in_vain >= _MOST_REFUSALS:
            self.fail(refused[0])
        else:
            kept = f"{len(self.jobs)} jobs are there" if self.jobs else "no job is there"
            self._tell_once(refused[0], f"{refused[0]}; {kept}, and it is asked again from time to time")

    async def _start(self, handle: Any) -> str | None:
        """Send a job; returns what the batch system says against it."""
        try:
            await handle.start()
        except (RuntimeError, OSError, ValueError) as error:  # refused; no such program; an answer without a number
            return _reason(error)
        if self._stopping:  # the run ended meanwhile
            await self._cancel([Job(handle, 0.0)])
        return None

    async def _cancel(self, jobs: list[Job]) -> None:
        await asyncio.gather(*(job.handle.close() for job in jobs), return_exceptions=True)

    def _say_what_waits(self, fine: bool, now: float) -> None:
        """Tell, each time that it happens, that no job has been at work for some time."""
        if fine:
            self._silent = None
            return
        self._silent = now if self._silent is None else self._silent
        if self.jobs and now - self._silent > _SILENT:
            self._silent = math.inf
            waiting = f"no worker for {_SILENT:.0f} s: {len(self.jobs)} jobs wait in the queue or have just begun"
            self.tell(f"{waiting}; `{self.lists}` lists them, and the run goes on when one begins")

    def _tell_once(self, key: str, line: str) -> None:
        if key not in self._told:
            self._told.add(key)
            self.tell(line)


def _reason(error: Exception) -> str:
    """What the batch system said, of what `dask_jobqueue` raises: the lines below "stderr:", or below "stdout:"."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    for heading in ("stderr:", "stdout:"):
        if heading in lines:
            after = lines[lines.index(heading) + 1 :]
            said = after[: next((k for k, line in enumerate(after) if line in ("stderr:", "stdout:")), None)]
            if said:
                return " ".join(said)
    return " ".join(lines) or type(error).__name__
