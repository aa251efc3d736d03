"""Boxes deformed there and back, and in two steps or one."""

import numpy as np
import random_packings
from hypothesis import given
from hypothesis import strategies as st

from jamlab.packing.deformation import at_phi, deformed, sheared, simple_shear

strains = st.floats(-2, 2)


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
        np.testing.assert_allclose(there.polygon_areas, packing.polygon_areas, rtol=1e-11)


@given(random_packings.packings(), strains, strains)
def test_shears_add_up(packing, first, second):
    assert_close(sheared(sheared(packing, first), second), sheared(packing, first + second))
    assert_close(sheared(sheared(packing, first), -first), packing)


@given(random_packings.packings(), st.floats(0, np.pi), st.floats(-0.5, 0.5))
def test_shear_in_any_direction_keeps_the_area_and_is_undone_in_the_turned_frame(packing, angle, strain):
    there, rotation = deformed(packing, simple_shear(strain, angle))
    assert abs(there.area / packing.area - 1) < 1e-13 and there.box[0, 1] == 0
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(2), rtol=0, atol=1e-14)
    back, _ = deformed(there, rotation @ simple_shear(-strain, angle) @ rotation.T)
    turned = back.positions[:, None] - back.positions
    np.testing.assert_allclose(
        np.hypot(*np.moveaxis(turned, -1, 0)),
        np.hypot(*np.moveaxis(packing.positions[:, None] - packing.positions, -1, 0)),
        rtol=0,
        atol=1e-11 * (1 + np.abs(packing.positions).max()),
    )
