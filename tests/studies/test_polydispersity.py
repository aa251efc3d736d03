"""The study of what sizes change: its rows are those of packings made anew, and its picture shows their means."""

import numpy as np
import pandas as pd
import pytest

import jamlab
from studies.beyond import polydispersity
from studies.beyond.polydispersity import DISTANCE, STUDY, measure_sizes


def test_rows_are_measured_at_one_distance_above_the_onset_of_each_packing(monkeypatch):
    monkeypatch.setattr(polydispersity, "PARTICLES", {"sp": 8, "dp": 4})
    monkeypatch.setattr(polydispersity, "BLOCK", 1)
    (row,) = measure_sizes("sp", "lognormal:0.2", 3)
    onset = jamlab.jam(n=8, seed=3, sizes="lognormal:0.2")
    *_, state = jamlab.compress(onset, onset.phi + DISTANCE, DISTANCE / 4, by="phi")
    assert row["phi_J"] == onset.phi and row["z"] == jamlab.contacts(state).z
    assert row["g"] == pytest.approx(jamlab.shear_modulus(state, average=True), rel=1e-9)
    assert row["storage_0.1"] == pytest.approx(jamlab.complex_modulus(state, [0.1]).storage[0], rel=1e-9)
    assert set(row) <= {*STUDY.columns}


def test_the_picture_shows_means_over_the_packings_of_the_table():
    table, shown = STUDY.table(), STUDY.draw()
    assert {task.rpartition(" ")[0] for task in table.tasks} == {task.rpartition(" ")[0] for task in STUDY.tasks()}
    of = table.rows[(table.rows["model"] == "sp") & table.rows["sizes"].str.startswith("bidisperse:2,")]
    means = pd.to_numeric(of["phi_J"]).groupby(of["sizes"]).mean()
    drawn = shown.rows[(shown.rows["panel"] == "a") & (shown.rows["series"] == "ratio 2")]
    assert sorted(drawn["y"]) == pytest.approx(sorted(means), rel=1e-9)
    assert ((drawn["low"] <= drawn["y"]) & (drawn["y"] <= drawn["high"])).all()
    assert all(np.isfinite(number["value"]) for number in shown.numbers.values())
