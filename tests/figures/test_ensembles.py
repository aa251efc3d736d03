"""Ensemble averages over packings: distances to onset, places, what is left out."""

import numpy as np
import pandas as pd
import pytest
from drawn_figures import TABLES
from paper_tables import states

from jamlab.figures.papers.ensembles import add_distances, ensemble, from_onset, interpolate, log_places, select_usual
from jamlab.figures.papers.tables import (
    count_voids,
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
        found = interpolate(x, law(x), places)
        assert found[1:4] == pytest.approx(law(places[1:4]), rel=2e-3)
        assert np.isnan(found[[0, 4]]).all()  # nothing is known between onset and the first state, nor beyond the last


def test_voids_are_counted_once():
    raw = TABLES["voids"]()
    counted = count_voids(raw)
    assert counted["voids"].sum() == len(raw)
    assert counted["shape"].sum() == pytest.approx(raw["shape"].sum())
    assert counted[counted["onset"]]["voids"].sum() == (raw["state"] == 0).sum()
