"""The automatic choice: cheapest way that meets the tolerance, refusals, what it says, and a scene by each model."""

import copy
import json
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

import jamlab
from jamlab.benchmarks.model_table import make_table
from jamlab.engine.deck_defaults import defaults
from jamlab.protocols.model_choice import QUANTITIES, Way, expected_error, list_ways, read_table
from jamlab.protocols.scene import bring_to, default_way

DISKS = {"model": "sp", "contact": None, "nv": None}
COARSE = {"model": "dp", "contact": "outline", "nv": [6, 8]}
FINE = {"model": "dp", "contact": "outline", "nv": [12, 17]}


def table(**changes):
    """Disks are off by 0.2 in z and scatter by 0.1 at rho = 0.90, by 0.02 at 0.85; coarse polygons by 0.02 at both."""

    def row(way, rho, bias, scatter, seconds):
        off = {name: [bias - scatter, bias, bias + scatter] for name in QUANTITIES}
        return {"way": way, "rho": rho, "of": 10, "failed": 0, "errors": off, "seconds": seconds}

    rows = [row(DISKS, rho, -0.2, scatter, 0.1) for rho, scatter in ((0.85, 0.02), (0.90, 0.1))]
    rows += [row(COARSE, rho, 0.05, 0.02, 1.0) for rho in (0.85, 0.90)]
    rows += [row(FINE, rho, 0.0, 0.0, 5.0) for rho in (0.85, 0.90)]
    now = {k: v for k, v in defaults("dp").items() if k not in ("longest_edge", "contact")}
    return {"schema": 1, "n": 100, "reference": FINE, "parameters": now, "rows": rows} | changes


def chosen(rho, z, **options):
    return jamlab.choose(rho, {"z": z}, 100, table=options.pop("table", table()), **options)


def test_the_cheapest_way_that_is_good_enough():
    """Limits are 4.97 times the scatter, t of two degrees of freedom times sqrt(4/3), and a third of the mean."""
    assert chosen(0.90, 0.57).way.model == "sp"
    assert chosen(0.90, 0.55).way.nv == (6, 8)
    assert chosen(0.90, 0.11).way.nv == (12, 17)
    assert chosen(0.85, 0.17).way.model == "sp"  # there disks scatter as little
    assert chosen(0.90, 0.6, model="dp").way.nv == (6, 8)


def test_a_choice_says_what_why_and_how_wrong():
    choice = chosen(0.90, 0.15)
    assert "6/8 vertices" in choice.why and "z within 0.15" in choice.why and "disks (SP) with z to 0.56" in choice.why
    assert choice.error == {"z": pytest.approx(0.0994 + 0.05 / 3, abs=1e-4)} and choice.seconds == pytest.approx(1.0)
    assert choice.correction["z"] == pytest.approx(-0.05) and choice.warning == ""
    assert chosen(0.90, 0.01).error == {"z": 0.0}  # default droplets are what errors are measured against


def test_ways_that_fail_are_not_chosen():
    broken = table()
    for row in broken["rows"]:
        row["failed"] = 2 if row["way"] == COARSE else 0
    assert chosen(0.90, 0.15, table=broken).way.nv == (12, 17)


def test_other_parameters_than_those_of_the_table_are_said():
    old = copy.deepcopy(table())
    old["parameters"]["gamma"] = 123.0
    assert "gamma = 123.0" in chosen(0.90, 0.6, table=old).warning


def test_expected_error_is_a_prediction_interval():
    """95 % of new draws lie inside; the random part falls with the square root of n."""
    rng = np.random.default_rng(1)
    draws = rng.normal(0.0, 1.0, (4000, 6))
    inside = [abs(new - np.mean(old)) <= expected_error(list(old), 64, 64) for *old, new in draws]
    assert 0.94 < np.mean(inside) < 0.96
    errors = [0.1, 0.3]
    wide, narrow = expected_error(errors, 64, 64), expected_error(errors, 64, 6400)
    assert wide == pytest.approx(10 * narrow)
    assert wide == pytest.approx(stats.t.ppf(0.975, 1) * np.std(errors, ddof=1) * np.sqrt(1.5))
    assert expected_error([0.0, 0.0, 0.0], 64, 64, quantum=2 / 64) > 1 / 64
    assert expected_error([0.1], 64, 64) == np.inf


