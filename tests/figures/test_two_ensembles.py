"""Packings of one size in two ensembles, and those that were not compressed beyond onset: never in one mean."""

import pandas as pd
import paper_tables
import pytest

from jamlab.figures.papers.baumgarten_motion import figure_5, figure_8
from jamlab.figures.papers.baumgarten_spectra import figure_1, figure_3
from jamlab.figures.papers.spectral_groups import select_ensemble
from jamlab.figures.papers.tables import EnsembleTables


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
    fixed = EnsembleTables({name: paper_tables.TABLES[name]() for name in mixed}.__getitem__)
    for figure in (figure_1, figure_3, figure_5):
        pd.testing.assert_frame_equal(figure(both).table, figure(fixed).table)
    one, other = figure_8(both), figure_8(fixed)
    viscosity = one.table["y"].to_numpy() / other.table["y"].to_numpy()
    assert viscosity == pytest.approx(3.0)
    assert "sheared until stable: N = 256 (5), N = 1024 (5)." in one.caption
    assert "of fixed shape: N = 256 (5), N = 1024 (5)." in other.caption


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
