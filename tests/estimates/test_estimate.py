"""Means to an error: which packings are chosen, how many, whether intervals hold, and when it stops early."""

import lzma
from dataclasses import replace
from importlib import resources

import numpy as np
import pytest
from scipy import stats

import jamlab
from jamlab.estimates.choice import Why
from jamlab.estimates.estimate import FEWEST, finite, plan_mean, reference_way
from jamlab.estimates.ways import EnsembleWay, WayRecord, bring_on, difference, find_onset, read_ways
from jamlab.statistics.confidence import bend, between

LEVELS = np.array([0.84, 0.86, 0.88, 0.90, 0.92, 0.94])
DISKS = EnsembleWay("disks", 64)
CARRIED = EnsembleWay("carried", 64, (12, 17))
OFF, SPREAD = 0.3, 0.1  # of the carried droplets, in z


def record(way, mean, spread, seconds, packings, seed):
    """Packings whose z rises with rho from a mean, all other quantities alike."""
    rng = np.random.default_rng([seed, 5])
    z = mean + 10 * (LEVELS - 0.84) + rng.normal(0, spread, (packings, len(LEVELS)))
    names = ("z", "g", "b", "d_shape_factor", "void_sides")
    values = dict.fromkeys(names, z) | {"rho_J": rng.normal(0.83, 0.01, (packings, 1))}
    return WayRecord(way, np.arange(packings), LEVELS, values, np.full((packings, len(LEVELS)), seconds))


def table(packings=100, seed=1):
    droplets = record(reference_way(), 4.0, SPREAD, 10.0, packings, seed)
    carried = record(CARRIED, 4.0 - OFF, SPREAD, 1.0, packings, seed + 1)
    return {DISKS: record(DISKS, 3.5, 5.0, 0.1, packings, seed + 2), CARRIED: carried, reference_way(): droplets}


def gaussian(mean, spread, rng):
    """A way to make packings whose values are Gaussian."""
    return lambda count: [(float(x), 1.0) for x in rng.normal(mean, spread, count)]


def reasons(plan):
    return dict(zip(plan.choice.options["way"], plan.choice.options["why"], strict=True))


def test_cheap_packings_serve_where_their_difference_is_known():
    """By a hundred packings of each a mean difference is known to 1.96 sqrt(2/100) of the scatter."""
    loose, tight = (plan_mean("z", 0.9, error, table=table()) for error in (0.05, 0.01))
    assert (loose.choice.way, tight.choice.way) == (CARRIED, reference_way())
    assert (
        loose.choice.bound["z"] <= 0.05
        and tight.choice.bound["z"] <= 0.01
        and tight.choice.correction["z"] == tight.bias_error == 0
    )
    assert loose.choice.correction["z"] == pytest.approx(OFF, abs=loose.bias_error)
    assert loose.bias_error == pytest.approx(1.96 * SPREAD * 0.02**0.5, rel=0.2)
    assert tight.choice.packings == pytest.approx((1.96 * SPREAD / 0.01) ** 2, rel=0.3)
    assert tight.choice.seconds == pytest.approx(10.0 * tight.choice.packings)
    assert reasons(loose) == {DISKS: Why.UNSURE, CARRIED: Why.TAKEN, reference_way(): Why.COSTS_MORE}
    assert loose.choice.options["packings"].tolist()[1] == loose.choice.packings


