"""Ensemble averages over packings: distances to onset, places, what is left out; never two ensembles in one mean."""

import flow_tables
import numpy as np
import pandas as pd
import paper_tables
import pytest
from drawn_figures import TABLES, drawn
from paper_tables import onset, states
from scipy.interpolate import PchipInterpolator

from jamlab.campaign.tables import aggregate
from jamlab.errors import InputError
from studies.baumgarten.correlation import by_frequency
from studies.baumgarten.motion import figure_5, figure_8
from studies.baumgarten.spectra import figure_1, figure_3
from studies.baumgarten.spectral_groups import (
    Group,
    same_packings,
    select_ensemble,
    select_largest,
    select_sweep,
)
from studies.boromand.onset import figure_10
from studies.dynamics.flow_curves import steady_flows
from studies.ensemble_tables import EnsembleTables, count_voids
from studies.ensembles import (
    add_distances,
    ensemble,
    from_onset,
    interpolate,
    log_places,
    nearest_size,
    sampled_sizes,
    select_usual,
    sizes,
)


def test_distances_are_those_to_the_onset_of_each_packing():
    d = add_distances(states())
    first = d[d["state"] == 0]
    assert (first[["d_rho", "d_phi", "d_z", "lost"]].abs().to_numpy() < 1e-12).all()
    # areas: all of the loss of rho against phi goes into the particles
    last = d[d["state"] == 30].iloc[0]
    assert last["lost"] == pytest.approx(1 - (last["rho"] / last["phi"]) / 1.0, abs=1e-12)
    assert add_distances(d) is d


def test_states_without_a_minimum_or_a_backbone_are_left_out():
    s = states()
    s.loc[5, "converged"] = False
    s.loc[7, "z"] = np.nan
    assert len(add_distances(s)) == len(s) - 2


def test_only_the_usual_protocol_is_drawn():
    s = states()
    other = s[s["seed"] == 1].assign(units="k", ensemble="shear-stabilized")
    assert len(select_usual(pd.concat([s, other]))) == len(s)


def test_places_that_few_packings_reach_are_left_out():
    d = add_distances(states(sizes=(32,)))
    full = ensemble(d, "sp", 32, "d_phi", "z", from_onset())
    cut = ensemble(d[(d["d_phi"] < 0.1) | (d["seed"] <= 2)], "sp", 32, "d_phi", "z", from_onset())
    assert full.y.shape[0] == cut.y.shape[0] == 5
    assert cut.mean[0].max() < 0.1 < full.mean[0].max()
    assert ensemble(d, "dp", 32, "d_phi", "z", log_places(1e-6, 1)).y.shape == (1, 1)


def test_every_packing_is_interpolated_at_the_same_places():
    """Bins averaged states at different distances; PCHIP in the root meets roots and lines alike."""
    x = np.array([0.0, 0.01, 0.02, 0.04, 0.08])
    places = np.array([0.005, 0.015, 0.03, 0.06, 0.1])
    for law in (lambda v: 3.7 * v**0.5, lambda v: 2.0 * v, lambda v: 3.7 * v**0.5 + 4.0 * v):
        (found,) = interpolate(np.zeros(5, dtype=int), x, law(x), places)
        assert found[1:4] == pytest.approx(law(places[1:4]), rel=2e-3)
        assert np.isnan(found[[0, 4]]).all()  # nothing is known between onset and the first state, nor beyond the last


@pytest.mark.parametrize("first", [0.0, 0.1])
def test_curves_interpolated_together_are_those_of_scipy_one_by_one(first):
    """Curves of 1 to 9 points, in any order, some twice, some at a place; with bends of both signs and flat pieces."""
    rng = np.random.default_rng(3)
    curve = rng.permutation(np.repeat(np.arange(60), rng.integers(1, 10, 60)))
    x, y = rng.integers(0, 12, len(curve)) / 10, rng.integers(-3, 4, len(curve)).astype(float)
    places = np.linspace(first, 1.2, 40)
    for k, row in enumerate(interpolate(curve, x, y, places)):
        own = (curve == k) & ((x > 0) | (first == 0))
        at, chosen = np.unique(x[own], return_index=True)
        expected = np.full(40, np.nan)
        if len(at) > 1:
            expected = PchipInterpolator(np.sqrt(at), y[own][chosen], extrapolate=False)(np.sqrt(places))
        np.testing.assert_allclose(row, expected, rtol=1e-14, atol=1e-14)


