"""Processes of this machine that call one function, one item each at a time.

Each process is a new Python: a fork would share what LAMMPS and MPI hold, and `multiprocessing` would run the script
of a user, without `if __name__ == "__main__":`, once more in every process. A process that is killed leaves the calls
of the others alone, and all processes end with the one that started them.
"""

import signal
import subprocess
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from typing import Any, Self

from jamlab.errors import warn
from jamlab.processes.answers import read_answer, sent
from jamlab.processes.child import child_environment, dying_line
from jamlab.processes.death import Death, describe_exit
from jamlab.processes.memory import MemoryKills


class Children:
    """Processes that call one function, `function(item, report)`, started when there is something to do; all are gone
    at the end of the block."""

    def __init__(self, function: Callable[..., Any], count: int) -> None:
        self.workers = count
        self.width = 2 * count  # one that runs and one that waits for each, so that no process waits for the caller
        self._function = sent(function, "the function")
        self._kills = MemoryKills()
        self._started: list[subprocess.Popen[bytes]] = []
        self._waiting: deque[tuple[Any, Any]] = deque()
        self._busy: dict[Connection, tuple[subprocess.Popen[bytes], Any, Any]] = {}
        self._idle: list[tuple[Connection, subprocess.Popen[bytes]]] = []
        self._alarm, self._bell = Pipe(duplex=False)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        for process in self._started:
            process.kill()
        for process in self._started:
            process.wait()
        for connection in (*self._busy, *(connection for connection, _ in self._idle), self._alarm, self._bell):
            connection.close()

    def interrupt(self) -> None:
        """Have `wait` raise KeyboardInterrupt; from any thread."""
        with suppress(OSError):  # the block has ended
            self._bell.send_bytes(b"!")

    def submit(self, key: Any, item: Any, *, first: bool = False) -> None:
        """Have the function called for an item by the next process that is free, before the others if it is the
        first."""
        self._waiting.insert(0 if first else len(self._waiting), (key, item))
        self._hand_out()

    def wait(self, patience: float | None = None) -> tuple[Any, str, Any]:
        """Wait for what comes next, see `Crew.wait`."""
        while (found := self._receive(patience))[1] == "warning":
            warn(*found[2])
        return found

    def _receive(self, patience: float | None) -> tuple[Any, str, Any]:
        found = wait([self._alarm, *self._busy], patience)
        if not found:
            return None, "nothing", None
        if self._alarm in found:
            raise KeyboardInterrupt
        connection = found[0]
        assert isinstance(connection, Connection)
        process, key, item = self._busy[connection]
        try:
            kind, content = connection.recv()
        except (EOFError, ConnectionError):
            connection.close()
            code = _end(process)
            answer: tuple[str, Any] = "death", Death(item, describe_exit(code, self._kills), True, code)
            del self._busy[connection]
        else:
            answer = read_answer(kind, content)
            if kind not in ("report", "warning"):
                del self._busy[connection]
                self._idle.append((connection, process))
            if kind == "exit":
                answer = "death", Death(item, describe_exit(answer[1]), True, answer[1])
        self._hand_out()
        return key, *answer

    def _hand_out(self) -> None:
        while self._waiting and len(self._busy) < self.workers:
            if not self._idle:
                self._start()
            (connection, process), (key, item) = self._idle.pop(), self._waiting.popleft()
            self._busy[connection] = process, key, item
            content = sent(item, "an item")
            with suppress(ConnectionError):  # it died; `wait` finds out
                connection.send_bytes(content)

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
            ours.send_bytes(self._function)


def _end(process: subprocess.Popen[bytes]) -> int:
    """Exit code of a process that has closed its connection, and is about to end."""
    with suppress(subprocess.TimeoutExpired):
        return process.wait(timeout=5.0)  # s
    process.kill()
    return process.wait()
