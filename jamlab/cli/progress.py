"""Show progress on stderr: bars with the time left on a terminal, otherwise plain lines now and then."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bars

from jamlab.cli.console import err_console

if TYPE_CHECKING:
    from jamlab.protocols.relaxation import Progress

_LINE_INTERVAL = 10.0  # s between lines of one name where there is no terminal
_MET = 0.9999  # of the way to the end, which a sweep meets to its tolerance
_EARLY = 0.03  # share of the work below which the time left is a guess not worth showing

# packing fractions, and the share of the time to onset spent below them: minimisation slows down as contacts form
_WAY = {
    "sp": ((0.2, 0.83, 0.84, 0.85), (0.0, 0.05, 0.3, 0.9)),
    "dp": ((0.2, 0.80, 0.82, 0.826, 0.835), (0.0, 0.05, 0.21, 0.55, 0.75)),
}
_SEARCH = {"sp": 0.003, "dp": 0.05}  # part of what is left that one more minimisation near onset takes
_ONSET = {"sp": 0.9, "dp": 0.5}  # part of a run to rho = 0.95 that the way to onset takes; measured with 64 particles


@dataclass
class WorkDone:
    """Estimate which share of the work is done from the stages and packing fractions that protocols report.

    Attributes:
        to: packing fraction at the end.
        onset: share of the search for onset in all the work.
        model: "sp" or "dp".
        share: done so far, 0 to 1; never falls.
    """

    to: float
    onset: float = 1.0
    model: str = "sp"
    share: float = 0.0
    _last: float | None = field(default=None, repr=False)  # packing fraction of the search for onset
    _from: float | None = field(default=None, repr=False)  # where the sweep starts

    def update(self, stage: str, fraction: float) -> float:
        """Take one report; returns the share done."""
        if stage == "compress":
            if self._from is None:
                self._from = fraction if self._last is None else self._last
            way = abs(self.to - self._from)
            part = min(1.0, abs(fraction - self._from) / way) if way else 1.0
            if part > _MET:
                part = 1.0
            before = 0.0 if self._last is None else self.onset
            done = before + (1 - before) * np.sqrt(part)
        else:
            self._last = fraction
            done = self.onset * float(np.interp(fraction, *_WAY[self.model]))
            done = max(done, self.share + _SEARCH[self.model] * (self.onset - self.share))
        self.share = max(self.share, float(done))
        return self.share


@contextmanager
def progress_bars(names: dict[str, str], to: float, alone: bool = False) -> "Iterator[dict[str, Progress]]":
    """Show one bar with a clock for each name; a clock stops when its work is done.

    Args:
        names: model -> text beside its bar.
        to: packing fraction at the end of all bars.
        alone: whether the work is the way to onset, or a sweep, alone, instead of one after the other.

    Yields:
        Model -> a function to pass as `progress` to a protocol.
    """
    columns = (TextColumn("{task.description}"), BarColumn(16), TimeElapsedColumn(), TextColumn("{task.fields[at]}"))
    quiet = not err_console.is_terminal
    with Bars(*columns, console=err_console, transient=True, disable=quiet) as bars:

        def add(key: str, name: str) -> "Progress":
            bar = bars.add_task(name, total=1.0, at="")
            work = WorkDone(to, _ONSET[key], key) if not alone else WorkDone(to, model=key)
            began = last = time.monotonic()

            def show(stage: str, fraction: float) -> None:
                nonlocal last
                share, now = work.update(stage, fraction), time.monotonic()
                at = f"{stage} {fraction:.4f}{_time_left(share, now - began)}"
                bars.update(bar, completed=share, at=at)
                if quiet and now - last > _LINE_INTERVAL:
                    last = now
                    err_console.print(f"{name}: {at}, {now - began:.0f} s so far", soft_wrap=True, highlight=False)

            return show

        yield {key: add(key, name) for key, name in names.items()}


@contextmanager
def progress_bar(name: str, to: float, model: str = "sp") -> "Iterator[Progress]":
    """Show one bar of the way to onset or of a sweep; yields its function."""
    with progress_bars({model: name}, to, alone=True) as progress:
        yield progress[model]


@contextmanager
def count_bar(name: str) -> "Iterator[Callable[[int, int], None]]":
    """Count pieces of work that take about the same time each; yields a function of how many are done, and of all."""
    columns = (TextColumn("{task.description}"), BarColumn(16), MofNCompleteColumn(), TimeElapsedColumn())
    quiet = not err_console.is_terminal
    with Bars(*columns, TimeRemainingColumn(), console=err_console, transient=True, disable=quiet) as bars:
        bar, began = bars.add_task(name, total=None), time.monotonic()
        last = began

        def show(done: int, total: int) -> None:
            nonlocal last
            now = time.monotonic()
            bars.update(bar, completed=done, total=total)
            if quiet and now - last > _LINE_INTERVAL:
                last = now
                left = _time_left(done / total, now - began)
                err_console.print(f"{done} of {total} {name}{left}", soft_wrap=True, highlight=False)

        yield show


@contextmanager
def share_bar(name: str) -> "Iterator[Callable[[str, float], None]]":
    """Show how far one long run is; yields a function of what is done, in words, and of the share of the work."""
    columns = (TextColumn("{task.description}"), BarColumn(16), TimeElapsedColumn(), TextColumn("{task.fields[at]}"))
    quiet = not err_console.is_terminal
    with Bars(*columns, console=err_console, transient=True, disable=quiet) as bars:
        bar, began = bars.add_task(name, total=1.0, at=""), time.monotonic()
        last, first = began, 0.0

        def show(text: str, share: float) -> None:
            nonlocal last, first
            now = time.monotonic()
            first = first or share  # a run that goes on from a file begins with a part of the work done
            left = _time_left((share - first) / (1 - first), now - began) if first < 1 else ""
            bars.update(bar, completed=share, at=text + left)
            if quiet and now - last > _LINE_INTERVAL:
                last = now
                err_console.print(f"{name}: {text}{left}, {now - began:.0f} s so far", soft_wrap=True, highlight=False)

        yield show


def _time_left(share: float, elapsed: float) -> str:
    if share < _EARLY or share >= 1:
        return ""
    left = elapsed * (1 - share) / share
    return f", about {left:.0f} s left" if left < 120 else f", about {left / 60:.0f} min left"
