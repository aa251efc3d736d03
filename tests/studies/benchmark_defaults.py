"""Every default against the others of its chart, measured anew on a few packings, beside what ships.

pytest -m benchmark -s tests/studies/benchmark_defaults.py, some minutes; costs count as ratios within one chart, so
that the machine does not matter. JAMLAB_SEEDS: how many packings, by default 3. "other-codes" needs all peers.
"""

import os
from itertools import islice

import pytest

from studies import tables
from studies.registry import CHARTS
from studies.speed_accuracy.chart import points_of

DEARER = 1.8  # factor in the price of a default: single packings scatter, and so does a busy machine
WORSE = 3.0  # factor over the 90 % quantile of the error that ships


def defaults(rows):
    points = points_of(rows)
    return points[points["default"]].set_index(["panel", "method", "setting"]).to_dict("index")


@pytest.mark.benchmark
@pytest.mark.parametrize("name", CHARTS)
def test_defaults_stay_where_they_are(name, tmp_path):
    few = dict(islice(CHARTS[name].study.tasks.items(), int(os.environ.get("JAMLAB_SEEDS", "3"))))
    tables.measure(tmp_path, name, few)
    shipped_rows = tables.read_table(tables.DATA, name)
    shipped = defaults(shipped_rows[shipped_rows["task"].isin(few)])  # the same packings
    found = defaults(tables.read_table(tmp_path, name))
    assert found.keys() == shipped.keys()
    for key, now in found.items():
        was = shipped[key]
        errors = f"error {now['error']:.2g} ({was['error']:.2g})"
        print(f"{name}: {' | '.join(key)}: {errors}, price {now['price']:.2f} ({was['price']:.2f})")
        assert now["price"] <= DEARER * was["price"], f"{key}: costs {now['price']:.2f} times the cheapest as good"
        assert now["error"] <= WORSE * max(was["high"], was["error"], now["floor"])
        assert now["failed"] <= was["failed"]
