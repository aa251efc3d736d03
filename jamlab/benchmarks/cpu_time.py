"""Time measurement: one core for everybody, CPU time, the shortest of several runs."""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

Result = TypeVar("Result")


@contextmanager
def one_core() -> Iterator[None]:
    """Keep this process, with the threads of every library in it, on one core."""
    allowed = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {sorted(allowed)[os.getpid() % len(allowed)]})  # several runs at once spread out
    try:
        yield
    finally:
        os.sched_setaffinity(0, allowed)


def shortest(run: Callable[[], Result], *, runs: int = 20, budget: float = 1.0) -> tuple[float, Result]:
    """Shortest CPU time of a function, all threads, and its last result.

    On one core this is the wall time of a machine that nobody else uses.

    Args:
        run: the function.
        runs: how often at most.
        budget: s; no new run is begun after that.
    """
    best, spent = float("inf"), 0.0
    for _ in range(runs):
        began = time.process_time()
        result = run()
        took = time.process_time() - began
        best, spent = min(best, took), spent + took
        if spent > budget:
            break
    return best, result
