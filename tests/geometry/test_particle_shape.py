"""Areas and shape factors of single particles."""

import numpy as np
import pytest
from packings_by_hand import disks, droplets

from jamlab.geometry.particle_shape import area_ratios, particle_areas, shape_factors
from jamlab.packing.free_droplet import regular_polygon


def test_free_disk_is_a_circle():
    packing = disks([[1.0, 1.0], [5.0, 5.0]], [1.0, 1.4])
    np.testing.assert_allclose(shape_factors(packing), 1.0, rtol=1e-14)
    np.testing.assert_allclose(particle_areas(packing), [np.pi / 4, np.pi * 0.49], rtol=1e-14)


def test_half_disk_by_hand():
    """Unit disk cut at height 1/2: arc 4 pi/3, chord sqrt(3), area 2 pi/3 + sqrt(3)/4."""
    packing = disks([[0.0, 0.0], [1.0, 0.0]], [2.0, 2.0])
    area = 2 * np.pi / 3 + np.sqrt(3) / 4
    np.testing.assert_allclose(particle_areas(packing), area, rtol=1e-14)
    np.testing.assert_allclose(
        shape_factors(packing), (4 * np.pi / 3 + np.sqrt(3)) ** 2 / (4 * np.pi * area), rtol=1e-14
    )


def test_confluent_crystal_has_the_shape_of_a_hexagon():
    packing = disks([[0.0, 0.0]], [1.3], np.array([[1.0, 0.0], [0.5, np.sqrt(0.75)]]))
    np.testing.assert_allclose(shape_factors(packing), 6 / np.pi * np.tan(np.pi / 6), rtol=1e-13)


def test_disk_inside_another_has_no_shape():
    packing = disks([[0.0, 0.0], [0.1, 0.0]], [2.0, 1.0])
    np.testing.assert_array_equal(np.isnan(shape_factors(packing)), [False, True])
    assert particle_areas(packing)[1] == 0.0


@pytest.mark.parametrize(("nv", "factor"), [(12, 1.0235), (17, 1.0115)])
def test_regular_polygon(nv, factor):
    packing = droplets([regular_polygon(nv, 1.3, 0.4)], 0.1)
    np.testing.assert_allclose(shape_factors(packing), nv / np.pi * np.tan(np.pi / nv), rtol=1e-13)
    np.testing.assert_allclose(shape_factors(packing), factor, atol=5e-5)


def test_rim_rounds_the_shape():
    packing = droplets([regular_polygon(4, 1.0), regular_polygon(12, 1.3) + 5], 0.2)
    a, p = packing.polygon_areas, packing.perimeters
    area = a + 0.1 * p + 0.01 * np.pi
    np.testing.assert_allclose(particle_areas(packing), area, rtol=1e-13)
    np.testing.assert_allclose(
        shape_factors(packing, rim=True), (p + 0.2 * np.pi) ** 2 / (4 * np.pi * area), rtol=1e-13
    )
    assert (shape_factors(packing, rim=True) < shape_factors(packing)).all()


def test_rim_makes_no_difference_to_disks():
    packing = disks([[0.0, 0.0], [1.0, 0.2]], [1.0, 1.4])
    np.testing.assert_array_equal(shape_factors(packing, rim=True), shape_factors(packing))


def test_shapes_do_not_depend_on_overlaps_but_areas_do():
    ring = regular_polygon(12, 1.0)
    apart, close = (droplets([ring, ring + np.array([x, 0.0])], 0.3) for x in (3.0, 1.3))
    np.testing.assert_allclose(shape_factors(close, rim=True), shape_factors(apart, rim=True), rtol=1e-13)
    assert (particle_areas(close) < particle_areas(apart) - 1e-3).all()


def test_area_ratio_of_each_droplet_is_that_to_its_own_rest_area():
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    packing = droplets([square + 2, 2 * square + 6], 0.1)
    packing = packing.with_state(params={**packing.params, "a0": np.array([1.25, 5.0])})
    np.testing.assert_allclose(area_ratios(packing), [1 / 1.25, 4 / 5.0], rtol=1e-14)
