"""The automatic choice: cheapest way that meets the error, refusals, what it says, and a scene by each model."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

import jamlab
from jamlab.estimates.choice import Why
from jamlab.estimates.model_choice import CHOICE_QUANTITIES, errors_of, expected_error, list_records
from jamlab.estimates.ways import EnsembleWay, WayRecord, bring_on, default_way, read_ways
from jamlab.statistics.confidence import exceeded_by_few

LEVELS = np.array([0.85, 0.90])
DISKS = EnsembleWay("disks", 64)
COARSE = EnsembleWay("carried", 64, (8, 11))
FINE = default_way(64)
ERRORS = np.linspace(
    -1.0, 1.0, 21
)  # of 21 packings the largest bounds 95 %: 1.05 times the one from the mean of others


def table():
    """Disks are off by -0.2 in z, and by up to 0.5 more at rho = 0.90, 0.1 at 0.85; coarse polygons by 0.1 at both.

    Values of all packings go up and down together, which must not count.
    """

    def record(way, bias, scatter, seconds):
        own = ERRORS[:, None] * np.array(scatter)
        values = dict.fromkeys(CHOICE_QUANTITIES, 4.0 + np.linspace(-3, 3, 21)[:, None] + bias + own)
        return WayRecord(way, np.arange(21), LEVELS, values, np.full((21, 2), seconds))

    disks, coarse = record(DISKS, -0.2, (0.1, 0.5), 0.1), record(COARSE, 0.06, (0.1, 0.1), 1.0)
    return {DISKS: disks, COARSE: coarse, FINE: record(FINE, 0.0, (0.0, 0.0), 5.0)}


def chosen(rho, z, **options):
    return jamlab.choose(rho, {"z": z}, 64, table=options.pop("table", table()), **options)


def test_the_cheapest_way_that_is_good_enough():
    """Limits are 1.05 times the largest distance from the mean, and a third of the mean."""
    assert chosen(0.90, 0.60).way == DISKS
    assert chosen(0.90, 0.59).way == COARSE
    assert chosen(0.90, 0.12).way == FINE
    assert chosen(0.85, 0.18).way == DISKS  # there disks scatter as little
    assert chosen(0.90, 0.6, model="dp").way == COARSE
    assert jamlab.choose(0.90, {"z": 0.12}, 1024, table=table()).way == replace(COARSE, n=1024)
    assert chosen(0.875, 1.0).bound["z"] == pytest.approx(1.05 * 0.3 + 0.2 / 3)  # half-way between the levels


def test_a_choice_holds_its_options_and_prints_them():
    choice = chosen(0.90, 0.15)
    assert choice.options["why"].tolist() == [Why.LARGE, Why.TAKEN, Why.COSTS_MORE]
    assert choice.options["error_z"].tolist() == pytest.approx([1.05 * 0.5 + 0.2 / 3, 0.125, 0.0])
    assert choice.options["way"].tolist() == [DISKS, COARSE, FINE] and choice.seconds == pytest.approx(1.0)
    assert choice.bound == {"z": pytest.approx(0.125)} and "cheapest of 2 ways that serve" in repr(choice)
    assert choice.correction == pytest.approx({"z": -0.06, "g": 0.0, "d_shape_factor": -0.06, "void_sides": -0.06})
    assert chosen(0.90, 0.01).bound == {"z": 0.0}  # default droplets are what errors are measured against


def test_nothing_is_promised_of_a_way_with_few_packings_or_where_it_fails():
    """Of 18 packings not even the largest bounds 95 %; of 21 coarse ones three fail at 0.90, but none does at 0.85."""
    few = table()
    few[DISKS] = replace(few[DISKS], seeds=np.arange(18), values={k: v[:18] for k, v in few[DISKS].values.items()})
    assert chosen(0.90, 5.0, table=few).options["why"].tolist() == [Why.UNKNOWN, Why.TAKEN, Why.COSTS_MORE]
    broken = table()
    broken[COARSE].values["z"][:3, 1] = np.nan
    assert chosen(0.90, 0.15, table=broken).way == chosen(0.86, 0.15, table=broken).way == FINE
    assert chosen(0.90, 0.15, table=broken).options["why"].tolist()[1] == Why.FAILS
    assert chosen(0.85, 0.15, model="dp", table=broken).way == COARSE


def test_neither_looser_minima_nor_droplets_from_the_start_make_a_scene():
    world = table()
    for way in (replace(FINE, force_tolerance=1e-6), replace(FINE, start="droplets"), replace(FINE, n=32)):
        world[way] = replace(world[FINE], way=way, seconds=np.full((21, 2), 1e-3))
    assert chosen(0.90, 0.01, table=world).way == FINE


def test_few_new_packings_exceed_what_is_expected():
    """95 % of new draws lie inside, of a skewed distribution too; the error falls with the square root of n."""
    rng = np.random.default_rng(1)
    for draws in (rng.normal(0.0, 1.0, (4000, 40)), rng.lognormal(0.0, 1.0, (4000, 40))):
        inside = [abs(new - np.mean(old)) <= expected_error(np.array(old), 64, 64) for *old, new in draws]
        assert 0.935 < np.mean(inside) < 0.965
    wide, narrow = expected_error(ERRORS, 64, 64), expected_error(ERRORS, 64, 6400)
    assert wide == pytest.approx(10 * narrow) and wide == pytest.approx(1.05)
    assert expected_error(np.zeros(19), 64, 64, quantum=2 / 64) == 2 / 64
    assert [exceeded_by_few(np.arange(39.0)[:n]) for n in (39, 38, 19, 18)] == [37.0, 37.0, 18.0, np.inf]


@pytest.mark.parametrize("name", CHOICE_QUANTITIES)
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
    ("rho", "error", "options", "said"),
    [
        (0.90, {"z": 1e-6}, {"model": "sp"}, "64 disks"),
        (0.99, {"z": 0.1}, {}, "0.85 and 0.9"),
        (0.90, {"weight": 0.1}, {}, "'weight'"),
        (0.90, {"z": -0.1}, {}, "-0.1"),
        (0.90, {}, {}, "error"),
        (1.5, {"z": 0.1}, {}, "1.5"),
        (0.90, {"z": 0.1}, {"model": "xp"}, "'xp'"),
        (0.90, {"z": 0.1}, {"table": {}}, "64 droplets carried"),
    ],
)
def test_refusals(rho, error, options, said):
    with pytest.raises(jamlab.InputError, match=said):
        jamlab.choose(rho, error, 64, **{"table": table()} | options)


@pytest.mark.parametrize("n", [0, 1, 7, 1_000_002])
def test_a_choice_refuses_what_no_scene_has(n):
    said = []
    for ask in (jamlab.choose, jamlab.scene):
        with pytest.raises(jamlab.InputError, match=f"n = {n}: ") as caught:
            ask(rho=0.9, n=n, error={"z": 2.0})
        said.append(str(caught.value))
    assert said[0] == said[1]


def test_shipped_table_serves_scenes():
    """Disks, fewer vertices, another contact form and default droplets, from the onsets to confluence."""
    ways = [record.way for record in list_records(read_ways())]
    assert {DISKS, COARSE, FINE, replace(FINE, contact="segment/smooth")} == set(ways)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert jamlab.choose(0.86, {"z": 2.0}).way == DISKS
        assert [jamlab.choose(rho, {"z": 1e-3}).way for rho in (0.84, 0.95, 0.98)] == [FINE] * 3


def test_scene_with_disks():
    found = jamlab.scene(0.87, 16, 3, error={"z": 2.0})
    choice = jamlab.choose(0.87, {"z": 2.0}, 16)
    assert found.model == "sp" and jamlab.packing_fraction(found) == pytest.approx(0.87, abs=1e-6)
    assert found.provenance["model_choice"] == str(choice.way)
    assert found.provenance["model_correction"] == choice.correction


def test_scene_with_droplets_goes_beyond_the_handover():
    """At rho = 0.90 disks carry the droplets to 0.88; below onset it is refused."""
    onset = jamlab.jam(10, "sp", 1)
    dense = bring_on(EnsembleWay("carried", 10, (8, 11), "segment/smooth"), onset, 0.90)
    assert dense.params["contact"] == "segment/smooth" and set(np.diff(dense.offsets)) == {8, 11}
    assert jamlab.packing_fraction(dense) == pytest.approx(0.90, abs=1e-6)
    assert dense.provenance["handover"]["rho"] == pytest.approx(0.88, abs=1e-6)
    assert dense.converged
    with pytest.raises(jamlab.ConvergenceError):
        bring_on(EnsembleWay("disks", 10), onset, 0.7)
