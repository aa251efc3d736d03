"""Charts of cost against error: what counts as beaten, what it costs, what ships, what is measured anew."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import jamlab
from studies.reference_data import open_tables
from studies.registry import CHARTS
from studies.speed_accuracy.chart import COLUMNS, Trial, drawn_of, points_of
from studies.speed_accuracy.droplet_vertices import limit_of_vertices
from studies.speed_accuracy.ensemble_means import limit_of_size, points_of_means
from studies.speed_accuracy.moduli import dense_modulus, relaxed
from studies.speed_accuracy.packing_fractions import covered
from studies.tables import measure


def trials(*rows):
    """A table of trials from panel, setting, seconds, error and, if it is not 0, the error of the reference."""
    filled = [(panel, "m", name, s, e, *(more or [0.0]), False, "", False) for panel, name, s, e, *more in rows]
    return pd.DataFrame(filled, columns=COLUMNS)


def test_beaten_points_and_their_price():
    """A staircase by hand: equal cost and larger error, equal error and larger cost, other panels, no number."""
    nan = float("nan")
    points = points_of(
        trials(
            *[("a", "fast", 1.0, 1e-2), ("a", "good", 10.0, 1e-6), ("a", "worse", 1.0, 2e-2)],
            *[("a", "slower", 20.0, 1e-6), ("a", "as fast as can be told", 11.0, 1e-6), ("a", "broken", nan, nan)],
            *[("b", "alone", 99.0, 1.0), ("c", "exact", 30.0, 0.0, 1e-14)],
            *[("c", "below the floor", 30.0, 1e-13, 1e-14), ("c", "cheap, but fails", 1.0, 1e-13, 1e-14)],
            ("c", "cheap, but fails", nan, nan, 1e-14),
        )
    ).set_index("setting")
    beaten = ["worse", "slower", "broken"]
    assert points.index[~points["on_front"]].tolist() == beaten
    assert points["price"][["fast", "good", "worse", "slower", "exact"]].tolist() == [1.0, 1.0, 1.0, 2.0, 1.0]
    assert points["failed"]["cheap, but fails"] == points["packings"]["cheap, but fails"] == 1


def test_means_and_bands_over_packings():
    errors = [-1e-3, 2e-3, -3e-3, 4e-3, np.nan]
    rows = [("p", "m", "1", 0.1 * k, e, 1e-9, False, "note" if k == 4 else "", False) for k, e in enumerate(errors)]
    found = points_of(pd.DataFrame([*rows, ("p", "m", "2", 1.0, 0.0, 3e-9, True, "", False)], columns=COLUMNS))
    first, second = found.to_dict("records")
    assert [first["setting"], second["setting"]] == ["1", "2"] and second["default"] and not first["default"]
    assert (first["error"], first["packings"], first["failed"]) == (pytest.approx(2.5e-3), 4, 1)
    assert first["low"] == pytest.approx(1.3e-3) and first["high"] == pytest.approx(3.7e-3)
    assert first["seconds"] == pytest.approx(0.15) and first["note"] == "note" and first["floor"] == pytest.approx(1e-7)


def test_the_reference_of_moduli_is_the_one_of_linear_response():
    """Two ways that share no solver."""
    packing = relaxed(jamlab.pack(16, 1e-2, 1, ensemble="shear-stabilized"), 1e-14)
    assert dense_modulus(packing) == pytest.approx(jamlab.shear_modulus(packing), rel=1e-9)


def test_limits_that_references_are_carried_to():
    """Polygons err by 1/count^2, means by a power of N; scatter about that widens the error of their limit."""
    coarse, fine = ({"pressure": 2.0 + 5.0 / count**2} for count in (32, 48))
    assert limit_of_vertices(coarse, fine, (32, 48))["pressure"] == pytest.approx(2.0, abs=1e-12)
    rng = np.random.default_rng(1)
    values = {n: 4.0 - 3.0 * n**-0.7 + 0.1 * rng.standard_normal(400) for n in (16, 32, 64, 128, 256, 1024)}
    mean, error = limit_of_size(values)
    assert abs(mean - 4.0) < 3 * error < 0.1
    moved = {n: each + (0.1 if n == 64 else 0.0) for n, each in values.items()}
    assert limit_of_size(moved)[1] > 2 * error


def test_more_packings_and_larger_ones_err_less():
    """Errors of means fall with the number of packings; beyond it remains what a size differs from the limit by."""
    rng = np.random.default_rng(2)
    rows = [
        (panel, f"N = {n}", "", 1e-3 * n, 4.0 - 3.0 / n + rng.normal(0, 1 / np.sqrt(n)), 0.0, False, "", False)
        for panel in ("φ", "z", "G, k")
        for n in (16, 32, 64, 128, 256, 1024, 4096)
        for _ in range(200)
    ]
    found = points_of_means(pd.DataFrame(rows, columns=COLUMNS)).set_index(["panel", "method", "setting"])
    z = found.loc["z"]
    assert z.loc[("N = 256", "50"), "error"] < 0.3 * z.loc[("N = 256", "1"), "error"]
    assert z.loc[("N = 16", "50"), "error"] == pytest.approx(3 / 16, rel=0.2)
    assert z.loc[("N = 64", "10"), "seconds"] == pytest.approx(0.64)


def test_random_points_and_exact_ways_agree():
    packing = jamlab.pack(16, 1e-2, 1)
    assert covered(packing, 200_000, 1) == pytest.approx(jamlab.packing_fraction(packing), abs=4e-3)


@pytest.mark.parametrize("name", CHARTS)
def test_what_ships(name):
    """As many packings as the chart says, a default that gives numbers, of which the price is what the pages say."""
    chart, table = CHARTS[name], open_tables().read(name)
    none = {"droplet-vertices": 4}.get(name, 0)  # as many packings at most jam beyond rho, and give no rows
    assert set(COLUMNS) <= set(table.columns) and set(table["task"]) <= set(chart.study.tasks)
    assert len(set(table["task"])) >= len(chart.study.tasks) - none
    points = chart.points(table)
    fewer = {"N = 1024": 5, "N = 8192": 3}  # in other codes, as the caption says
    at_least = points["panel"].map(fewer).fillna(0.75 * chart.words["packings"])  # an unstable one has no spectrum
    assert (points["packings"] + points["failed"] >= at_least).all()
    has_default = name != "ensemble-means"  # how many packings are enough is up to the reader
    assert drawn_of(points[points["default"]]).all() and points["default"].any() == has_default
    shown = points[drawn_of(points)]
    assert (shown["low"] <= shown["high"]).all() and (shown["seconds"] > 0).all()
    dear = {"packing-fraction": 4.0}  # where no three disks overlap in a point, pairs are exact and cost less
    assert not has_default or points.loc[points["default"], "price"].max() <= dear.get(name, 2.05)


def test_a_chart_is_drawn_from_what_was_measured(tmp_path):
    """The first packing is measured twice, to load libraries; a default that costs twice the cheapest is named."""
    done = []

    def made(seed):
        done.append(seed)
        own = [Trial("p", "m", f"{k}", 10.0**k, 10.0**-k, default=k == 1) for k in (1, 2)]
        return [*own, Trial("p", "better", "", 5.0, 0.01)]

    chart = replace(CHARTS["spectrum"], measure=made)
    last = chart.words["packings"]
    path = measure(tmp_path, "spectrum", dict(list(chart.study.tasks.items())[:3]))
    assert done == [last, last, last - 1, last - 2] and path.exists()
    drawn = chart.study.draw(open_tables(tmp_path))
    found = drawn.table.set_index(["method", "setting"])
    assert found.loc[("m", "2"), ["seconds", "error", "packings"]].tolist() == [100.0, 0.01, 3]
    off, every = drawn.text
    assert [[*row[:3], row[5]] for row in off.rows] == [["p", "m", "1", "2.0"]] and len(every.rows) == 3
