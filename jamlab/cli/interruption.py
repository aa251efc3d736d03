"""End on SIGINT and SIGTERM with one line that says what was kept; a second signal ends at once.

Files are written to the side and renamed, so what is there is whole; child processes die with this one.
"""

import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

if TYPE_CHECKING:
    from types import FrameType


_SIGNALS = (signal.SIGINT, signal.SIGTERM)
NOTHING = "nothing was written"
_describe: Callable[[], str] = lambda: NOTHING  # noqa: E731
_came: list[int] = []  # numbers of the signals that ended the command


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
        return f"kept {path}, which is complete" if written else NOTHING

    describe_kept(describe)


def interrupt_on_signals() -> None:
    """Raise KeyboardInterrupt in the main thread when a signal comes, also where the shell ignores SIGINT."""
    for number in _SIGNALS:
        signal.signal(number, _interrupt)


def end_on_signals() -> None:
    """Let a signal end the process at once."""
    for number in _SIGNALS:
        signal.signal(number, signal.SIG_DFL)


def _interrupt(number: int, _: "FrameType | None") -> NoReturn:
    end_on_signals()  # a second one
    _came.append(number)
    raise KeyboardInterrupt


def stopping_signal() -> int | None:
    """Number of the signal that is ending the command; ctypes makes another error of what is raised in its calls."""
    return _came[0] if _came else None


def last_line() -> str:
    """What is printed when a signal has come."""
    return f"interrupted: {_describe()}"
