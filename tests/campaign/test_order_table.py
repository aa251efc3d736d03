"""Bond-orientational order as a table of a campaign."""

import numpy as np
import pandas as pd
import pytest
from campaigns import run_here, written

import jamlab
from jamlab.campaign.observables import OrderOfStates


def triangular(columns, rows):
    """Touching disks on a triangular lattice, rows even."""
    y, x = np.mgrid[:rows, :columns]
    places = np.column_stack([(x + 0.5 * (y % 2)).ravel(), np.sqrt(0.75) * y.ravel()])
    return jamlab.Packing("sp", np.diag([columns, np.sqrt(0.75) * rows]), places, {"k": 1.0}, "k", np.ones(len(places)))


def test_a_crystal_has_order_one_and_no_disclinations():
    (row,) = OrderOfStates().one(triangular(6, 4))
    assert row["psi_6"] == pytest.approx(1, abs=1e-12) and row["psi_6_global"] == pytest.approx(1, abs=1e-12)
    assert (row["share_5"], row["share_6"], row["share_7"]) == (0, 1, 0)


def test_the_table_has_a_row_for_each_state_of_both_models(tmp_path):
    sweep = {"model": ["sp", "dp"], "n": 8, "seeds": 1, "compress": None, "onset": True, "observables": ["order"]}
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml", **sweep))
    assert [outcome[0] for outcome in run_here(campaign)] == ["finished"] * 2
    table = campaign.table("order")
    packings = [packing for task in table["task"] for packing in campaign.packings(task)]
    measured = pd.DataFrame(jamlab.measure(packings, ["psi_6", "psi_6_global", "rho"]))
    assert len(table) == 2
    pd.testing.assert_frame_equal(table[["psi_6", "psi_6_global", "rho"]], measured)
    sides = np.array([jamlab.hexatic_order(packing).neighbors for packing in packings])
    for k in (5, 6, 7):
        assert table[f"share_{k}"].tolist() == (sides == k).mean(axis=1).tolist()
    means = campaign.aggregate(["psi_6"], by=["model"], table="order")
    assert len(means) == 2 and (means["psi_6_packings"] == 1).all()
