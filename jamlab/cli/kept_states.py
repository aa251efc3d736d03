"""Keep the finished states of a sweep when the command that makes it is interrupted."""

import time
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from jamlab.cli.interruption import Interrupted, describe_kept, stopping_signal

if TYPE_CHECKING:
    from jamlab.packing.packing import Packing

_INTERVAL = 10.0  # s between two files on the way, of which a killed command leaves the last


class KeptStates:
    """States of a sweep, written to a file every so many seconds, at the end, and when a signal ends the command.
    Whoever measures them, which may take longer than to make them, writes the file once more with the results."""

    def __init__(self, out: Path, interval: float = _INTERVAL) -> None:
        self.states: list[Packing] = []
        self._out, self._interval = out, interval
        self._written, self._saved = 0, time.monotonic()

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
        return f"kept {self._written} states in {self._out}, which is complete; `jamlab compress` goes on from it"
