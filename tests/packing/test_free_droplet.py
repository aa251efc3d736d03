"""One free droplet: the balance of line tension and area, and where there is none."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from jamlab.errors import InputError
from jamlab.packing.free_droplet import free_area, free_polygon_area, regular_polygon


def law(part, ka, a0, nv):
    """Line tension as a part of the largest that a droplet bears."""
    largest = 2 * (a0 / 3) ** 1.5 / np.sqrt(nv * np.tan(np.pi / nv))
    return {"gamma": part * ka * largest, "ka": ka, "a0": np.array([a0]), "delta": 0.2}


@given(st.integers(3, 40), st.floats(0.0, 0.999), st.floats(0.1, 1e3), st.floats(0.1, 10.0))
def test_energy_of_a_free_droplet_is_least(nv, part, ka, a0):
    """E(a) = gamma p + (ka/2)(a - a0)^2, among regular polygons a little smaller and larger."""
    params = law(part, ka, a0, nv)
    a = float(free_polygon_area([nv], params)[0])

    def energy(area):
        ring = regular_polygon(nv, area)
        perimeter = np.hypot(*(np.roll(ring, -1, axis=0) - ring).T).sum()
        return params["gamma"] * perimeter + 0.5 * ka * (area - a0) ** 2

    step = 1e-3 * (a - a0 / 3)  # the barrier to collapse is at a0/3 or below
    assert energy(a) < min(energy(a - step), energy(a + step)) and 0 < a <= a0 * (1 + 1e-12)
    half = 0.1
    rim = free_area([nv], params)[0] - a
    assert rim == pytest.approx(half * 2 * np.sqrt(nv * np.tan(np.pi / nv) * a) + np.pi * half**2, rel=1e-12)


@pytest.mark.parametrize("nv", [3, 12, 17])
def test_line_tension_that_no_area_bears_is_refused(nv):
    params = law(1.001, 2.0, 1.3, nv)
    with pytest.raises(InputError, match=f"gamma = {params['gamma']:g} at ka = 2.*raise ka"):
        free_polygon_area([nv], params)
