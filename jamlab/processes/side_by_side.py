"""Call one function for several items side by side, in processes of one core each.

Each process is a new Python: a fork would share what LAMMPS and MPI hold, and `multiprocessing` would run the script
of a user, without `if __name__ == "__main__":`, once more in every process. A process that is killed leaves the calls
of the others alone, and all processes end with the one that started them.
"""

import signal
import subprocess
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from typing import Any, Self, TypeVar

from jamlab.errors import EngineError, warn
from jamlab.processes.child import child_environment, dying_line

T = TypeVar("T")
R = TypeVar("R")
Report = Callable[..., None]


def run_side_by_side(
    function: Callable[[T, Report], R],
    items: Sequence[T],
    processes: int,
    *,
    report: Callable[..., None] = lambda item, *step: None,
    done: Callable[[int], None] = lambda count: None,
) -> list[R]:
    """Call `function(item, report)` for every item, the first ones first.

    Args:
        function: can be pickled, as can items, and what it returns and raises; not of the script that runs.
        items: one call for each.
        processes: at most so many at once; each takes its next item when it is done with one.
        report: called in this process as `report(item, ...)` with what `function` reports.
        done: called in this process after each call, with the number of items done.

    Returns:
        What `function` returned, in the order of the items.
    """
    found: dict[int, R] = {}
    with Children(function, processes) as children:
        for index, item in enumerate(items):
            children.submit(index, item)
        while len(found) < len(items):
            index, kind, content = children.wait()
            if kind == "report":
                report(items[index], *content)
            elif kind == "error":
                raise content
            elif kind == "death":
                raise EngineError("a worker process was killed, possibly out of memory: free some memory and run again")
            else:
                found[index] = content
                done(len(found))
    return [found[index] for index in range(len(items))]


class Children:
    """Processes that call one function, `function(item, report)`, started when there is something to do; all are gone
    at the end of the block."""

    def __init__(self, function: Callable[..., Any], count: int) -> None:
        self.count = count
        self._function = function
        self._started: list[subprocess.Popen[bytes]] = []
        self._waiting: deque[tuple[Any, Any]] = deque()
        self._busy: dict[Connection, tuple[subprocess.Popen[bytes], Any, Any]] = {}
        self._idle: list[tuple[Connection, subprocess.Popen[bytes]]] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        for process in self._started:
            process.kill()
        for process in self._started:
            process.wait()
        for connection in (*self._busy, *(connection for connection, _ in self._idle)):
            connection.close()

    def submit(self, key: Any, item: Any, *, first: bool = False) -> None:
        """Have the function called for an item by the next process that is free, before the others if it is the
        first."""
        self._waiting.insert(0 if first else len(self._waiting), (key, item))
        self._hand_out()

    def wait(self) -> tuple[Any, str, Any]:
        """Wait for what comes next: the key of a call, what it is, and its content. "report": what is reported;
        "result": what is returned; "error": what is raised; "death": the item, and the exit code of the process."""
        while (found := self._receive())[1] == "warning":
            warn(*found[2])
        return found

    def _receive(self) -> tuple[Any, str, Any]:
        connection = wait(list(self._busy))[0]
        assert isinstance(connection, Connection)
        process, key, item = self._busy[connection]
        try:
            kind, content = connection.recv()
        except (EOFError, ConnectionError):
            connection.close()
            process.kill()
            kind, content = "death", (item, process.wait())
        if kind not in ("report", "warning"):
            del self._busy[connection]
        if kind in ("result", "error"):
            self._idle.append((connection, process))
        self._hand_out()
        return key, kind, content

    def _hand_out(self) -> None:
        while self._waiting and len(self._busy) < self.count:
            if not self._idle:
                self._start()
            (connection, process), (key, item) = self._idle.pop(), self._waiting.popleft()
            self._busy[connection] = process, key, item
            with suppress(ConnectionError):  # it died; `wait` finds out
                connection.send(item)

    def _start(self) -> None:
        ours, theirs = Pipe()
        # Ctrl-C reaches the whole process group; a child inherits this mask, and its parent ends it
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        nothing, descriptor = subprocess.DEVNULL, theirs.fileno()
        how: Any = {"env": child_environment(), "pass_fds": (descriptor,), "stdin": nothing, "stdout": nothing}
        try:
            self._started.append(subprocess.Popen(dying_line([str(descriptor)]), **how))
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
            theirs.close()  # so that a process that dies ends its connection
        self._idle.append((ours, self._started[-1]))
        with suppress(ConnectionError):
            ours.send(self._function)
