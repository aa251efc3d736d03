"""Collapses through a critical point recover exponents and scaling function."""

import numpy as np
import pytest

from studies.dynamics.collapse import collapse_through

SHAPE = (-0.02, 0.1, 0.4, 0.3)  # of ln f, highest power first
X, S = (part.ravel() for part in np.meshgrid(np.linspace(0.80, 0.88, 9), np.geomspace(1e-4, 1e-2, 5)))


def data(q, w, critical=0.84):
    z = (X - critical) / S**w
    return S**q * np.exp(np.polyval(SHAPE, z))


@pytest.mark.parametrize(("q", "w"), [(0.4, 0.3), (0.7, 0.25)])
def test_exponents_and_the_scaling_function_are_recovered(q, w):
    found = collapse_through(X, S, data(q, w), (0.835, q + 0.1, w + 0.05), order=3)
    assert [found.critical, found.q, found.w] == pytest.approx([0.84, q, w], abs=1e-5)
    z = np.linspace(-0.2, 0.3, 5)
    assert found.function(z) == pytest.approx(np.exp(np.polyval(SHAPE, z)), rel=1e-4)
    left = np.log(data(q, w)) - np.polyval(np.polyfit(X, np.log(data(q, w)), 3), X)  # one curve for all s
    assert found.spread < 1e-6 and found.before == pytest.approx(np.sqrt(np.mean(left**2)), rel=1e-6)
