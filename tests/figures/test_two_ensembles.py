"""Packings of one size in two ensembles, and those that were not compressed beyond onset: never in one mean."""

import flow_tables
import numpy as np
import pandas as pd
import paper_tables
import pytest
from drawn_figures import drawn

from jamlab.campaign.tables import aggregate
from jamlab.errors import InputError
from jamlab.studies.baumgarten.motion import figure_5, figure_8
from jamlab.studies.baumgarten.spectra import figure_1, figure_3
from jamlab.studies.baumgarten.spectral_groups import select_ensemble
from jamlab.studies.dynamics.flow_curves import steady_flows
from jamlab.studies.ensemble_tables import EnsembleTables, count_voids


def both_ensembles(table, **scaled):
    """The same packings in boxes sheared until stable too, with other numbers."""
    other = table.assign(ensemble="shear-stabilized", **{c: table[c] * f for c, f in scaled.items()})
    return pd.concat([other, table], ignore_index=True)


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
    for drawing, ensemble in ((one, "shear-stabilized"), (other, "fixed-box")):
        assert {name: float(v.value) for name, v in drawing.values.items() if name.startswith("packings")} == {
            f"packings, {ensemble}, N = {n}": count for n, count in counts
        }


def test_the_other_ensemble_serves_where_one_has_too_few_packings():
    table = pd.DataFrame(
        {
            "n": [64] * 12 + [128] * 8,
            "seed": [*range(10), 1, 2, *range(6), 1, 2],
            "ensemble": ["fixed-box"] * 10 + ["shear-stabilized"] * 8 + ["fixed-box"] * 2,
        }
    )
    for ensemble in ("fixed-box", "shear-stabilized"):
        chosen = select_ensemble(table, ensemble).groupby("n")["ensemble"].agg(["first", "size"])
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


def test_the_wanted_ensemble_is_taken_where_both_have_few_packings():
    few = pd.DataFrame({"n": 64, "seed": [1, 2, 3] * 2, "ensemble": ["fixed-box"] * 3 + ["shear-stabilized"] * 3})
    for ensemble in ("fixed-box", "shear-stabilized"):
        assert select_ensemble(few, ensemble)["ensemble"].unique().tolist() == [ensemble]


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
    moved = [c.family["highest = 0.1"] / c.value for c in found.claims if c.quantity.startswith("a: eta_0/N^a")]
    assert len(moved) == 4 and max(moved) < 0.95


def test_the_slope_of_viscosities_is_that_of_the_collapsed_curves():
    """N^1.09 under Stokes drag, as drawn: eta_0 = N^1.09 (p N^2)^-0.4 has the slope -0.4 at every size together."""
    table = paper_tables.spectra()
    x = table["target_pressure"] * table["n"] ** 2
    table["eta0"] = table["n"] ** np.where(table["law"] == "stokes", 1.09, 1.0) * x**-0.4
    claims = figure_8(EnsembleTables({"spectra": table}.__getitem__)).claims
    slopes = [c.value for c in claims if "slope" in c.quantity and "no pre-stress" in c.quantity]
    assert slopes == pytest.approx([-0.4, -0.4], abs=1e-9)
