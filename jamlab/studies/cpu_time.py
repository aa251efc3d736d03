"""Measure time: everything on one core, CPU time, the shortest of several runs."""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

Result = TypeVar("Result")


@contextmanager
def one_core() -> Iterator[None]:
    """Pin this process, with the threads of every library in it, to one core."""
    allowed = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {sorted(allowed)[os.getpid() % len(allowed)]})  # runs side by side take different cores
    try:
        yield
    finally:
        os.sched_setaffinity(0, allowed)


def shortest(run: Callable[[], Result], *, runs: int = 20, budget: float = 1.0) -> tuple[float, Result]:
    """Measure the shortest CPU time of a function, over all its threads, and return it with the last result.

    On one core this equals the wall time on a machine without other load.

    Args:
        run: the function.
        runs: upper limit.
        budget: s after which no new run begins.
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