@pytest.mark.parametrize(
    ("rho", "tolerance", "options", "said"),
    [
        (0.90, {"z": 1e-6}, {"model": "sp"}, "disks .SP. comes nearest"),
        (0.99, {"z": 0.1}, {}, "0.85 .. 0.9"),
        (0.90, {"weight": 0.1}, {}, "'weight'"),
        (0.90, {"z": -0.1}, {}, "-0.1"),
        (0.90, {}, {}, "no tolerance"),
        (1.5, {"z": 0.1}, {}, "1.5"),
        (0.90, {"z": 0.1}, {"model": "xp"}, "'xp'"),
    ],
)
def test_refusals(rho, tolerance, options, said):
    with pytest.raises(jamlab.InputError, match=said):
        jamlab.choose(rho, tolerance, 100, table=table(), **options)


def test_shipped_table_is_whole():
    """Every quantity, provenance, disks and default droplets among the ways."""
    shipped = read_table()
    ways = list_ways(shipped)
    assert Way("sp") in ways and default_way() in ways and len(ways) >= 3
    assert all(set(row["errors"]) == set(QUANTITIES) for row in shipped["rows"])
    assert {"command", "seeds", "lammps", "wall_time"} <= set(shipped["provenance"])
    assert jamlab.choose(0.86, {"z": 2.0}).way.model == "sp"
    for file in ("missing.json", __file__):
        with pytest.raises(jamlab.StorageError, match="jamlab chart table"):
            read_table(Path(file))


def test_scene_with_disks():
    found = jamlab.scene(0.87, 16, 3, tolerance={"z": 2.0})
    assert found.packing.model == "sp" and found.values["z"] == jamlab.contacts(found.packing).z
    assert jamlab.packing_fraction(found.packing) == pytest.approx(0.87, abs=1e-6)
    assert found.packing.provenance["model_why"] == found.choice.why
    assert found.estimate["z"] == found.values["z"] + found.choice.correction["z"]


def test_scene_with_droplets_goes_beyond_the_handover():
    """At rho = 0.90 disks carry the droplets to 0.88."""
    onset = jamlab.jam("sp", 10, 1)
    dense = bring_to(Way("dp", "outline", (8, 11)), onset, 0.90)
    assert dense.model == "dp" and set(np.diff(dense.offsets)) == {8, 11}
    assert jamlab.packing_fraction(dense) == pytest.approx(0.90, abs=1e-6)
    assert dense.provenance["handover"]["rho"] == pytest.approx(0.88, abs=1e-6)
    assert dense.converged


def test_scene_below_onset_is_refused():
    onset = jamlab.jam("sp", 10, 1)
    with pytest.raises(jamlab.ConvergenceError, match="jams at rho"):
        bring_to(Way("sp"), onset, 0.7)


def test_table_is_measured_and_written(tmp_path):
    """Default droplets are off by nothing, disks by something; the file is what `choose` reads."""
    path = tmp_path / "table.json"
    made = make_table(path, n=8, seeds=range(3, 5), levels=(0.88,), forms=(), fractions=())
    assert (
        json.loads(json.dumps(made)) == read_table(path)
        and Way("dp", made["reference"]["contact"], tuple(made["reference"]["nv"])) == default_way()
    )
    off = {row["way"]["model"]: row for row in made["rows"]}
    assert off["dp"]["errors"]["a"] == [0.0, 0.0] != off["sp"]["errors"]["a"]
    assert all(row["of"] == 2 and row["failed"] == 0 and row["seconds"] > 0 for row in off.values())
    assert jamlab.choose(0.88, {"z": 1e-3}, 8, table=made).way == default_way()
