"""The study of shear at constant pressure: its rows are those of runs made anew, its picture shows their means."""

import pytest

import jamlab
from studies.beyond import dilatancy
from studies.reference_data import reference_tables


def test_rows_of_dilatancy_are_those_of_a_run(monkeypatch):
    for name, value in {"PARTICLES": 16, "STRAIN": 0.02, "ROWS": 2, "BLOCK": 1}.items():
        monkeypatch.setattr(dilatancy, name, value)
    rows = dilatancy.measure_dilatancy(1e-2, 3)
    run = jamlab.quasistatic_shear(jamlab.pack(16, 1e-2, 3), 0.02, dilatancy.STEP, pressure="constant")
    assert [row["strain"] for row in rows] == [0.0, 0.01, 0.02] and rows[0]["dilation"] == 0
    assert rows[-1]["dilation"] == run.dilation[-1] and rows[-1]["ratio"] == run.stress[-1] / 1e-2
    assert rows[-1]["off"] < 1e-8 and rows[-1]["phi"] == pytest.approx(run.packing.phi)


def test_the_picture_shows_means_over_twenty_packings():
    study = dilatancy.STUDY
    table, shown = reference_tables().read(study.name), study.draw(reference_tables())
    assert table.groupby("pressure")["seed"].nunique().min() >= 20 and table["off"].max() < 1e-8
    last = table[(table["pressure"] == 1e-2) & (table["strain"] == table["strain"].max())]
    drawn = shown.table[(shown.table["panel"] == "a") & (shown.table["series"] == "p = 0.01")]
    assert drawn["y"].iloc[-1] == pytest.approx(last["dilation"].mean(), rel=1e-6)
