"""Ensemble averages over packings: distances to onset, places, what is left out."""

import numpy as np
import pandas as pd
import pytest
from drawn_figures import TABLES, drawn
from paper_tables import onset, states
from scipy.interpolate import PchipInterpolator

from jamlab.errors import InputError
from jamlab.studies.baumgarten.correlation import by_frequency
from jamlab.studies.baumgarten.spectral_groups import Group, same_packings, select_largest, select_sweep
from jamlab.studies.boromand.onset import figure_10
from jamlab.studies.ensemble_tables import EnsembleTables, count_voids
from jamlab.studies.ensembles import (
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
