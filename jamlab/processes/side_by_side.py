"""Call one function for several items side by side, in processes of one core each.

Each process is a new Python: a fork would share what LAMMPS and MPI hold, and `multiprocessing` would run the script
of a user, without `if __name__ == "__main__":`, once more in every process.
"""

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from typing import Any, TypeVar

from jamlab.errors import EngineError
from jamlab.processes.child import child_environment

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
    """Call `function(item, report)` for every item, the first ones first. `function`: can be pickled, as can items, and
    what it returns and raises; not of the script that runs; `items`: one call for each; `processes`: at most so many at
    once; each takes its next item when it is done with one; `report`: called in this process as `report(item, ...)`
    with what `function` reports; `done`: called in this process after each call, with the number of items done. Returns
    what `function` returned, in the order of the items."""
    waiting = iter(range(len(items)))
    busy: dict[Connection, int] = {}
    found: dict[int, R] = {}
    with _children(min(processes, len(items))) as connections:

        def give(connection: Connection) -> None:
            index = next(waiting, None)
            if index is None:
                connection.close()
            else:
                busy[connection] = index
                _send(connection, items[index])

        for connection in connections:
            _send(connection, function)
            give(connection)
        while busy:
            for ready in wait(list(busy)):
                assert isinstance(ready, Connection)
                kind, content = _receive(ready)
                if kind == "report":
                    report(items[busy[ready]], *content)
                elif kind == "error":
                    raise content
                else:
                    found[busy.pop(ready)] = content
                    done(len(found))
                    give(ready)
    return [found[index] for index in range(len(items))]


def _send(connection: Connection, content: Any) -> None:
    try:
        connection.send(content)
    except ConnectionError:
        raise _killed() from None


def _receive(connection: Connection) -> tuple[str, Any]:
    try:
        kind, content = connection.recv()
    except (EOFError, ConnectionError):
        raise _killed() from None
    return kind, content


def _killed() -> EngineError:
    return EngineError("a process that worked for this one was killed: free some memory, and run again")


@contextmanager
def _children(count: int) -> Iterator[list[Connection]]:
    """Start processes; all are gone afterwards. One whose connection closes ends by itself."""
    started: list[subprocess.Popen[bytes]] = []
    connections = []
    try:
        for _ in range(count):
            ours, theirs = Pipe()
            connections.append(ours)
            with theirs:  # closed here, so that a process that dies ends its connection
                started.append(start_child(theirs.fileno()))
        yield connections
    finally:
        for process in started:
            process.kill()
        for process in started:
            process.wait()
        for connection in connections:
            connection.close()


def start_child(descriptor: int) -> subprocess.Popen[bytes]:
    """Start a process that answers calls through this end of a pipe; it dies with the thread that started it."""
    line = [sys.executable, "-P", "-m", "jamlab.processes.child", str(descriptor), str(os.getpid())]
    # Ctrl-C reaches the whole process group; a child inherits this mask, and its parent ends it
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        nothing = subprocess.DEVNULL
        return subprocess.Popen(line, env=child_environment(), pass_fds=(descriptor,), stdin=nothing, stdout=nothing)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
