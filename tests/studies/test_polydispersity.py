"""The study of what sizes change: its rows are those of packings made anew, and its picture shows their means."""

import numpy as np
import pytest

import jamlab
from studies.beyond import polydispersity
from studies.beyond.polydispersity import DISTANCE, STUDY, measure_sizes
from studies.reference_data import reference_tables


def test_rows_are_measured_at_one_distance_above_the_onset_of_each_packing(monkeypatch):
    monkeypatch.setattr(polydispersity, "PARTICLES", {"sp": 8, "dp": 4})
    monkeypatch.setattr(polydispersity, "BLOCK", 1)
    (row,) = measure_sizes("sp", "lognormal:0.2", 3)
    onset = jamlab.jam(n=8, seed=3, sizes="lognormal:0.2")
    *_, state = jamlab.compress(onset, onset.phi + DISTANCE, DISTANCE / 4, by="phi")
    assert row["phi_J"] == onset.phi and row["z"] == jamlab.contacts(state).z
    assert row["g"] == pytest.approx(jamlab.shear_modulus(state, average=True), rel=1e-9)
    assert row["storage_0.1"] == pytest.approx(jamlab.complex_modulus(state, [0.1]).storage[0], rel=1e-9)


def test_the_picture_shows_means_over_the_packings_of_the_table():
    table, shown = reference_tables().read(STUDY.name), STUDY.draw(reference_tables())
    assert {task.rpartition(" ")[0] for task in table["task"]} == {task.rpartition(" ")[0] for task in STUDY.tasks}
    of = table[(table["model"] == "sp") & table["sizes"].str.startswith("bidisperse:2,")]
    means = of["phi_J"].groupby(of["sizes"]).mean()
    drawn = shown.table[(shown.table["panel"] == "a") & (shown.table["series"] == "ratio 2")]
    assert sorted(drawn["y"]) == pytest.approx(sorted(means), rel=1e-9)
    assert ((drawn["low"] <= drawn["y"]) & (drawn["y"] <= drawn["high"])).all()
    assert all(np.isfinite(number["value"]) for number in shown.numbers.values())
