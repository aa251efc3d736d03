"""Call one function for several items through an executor (PEP 3148), such as that of a cluster.

A worker runs one call at a time: neither LAMMPS nor its MPI can run several in threads of one process. A pool of this
machine that breaks, as a worker of it was killed, is replaced by processes of jamlab.
"""

import math
import os
import queue
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from concurrent.futures import wait as wait_for
from contextlib import contextmanager
from functools import cache
from typing import Any, NamedTuple, Self

from threadpoolctl import ThreadpoolController

from jamlab.errors import EngineError, warn
from jamlab.processes.answers import answer, read_answer, sent
from jamlab.processes.child import ONE_THREAD
from jamlab.processes.children import Children
from jamlab.processes.cores import available_cores, cores_given
from jamlab.processes.death import Death, describe_exit
from jamlab.processes.engines import (
    check_threads,
    count_known,
    describe_failure,
    is_open,
    is_pool_of_processes,
    scheduler_in_use,
)
from jamlab.processes.letterbox import Address, Letterbox, Sender
from jamlab.processes.memory import MemoryKills, memory_limits

_LOOK = 0.1  # s between two looks for what calls tell while they run
_END = 10.0  # s in which a pool that broke gives up its calls
_MANY = 1000  # calls that an executor knows at a time: enough for a cluster, and few to cancel
_NEWS = 2.0  # s between two looks for how many workers there are: to ask a scheduler takes some ms
_SILENT = 60.0  # s without workers until the user hears of it
_ALONE = threading.RLock()
_THREADS = "a worker runs several calls at once in threads, which LAMMPS cannot: give each worker one thread"


class _Call(NamedTuple):
    """What a worker is sent."""

    function: bytes
    item: bytes
    number: int  # tells it from others that are the same
    letterbox: Address
    folders: list[str]  # where Python finds modules here


class _Answer(NamedTuple):
    """What comes back of a call."""

    kind: str  # see `answer`
    content: bytes
    told: list[tuple[int, str, bytes]]  # warnings and reports that could not be told while it ran
    worker: tuple[str, int]  # host and process


def carry(call: _Call) -> _Answer:
    """Run a call in a worker."""
    told: list[tuple[int, str, bytes]] = []
    worker = os.uname().nodename, os.getpid()
    if not _ALONE.acquire(blocking=False):
        return _Answer("error", sent(EngineError(_THREADS), "an error"), told, worker)
    try:
        with Sender(call.letterbox) as sender, _as_a_child(call.folders):

            def tell(kind: str, content: bytes) -> None:
                letter = call.number, kind, content
                if not sender.send(letter):
                    told.append(letter)

            return _Answer(*answer(call.function, call.item, tell), told, worker)
    finally:
        _ALONE.release()


@contextmanager
def _as_a_child(folders: list[str]) -> Iterator[None]:
    """One thread, and the modules of who called, as in `jamlab.processes.child`."""
    before = {name: os.environ.get(name) for name in ONE_THREAD}, list(sys.path)
    os.environ.update(ONE_THREAD)
    sys.path += [folder for folder in folders if folder not in sys.path]
    try:
        with cores_given(1), _loaded_threads().limit(limits=1):
            yield
    finally:
        sys.path[:] = before[1]
        for name, value in before[0].items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@cache  # to look for libraries takes 1.5 ms; those that are loaded later read the environment
def _loaded_threads() -> ThreadpoolController:
    return ThreadpoolController()


