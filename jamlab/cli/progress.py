"""Show progress on stderr: bars with the time left on a terminal, otherwise plain lines now and then."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bars

from jamlab.cli.console import err_console

if TYPE_CHECKING:
    from jamlab.processes.progress import Progress

_LINE_INTERVAL = 10.0  # s between lines of one name where there is no terminal
_EARLY = 0.03  # share of the work below which the time left is a guess not worth showing


@contextmanager
def progress_bars(names: dict[str, str], *, resumed: bool = False) -> "Iterator[dict[str, Progress]]":
    """Show one bar with a clock for each name (key -> text); a clock stops when its work is done. Yields key ->
    progress. Of a run that was resumed, what is done at the first call was done before."""
    columns = (TextColumn("{task.description}"), BarColumn(16), TimeElapsedColumn(), TextColumn("{task.fields[at]}"))
    quiet = not err_console.is_terminal
    with Bars(*columns, console=err_console, transient=True, disable=quiet) as bars:

        def add(name: str) -> "Progress":
            bar = bars.add_task(name, total=1.0, at="")
            began = last = time.monotonic()
            before = 0.0

            def show(share: float, text: str) -> None:
                nonlocal last, before
                now = time.monotonic()
                before = before or (share if resumed else 0.0)
                at = text + (_time_left((share - before) / (1 - before), now - began) if before < 1 else "")
                bars.update(bar, completed=share if share == share else None, at=at)
                if quiet and now - last > _LINE_INTERVAL:
                    last = now
                    err_console.print(f"{name}: {at}, {now - began:.0f} s so far", soft_wrap=True, highlight=False)

            return show

        yield {key: add(name) for key, name in names.items()}


@contextmanager
def progress_bar(name: str, *, resumed: bool = False) -> "Iterator[Progress]":
    """Show one bar, see `progress_bars`; yields its function."""
    with progress_bars({name: name}, resumed=resumed) as progress:
        yield progress[name]


def _time_left(share: float, elapsed: float) -> str:
    if not _EARLY <= share < 1:
        return ""
    left = elapsed * (1 - share) / share
    return f", about {left:.0f} s left" if left < 120 else f", about {left / 60:.0f} min left"
