"""How time is measured."""

import os
import time

from studies.table import one_core, shortest


def test_one_core_holds_and_lets_go():
    before = os.sched_getaffinity(0)
    with one_core():
        assert len(os.sched_getaffinity(0)) == 1 and os.sched_getaffinity(0) <= before
    assert os.sched_getaffinity(0) == before


def test_shortest_counts_work_not_waiting():
    """Sleep costs nothing; a run that works longest does not count."""
    runs = iter([300_000, 3_000, 100_000])

    def work():
        time.sleep(0.02)
        return sum(range(next(runs)))

    seconds, last = shortest(work, runs=3, budget=10.0)
    assert seconds < 0.01 and last == sum(range(100_000))


def test_shortest_stops_at_its_budget():
    count = 0

    def work():
        nonlocal count
        count += 1
        return sum(range(200_000))

    shortest(work, runs=1000, budget=1e-6)
    assert count == 1
