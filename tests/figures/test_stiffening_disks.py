"""The figure of Hertzian beside harmonic disks, from the table that ships."""

import numpy as np
import pytest

from jamlab.studies.beyond.stiffening_disks import EXPECTED, NAMES, exponent_of, read_states, stiffening_disks
from jamlab.studies.gallery import FIGURES


def test_exponent_of_a_power_law_is_its_power_in_every_resample():
    x = np.geomspace(1e-3, 1e-1, 11)
    found = exponent_of(x, np.outer([1.0, 2.0, 5.0], x**1.5))
    assert found.value == pytest.approx(1.5) and found.low == pytest.approx(1.5) and found.high == pytest.approx(1.5)


def test_exponents_of_the_figure_are_those_of_the_theory():
    drawing = stiffening_disks(None)
    for column, alpha in EXPECTED:
        found = drawing.values[f"{column}, {NAMES[alpha]}"]
        assert found.low - 0.12 < EXPECTED[column, alpha] < found.high + 0.12
        assert found.high - found.low < 0.5
    assert FIGURES["beyond-stiffening-disks"] is stiffening_disks and "Hertz" in drawing.caption


def test_table_holds_states_above_onset_of_both_laws():
    table = read_states()
    assert set(table["exponent"]) == set(NAMES) and (table[["distance", "pressure", "g"]] > 0).all().all()
    near = table[table["distance"] < 2e-3]
    assert near["excess"].abs().max() < 0.3