def test_voids_are_counted_once():
    raw = TABLES["voids"]()
    counted = count_voids(raw)
    assert counted["voids"].sum() == len(raw)
    assert counted["shape"].sum() == pytest.approx(raw["shape"].sum())
    assert counted[counted["onset"]]["voids"].sum() == (raw["state"] == 0).sum()


def packings(**counts):
    """Rows of a table with so many packings of each size, one row each."""
    return pd.DataFrame(
        [{"model": "sp", "n": int(n[1:]), "seed": s} for n, count in counts.items() for s in range(count)]
    )


def test_a_size_that_is_only_begun_takes_nobodys_place():
    table = packings(n64=100, n256=20, n1024=6)
    assert sizes(table, "sp") == [64, 256, 1024]
    assert sampled_sizes(table, "sp") == [64, 256]
    assert nearest_size(table, "sp", 1000) == 256
    assert sampled_sizes(packings(n64=5, n256=3), "sp") == [64]  # none has enough: those with the most
    assert select_largest(packings(n64=10, n256=5, n1024=1))["n"].unique() == [256]


@pytest.mark.slow
def test_begun_sizes_do_not_move_the_width_of_onsets():
    """Six packings of N = 1024 of any width; before, they widened every interval to that of six packings."""
    table = onset()
    few = table[(table["n"] == 128) & (table["seed"] < 6)].assign(n=1024)
    begun = figure_10(EnsembleTables({"onset": pd.concat([table, few], ignore_index=True)}.get))
    theta = [next(c for c in d.claims if c.quantity.startswith("theta")) for d in (drawn("boromand-10"), begun)]
    assert [c.value for c in theta] == pytest.approx([0.55, 0.55], abs=1e-6)
    assert theta[1].high == pytest.approx(theta[0].high)


def test_the_width_of_onsets_is_fitted_at_the_sizes_of_the_paper():
    """Others are told beside it: twenty packings of N = 1024 that all jam at about the same place."""
    table = onset()
    more = table[(table["n"] == 128) & (table["seed"] < 20)].assign(n=1024)
    more = more.assign(phi_J=0.84 + 1e-4 * (more["phi_J"] - 0.84))
    found = figure_10(EnsembleTables({"onset": pd.concat([table, more], ignore_index=True)}.get))
    theta = next(c for c in found.claims if c.quantity.startswith("theta"))
    assert theta.value == pytest.approx(0.55, abs=1e-6)
    assert found.values["theta of all sizes, SP"].value > 1
    limit = next(c for c in found.claims if c.quantity.startswith("onset in the large-N limit, SP"))
    assert limit.value == pytest.approx(0.842, abs=1e-6)
    every = found.values["onset in the large-N limit of all sizes, SP"]
    assert 0.84 < every.low < every.value < every.high < 0.85


def test_a_scan_of_damping_may_stand_at_a_smaller_size_than_the_spectra():
    scan = pd.DataFrame({"n": 2048, "target_pressure": 1e-4, "beta": [0.0, 1e-2, 1.0]})
    large = pd.DataFrame({"n": 32768, "target_pressure": [1e-4, 1e-4, 1e-2], "beta": [0.0, 1.0, 1.0]})
    assert select_sweep(pd.concat([large, scan]), "beta")["n"].unique() == [2048]
    assert select_sweep(pd.concat([large, large.assign(n=8192)]), "beta")["n"].unique() == [32768]


def test_a_place_that_too_few_packings_reach_for_an_interval_is_left_out():
    """Three of five packings go on to d_phi = 0.2."""
    table = pd.concat(
        pd.DataFrame({"model": "sp", "n": 32, "seed": seed, "d_phi": np.linspace(0.01, end, 8), "z": 4.0})
        for seed, end in enumerate((0.1, 0.1, 0.3, 0.3, 0.3))
    )
    found = ensemble(table, "sp", 32, "d_phi", "z", [0.05, 0.2])
    assert found.y.shape == (5, 1) and found.mean[0] == pytest.approx([0.05])


def test_packings_of_two_laws_are_paired_by_seed():
    """Under one law seed 2 is not stable."""

    def group(seeds, eta0):
        one = np.ones((len(seeds), 1))
        return Group(np.array(seeds), np.ones(1), one, one, one[:, 0], np.array(eta0), one[:, 0])

    found = same_packings([group([1, 2, 3], [1.0, 2.0, 3.0]), group([1, 3], [10.0, 30.0])])
    assert found.tolist() == [[1.0, 10.0], [3.0, 30.0]]


