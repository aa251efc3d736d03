"""Boxes deformed there and back: compression, and shear in any direction."""

import numpy as np
import random_packings
from hypothesis import given
from hypothesis import strategies as st

from jamlab.packing.deformation import at_phi, deformed
from jamlab.packing.shear_direction import shear_direction


def assert_close(got, wanted, digits=1e-12):
    scale = 1 + np.abs(wanted.positions).max()
    np.testing.assert_allclose(got.box, wanted.box, rtol=0, atol=digits * scale)
    np.testing.assert_allclose(got.positions, wanted.positions, rtol=0, atol=digits * scale)


@given(random_packings.packings(), st.floats(0.5, 1.5))
def test_compressed_there_and_back(packing, factor):
    """Particles keep their size; centres move with the box."""
    phi = min(factor * packing.phi, 2.0)
    there = at_phi(packing, phi)
    assert abs(there.phi / phi - 1) < 1e-12
    assert_close(at_phi(there, packing.phi), packing)
    inside = packing.centroids @ np.linalg.inv(packing.box)
    np.testing.assert_allclose(there.centroids @ np.linalg.inv(there.box), inside, rtol=0, atol=1e-11)
    if packing.model == "sp":
        assert np.array_equal(there.diameters, packing.diameters)
    else:
        np.testing.assert_allclose(there.polygons.areas, packing.polygons.areas, rtol=1e-11)


@given(random_packings.packings(), st.floats(0, np.pi), st.floats(-0.5, 0.5))
def test_shear_in_any_direction_keeps_the_area_and_is_undone_in_the_turned_frame(packing, angle, strain):
    direction = shear_direction(packing, angle)
    there, rotation = deformed(packing, direction.gradient(strain))
    assert abs(there.area / packing.area - 1) < 1e-13 and there.box[0, 1] == 0
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(2), rtol=0, atol=1e-14)
    back, _ = deformed(there, rotation @ direction.gradient(-strain) @ rotation.T)
    one, other = (np.hypot(*(x[:, None] - x).T) for x in (back.positions, packing.positions))
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-11 * (1 + np.abs(packing.positions).max()))
