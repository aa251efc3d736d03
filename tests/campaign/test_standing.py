"""What a run says of itself: work done and left by the times of tasks, the rate, and one line for all of it."""

import itertools
import math

import pytest
from campaigns import read_campaign_file, written

from jamlab.campaign import standing
from jamlab.campaign.chunks import Cutter
from jamlab.campaign.standing import Meter, Standing
from jamlab.campaign.tasks import batches, task_names
from jamlab.campaign.workers import FAILED, FINISHED, Outcome

SMALL = {"compress": None, "onset": True}


class Crew:
    workers = 4

    def interrupt(self):
        self.told = True


@pytest.fixture
def clock(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(standing.time, "monotonic", lambda: now[0])
    return now


def a_run(tmp_path, seconds, before=(0, 0), **changes):
    """A meter that follows a run of one batch for each n, and the cutter."""
    chosen = batches(read_campaign_file(written(tmp_path / "c.toml", **SMALL | changes)))
    names = task_names(chosen)
    cutter = Cutter(chosen, names, lambda: 4, dict(zip([b.name for b in chosen], seconds, strict=False)))
    meter = Meter()
    meter.begin(len(names) + sum(before), *before)
    meter.follow(cutter, Crew())
    return meter, cutter


def test_time_left_is_that_of_the_work_and_not_of_the_number_of_tasks(tmp_path, clock):
    """40 tasks of 10 s and 40 of 1 s, the long ones first, on four workers: 110 s."""
    meter, cutter = a_run(tmp_path, (10.0, 1.0), n=[64, 16], seeds=40)  # 400 s and 40 s of work
    assert meter.standing().seconds_left == pytest.approx(440 / 4)
    chunks = [cutter.next() for _ in range(40)]
    assert meter.standing().seconds_left == pytest.approx((440 - 4 * 5) / 4)  # those under way are half done
    for chunk in chunks:
        cutter.learn(chunk, 10.0)
        meter.count(Outcome(FINISHED, "", 10.0))
    clock[0] += 100.0
    found = meter.standing()
    assert (found.finished, found.share, found.workers) == (40, pytest.approx(400 / 440), 4)
    assert found.seconds_left == pytest.approx(10.0) and found.rate == pytest.approx(0.4)


def test_the_last_task_takes_its_time_however_many_workers_there_are(tmp_path, clock):
    meter, cutter = a_run(tmp_path, (100.0,), n=16, seeds=1)
    assert meter.standing().seconds_left == pytest.approx(50.0)
    cutter.next()
    assert meter.standing().seconds_left == pytest.approx(50.0)


def test_time_left_of_batches_without_a_time_follows_from_the_sites(tmp_path, clock):
    meter, cutter = a_run(tmp_path, (8.0,), n=[64, 16], seeds=10)
    assert meter.standing().seconds_left == pytest.approx((80 + 20) / 4)
    meter, cutter = a_run(tmp_path, (), n=[64, 16], seeds=10)
    assert math.isnan(meter.standing().seconds_left) and meter.standing().share == 0
    cutter.learn(cutter.next(), 8.0)
    assert meter.standing().seconds_left == pytest.approx((72 + 20) / 4)


def test_tasks_of_earlier_runs_count_as_done_but_not_for_the_rate(tmp_path, clock):
    meter, cutter = a_run(tmp_path, (1.0,), before=(8, 2), seeds=10)
    assert (meter.standing().share, meter.standing().finished) == (0.5, 8)
    for _ in range(5):
        cutter.learn(cutter.next(), 1.0)
        meter.count(Outcome(FAILED, "", 1.0))
    clock[0] += 10
    found = meter.standing()
    assert (found.share, found.failed, found.rate) == (0.75, 7, pytest.approx(0.5))


def test_a_million_tasks_are_shown_a_few_times_a_second(tmp_path, clock):
    meter, _ = a_run(tmp_path, (1.0,), seeds=200)
    shown = []
    for count in itertools.count(1):
        meter.count(Outcome(FINISHED, "", 1.0))
        clock[0] += 0.05
        meter.look(shown.append)
        if count == 200:
            break
    assert 40 <= len(shown) <= 60 and shown[-1].finished == 200


def test_a_run_is_interrupted_before_and_after_its_workers_are_there(tmp_path):
    meter, _ = a_run(tmp_path, (), seeds=2)
    crew = Crew()
    meter.follow(None, crew)
    meter.interrupt()
    assert crew.told
    meter, late = Meter(), Crew()
    meter.interrupt()
    meter.follow(None, late)
    assert late.told


@pytest.mark.parametrize(
    ("rate", "left", "line"),
    [
        (25.0, 50.0, "5 of 9 tasks, 1 failed, about 50 s left, 25 tasks/s, 8 workers"),
        (12345.6, 7300.0, "5 of 9 tasks, 1 failed, about 2.0 h left, 12346 tasks/s, 8 workers"),
        (0.25, 600.0, "5 of 9 tasks, 1 failed, about 10 min left, 15 tasks/min, 8 workers"),
        (1e-5, 9e5, "5 of 9 tasks, 1 failed, about 250.0 h left, 0.864 tasks/day, 8 workers"),
        (math.nan, math.nan, "5 of 9 tasks, 1 failed, 8 workers"),
    ],
)
def test_the_line(rate, left, line):
    assert str(Standing(9, 5, 1, 0.5, rate, left, 8)) == line
    assert str(Standing(9, 5, 0, 0.5, math.nan, 0.0, 1)) == "5 of 9 tasks, 1 worker"
