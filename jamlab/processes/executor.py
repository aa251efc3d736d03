"""Call one function for several items through an executor (PEP 3148), such as that of a cluster.

A worker runs one call at a time: neither LAMMPS nor its MPI can run several in threads of one process.
"""

import os
import platform
import queue
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from typing import Any, NamedTuple, Self

from jamlab.errors import EngineError, warn
from jamlab.processes.answers import answer, read_answer, sent
from jamlab.processes.cores import cores_given
from jamlab.processes.death import Death

_ALONE = threading.RLock()
_THREADS = "a worker runs several calls at once in threads, which LAMMPS cannot: give each worker one thread"


class _Answer(NamedTuple):
    """What comes back of a call."""

    kind: str  # "result" or "error"
    content: bytes
    told: list[tuple[str, Any]]  # warnings and reports that could not be told while it ran
    worker: tuple[str, int]  # host and process


def carry(function: bytes, item: bytes, number: int) -> _Answer:
    """Run a call in a worker; `number` tells it from others that are the same."""
    told: list[tuple[str, Any]] = []
    worker = platform.node(), os.getpid()
    if not _ALONE.acquire(blocking=False):
        return _Answer("error", sent(EngineError(_THREADS), "an error"), told, worker)
    try:
        with cores_given(1):
            return _Answer(*answer(function, item, lambda *each: told.append(each)), told, worker)
    finally:
        _ALONE.release()


class OnExecutor:
    """The workers of an executor, as a `Crew`. They are their owner's: the end of the block cancels the calls that
    wait, and leaves workers alone."""

    def __init__(self, function: Callable[..., Any], executor: Executor) -> None:
        self._function, self._executor = sent(function, "the function"), executor
        self._waiting: deque[tuple[Any, Any]] = deque()
        self._under_way: dict[Future[_Answer], tuple[Any, Any]] = {}
        self._ended: queue.SimpleQueue[Future[_Answer]] = queue.SimpleQueue()
        self._ready: deque[tuple[Any, str, Any]] = deque()
        self._seen: set[tuple[str, int]] = set()
        self._number = 0

    @property
    def workers(self) -> int:
        """Calls that run at a time, as far as it is known."""
        return max(1, len(self._seen))

    @property
    def width(self) -> int:
        """Calls that the executor knows at a time: enough for a cluster, and few to cancel."""
        known = getattr(self._executor, "_max_workers", None)
        return 2 * known if isinstance(known, int) else 1000

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        for future in list(self._under_way):
            future.cancel()

    def submit(self, key: Any, item: Any, *, first: bool = False) -> None:
        """Have the function called for an item, before the others that the executor does not know yet if it is the
        first."""
        self._waiting.insert(0 if first else len(self._waiting), (key, item))
        self._hand_out()

    def wait(self) -> tuple[Any, str, Any]:
        """Wait for what comes next, see `Crew.wait`."""
        while True:
            while not self._ready:
                self._end(self._ended.get())
            key, kind, content = self._ready.popleft()
            if kind != "warning":
                return key, kind, content
            warn(*content)

    def _hand_out(self) -> None:
        while self._waiting and len(self._under_way) < self.width:
            key, item = self._waiting.popleft()
            self._number += 1
            try:
                future = self._executor.submit(carry, self._function, sent(item, "an item"), self._number)
            except RuntimeError as error:  # broken, or shut down
                raise EngineError(f"the executor takes no calls ({error}): start it again, and run again") from error
            self._under_way[future] = key, item
            future.add_done_callback(self._ended.put)

    def _end(self, future: "Future[_Answer]") -> None:
        key, item = self._under_way.pop(future)
        try:
            found = future.result()
        except CancelledError as error:
            self._ready.append((key, "death", Death(item, f"cancelled: {error}", False, None)))
        except BaseException as error:  # of the executor: what the call raises is in its answer
            alone = not isinstance(error, BrokenExecutor)
            self._ready.append((key, "death", Death(item, f"{type(error).__name__}: {error}", alone, None)))
        else:
            self._seen.add(found.worker)
            self._ready += [(key, *each) for each in found.told]
            self._ready.append((key, *read_answer(found.kind, found.content)))
        self._hand_out()
