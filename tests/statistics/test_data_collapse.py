"""Exponents and spread of collapses of several sizes, from known scaling functions."""

import numpy as np
import pytest

from jamlab.errors import InputError
from jamlab.statistics.data_collapse import fit_scaling_exponents


def master(x):
    return x / (1 + x**0.5)  # x for small x, sqrt(x) for large


def sized(n, a, b):
    """Curve of a system of size n that collapses as x n^a, y n^b."""
    x = np.geomspace(1e-5, 0.1, 40)
    return x, master(x * n**a) / n**b


@pytest.mark.parametrize(("a", "b"), [(2.0, 1.0), (1.2, 0.3)])
def test_finite_size_exponents_of_a_collapse(a, b):
    n = np.array([32.0, 64.0, 128.0, 256.0])
    found = fit_scaling_exponents(n, [[sized(m, a, b) for m in n]], start=(1.5, 0.7))
    # interpolation between 40 points bends the master curve a little
    assert found.a == pytest.approx(a, abs=0.01) and found.b == pytest.approx(b, abs=0.01)
    assert found.spread < 2e-3
    fixed = fit_scaling_exponents(n, [[sized(m, a, b) for m in n]], b=b, start=(1.0, 0.0))
    assert fixed.b == b and fixed.a == pytest.approx(a, abs=0.01)
    shifted = fit_scaling_exponents(n, [[sized(m, a, b) for m in n]], a=a)  # b alone: the bottom of a parabola
    assert shifted.a == a and shifted.b == pytest.approx(b, abs=1e-3)
    assert shifted.spread == min(
        fit_scaling_exponents(n, [[sized(m, a, b) for m in n]], a=a, b=shifted.b + e).spread for e in (-1e-4, 0, 1e-4)
    )


def measure_spread(curves):
    return fit_scaling_exponents(np.ones(len(curves)), [curves], a=0.0, b=0.0).spread


def test_spread_is_the_distance_from_the_mean_curve():
    x = np.geomspace(1e-3, 1, 30)
    assert measure_spread([(x, x), (x, x)]) == pytest.approx(0, abs=1e-12)
    # two curves a factor e apart: each half a unit from their mean
    assert measure_spread([(x, x), (x, np.e * x)]) == pytest.approx(0.5)
    assert measure_spread([(3 * x, 7 * x), (3 * x, 7 * np.e * x)]) == pytest.approx(0.5)
    assert measure_spread([(x, x), (1e6 * x, x)]) == float("inf")


def test_impossible_collapses_are_refused():
    x = np.geomspace(1e-3, 1, 5)
    for curves in ([(x, x)], [(x, x), (x, -x)]):
        with pytest.raises(InputError):
            measure_spread(curves)
    with pytest.raises(InputError):
        fit_scaling_exponents([1.0, 2.0], [[(x, x)]])
