"""A planted loss of a tenth is told, and none is not.

pytest -m benchmark -s tests/studies/benchmark_speed_history.py
"""

import time

import pytest

from studies.speed_history.losses import changes
from studies.speed_history.record import PROCESSES, Record
from studies.speed_history.works import REPEATS, measure_work, works

pytestmark = pytest.mark.benchmark
NAMES = ("onset of 64 disks", "true packing fraction, 64 droplets", "tessellation, 64 droplets", "measure, 64 disks")


def slower(run, by):
    """The same work, followed by a pause that costs CPU time: so much of what one run takes."""

    def longer():
        began = time.process_time()
        found = run()
        end = time.process_time() + by * (time.process_time() - began)
        while time.process_time() < end:
            pass
        return found

    return longer


def record(commit, day, row):
    return Record(commit, f"2026-01-{day:02d}T00:00:00+00:00", "", "", "", "", {"w": row})


def merged(runs):
    return {"ratios": [run["ratios"] for run in runs], "seconds": [], "found": [runs[0]["found"]]}


@pytest.mark.parametrize("name", NAMES)
def test_a_planted_loss(name):
    """By turns: the work, the same once more, and the same with a loss of a tenth."""
    run = works()[name]()
    ways = {"before": run, "after": run, "with a loss": slower(run, 0.1)}
    runs = {way: [] for way in ways}
    for _ in range(PROCESSES):
        for way, each in ways.items():
            runs[way].append(measure_work(each, REPEATS))
    before = record("before", 1, merged(runs["before"]))
    told = {way: changes(record(way, 2, merged(runs[way])), [before])[0] for way in ("after", "with a loss")}
    for way, change in told.items():
        print(f"\n{name}, {way}: ratio {change.ratio:.3f}, error {change.error:.3f}, {change.cells[2] or 'no loss'}")
    assert told["with a loss"].lost and not told["after"].lost