class OnExecutor:
    """The workers of an executor, as a `Crew`. They are their owner's: the end of the block cancels the calls that
    wait, and leaves workers alone. Calls on this machine tell warnings and reports while they run, others at their
    end."""

    def __init__(self, function: Callable[..., Any], executor: Executor) -> None:
        check_threads(executor)
        self._function, self._executor = function, executor
        self._content = sent(function, "the function")
        installed = (sys.prefix, sys.base_prefix)
        self._folders = [os.path.abspath(each) for each in sys.path if not each.startswith(installed)]
        self._letterbox, self._kills = Letterbox(), MemoryKills()
        self._waiting: deque[tuple[Any, Any]] = deque()
        self._under_way: dict[Future[_Answer], tuple[int, Any, Any]] = {}
        self._keys: dict[int, Any] = {}
        self._ended: queue.SimpleQueue[Future[_Answer]] = queue.SimpleQueue()
        self._ready: deque[tuple[Any, str, Any]] = deque()
        self._seen: set[tuple[str, int]] = set()
        self._number = 0
        self._asked = -_NEWS
        self._known: int | None = None
        self._bare: float | None = None  # since when there are no workers; inf once the user has heard of it
        self._own: Children | None = None  # instead of a pool that broke
        self._interrupted = False

    @property
    def workers(self) -> int:
        """Calls that run at a time, as far as it is known."""
        if self._own is not None:
            return self._own.workers
        return self._count() or max(1, len(self._seen))

    def _count(self) -> int | None:
        if (now := time.monotonic()) > self._asked + _NEWS:
            self._asked, self._known = now, count_known(self._executor)
        return self._known

    @property
    def width(self) -> int:
        """Calls that are worth submitting at a time."""
        if self._own is not None:
            return self._own.width
        return 2 * self.workers if is_pool_of_processes(self._executor) else _MANY

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        for future in list(self._under_way) if is_open(self._executor) else ():
            future.cancel()
        if self._own is not None:
            self._own.__exit__(*error)
        self._letterbox.close()

    def submit(self, key: Any, item: Any, *, first: bool = False) -> None:
        """Have the function called for an item, before the others that the executor does not know yet if it is the
        first."""
        if self._own is not None:
            self._own.submit(key, item, first=first)
            return
        self._waiting.insert(0 if first else len(self._waiting), (key, item))
        self._hand_out()

    def wait(self, patience: float | None = None) -> tuple[Any, str, Any]:
        """Wait for what comes next, see `Crew.wait`."""
        end = math.inf if patience is None else time.monotonic() + patience
        while True:
            while not self._ready:
                if self._interrupted:
                    raise KeyboardInterrupt
                if self._own is not None:
                    return self._own.wait(patience)
                self._look()
                if not self._ready and time.monotonic() > end:
                    return None, "nothing", None
            key, kind, content = self._ready.popleft()
            if kind != "warning":
                return key, kind, content
            warn(*content)

    def interrupt(self) -> None:
        """Have `wait` raise KeyboardInterrupt; from any thread."""
        self._interrupted = True
        if self._own is not None:
            self._own.interrupt()

    def _look(self) -> None:
        """Take what calls told, and the next one that ended."""
        try:
            future = self._ended.get(timeout=_LOOK)
        except queue.Empty:
            self._hear(self._letterbox.take())
            if not is_open(self._executor):
                said = f"{type(self._executor).__name__} has lost its workers, {len(self._under_way)} calls under way"
                raise EngineError(f"{said}: connect again, and run again") from None
            self._say_what_waits()
            return
        self._hear(self._letterbox.take())
        self._end(future)
        self._hand_out()

    def _say_what_waits(self) -> None:
        """Warn, each time that it happens, that Dask has no workers: a run would wait for ever without a word."""
        if self._count() is not None or (scheduler := scheduler_in_use(self._executor)) is None:
            self._bare = None
            return
        now = time.monotonic()
        self._bare = now if self._bare is None else self._bare
        if now - self._bare > _SILENT:
            self._bare = math.inf
            said = f"the Dask scheduler {scheduler} has had no workers for {_SILENT:.0f} s"
            said += f" (calls that wait: {len(self._under_way)})"
            warn(f"{said}: start some by `dask worker {scheduler} --nthreads 1`, or stop, and run again with others")

    def _hear(self, told: list[tuple[int, str, bytes]]) -> None:
        for number, kind, content in told:
            if number in self._keys:
                self._ready.append((self._keys[number], *read_answer(kind, content)))

    def _hand_out(self) -> None:
        while self._own is None and self._waiting and len(self._under_way) < self.width:
            key, item = self._waiting[0]
            self._number += 1
            call = _Call(self._content, sent(item, "an item"), self._number, self._letterbox.address, self._folders)
            try:
                future = self._executor.submit(carry, call)
            except BrokenExecutor as error:
                self._replace(error)
            except Exception as error:  # whatever an executor raises that is shut down, or has lost its workers
                said = f"{type(self._executor).__name__} takes no calls ({type(error).__name__}: {error})"
                raise EngineError(f"{said}: give one that is open and has workers, and run again") from error
            else:
                self._waiting.popleft()
                self._under_way[future] = self._number, key, item
                self._keys[self._number] = key
                future.add_done_callback(self._ended.put)

    def _end(self, future: "Future[_Answer]") -> None:
        """Take the end of a call."""
        try:
            error = future.exception(timeout=0)
        except CancelledError as cancelled:
            error = cancelled
        if isinstance(error, BrokenExecutor):
            self._replace(error)
            return
        number, key, item = self._under_way.pop(future)
        if error is None:
            self._take(key, item, future.result())
        else:
            self._seen.clear()  # one is gone; the others answer again
            cause = describe_failure(self._executor, error)
            self._ready.append((key, "death", Death(item, cause, not isinstance(error, CancelledError), None)))
        del self._keys[number]

    def _take(self, key: Any, item: Any, found: _Answer) -> None:
        self._seen.add(found.worker)
        self._hear(found.told)
        kind, content = read_answer(found.kind, found.content)
        if kind == "exit":
            kind, content = "death", Death(item, describe_exit(content), True, content)
        self._ready.append((key, kind, content))

    def _replace(self, error: BrokenExecutor) -> None:
        """Go on in own processes after a pool broke; the calls that it lost are deaths."""
        name, said = type(self._executor).__name__, describe_failure(self._executor, error)
        if not is_pool_of_processes(self._executor):
            raise EngineError(f"{name} broke ({said}): start another one, and run again") from error
        if self._kills.rose():
            said += f": killed, out of memory, of which there are {memory_limits()}"
        wait_for(list(self._under_way), timeout=_END)
        self._hear(self._letterbox.take())
        ended = [future for future in self._under_way if future.done() and not future.cancelled()]
        for future in [each for each in ended if each.exception() is None]:
            _, key, item = self._under_way.pop(future)
            self._take(key, item, future.result())
        self._ready += [(key, "death", Death(item, said, False, None)) for _, key, item in self._under_way.values()]
        self._under_way.clear()
        self._own = Children(self._function, count_known(self._executor) or available_cores())
        while self._waiting:
            self._own.submit(*self._waiting.popleft())
        warn(f"{name} broke ({said}): {self._own.workers} processes of jamlab go on with its calls")
