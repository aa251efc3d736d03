"""What a run of a campaign did, and how far it is: what the progress line and `Running` show."""

import math
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from jamlab.campaign.chunks import Cutter
from jamlab.campaign.workers import FAILED, Outcome
from jamlab.processes.progress import in_words
from jamlab.processes.side_by_side import Crew

_LOOK = 0.2  # s between two looks of a progress line: a line for each of a million tasks would cost more than they do
_WINDOW, _SAMPLE = 30, 2.0  # the rate is that of so many samples, at least so many seconds apart


@dataclass(frozen=True)
class CampaignRun:
    """What one run of a campaign did.

    Attributes:
        finished: number of tasks.
        failed: number of tasks; the reasons are in the folder.
        repaired: name of a damaged file: a task, or `chunk-...` of several -> what was wrong, and where it is now.
        left: number of tasks of the chosen sweeps neither finished nor failed: those of other shares.
        gaps: one line for each task that finished without some of its states: which, and why.
    """

    finished: int
    failed: int
    repaired: dict[str, str]
    left: int
    gaps: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Standing:
    """How far a run is.

    Attributes:
        tasks: number of tasks that the run was started for, those that were finished before included.
        finished: number of tasks.
        failed: number of tasks.
        share: share of the work that is done, 0 to 1, by the times of the tasks; by their number where these are not
            known.
        rate: tasks that ended, per second, in the last minutes; nan before the first one.
        seconds_left: expected wall time, s, of the remaining tasks; nan before it is known.
        workers: number of tasks or chunks that run at a time, as far as it is known; 0 before workers are started.
    """

    tasks: int
    finished: int
    failed: int
    share: float
    rate: float
    seconds_left: float
    workers: int

    def __str__(self) -> str:
        said = [f"{self.finished} of {self.tasks} tasks"]
        if self.failed:
            said.append(f"{self.failed} failed")
        if self.seconds_left >= 1:
            said.append(f"about {in_words(self.seconds_left)} left")
        if self.rate > 0:
            number, unit = next((self.rate * s, unit) for s, unit in _UNITS if self.rate * s >= 1 or unit == "day")
            said.append(f"{number:.3g} tasks/{unit}" if number < 1000 else f"{number:.0f} tasks/{unit}")
        if self.workers:
            said.append(f"{self.workers} worker{'s'[: self.workers != 1]}")
        return ", ".join(said)


_UNITS = ((1, "s"), (60, "min"), (3600, "h"), (86_400, "day"))


class Meter:
    """Follows one run, and ends it from another thread."""

    def __init__(self) -> None:
        self.tasks, self.finished, self.failed = 0, 0, 0
        self._before = 0  # tasks that ended in earlier runs
        self._cutter: Cutter | None = None
        self._crew: Crew | None = None
        self._samples: deque[tuple[float, int]] = deque(maxlen=_WINDOW)
        self._looked, self._end = 0.0, math.inf  # times
        self._lock = threading.Lock()  # of the crew
        self.interrupted = False  # the driver is asked to end
        self.stopped = False  # it ended for that reason

    def begin(self, tasks: int, finished: int, failed: int) -> None:
        """Set the number of tasks of the run, and how many of them ended before."""
        self.tasks, self.finished, self.failed = tasks, finished, failed
        self._before = finished + failed
        self._samples.append((time.monotonic(), self._before))

    def follow(self, cutter: Cutter, crew: Crew) -> None:
        """Take the times of tasks from a cutter, and the number of workers from a crew."""
        with self._lock:
            self._cutter, self._crew = cutter, crew
            if self.interrupted:
                crew.interrupt()

    def end(self) -> None:
        """Take note that the workers are gone."""
        with self._lock:
            self._crew, self._end = None, time.monotonic()

    def interrupt(self) -> None:
        """End the run as soon as it waits for its workers."""
        with self._lock:
            self.interrupted = True
            if self._crew is not None:
                self._crew.interrupt()

    def count(self, outcome: Outcome) -> None:
        """Count a task that has ended."""
        if outcome.state == FAILED:
            self.failed += 1
        else:
            self.finished += 1

    def look(self, show: Callable[[Standing], None]) -> None:
        """Show how far the run is, a few times a second and at its end."""
        now, ended = time.monotonic(), self.finished + self.failed
        if now - self._looked >= _LOOK or ended == self.tasks:
            self._looked = now
            show(self.standing())

    def standing(self) -> Standing:
        """How far the run is."""
        now, ended = min(time.monotonic(), self._end), self.finished + self.failed
        cutter, crew = self._cutter, self._crew
        if self._samples and now - self._samples[-1][0] >= _SAMPLE:
            self._samples.append((now, ended))
        began, before = self._samples[0] if self._samples else (now, ended)
        rate = (ended - before) / (now - began) if ended > before and now > began else math.nan
        done = left = math.nan
        if cutter is not None:
            done, left = cutter.share_done(), cutter.seconds_left()
        if self._end < math.inf:  # stopped
            left = math.nan
        if ended >= self.tasks:
            done, left = 1.0, 0.0
        if done != done:
            done = (ended - self._before) / max(1, self.tasks - self._before)
        share = (self._before + (self.tasks - self._before) * done) / max(1, self.tasks)
        workers = 0 if crew is None else crew.workers
        return Standing(self.tasks, self.finished, self.failed, share, rate, left, workers)
