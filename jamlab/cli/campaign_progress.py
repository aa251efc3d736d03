"""Show a running campaign on stderr: a bar on a terminal, otherwise a line now and then."""

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bars

from jamlab.campaign.campaign import Campaign
from jamlab.campaign.standard_error import wanted_batches
from jamlab.campaign.tasks import Batch, batches
from jamlab.campaign.worker import FAILED, Outcome
from jamlab.cli.console import err_console
from jamlab.cli.interruption import describe_kept

_LINE_INTERVAL = 30.0  # s between lines where there is no terminal: two in a minute keep a log short


@contextmanager
def show_tasks(campaign: Campaign, only: Iterable[str] | None) -> Iterator[Callable[[Outcome], None]]:
    """Count tasks, and print failures at once; yields a function for `Campaign.run(progress=...)`."""
    chosen = batches(campaign.content, only)
    describe_kept(lambda: _describe(campaign, chosen))
    names = {name for batch in wanted_batches(chosen, campaign.folder) for name in batch.names()}
    total, before = len(names), len(names & campaign.folder.finished())
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    quiet = not err_console.is_terminal
    with Bars(*columns, TimeRemainingColumn(), console=err_console, transient=True, disable=quiet) as bars:
        bar = bars.add_task(campaign.name, total=total, completed=before)
        count, last = before, time.monotonic()

        def show(outcome: Outcome) -> None:
            nonlocal count, last
            count += 1
            bars.update(bar, completed=count, total=max(total, count))  # `until` may add seeds
            if outcome.state == FAILED:
                bars.console.print(f"failed: {outcome.line}", soft_wrap=True, highlight=False)
            elif quiet and time.monotonic() - last > _LINE_INTERVAL:
                last = time.monotonic()
                err_console.print(f"{count} of {max(total, count)} tasks", soft_wrap=True, highlight=False)

        yield show


def _describe(campaign: Campaign, chosen: list[Batch]) -> str:
    """How many tasks are finished, of at most how many if `until` decides, and what goes on with them."""
    names = {name for batch in chosen for name in batch.names()}
    most = "at most " if any(batch.until for batch in chosen) else ""
    path = campaign.folder.path
    elsewhere = "" if path in (campaign.file.parent, campaign.file.parent / campaign.name) else f" --out {path}"
    return (
        f"{len(names & campaign.folder.finished())} of {most}{len(names)} tasks are finished in {path}; "
        f"`jamlab campaign resume {campaign.file}{elsewhere}` goes on"
    )
