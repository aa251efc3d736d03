"""Charts of cost against error: what counts as beaten, what it costs, what ships, what is measured anew."""

from dataclasses import asdict, replace
from itertools import islice

import numpy as np
import pandas as pd
import pytest

import jamlab
from studies.other_codes.compare import jolted_minimum
from studies.other_codes.peers import Lammps
from studies.reference_data import read_folder, reference_tables
from studies.registry import CHARTS
from studies.speed_accuracy import droplet_vertices, onset_and_pressure
from studies.speed_accuracy.chart import (
    COLUMNS,
    Point,
    Trial,
    curve_figure,
    dominated,
    points_of,
    price,
)
from studies.speed_accuracy.ensemble_means import limit_of_size
from studies.tables import measure


def point(method, seconds, error, panel="a", floor=0.0, **rest):
    numbers = {"low": error, "high": error, "floor": floor, "packings": 20, "failed": 0, "default": False}
    return Point(panel, method, "", seconds, error, **numbers | rest)


def test_beaten_points_and_their_price():
    """A staircase by hand: equal cost and larger error, equal error and larger cost, other panels, no number."""
    points = [
        point("fast", 1.0, 1e-2),
        point("good", 10.0, 1e-6),
        point("worse", 1.0, 2e-2),
        point("slower", 20.0, 1e-6),
        point("as fast as can be told", 11.0, 1e-6),
        point("broken", np.nan, np.nan),
        point("alone", 99.0, 1.0, panel="b"),
        point("exact", 30.0, 0.0, panel="c", floor=1e-12),
        point("below the floor", 30.0, 1e-13, panel="c", floor=1e-12),
        point("cheap, but fails", 1.0, 1e-13, panel="c", floor=1e-12, failed=3),
    ]
    assert dominated(points).tolist() == [False, False, True, True, False, True, False, False, False, False]
    assert [price(p, points) for p in points[:4]] == [1.0, 1.0, 1.0, 2.0]
    assert price(points[7], points) == 1.0


def test_what_the_reference_cannot_tell_is_not_ranked():
    """Below a loose floor nothing is beaten, has a price or is called exact; it still beats what is worse."""
    rows = [
        ("p", "m", f"{k}", float(k), e, 1e-3, k == 4, "", False)
        for k, e in ((1, 1e-1), (2, 5e-4), (3, 1e-2), (4, 8e-4))
    ]
    table = pd.DataFrame(rows, columns=COLUMNS)
    loose = points_of(table, better=1.0)
    assert [p.ranked for p in loose] == [True, False, True, False]
    assert dominated(loose).tolist() == [False, False, True, False] and price(loose[3], loose) == 1.0
    assert all(p.ranked for p in points_of(table)) and dominated(points_of(table)).any()
    axes = curve_figure("title", "error", loose).axes[0]
    (strip,) = [patch for patch in axes.patches if patch.get_hatch()]
    assert strip.get_y() + strip.get_height() == pytest.approx(1e-3)
    marks = [(line.get_ydata()[0], line.get_alpha()) for line in axes.lines if line.get_markersize() == 7]
    assert sorted(marks) == [(1e-3, 0.5), (1e-3, 0.5), (1e-2, 1.0), (0.1, 1.0)]  # unranked ones on the strip, pale


def test_limits_that_references_are_carried_to():
    """Polygons err by 1/count^2, means by a power of N; scatter about that widens the error of their limit."""
    coarse, fine = ({"pressure": 2.0 + 3.0 / n**2, "z": float(n)} for n in (32, 48))
    limit = droplet_vertices._limit(coarse, fine, (32, 48))
    assert limit["pressure"] == pytest.approx(2.0, abs=1e-12) and limit["z"] == 48.0
    noise = np.array([-1.0, 1.0] * 50)
    values = {n: 0.84 - 0.2 / n**0.7 + 0.002 * noise for n in (16, 32, 64, 128, 256, 1024)}
    mean, error = limit_of_size(values)
    assert mean == pytest.approx(0.84, abs=1e-5) and error < 0.001
    moved = values | {256: values[256] + 0.002}
    assert limit_of_size(moved)[1] > 2 * error


def test_a_mean_is_known_as_its_least_known_difference():
    """Steps that agree in all packings share the error of those that do not: the next packing may differ."""
    off = {"0.1": [1e-2, -3e-2, 5e-2, 0.0], "0.01": [1e-8, 1e-8, 1e-8, 1e-8]}
    rows = [("one", "m", s, 1.0, e, 1e-8, False, "", False) for s, errors in off.items() for e in errors]
    means = [p for p in onset_and_pressure.points_of_onsets(pd.DataFrame(rows, columns=COLUMNS)) if p.panel != "one"]
    assert [p.floor for p in means] == pytest.approx(2 * [np.std(off["0.1"], ddof=1) / 2])
    assert [p.ranked for p in means] == [True, False] and means[0].error == pytest.approx(
        np.hypot(7.5e-3, means[0].floor)
    )


