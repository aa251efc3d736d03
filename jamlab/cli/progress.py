"""Show progress on stderr: bars with the time left on a terminal, otherwise plain lines now and then."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bars

from jamlab.cli.console import err_console

if TYPE_CHECKING:
    from jamlab.processes.progress import Progress

_LINE_INTERVAL = 10.0  # s between lines of one name where there is no terminal
_EARLY = 0.03  # share of the work below which the time left is a guess not worth showing


@contextmanager
def progress_bars(names: dict[str, str]) -> "Iterator[dict[str, Progress]]":
    """Show one bar with a clock for each name; a clock stops when its work is done.

    Args:
        names: key -> text beside its bar.

    Yields:
        Key -> a function to pass as `progress`.
    """
    columns = (TextColumn("{task.description}"), BarColumn(16), TimeElapsedColumn(), TextColumn("{task.fields[at]}"))
    quiet = not err_console.is_terminal
    with Bars(*columns, console=err_console, transient=True, disable=quiet) as bars:

        def add(name: str) -> "Progress":
            bar = bars.add_task(name, total=1.0, at="")
            began = last = time.monotonic()

            def show(share: float, text: str) -> None:
                nonlocal last
                now = time.monotonic()
                at = text + _time_left(share, now - began)
                bars.update(bar, completed=share if share == share else None, at=at)
                if quiet and now - last > _LINE_INTERVAL:
                    last = now
                    err_console.print(f"{name}: {at}, {now - began:.0f} s so far", soft_wrap=True, highlight=False)

            return show

        yield {key: add(name) for key, name in names.items()}


@contextmanager
def progress_bar(name: str) -> "Iterator[Progress]":
    """Show one bar; yields its function."""
    with progress_bars({name: name}) as progress:
        yield progress[name]


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
    if not _EARLY <= share < 1:
        return ""
    left = elapsed * (1 - share) / share
    return f", about {left:.0f} s left" if left < 120 else f", about {left / 60:.0f} min left"