def test_ways_that_tell_too_little_are_not_taken():
    """Few of which jam, of few packings, of another quantity; and a reference that tells nothing is refused by name."""
    world = table()
    world[CARRIED].values["z"][:60, 0] = np.nan
    world[replace(CARRIED, n=32)] = record(replace(CARRIED, n=32), 4.0, SPREAD, 0.1, 5, 8)
    low, high = (plan_mean("z", rho, 0.05, table=world) for rho in (0.84, 0.86))
    assert (low.choice.way, high.choice.way) == (reference_way(), CARRIED)
    assert reasons(low)[CARRIED] == Why.FAILS and reasons(low)[replace(CARRIED, n=32)] == Why.UNKNOWN
    world[DISKS] = record(DISKS, 4.0, SPREAD, 0.01, 100, 9)
    ways = [
        plan_mean(*asked, table=world).choice.way
        for asked in (("z", 0.9, 0.05), ("g", 0.9, 0.05), ("rho_J", None, 0.005))
    ]
    assert ways == [DISKS, CARRIED, DISKS]
    with pytest.raises(jamlab.InputError):
        plan_mean("b", 0.9, 0.05, model="sp", table=world)
    world[reference_way()].values["z"][:90, 0] = np.nan
    with pytest.raises(jamlab.InputError, match=r"0\.85"):
        plan_mean("z", 0.85, 0.05, table=world)


def test_a_way_is_made_as_it_says():
    tight, loose = EnsembleWay("carried", 8, (8, 11)), EnsembleWay("carried", 8, (8, 11), force_tolerance=1e-5)
    exact, rough = (bring_on(way, find_onset(way, 1), 0.9) for way in (tight, loose))
    assert exact.max_force <= 1e-10 < rough.max_force <= 1e-5 and rough.converged
    assert str(loose) == "8 droplets carried by disks with 8/11 vertices, forces to 1e-05"


def test_differences_between_levels_lie_on_a_line_and_say_how_far_it_bends():
    """A parabola bends (x - a)(b - x) away, which is known of three levels; of a zigzag it is most of the answer."""
    x = np.array([0.0, 1.0, 3.0, 4.0])
    assert between(x, x**2, 2.0) == pytest.approx(5.0) and bend(x, x**2, 2.0) == pytest.approx(1.0)
    assert between(x, x**2, 3.0) == 9.0 and bend(x, x**2, 3.0) == bend(x, 2 * x, 0.4) == 0
    assert between(x, [np.inf, 1.0, 2.0, 3.0], 0.5) == np.inf and between(x, [np.inf, 1.0, 2.0, 3.0], 1.0) == 1.0
    world = table()
    for shape, most in ((lambda rho: 3 * np.sin(20 * (rho - 0.84)), 0.06), (lambda rho: np.cos(50 * np.pi * rho), 2.0)):
        values = {"z": world[CARRIED].values["z"] + shape(LEVELS)}
        carried = WayRecord(CARRIED, np.arange(100), LEVELS, values, world[CARRIED].seconds)
        for rho in np.linspace(0.84, 0.94, 21):
            found = difference(carried, world[reference_way()], "z", rho)
            assert abs(found.value - (shape(rho) - OFF)) < 3 * found.error < 3 * most


def test_packings_are_added_where_they_scatter_more_than_the_table_says():
    plan = plan_mean("z", 0.9, 0.03, table=table())
    found = finite(plan.collect(0.03, gaussian(4.6, 2 * SPREAD, np.random.default_rng(2))))
    assert len(found) > 2.5 * plan.choice.packings and plan.ci95(found) <= 0.03
    wild = finite(plan.collect(0.03, gaussian(4.6, 20 * SPREAD, np.random.default_rng(2))))
    assert len(wild) <= 32 * plan.choice.packings and plan.ci95(wild) > 0.03  # it ends all the same


def test_it_stops_where_the_model_is_not_known_better():
    plan = plan_mean("z", 0.9, 0.05, model="sp", table=table())
    found = finite(plan.collect(0.05, gaussian(4.1, 5.0, np.random.default_rng(2))))
    assert plan.half_width(found) <= 0.5 * plan.bias_error and plan.ci95(found) > plan.bias_error > 0.05


