"""Bond-orientational order as an observable: crystals, a compression, its plot and what it costs."""

import numpy as np
import pytest
from campaigns import run_here, written

import jamlab
from jamlab.campaign.file_values import Tolerances
from jamlab.campaign.observable import Measured, Size, TaskStates
from jamlab.campaign.observables import Order


def order_of(packing):
    (row,) = Order().measure(Measured(TaskStates([packing], [np.nan], [True], []), np.zeros(1), Tolerances()))
    return row


def test_a_crystal_has_order_one_and_six_neighbours():
    lattice = np.array([[1.0, 0.0], [0.5, np.sqrt(0.75)]])
    centres = np.array([[i, j] for i in range(6) for j in range(6)]) @ lattice
    row = order_of(jamlab.Packing("sp", 6 * lattice, centres, {"k": 1.0}, "k", np.full(36, 1.01)))
    assert (row["psi_6"], row["psi_6_overall"]) == pytest.approx((1, 1))
    assert [row[f"share_{k}"] for k in (5, 6, 7)] == [0, 1, 0]


def test_two_grains_turned_by_thirty_degrees_have_order_inside_each_only():
    """psi_6 of the grains is +1 and -1: |psi_6| stays near 1, the mean vanishes."""
    grain = np.array([[i + 0.5 * (j % 2), j * np.sqrt(0.75)] for i in range(30) for j in range(34)])
    turned = grain[:, ::-1]  # exchanging x and y turns bonds by 30 degrees
    half = [g[(g < 26).all(axis=1)] for g in (grain, turned)]
    centres = np.concatenate([half[0], half[1] + [27, 0]])
    row = order_of(jamlab.Packing("sp", np.diag([54.0, 27.0]), centres, {"k": 1.0}, "k", np.ones(len(centres))))
    assert row["psi_6"] > 0.85 and row["psi_6_overall"] < 0.1


def test_rows_of_a_campaign_are_those_of_its_packings(tmp_path):
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml", observables=["order"], n=16, model="sp"))
    assert [outcome.state for outcome in run_here(campaign)] == ["finished"] * 2
    table, states = campaign.table("order"), campaign.table("states")
    assert len(table) == len(states) and table["rho"].tolist() == states["rho"].tolist()
    for task, part in table.groupby("task"):
        for row, packing in zip(part.to_dict("records"), campaign.packings(task), strict=True):
            order = jamlab.orientational_order(packing)
            assert (row["psi_6"], row["psi_6_overall"]) == (order.mean_local, order.overall)
            assert row["share_6"] == (order.neighbors == 6).mean()
    axes = campaign.plot("psi_6", along="rho", table="order")
    assert "psi_6" in axes.get_ylabel()


def test_added_later_it_is_measured_on_the_packings_that_are_there(tmp_path, monkeypatch):
    path = written(tmp_path / "c.toml", seeds=1)
    run_here(jamlab.open_campaign(path))
    monkeypatch.setattr("jamlab.campaign.states.jam", lambda *_, **__: pytest.fail("a packing was made"))
    campaign = jamlab.open_campaign(written(path, seeds=1, observables=["order"]))
    assert [line.stored for line in campaign.plan()] == [1]
    assert [outcome.state for outcome in run_here(campaign)] == ["finished"]
    assert len(campaign.table("order")) == len(campaign.table("states"))


def test_it_costs_less_than_the_states():
    small, large = (Order().seconds(Size("sp", n, n, 10)) for n in (64, 1024))
    assert 0.02 < small < 0.1 and 5 < large / small < 16
