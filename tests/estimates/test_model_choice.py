"""The automatic choice: cheapest way that meets the tolerance, refusals, what it says, and a scene by each model."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import jamlab
from jamlab.estimates.ensemble_way import EnsembleWay, bring_on, default_way
from jamlab.estimates.model_choice import QUANTITIES, errors_of, expected_error, list_records
from jamlab.estimates.way_table import WayRecord, read_ways

LEVELS = np.array([0.85, 0.90])
DISKS = EnsembleWay("disks", 64)
COARSE = EnsembleWay("carried", 64, (8, 11))
FINE = default_way(64)


def table():
    """Disks are off by -0.2 in z and scatter by 0.1 at rho = 0.90, by 0.02 at 0.85; coarse polygons by 0.02 at both.

    Values of all packings go up and down together, which must not count.
    """

    def record(way, bias, scatter, seconds):
        own = np.array([-1.0, 0.0, 1.0])[:, None] * np.array(scatter)
        values = dict.fromkeys(QUANTITIES, 4.0 + np.array([[-3.0], [0.5], [2.5]]) + bias + own)
        return WayRecord(way, np.arange(3), LEVELS, values, np.full((3, 2), seconds))

    disks, coarse = record(DISKS, -0.2, (0.02, 0.1), 0.1), record(COARSE, 0.05, (0.02, 0.02), 1.0)
    return {DISKS: disks, COARSE: coarse, FINE: record(FINE, 0.0, (0.0, 0.0), 5.0)}


def chosen(rho, z, **options):
    return jamlab.choose(rho, {"z": z}, 64, table=options.pop("table", table()), **options)


def test_the_cheapest_way_that_is_good_enough():
    """Limits are 4.97 times the scatter, t of two degrees of freedom times sqrt(4/3), and a third of the mean."""
    assert chosen(0.90, 0.57).way == DISKS
    assert chosen(0.90, 0.55).way == COARSE
    assert chosen(0.90, 0.11).way == FINE
    assert chosen(0.85, 0.17).way == DISKS  # there disks scatter as little
    assert chosen(0.90, 0.6, model="dp").way == COARSE
    assert jamlab.choose(0.90, {"z": 0.11}, 1024, table=table()).way == replace(COARSE, n=1024)


def test_a_choice_says_what_why_and_how_wrong():
    choice = chosen(0.90, 0.15)
    assert "8/11 vertices" in choice.why and "z within 0.15" in choice.why and "64 disks with z to 0.56" in choice.why
    assert choice.error == {"z": pytest.approx(0.0994 + 0.05 / 3, abs=1e-4)} and choice.seconds == pytest.approx(1.0)
    assert choice.correction == pytest.approx({"z": -0.05, "g": 0.0, "a": -0.05, "void_sides": -0.05})
    assert chosen(0.90, 0.01).error == {"z": 0.0}  # default droplets are what errors are measured against


def test_a_way_is_not_chosen_where_it_fails():
    """Of three coarse packings one fails at 0.90, but none does at 0.85."""
    broken = table()
    broken[COARSE].values["z"][0, 1] = np.nan
    assert chosen(0.90, 0.15, table=broken).way == chosen(0.86, 0.15, table=broken).way == FINE
    assert chosen(0.85, 0.15, model="dp", table=broken).way == COARSE


def test_neither_looser_minima_nor_droplets_from_the_start_make_a_scene():
    world = table()
    for way in (replace(FINE, tolerance=1e-6), replace(FINE, start="droplets"), replace(FINE, n=32)):
        world[way] = replace(world[FINE], way=way, seconds=np.full((3, 2), 1e-3))
    assert chosen(0.90, 0.01, table=world).way == FINE


def test_expected_error_is_a_prediction_interval():
    """95 % of new draws lie inside; the random part falls with the square root of n."""
    rng = np.random.default_rng(1)
    draws = rng.normal(0.0, 1.0, (4000, 6))
    inside = [abs(new - np.mean(old)) <= expected_error(old, 64, 64) for *old, new in draws]
    assert 0.94 < np.mean(inside) < 0.96
    errors = np.array([0.1, 0.3])
    wide, narrow = expected_error(errors, 64, 64), expected_error(errors, 64, 6400)
    assert wide == pytest.approx(10 * narrow)
    assert wide == pytest.approx(stats.t.ppf(0.975, 1) * np.std(errors, ddof=1) * np.sqrt(1.5))
    assert expected_error(np.zeros(3), 64, 64, quantum=2 / 64) > 1 / 64
    assert expected_error(errors[:1], 64, 64) == np.inf


@pytest.mark.parametrize("name", QUANTITIES)
def test_errors_expected_from_the_shipped_table_hold_in_95_of_100_packings(name):
    """Each packing of disks, carried or coarse droplets against what all others of its way foretell."""
    reference = read_ways()[FINE]
    held = []
    for record in list_records(read_ways()):
        for errors in errors_of(record, reference, name) if record is not reference else ():
            for k in range(len(errors)):
                others = np.delete(errors, k)
                expected = expected_error(others, 64, 64, 2 / 64 if name == "z" else 0.0)
                held.append(abs(errors[k] - np.mean(others)) <= expected)
    assert len(held) > 1000 and 0.93 < np.mean(held) < 0.99


@pytest.mark.parametrize(
    ("rho", "tolerance", "options", "said"),
    [
        (0.90, {"z": 1e-6}, {"model": "sp"}, "64 disks comes nearest"),
        (0.99, {"z": 0.1}, {}, "0.85 .. 0.9"),
        (0.90, {"weight": 0.1}, {}, "'weight'"),
        (0.90, {"z": -0.1}, {}, "-0.1"),
        (0.90, {}, {}, "no tolerance"),
        (1.5, {"z": 0.1}, {}, "1.5"),
        (0.90, {"z": 0.1}, {"model": "xp"}, "'xp'"),
        (0.90, {"z": 0.1}, {"table": {}}, "the table has no 64 droplets carried"),
    ],
)
def test_refusals(rho, tolerance, options, said):
    with pytest.raises(jamlab.InputError, match=said):
        jamlab.choose(rho, tolerance, 64, **{"table": table()} | options)


@pytest.mark.parametrize("n", [0, 1, 7, 1_000_002])
def test_a_choice_refuses_what_no_scene_has(n):
    said = []
    for ask in (jamlab.choose, jamlab.scene):
        with pytest.raises(jamlab.InputError, match=f"n = {n}: ") as caught:
            ask(rho=0.9, n=n, tolerance={"z": 2.0})
        said.append(str(caught.value))
    assert said[0] == said[1]


def test_shipped_table_serves_scenes():
    """Disks, fewer vertices, another contact form and default droplets, from the onsets to confluence."""
    ways = [record.way for record in list_records(read_ways())]
    assert {DISKS, COARSE, FINE, replace(FINE, contact="segment/smooth")} == set(ways)
    assert jamlab.choose(0.86, {"z": 2.0}).way == DISKS
    for rho in (0.84, 0.95, 0.98):
        assert jamlab.choose(rho, {"z": 1e-3}).way == FINE


def test_scene_with_disks():
    found = jamlab.scene(0.87, 16, 3, tolerance={"z": 2.0})
    assert found.packing.model == "sp" and found.values["z"] == jamlab.contacts(found.packing).z
    assert jamlab.packing_fraction(found.packing) == pytest.approx(0.87, abs=1e-6)
    assert found.packing.provenance["model_why"] == found.choice.why
    assert found.estimate["z"] == found.values["z"] + found.choice.correction["z"]


def test_scene_with_droplets_goes_beyond_the_handover():
    """At rho = 0.90 disks carry the droplets to 0.88."""
    onset = jamlab.jam("sp", 10, 1)
    dense = bring_on(EnsembleWay("carried", 10, (8, 11), "segment/smooth"), onset, 0.90)
    assert dense.params["contact"] == "segment/smooth" and set(np.diff(dense.offsets)) == {8, 11}
    assert jamlab.packing_fraction(dense) == pytest.approx(0.90, abs=1e-6)
    assert dense.provenance["handover"]["rho"] == pytest.approx(0.88, abs=1e-6)
    assert dense.converged


def test_scene_below_onset_is_refused():
    onset = jamlab.jam("sp", 10, 1)
    with pytest.raises(jamlab.ConvergenceError, match="jams at rho"):
        bring_on(EnsembleWay("disks", 10), onset, 0.7)
