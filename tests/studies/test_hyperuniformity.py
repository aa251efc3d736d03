"""The study of structure measures what it says, and its figure keeps the exponents of the table that ships."""

import numpy as np
import pytest

import jamlab
from studies.beyond import hyperuniformity as study
from studies.reference_data import open_tables
from studies.tables import DATA


def test_rows_are_means_over_shells_and_pairs_by_gap(monkeypatch):
    monkeypatch.setattr(study, "N", 16)
    rows = study.measure_structure(1e-2, 1)
    p = jamlab.pack(16, 1e-2, 1, units="k")
    shells = jamlab.spectral_density(p, study.EDGES[-1]).shells(study.EDGES)
    own = {row["x"]: row["value"] for row in rows if row["quantity"] == "chi"}
    assert list(own.values()) == pytest.approx(shells.mean)
    assert {row["quantity"] for row in rows} == {"chi", "s"}
    near = study.gaps_of(p)
    backbone = jamlab.remove_rattlers(p)
    radius = 0.5 * backbone.diameters
    apart = backbone.positions[:, None] - backbone.positions
    apart -= np.rint(apart / p.box[0, 0]) * p.box[0, 0]
    i, j = np.triu_indices(backbone.n, 1)
    gap = np.hypot(*apart[i, j].T) / (radius[i] + radius[j]) - 1
    assert np.histogram(gap, study.GAPS)[0].astype(bool).tolist() == (near > 0).tolist()


def test_exponents_at_onset_are_those_of_the_literature():
    drawn = study.draw_structure(open_tables(DATA))
    chi, gaps = drawn.values["exponent of chi_V, onset"], drawn.values["exponent of gaps"]
    quenched = drawn.values["exponent of chi_V, p = 1e-05 k"]
    assert chi.low < study.MAHER < chi.high and quenched.low < study.DAM[0] < study.DAM[1] < quenched.high
    assert gaps.low < -study.GAMMA < gaps.high
