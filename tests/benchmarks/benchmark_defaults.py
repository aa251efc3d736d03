"""Every default against the others of its chart, measured anew on a few packings, beside what ships.

pytest -m benchmark -s tests/benchmarks/benchmark_defaults.py, some minutes; costs count as ratios within one chart, so
that the machine does not matter. JAMLAB_SEEDS: how many packings, by default 3.
"""

import os

import pytest
from jamlab.studies.cost.topic import measure_trials, shipped_trials
from jamlab.studies.cost.topics import TOPICS

from jamlab.studies.cost.curve_points import price

DEARER = 1.8  # factor in the price of a default: single packings scatter, and so does a busy machine
WORSE = 3.0  # factor over the 90 % quantile of the error that ships


def defaults(points):
    return {(p.panel, p.method, p.setting): p for p in points if p.default}


@pytest.mark.benchmark
@pytest.mark.parametrize("name", [name for name in TOPICS if name != "ensemble-means"])
def test_defaults_stay_where_they_are(name, tmp_path):
    topic = TOPICS[name]
    seeds = topic.seeds[: int(os.environ.get("JAMLAB_SEEDS", "3"))]
    now = topic.points(measure_trials(tmp_path / "now.csv", topic, seeds).rows)
    shipped_rows = shipped_trials(name).rows
    before = topic.points(shipped_rows[shipped_rows["task"].isin(list(map(str, seeds)))])  # the same packings
    shipped, found = defaults(before), defaults(now)
    assert found.keys() == shipped.keys()
    for key, point in found.items():
        paid, was = price(point, now), price(shipped[key], before)
        errors = f"error {point.error:.2g} ({shipped[key].error:.2g})"
        print(f"{name}: {' | '.join(key)}: {errors}, price {paid:.2f} ({was:.2f})")
        assert paid <= DEARER * was, f"{key}: costs {paid:.2f} times the cheapest as good, {was:.2f} before"
        assert point.error <= WORSE * max(shipped[key].high, shipped[key].error, point.floor)
        assert point.failed <= shipped[key].failed