def test_packings_are_paired_through_all_frequencies_of_a_correlation():
    """One lacks a frequency: its other ones must not stand beside those of another packing."""
    rows = [
        {"seed": seed, "omega": omega, "delta": float(k), "c": seed + 0.1 * k}
        for seed, omega in ((1, 0.1), (2, 0.1), (2, 1.0), (3, 0.1), (3, 1.0))
        for k in range(3)
    ]
    whole = by_frequency(pd.DataFrame(rows))
    assert whole.shape == (2, 2, 3, 2) and (whole[:, 0] == whole[:, 1]).all()
    with pytest.raises(InputError, match="every frequency"):
        by_frequency(pd.DataFrame(rows[:6]).assign(omega=[0.1] * 3 + [1.0] * 3))


def both_ensembles(table, **scaled):
    """The same packings in boxes sheared until stable too, with other numbers."""
    other = table.assign(ensemble="shear-stabilized", **{c: table[c] * f for c, f in scaled.items()})
    return pd.concat([other, table], ignore_index=True)


@pytest.mark.slow
def test_no_packing_is_averaged_over_two_ensembles():
    """Fig 3 and 5 keep to fixed boxes, as the paper; fig 8 takes those that were sheared until stable."""
    mixed = {
        "spectra": both_ensembles(paper_tables.spectra(), storage=3.0, loss=3.0, g0=3.0, eta0=3.0),
        "quasistatic": both_ensembles(paper_tables.quasistatic(), sliding=3.0),
    }
    both = EnsembleTables(mixed.__getitem__)
    for number, figure in {1: figure_1, 3: figure_3, 5: figure_5}.items():
        pd.testing.assert_frame_equal(figure(both).table, drawn(f"baumgarten-{number}").table)
    one, other = figure_8(both), drawn("baumgarten-8")
    viscosity = one.table["y"].to_numpy() / other.table["y"].to_numpy()
    assert viscosity == pytest.approx(3.0)
    counts = {(256, 5), (1024, 5)}
    for drawing, name in ((one, "shear-stabilized"), (other, "fixed-box")):
        assert {key: float(v.value) for key, v in drawing.values.items() if key.startswith("packings")} == {
            f"packings, {name}, N = {n}": count for n, count in counts
        }


def test_the_other_ensemble_serves_where_one_has_too_few_packings():
    """Where both have few, the wanted one is taken."""
    table = pd.DataFrame({"n": [64] * 12 + [128] * 8, "seed": [*range(10), 1, 2, *range(6), 1, 2]})
    table["ensemble"] = ["fixed-box"] * 10 + ["shear-stabilized"] * 8 + ["fixed-box"] * 2
    few = pd.DataFrame({"n": 64, "seed": [1, 2, 3] * 2, "ensemble": ["fixed-box"] * 3 + ["shear-stabilized"] * 3})
    for name in ("fixed-box", "shear-stabilized"):
        assert select_ensemble(few, name)["ensemble"].unique().tolist() == [name]
        chosen = select_ensemble(table, name).groupby("n")["ensemble"].agg(["first", "size"])
        assert chosen.loc[64].tolist() == ["fixed-box", 10] and chosen.loc[128].tolist() == ["shear-stabilized", 6]


def test_packings_at_onset_alone_take_no_part_in_curves():
    """Nine times as many were not compressed: a share of packings would reach nothing."""
    followed = paper_tables.states("dp", sizes=(32,))
    first = followed[followed["state"] == 0]
    alone = pd.concat([first.assign(seed=first["seed"] + 100 * k, task=f"more{k}") for k in range(1, 10)])
    small = first.assign(n=16)
    tables = EnsembleTables(lambda _: pd.concat([alone, small, followed], ignore_index=True))
    assert sorted(tables.states.query("n == 32")["seed"].unique()) == list(paper_tables.SEEDS)
    assert len(tables.states.query("n == 16")) == len(first)  # where none was


def test_each_law_finds_the_ensemble_that_has_it():
    """Contact damping in fixed boxes and Stokes drag in sheared ones: both panels of fig 8 are drawn."""
    table = paper_tables.spectra()
    stokes = table["law"] == "stokes"
    mixed = pd.concat([table[~stokes], table[stokes].assign(ensemble="shear-stabilized")], ignore_index=True)
    panels = figure_8(EnsembleTables({"spectra": mixed}.__getitem__)).table["panel"]
    assert set(panels) == {"a", "b"}