def test_lammps_keeps_its_bound_of_steps():
    """Its fire looks at the bound of iterations alone: 8192 disks once went on for a minute."""
    start, _ = jolted_minimum(16, 1, 0.9)
    for style in ("cg", "fire", "hftn"):
        short, long = (Lammps(style).descent(start)(1e-12, steps) for steps in (3, 5000))
        left = [jamlab.evaluate(start.with_state(positions=x)).max_force for x in (short, long)]
        assert left[0] > 1e-6 and left[1] < 1e-11


def test_means_and_bands_over_packings():
    errors = [-1e-3, 2e-3, -3e-3, 4e-3, np.nan]
    rows = [("p", "m", "1", 0.1 * k, e, 1e-9, False, "note" if k == 4 else "", False) for k, e in enumerate(errors)]
    found = points_of(pd.DataFrame([*rows, ("p", "m", "2", 1.0, 0.0, 3e-9, True, "", False)], columns=COLUMNS))
    assert [p.setting for p in found] == ["1", "2"]
    assert (found[0].error, found[0].packings, found[0].failed) == (pytest.approx(2.5e-3), 4, 1)
    assert found[0].low == pytest.approx(1.3e-3) and found[0].high == pytest.approx(3.7e-3)
    assert found[0].seconds == pytest.approx(0.15) and found[0].note == "note" and found[0].floor == pytest.approx(1e-7)
    assert found[1].exact and found[1].default and not found[0].exact


@pytest.mark.parametrize("name", CHARTS)
def test_what_ships(name):
    """Twenty packings, a default that gives numbers, and a reference better than what is compared with it."""
    chart, table = CHARTS[name], reference_tables().read(name)
    assert set(COLUMNS) <= set(table.columns) and set(table["task"]) <= set(chart.study.tasks)
    assert table["task"].nunique() >= 20
    points = chart.average(table)
    fewer = {"N = 1024": 5, "N = 8192": 3}  # in other codes, as the caption says
    assert all(p.packings + p.failed >= fewer.get(p.panel, 15) for p in points)
    assert all(p.packings and np.isfinite(p.error) for p in points if p.default)
    assert all(p.low <= p.high and p.seconds > 0 for p in points if p.drawn)
    assert bool(table["cut"].any()) == (name == "other-codes")


def test_one_packing_measured_anew_agrees_with_what_ships():
    """Numbers do not hang on the machine: the same errors of the same packing; costs in the same order."""
    chart = CHARTS["packing-fraction"]
    before = reference_tables().read("packing-fraction")
    before = before[(before["task"] == "1") & (before["panel"] == "φ = 0.86")].reset_index(drop=True)
    now = pd.DataFrame(map(asdict, islice(chart.measure(1), len(before))))
    now, before = (one.sort_values(["method", "setting"], ignore_index=True) for one in (now, before))
    assert now[["panel", "method", "setting"]].equals(before[["panel", "method", "setting"]])
    np.testing.assert_allclose(now["error"], before["error"], rtol=1e-5, atol=1e-14)
    cost = now[now["method"] == "random points"].groupby("setting")["seconds"].mean()
    assert cost["100000"] > 10 * cost["1000"]


def test_a_chart_is_drawn_from_what_was_measured(tmp_path):
    """The first packing is measured twice, to load libraries; a default that costs twice the cheapest is named."""
    done = []

    def trials(seed):
        done.append(seed)
        return [Trial("p", "m", f"{k}", 10.0**k, 10.0**-k, default=k == 1) for k in (1, 2)] + [
            Trial("p", "better", "", 5.0, 0.01)
        ]

    chart = replace(CHARTS["spectrum"], measure=trials, seeds=range(1, 4))
    path = measure(tmp_path, "spectrum", chart.study.tasks)
    assert done == [1, 1, 2, 3] and path.exists()
    drawn = chart.study.draw(read_folder(tmp_path))
    found = drawn.table.set_index(["method", "setting"])
    assert found.loc[("m", "2"), ["seconds", "error", "packings"]].tolist() == [100.0, 0.01, 3]
    off, every = drawn.text
    assert [[*row[:2], row[4]] for row in off.rows] == [["p", "m 1", "2.0"]] and len(every.rows) == 3
