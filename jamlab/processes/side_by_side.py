"""Call one function for several items side by side: in processes of this machine, or through an executor."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from typing import Any, Protocol, Self, TypeVar

from jamlab.errors import EngineError, InputError, named
from jamlab.processes.children import Children
from jamlab.processes.cores import available_cores
from jamlab.processes.executor import OnExecutor

T = TypeVar("T")
R = TypeVar("R")
Report = Callable[..., None]


class Crew(Protocol):
    """Workers that call one function, `function(item, report)`, until the end of a block."""

    @property
    def width(self) -> int:
        """Calls that are worth submitting at a time; may change."""

    @property
    def workers(self) -> int:
        """Calls that run at a time, as far as it is known; may change."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *error: object) -> None: ...

    def submit(self, key: Any, item: Any, *, first: bool = False) -> None:
        """Have the function called for an item, before the others that wait if it is the first."""

    def wait(self, patience: float | None = None) -> tuple[Any, str, Any]:
        """Wait for what comes next: the key of a call, what it is, and its content. "report": what is reported, a
        tuple; "result": what is returned; "error": what is raised; "death": a `Death`; "nothing": none of these came
        within `patience`, s, by default without limit."""

    def interrupt(self) -> None:
        """Have `wait` raise KeyboardInterrupt, as Ctrl-C does; from any thread."""


def crew(function: Callable[..., Any], where: int | Executor) -> Crew:
    """Workers for `function(item, report)`: so many processes of this machine, or those of an executor (PEP 3148)."""
    return OnExecutor(function, where) if isinstance(where, Executor) else Children(function, where)


def workers_there(workers: int | Executor | None) -> int | Executor:
    """What an argument `workers` stands for: so many processes, as many as this process has cores, or an executor."""
    if isinstance(workers, int) and workers < 1:
        raise InputError(f"{named('workers', workers)}: must be 1 or more")
    return available_cores() if workers is None else workers


def run_side_by_side(
    function: Callable[[T, Report], R],
    items: Sequence[T],
    workers: int | Executor,
    *,
    report: Callable[..., None] = lambda item, *step: None,
    done: Callable[[int], None] = lambda count: None,
) -> list[R]:
    """Call `function(item, report)` for every item, the first ones first.

    Args:
        function: can be pickled, as can items, and what it returns and raises; not of the script that runs.
        items: one call for each.
        workers: at most so many processes at once, each of which takes its next item when it is done with one; or an
            executor (PEP 3148), such as that of a cluster.
        report: called in this process as `report(item, ...)` with what `function` reports.
        done: called in this process after each call, with the number of items done.

    Returns:
        What `function` returned, in the order of the items.
    """
    found: dict[int, R] = {}
    lost = [0] * len(items)
    with crew(function, workers) as those:
        for index, item in enumerate(items):
            those.submit(index, item)
        while len(found) < len(items):
            index, kind, content = those.wait()
            if kind == "report":
                report(items[index], *content)
            elif kind == "error":
                raise content
            elif kind == "death":
                lost[index] += 1
                if content.alone or lost[index] > _MOST_LOST:
                    said = f"a worker process ended before its call did: {content.cause}"
                    raise EngineError(f"{said}; if memory is short, use fewer workers, and run again")
                those.submit(index, items[index], first=True)
            else:
                found[index] = content
                done(len(found))
    return [found[index] for index in range(len(items))]


_MOST_LOST = 5  # times that a call may end through no fault of its own, as its pool broke, or somebody cancelled it
