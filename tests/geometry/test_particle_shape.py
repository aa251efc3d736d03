"""Areas and shape factors of single particles, lengths of the flats between droplets, stress by their centroids."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from packings_by_hand import disks, droplets
from plain_capsules import plain_contact_lengths
from random_packings import polygons

import jamlab
from jamlab.geometry.particle_shape import particle_areas, relative_areas, shape_factors
from jamlab.geometry.vertex_contacts import vertex_contacts
from jamlab.models.droplets import regular_polygon

STATES = Path(__file__).parents[1] / "states"


def test_free_disk_is_a_circle():
    packing = disks([[1.0, 1.0], [5.0, 5.0]], [1.0, 1.4])
    np.testing.assert_allclose(shape_factors(packing), 1.0, rtol=1e-14)
    np.testing.assert_array_equal(shape_factors(packing, rim=True), shape_factors(packing))
    np.testing.assert_allclose(particle_areas(packing), [np.pi / 4, np.pi * 0.49], rtol=1e-14)


def test_half_disk_by_hand():
    """Unit disk cut at height 1/2: arc 4 pi/3, chord sqrt(3), area 2 pi/3 + sqrt(3)/4."""
    packing = disks([[0.0, 0.0], [1.0, 0.0]], [2.0, 2.0])
    area = 2 * np.pi / 3 + np.sqrt(3) / 4
    np.testing.assert_allclose(particle_areas(packing), area, rtol=1e-14)
    factor = (4 * np.pi / 3 + np.sqrt(3)) ** 2 / (4 * np.pi * area)
    np.testing.assert_allclose(shape_factors(packing), factor, rtol=1e-14)
    np.testing.assert_allclose(relative_areas(packing), area / np.pi, rtol=1e-14)


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
    a, p = packing.polygons.areas, packing.polygons.perimeters
    area = a + 0.1 * p + 0.01 * np.pi
    np.testing.assert_allclose(particle_areas(packing), area, rtol=1e-13)
    factor = (p + 0.2 * np.pi) ** 2 / (4 * np.pi * area)
    np.testing.assert_allclose(shape_factors(packing, rim=True), factor, rtol=1e-13)
    assert (shape_factors(packing, rim=True) < shape_factors(packing)).all()


def test_shapes_do_not_depend_on_overlaps_but_areas_do():
    ring = regular_polygon(12, 1.0)
    apart, close = (droplets([ring, ring + np.array([x, 0.0])], 0.3) for x in (3.0, 1.3))
    np.testing.assert_allclose(shape_factors(close, rim=True), shape_factors(apart, rim=True), rtol=1e-13)
    assert (particle_areas(close) < particle_areas(apart) - 1e-3).all()


def rectangle(width, height, corner, steps=4):
    """Counter-clockwise ring with `steps` edges on each side."""
    t = np.arange(steps)[:, None] / steps
    ends = np.array([[0, 0], [width, 0], [width, height], [0, height]], dtype=float)
    sides = [a + t * (b - a) for a, b in zip(ends, np.roll(ends, -1, axis=0), strict=True)]
    return np.concatenate(sides) + corner


@pytest.mark.parametrize("gap", [0.05, 0.2])
def test_shifted_rectangles_share_their_common_side_and_what_lies_around_its_ends(gap):
    """Unit squares shifted by 0.4: 0.6 in common, sqrt(delta^2 - gap^2) past a corner, delta - gap round one."""
    packing = droplets([rectangle(1, 1, [1, 1]), rectangle(1, 1, [2 + gap, 1.4])], 0.25)
    found = jamlab.contact_lengths(packing)
    assert found.pairs.tolist() == [[0, 1]]
    assert found.length == pytest.approx([0.6 + np.sqrt(0.25**2 - gap**2) + 0.25 - gap], rel=1e-12)


def test_contact_across_the_boundary_and_with_two_images():
    """A bar that nearly spans the box touches the other from both sides: two contacts, seen however it is wrapped."""
    rings = [rectangle(2, 1, [1, 1]), rectangle(1.9, 1, [3.05, 1])]
    narrow = np.array([[4.0, 0.0], [1.0, 9.0]])
    moved = [rings[0], rings[1] + narrow[1] - 2 * narrow[0]]
    for shapes in (rings, moved):
        found = jamlab.contact_lengths(droplets(shapes, delta=0.12, box=narrow))
        assert found.pairs.tolist() == [[0, 1], [0, 1]]
        assert found.length == pytest.approx([1 + 2 * (0.12 - 0.05)] * 2, rel=1e-12)


@pytest.mark.parametrize("name", ["compressed_droplets", "few_droplets", "stable_droplets"])
def test_contact_lengths_are_those_of_plain_loops(name):
    packing = jamlab.read(STATES / f"{name}.h5")
    found, (pairs, length) = jamlab.contact_lengths(packing), plain_contact_lengths(packing)
    assert len(length) > packing.n
    np.testing.assert_array_equal(found.pairs, pairs)
    np.testing.assert_allclose(found.length, length, rtol=0, atol=1e-13)


@given(polygons())
def test_contact_lengths_of_any_polygons_are_those_of_plain_loops(packing):
    found, (pairs, length) = jamlab.contact_lengths(packing), plain_contact_lengths(packing)
    np.testing.assert_array_equal(found.pairs, pairs)
    np.testing.assert_allclose(found.length, length, rtol=0, atol=1e-9)  # an end moves by the root of rounding


def test_edges_and_areas_by_hand():
    packing = droplets([rectangle(1, 2, [1, 1]), rectangle(0.5, 1, [5, 5], steps=2)], rest_area=2.0)
    edges = jamlab.measure(packing, ["shortest_edge", "longest_edge"])
    assert edges == pytest.approx({"shortest_edge": 0.25, "longest_edge": 0.5})
    packing = packing.with_state(params={**packing.params, "a0": np.array([1.25, 5.0])})
    assert relative_areas(packing) == pytest.approx([2 / 1.25, 0.5 / 5.0])


def test_stress_from_centroids_is_that_of_all_terms(dp_dense):
    """At equilibrium (1/A) sum F_mn (R_m - R_n) over contacts equals the virial of contacts, tension and area."""
    p = dp_dense
    found = vertex_contacts(p)
    m, n = p.particle[found.vertex], p.particle[found.tail]
    push = p.params["eps"] / p.params["delta"] * (1 - found.distance / p.params["delta"]) / found.distance
    force = push[:, None] * found.separation
    apart = p.centroids[m] - p.centroids[n] - found.shift
    by_centroids = np.einsum("ki,kj->ij", force, apart) / p.area
    whole = jamlab.evaluate(p).stress
    assert np.abs(by_centroids - whole).max() < 1e-8 * np.abs(whole).max()
