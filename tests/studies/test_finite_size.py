"""The limit of large systems is recovered, with its errors."""

import numpy as np
import pytest

from jamlab.errors import InputError
from studies.finite_size import finite_size


def test_the_large_system_limit_is_recovered():
    n = np.array([32, 64, 128, 256, 512])
    y = 0.842 - 0.2 * n**-0.7
    free = finite_size(n, y)
    assert free.limit == pytest.approx(0.842, abs=1e-5) and free.exponent == pytest.approx(0.7, abs=1e-3)
    fixed = finite_size(n[:2], y[:2], exponent=0.7)
    assert fixed.limit == pytest.approx(0.842, abs=1e-12) and fixed.amplitude == pytest.approx(-0.2, rel=1e-9)
    assert fixed(1e9) == pytest.approx(0.842, abs=1e-6)
    y[0] += 0.1
    error = np.array([1e3, 1e-4, 1e-4, 1e-4, 1e-4])
    assert finite_size(n, y, error, exponent=0.7).limit == pytest.approx(0.842, abs=1e-6)


@pytest.mark.parametrize(("n", "error"), [([32, 64], None), ([32, 64, -1], None), ([32, 64, 128], [1, 0, 1])])
def test_impossible_extrapolations_are_refused(n, error):
    with pytest.raises(InputError):
        finite_size(n, np.ones(len(n)), error)


def test_values_that_are_nan_take_their_errors_with_them():
    n = np.array([8.0, 16, 32, 64])
    y, error = 0.84 - 0.3 / n, np.array([1e-3, 1e-3, np.nan, 1e-3])
    found = finite_size(n, np.where(n == 32, np.nan, y), error)
    assert found.limit == pytest.approx(0.84, abs=1e-6) and not found.at_end


@pytest.mark.parametrize("exponent", [5.0, 0.05])
def test_an_exponent_at_the_end_of_its_range_says_so(exponent):
    n = np.array([8.0, 16, 32, 64])
    assert finite_size(n, 0.84 - 0.3 * n**-exponent).at_end
