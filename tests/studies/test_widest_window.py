"""The widest window of a power law ends where the law changes."""

import numpy as np
import pytest

from jamlab.errors import ConvergenceError, InputError
from studies.boromand.widest_window import widest_window

X = np.geomspace(1e-4, 0.3, 25)


def test_the_widest_window_ends_where_the_law_changes():
    cross = 1e-2
    y = np.where(X < cross, X**1.5, X**2.5 / cross)
    fit = widest_window(X, y, tolerance=0.02)
    assert fit.exponents == pytest.approx([1.5], abs=0.02)
    assert fit.low == X[0] and 0.5 * cross < fit.high < 1.3 * cross
    upper = widest_window(X, y, tolerance=0.02, low=cross)
    assert upper.exponents == pytest.approx([2.5], abs=0.02)


def test_no_window_is_found_in_noise():
    y = np.exp(np.random.default_rng(1).normal(size=len(X)))
    with pytest.raises(ConvergenceError):
        widest_window(X, y, tolerance=0.01)


def test_too_few_points_have_no_window():
    with pytest.raises(InputError):
        widest_window(X[:3], X[:3])


def test_the_widest_window_spans_decades_not_points():
    """Twelve points in a third of a decade obey one law, six in two decades another."""
    low, high = np.geomspace(1.0, 2.0, 12), np.geomspace(4.0, 400.0, 6)
    y = np.concatenate([low**1.5, 0.1 * high**0.5])
    fit = widest_window(np.concatenate([low, high]), y, tolerance=0.01)
    assert fit.exponents == pytest.approx([0.5]) and (fit.low, fit.high) == pytest.approx((4.0, 400.0))