def test_sweeps_from_onset_are_drawn_beside_many_more_packings_at_pressures():
    """Those have no onset, other units and another ensemble, but the same seeds."""
    sweep = paper_tables.states(sizes=(32,))
    pressures = sweep.assign(units="k", ensemble="shear-stabilized", onset=np.nan, onset_phi=np.nan, z=9.0)
    voids = paper_tables.voids()
    others = voids.assign(ensemble="shear-stabilized", onset=np.nan)
    mixed = {"states": pd.concat([pressures] * 3 + [sweep]), "voids": pd.concat([others] * 3 + [voids])}
    tables = EnsembleTables(mixed.__getitem__)
    assert len(tables.states) == len(sweep) and tables.states["z"].max() < 9
    pd.testing.assert_frame_equal(tables.void_counts, count_voids(voids))


def test_voids_of_two_ensembles_are_not_counted_together():
    voids = paper_tables.voids()
    sheared = voids[voids["seed"] < 3].assign(ensemble="shear-stabilized")
    tables = EnsembleTables({"voids": pd.concat([voids, sheared])}.__getitem__)
    pd.testing.assert_frame_equal(tables.void_counts, count_voids(voids))


def test_spectra_of_sweeps_from_onset_are_none_of_the_papers():
    """They are had at no pressure that packings share."""
    table = paper_tables.spectra()
    more = table[table["seed"] < 3].assign(target_pressure=np.nan, seed=9)
    both = EnsembleTables({"spectra": pd.concat([table, more], ignore_index=True)}.__getitem__)
    pd.testing.assert_frame_equal(figure_3(both).table, drawn("baumgarten-3").table)


def test_a_mean_over_two_ensembles_or_units_is_refused():
    table = pd.DataFrame({"model": "sp", "n": 32, "seed": [1, 2, 1, 2], "z": [4.0, 4.1, 4.2, 4.3], "units": "eps"})
    table["ensemble"] = ["fixed-box"] * 2 + ["shear-stabilized"] * 2
    with pytest.raises(InputError, match="ensemble fixed-box and shear-stabilized: add 'ensemble' to by"):
        aggregate(table, ["z"], ["model", "n"])
    assert aggregate(table, ["z"], ["n", "ensemble"])["z"].tolist() == pytest.approx([4.05, 4.25])
    with pytest.raises(InputError, match="units eps and k"):
        aggregate(table.assign(units=["eps", "k"] * 2), ["z"], ["n", "ensemble"])


def test_flows_of_two_ensembles_are_not_averaged():
    table = flow_tables.flow()
    sheared = table[table["seed"] < 4].assign(ensemble="shear-stabilized", stress=lambda t: 3 * t["stress"])
    both = pd.concat([sheared, table], ignore_index=True)
    pd.testing.assert_frame_equal(steady_flows(both).reset_index(drop=True), steady_flows(table).reset_index(drop=True))


def test_the_collapse_of_viscosities_ends_at_the_highest_pressure_of_the_paper():
    """Beyond 0.01 viscosity grows with pressure (first term of eq 22), which no collapse in p N^2 knows."""
    table = paper_tables.spectra()
    dense = table[table["target_pressure"] == 1e-2].assign(target_pressure=0.1, eta0=lambda t: 5 * t["eta0"])
    both = EnsembleTables({"spectra": pd.concat([table, dense], ignore_index=True)}.__getitem__)
    found, without = figure_8(both), drawn("baumgarten-8")
    for c, d in zip(found.claims, without.claims, strict=True):
        assert (c.value, c.low, c.high) == pytest.approx((d.value, d.low, d.high), nan_ok=True)
    moved = [c.family["p <= 0.1"].value / c.value for c in found.claims if c.quantity.startswith("a: eta_0/N^a")]
    assert len(moved) == 4 and max(moved) < 0.95


def test_the_slope_of_viscosities_is_that_of_the_collapsed_curves():
    """N^1.09 under Stokes drag, as drawn: eta_0 = N^1.09 (p N^2)^-0.4 has the slope -0.4 at every size together."""
    table = paper_tables.spectra()
    x = table["target_pressure"] * table["n"] ** 2
    table["eta0"] = table["n"] ** np.where(table["law"] == "stokes", 1.09, 1.0) * x**-0.4
    claims = figure_8(EnsembleTables({"spectra": table}.__getitem__)).claims
    slopes = [c.value for c in claims if "slope" in c.quantity and "no pre-stress" in c.quantity]
    assert slopes == pytest.approx([-0.4, -0.4], abs=1e-9)
