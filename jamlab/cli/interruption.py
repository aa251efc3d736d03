"""End on SIGINT and SIGTERM with one line that says what was kept, within seconds, whatever is running.

Python runs a signal handler only between two of its own steps, and one call of LAMMPS may take minutes. So a thread
ends the process if the handler's exception has not done so in time. Files are written to the side and renamed, so what
is there is whole; child processes die with this one.
"""

import os
import shlex
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, NoReturn, Self

if TYPE_CHECKING:
    from types import FrameType

    from jamlab.packing.packing import Packing


_GRACE = 3.0  # s for the clean way out
_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_NOTHING = "nothing was written"
_describe: Callable[[], str] = lambda: _NOTHING  # noqa: E731
_printed = threading.Event()
_came: list[int] = []  # numbers of the signals that ended the command


class Interrupted(BaseException):
    """A signal to end came; no `except Exception` may stop it, nor what libraries do about KeyboardInterrupt."""


def describe_kept(describe: Callable[[], str]) -> None:
    """Set what the line says after "interrupted: "; called at most once, when a signal has come."""
    global _describe
    _describe = describe


def expect_output(path: "Path") -> None:
    """Let the line name what this command has written to a file or into a folder by then."""
    began = time.time() - 0.01  # clocks of file systems tick more coarsely

    def describe() -> str:
        places = path.rglob("[!.]*") if path.is_dir() else [path]  # half-written files have names that begin with a dot
        written = [p for p in places if p.is_file() and p.stat().st_mtime >= began]
        if path.is_dir() and written:
            return f"kept {len(written)} file{'s'[: len(written) > 1]} in {path}, each complete"
        return f"kept {path}, which is complete" if written else _NOTHING

    describe_kept(describe)


@contextmanager
def ending_on_signals() -> Iterator[Callable[[], None]]:
    """End the process with one line and exit code 128 + number when a signal comes; main thread only. Yields a function
    to call when imports are done: until then a signal ends the process at once, since an exception in the middle of an
    import can be taken for a broken library."""
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    threading.Thread(target=_end_late, args=(reader,), name="jamlab signals", daemon=True).start()
    _set_handlers(lambda number, _: _leave(number))
    try:
        yield lambda: _set_handlers(_raise)
    except Interrupted as stop:
        _print_line()
        sys.exit(128 + int(stop.args[0]))


def _set_handlers(handler: "Callable[[int, FrameType | None], object]") -> None:
    for number in _SIGNALS:  # also where the shell ignores SIGINT for a job in the background
        signal.signal(number, handler)


def _raise(number: int, _: "FrameType | None") -> NoReturn:
    for each in _SIGNALS:  # one is enough: a second would interrupt the clean way out
        signal.signal(each, signal.SIG_IGN)
    _came.append(number)
    raise Interrupted(number)


def stopping_signal() -> int | None:
    """Number of the signal that is ending the command; ctypes makes another error of what is raised in its calls."""
    return _came[0] if _came else None


def _end_late(reader: int) -> None:
    while (number := os.read(reader, 1)[0]) not in _SIGNALS:
        pass
    time.sleep(_GRACE)
    _leave(number)


def _leave(number: int) -> NoReturn:
    _print_line()
    os._exit(128 + number)


def _print_line() -> None:
    if not _printed.is_set():
        _printed.set()
        shown = "\r\x1b[K\x1b[?25h" if os.isatty(2) else ""  # a progress bar may have hidden the cursor
        os.write(2, f"{shown}interrupted: {_describe()}\n".encode(errors="replace"))


_INTERVAL = 10.0  # s between two files on the way, of which a killed command leaves the last


class KeptStates:
    """States of a sweep, written to a file every so many seconds, at the end, and when a signal ends the command.
    Whoever measures them, which may take longer than to make them, writes the file once more with the results."""

    def __init__(self, out: Path, begun: "Sequence[Packing]" = (), *, interval: float = _INTERVAL) -> None:
        self.states: list[Packing] = list(begun)  # which the file holds already
        self._out, self._interval = out, interval
        self._written, self._saved = len(begun), time.monotonic()

    def __enter__(self) -> Self:
        describe_kept(self._describe)
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: BaseException | TracebackType | None) -> None:
        worth_it = kind is None or issubclass(kind, Interrupted) or stopping_signal() is not None
        if worth_it and len(self.states) > 1:
            self._save()

    def add(self, state: "Packing") -> None:
        """Take a finished state; the first one is the start, which nobody has waited for."""
        self.states.append(state)
        if len(self.states) > 1 and time.monotonic() - self._saved >= self._interval:
            self._save()

    def _save(self) -> None:
        from jamlab.packing.hdf5 import write

        write(self._out, self.states)
        self._written, self._saved = len(self.states), time.monotonic()

    def _describe(self) -> str:
        if not self._written:
            return "nothing was written"
        return f"kept {self._written} states in {self._out}; `{_this_command()}` resumes"


def _this_command() -> str:
    """The words of the shell, but for the one that would begin anew."""
    return shlex.join(["jamlab", *(word for word in sys.argv[1:] if word != "--force")])
