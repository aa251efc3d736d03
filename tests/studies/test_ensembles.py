"""Averages over packings: distances to onset, places, what is left out; never two ensembles in one mean."""

import flow_tables
import numpy as np
import pandas as pd
import paper_tables
import pytest
from paper_tables import states

from jamlab.errors import InputError
from studies import pages
from studies.dynamics.flow_curves import steady_flows
from studies.ensemble_tables import EnsembleTables, add_confluence, add_distances, count_voids
from studies.ensembles import at_places, interpolators, limit_of_sizes
from studies.papers.baumgarten.motion import correlations


def test_distances_are_those_to_the_onset_of_each_packing():
    d = add_distances(states())
    first = d[d["state"] == 0]
    assert (first[["d_rho", "d_phi", "d_z", "lost"]].abs().to_numpy() < 1e-12).all()
    # areas: all of the loss of rho against phi goes into the particles
    last = d[d["state"] == 30].iloc[0]
    assert last["lost"] == pytest.approx(1 - (last["rho"] / last["phi"]) / 1.0, abs=1e-12)
    assert add_distances(d) is d


def test_distances_to_confluence_end_where_a_packing_first_has_six_contacts():
    s = states(sizes=(32,)).query("seed == 1").assign(rho_printed=lambda t: t["rho"] + 0.01)
    s = add_confluence(add_distances(s))
    full = s.loc[s["z"] >= 6, "rho"].min()
    below = s[s["missing"].notna()]
    assert (below["rho"] < full).all() and len(below) == (s["rho"] < full).sum()
    assert (below["to_confluence"] + below["rho"]).to_numpy() == pytest.approx(full)
    assert (below["missing"] + below["z"]).to_numpy() == pytest.approx(6) and s["three"].to_numpy() == pytest.approx(
        0.01
    )


def test_places_that_few_packings_reach_are_left_out():
    d, places = add_distances(states(sizes=(32,))), np.linspace(0.0, 0.4, 41)
    some = d[(d["d_phi"] < 0.1) | (d["seed"] <= 2)]
    full, cut = (at_places(interpolators(rows, "d_phi", ["z"], True), places) for rows in (d, some))
    assert full.y.shape[0] == cut.y.shape[0] == 5
    assert cut.mean[0].max() < 0.1 < full.mean[0].max()
    assert at_places([], places).y.shape == (1, 1)


@pytest.mark.parametrize("law", [lambda v: 3.7 * v**0.5, lambda v: 2.0 * v, lambda v: 3.7 * v**0.5 + 4.0 * v])
def test_every_packing_is_interpolated_at_the_same_places(law):
    """In the root, where roots and lines are smooth; states in any order, one twice."""
    x = np.array([0.02, 0.0, 0.08, 0.01, 0.04, 0.04])
    places = np.array([0.005, 0.015, 0.03, 0.06, 0.1])
    rows = pd.concat(pd.DataFrame({"model": "sp", "n": 8, "seed": s, "x": x, "y": s * law(x)}) for s in (1, 2))
    found = at_places(interpolators(rows, "x", ["y"], False), places)
    assert found.x[0] == pytest.approx(places[1:4])  # nothing is known before the first state, nor beyond the last
    for seed, y in zip((1, 2), found.y, strict=True):
        assert y == pytest.approx(seed * law(places[1:4]), rel=2e-3)


def test_the_limit_of_large_systems_is_recovered_by_sizes_that_count_by_their_errors():
    """By the normal equations of weighted least squares; without scatter nothing is known of errors."""
    n, rng = np.array([8.0, 16, 32, 64]), np.random.default_rng(1)
    groups = [
        0.842 - 0.2 * m**-0.7 + s * rng.standard_normal(9) for m, s in zip(n, (0.1, 1e-3, 0.1, 3e-3), strict=True)
    ]
    w = np.diag([len(g) / g.var(ddof=1) for g in groups])
    columns = np.column_stack([np.ones(4), n**-0.7])
    wanted = np.linalg.solve(columns.T @ w @ columns, columns.T @ w @ [g.mean() for g in groups])
    assert limit_of_sizes(n, groups, 0.7) == pytest.approx(wanted[0], rel=1e-9)
    assert np.isnan(limit_of_sizes(n, [np.ones(3)] * 4))


def test_packings_are_paired_through_all_frequencies_of_a_correlation():
    """One lacks a frequency: its other ones must not stand beside those of another packing."""
    rows = [
        {"seed": seed, "omega": omega, "delta": float(k), "c": seed + 0.1 * k}
        for seed, omega in ((1, 0.1), (2, 0.1), (2, 1.0), (3, 0.1), (3, 1.0))
        for k in range(3)
    ]
    whole = correlations(pd.DataFrame(rows))
    assert whole.shape == (2, 2, 3, 2) and (whole[:, 0] == whole[:, 1]).all()
    with pytest.raises(InputError):
        correlations(pd.DataFrame(rows[:6]).assign(omega=[0.1] * 3 + [1.0] * 3))


# two ensembles --------------------------------------------------------------------------------------------------------


def both_ensembles(table, **scaled):
    """The same packings in the other ensemble too, with other numbers."""
    other = {"fixed-box": "shear-stabilized", "shear-stabilized": "fixed-box"}
    more = table.assign(ensemble=table["ensemble"].map(other), **{c: table[c] * f for c, f in scaled.items()})
    return pd.concat([more, table], ignore_index=True)


def test_no_packing_is_averaged_over_two_ensembles():
    one = {
        "spectra": paper_tables.spectra().query("n != 2048"),
        "quasistatic": paper_tables.quasistatic(),
        "states": paper_tables.both_models(),
        "flow": flow_tables.flow(),
    }
    changes = {"spectra": {"storage": 3.0, "loss": 3.0, "eta0": 3.0}, "quasistatic": {"median_tangential": 3.0}}
    changes |= {"states": {"z": 2.0}, "flow": {"stress": 3.0}}
    mixed = {name: both_ensembles(table, **changes[name]) for name, table in one.items()}
    both, alone = (EnsembleTables(given.__getitem__) for given in (mixed, one))
    for name in ("baumgarten-1", "baumgarten-5", "baumgarten-8", "boromand-7"):
        pd.testing.assert_frame_equal(pages.draw(name, both).table, pages.draw(name, alone).table)
    flows = [steady_flows(given.flow).reset_index(drop=True) for given in (both, alone)]
    pd.testing.assert_frame_equal(*flows)


def test_sweeps_from_onset_are_drawn_beside_many_more_packings_at_pressures():
    """Those have no onset, other units and another ensemble, but the same seeds. Droplets of another law are apart."""
    sweep = pd.concat([paper_tables.states(sizes=(64,)), paper_tables.states("dp", sizes=(64,)).assign(gamma=0.4)])
    pressures = sweep.assign(units="k", ensemble="shear-stabilized", rho_J=np.nan, phi_J=np.nan, z=9.0)
    other = sweep.query("model == 'dp'").assign(gamma=4.0, z=8.0)
    voids = paper_tables.voids()
    parts = [pressures.assign(task="p" + pressures["task"]), sweep, other.assign(task="o" + other["task"])]
    more = [voids.assign(task=each + voids["task"], rho=voids["rho"] + 0.003) for each in "po"]
    given = EnsembleTables({"states": pd.concat(parts), "voids": pd.concat([*more, voids])}.__getitem__)
    assert len(given.states) == len(sweep) and given.states["z"].max() < 8
    pd.testing.assert_frame_equal(given.void_counts, count_voids(sweep, voids))
    assert given.void_counts["voids"].sum() == len(voids)
