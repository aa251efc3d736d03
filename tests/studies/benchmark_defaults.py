"""Every default against the others of its chart, measured anew on a few packings, beside what ships.

pytest -m benchmark -s tests/studies/benchmark_defaults.py, some minutes; costs count as ratios within one chart, so
that the machine does not matter. JAMLAB_SEEDS: how many packings, by default 3.
"""

import os
from dataclasses import replace

import pytest

from studies import tables
from studies.registry import CHARTS
from studies.speed_accuracy.chart import price

DEARER = 1.8  # factor in the price of a default: single packings scatter, and so does a busy machine
WORSE = 3.0  # factor over the 90 % quantile of the error that ships


def defaults(points):
    return {(p.panel, p.method, p.setting): p for p in points if p.default}


@pytest.mark.benchmark
@pytest.mark.parametrize("name", [name for name in CHARTS if name != "ensemble-means"])
def test_defaults_stay_where_they_are(name, tmp_path):
    chart = CHARTS[name]
    few = replace(chart, seeds=chart.seeds[: int(os.environ.get("JAMLAB_SEEDS", "3"))])
    tables.measure(tmp_path, name, few.study.tasks)
    now = few.average(tables.read_table(tmp_path, name))
    shipped_rows = tables.read_table(tables.DATA, name)
    before = chart.average(shipped_rows[shipped_rows["task"].isin(few.study.tasks)])  # the same packings
    shipped, found = defaults(before), defaults(now)
    assert found.keys() == shipped.keys()
    for key, point in found.items():
        paid, was = price(point, now), price(shipped[key], before)
        errors = f"error {point.error:.2g} ({shipped[key].error:.2g})"
        print(f"{name}: {' | '.join(key)}: {errors}, price {paid:.2f} ({was:.2f})")
        assert paid <= DEARER * was, f"{key}: costs {paid:.2f} times the cheapest as good, {was:.2f} before"
        assert point.error <= WORSE * max(shipped[key].high, shipped[key].error, point.floor)
        assert point.failed <= shipped[key].failed
