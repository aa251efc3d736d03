"""What a running campaign shows on stderr: a bar on a terminal, else a line now and then."""

import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from jamlab.campaign.campaign import Campaign
from jamlab.campaign.driver import Tell
from jamlab.campaign.tasks import batches
from jamlab.cli.console import err_console

_EVERY = 30.0  # seconds between lines where there is no terminal


@contextmanager
def told(campaign: Campaign, only: Iterable[str] | None) -> Iterator[Tell]:
    """A function for `Campaign.run(tell=...)`; failures are printed as they come."""
    names = {name for batch in batches(campaign.content, only) for name in batch.names()}
    total, before = len(names), len(names & campaign.folder.finished())
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    quiet = not err_console.is_terminal
    with Progress(*columns, TimeRemainingColumn(), console=err_console, transient=True, disable=quiet) as progress:
        bar = progress.add_task(campaign.name, total=total, completed=before)
        count, last = before, time.monotonic()

        def tell(state: str, line: str, seconds: float) -> None:
            nonlocal count, last
            count += 1
            progress.advance(bar)
            if state == "failed":
                progress.console.print(f"failed: {line}", soft_wrap=True, highlight=False)
            elif quiet and time.monotonic() - last > _EVERY:
                last = time.monotonic()
                err_console.print(f"{count} of {total} tasks", soft_wrap=True, highlight=False)

        yield tell
