"""Fits of flow curves: errors that fit the scatter, and curves that hold no law."""

import numpy as np
import pytest

import jamlab
from jamlab.statistics.herschel_bulkley import herschel_bulkley

RATES = np.geomspace(1e-4, 1.0, 9)
LAW = 2e-3 + 0.05 * RATES**0.5


def test_points_that_scatter_by_more_than_their_errors_make_the_errors_of_the_law_larger():
    """By so much that they follow from the scatter, whatever errors the points came with."""
    stress = LAW * (1 + 0.05 * np.array([1, -1, 1, -1, 0, 1, -1, 1, -1]))
    one, other = (herschel_bulkley(RATES, stress, part * LAW) for part in (1e-3, 1e-2))
    assert one.misfit == pytest.approx(10 * other.misfit, rel=1e-4) and other.misfit > 1
    for name in ("yield_stress_error", "consistency_error", "exponent_error"):
        assert getattr(one, name) == pytest.approx(getattr(other, name), rel=1e-3)


def test_points_that_scatter_by_less_keep_theirs():
    one, other = (herschel_bulkley(RATES, LAW, part * LAW) for part in (1e-3, 1e-2))
    assert other.exponent_error == pytest.approx(10 * one.exponent_error, rel=1e-3)


@pytest.mark.parametrize("shift", [2.1e-3, 0.2])
def test_stresses_may_be_zero_or_negative(shift):
    """As those of a packing whose residual stress was not taken off."""
    found = herschel_bulkley(RATES, LAW - shift, 1e-3 * LAW)
    assert found.yield_stress == pytest.approx(2e-3 - shift, rel=1e-3) and found.exponent == pytest.approx(0.5)


def test_curves_that_hold_no_exponent_are_refused():
    with pytest.raises(jamlab.InputError, match=r"stress is 0\.3 at every rate"):
        herschel_bulkley(RATES, 0.3 + 0 * RATES, 1e-3 * LAW)
    with pytest.raises(jamlab.ConvergenceError, match=r"stress is 0\.3 at every rate, within its errors"):
        herschel_bulkley(RATES, 0.3 + 1e-12 * RATES, 1e-3 * LAW)
    with pytest.raises(jamlab.ConvergenceError, match="end of its range"):
        herschel_bulkley(RATES, 0.3 + 0.05 * RATES**3, 1e-3 * LAW)


def test_the_misfit_is_the_root_of_chi_squared_per_degree_of_freedom():
    stress, error = LAW * (1 + 0.01 * np.array([1, -1, 1, -1, 0, 1, -1, 1, -1])), 0.02 * LAW
    found = herschel_bulkley(RATES, stress, error)
    assert found.misfit == pytest.approx(np.sqrt(np.sum(((found(RATES) - stress) / error) ** 2) / (9 - 3)), rel=1e-6)