def test_seeds_without_a_value_are_made_up_for_and_nearly_none_is_refused():
    plan = plan_mean("z", 0.9, 0.1, table=table())
    rng = np.random.default_rng(4)
    found = plan.collect(0.1, lambda n: [(4.3 if rng.random() < 0.5 else np.nan, 1.0) for _ in range(n)])
    assert len(found) > len(finite(found)) >= plan.choice.packings
    with pytest.raises(jamlab.ConvergenceError):
        plan.collect(0.1, lambda n: [(np.nan, 1.0)] * n)


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("y", 0.9, 0.1), "'y'"),
        (("z", 0.83, 0.1), "rho = 0.83"),
        (("z", None, 0.1), "rho = None"),
        (("z", 0.9, 0.0), "error = 0.0"),
        (("z", 0.9, float("inf")), "error = inf"),
        (("z", 0.9, 1e-7), "error = 1e-07"),
    ],
)
def test_what_is_refused(words, named):
    with pytest.raises(jamlab.InputError) as caught:
        jamlab.estimate(*words)
    assert named in str(caught.value)
    with pytest.raises(jamlab.InputError):
        jamlab.estimate("z", 0.9, 0.1, model="ellipses")


@pytest.mark.slow
def test_an_estimate_is_of_the_packings_that_it_names():
    """A packing made again from its seed gives its value; two processes make the same packings."""
    shares = []
    found = jamlab.estimate("rho_J", None, 0.05, seed=3, progress=lambda share, text: shares.append((share, text)))
    twice = jamlab.estimate("rho_J", None, 0.05, seed=3, workers=2)
    assert twice.value == found.value and (twice.seeds == found.seeds).all() and shares[-1][0] == 1.0
    assert shares[-1][1].startswith(f"{len(shares)} packings")
    assert found.met and found.packings == len(found.values) == len(found.seeds) >= FEWEST
    assert found.value == pytest.approx(found.values.mean() + found.choice.correction["rho_J"])
    assert jamlab.packing_fraction(jamlab.jam(found.choice.way.n, "sp", int(found.seeds[0]))) == found.values[0]


def test_a_table_that_is_none_is_refused(tmp_path):
    shipped = resources.files("jamlab.estimates").joinpath("ways.csv.xz").read_bytes()
    bad = [b"start,n", lzma.compress(b'# {"facts": {}}\nstart,n\n'), lzma.compress(b""), shipped[:-1000]]
    for k, content in enumerate([*bad, shipped[:5000] + b"spoilt" + shipped[5006:]]):
        (tmp_path / f"{k}").write_bytes(content)
        with pytest.raises(jamlab.StorageError, match=f"{k}"):
            read_ways(tmp_path / f"{k}")
    other = lzma.decompress(shipped).replace(b'"gamma": 0.4', b'"gamma": 0.5', 1)
    (tmp_path / "d").write_bytes(lzma.compress(other))
    with pytest.raises(jamlab.StorageError, match="gamma"):
        read_ways(tmp_path / "d")


@pytest.mark.parametrize(("quantity", "error"), [("z", 0.01), ("z", 0.005), ("g", 0.005)])
def test_as_few_packings_are_planned_as_reach_the_error(quantity, error):
    """One fewer misses it: Student's t, whose freedom is that of the table and of the packings to be made."""
    plan = plan_mean(quantity, 0.9, error)
    one, aim = plan.scatter, np.sqrt(error**2 - plan.bias_error**2)

    def half_width(packings):
        return stats.t.ppf(0.975, one.freedom + packings - 1) * one.deviation / np.sqrt(packings)

    assert half_width(plan.choice.packings) <= aim < half_width(plan.choice.packings - 1)


def test_packings_that_lie_close_together_are_no_better_known_than_the_table_says():
    plan = plan_mean("z", 0.9, 0.02)
    one = plan.scatter
    least = stats.t.ppf(0.975, one.freedom + 29) * one.deviation / np.sqrt(30)
    assert plan.half_width(np.full(30, 4.5)) == pytest.approx(least, rel=1e-9)
    assert plan.half_width(4.5 + 10 * one.deviation * np.linspace(-1, 1, 30)) > 2 * least
