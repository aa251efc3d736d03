"""Outlines of polygons with rims: Steiner's formula, notches, overlaps of any order against unions of capsules."""

import numpy as np
import pytest
import shapely
from packings_by_hand import ANGLE, SQUARE, capsule_unions
from packings_by_hand import droplets as polygons

from jamlab.geometry.rims import rim_overlaps, rims, shared_areas
from jamlab.packing.free_droplet import regular_polygon


def dense_packing(seed, noise=0.03, dent=0.0, delta=0.25, side=4):
    """Distorted 12- and 17-gons on a sheared grid, overlapping at random."""
    rng = np.random.default_rng(seed)
    rings = []
    box = np.array([[side, 0.0], [0.3 * side, side]]) * 1.25
    for k in range(side**2):
        ring = regular_polygon(12 if k % 2 else 17, 0.8 if k % 2 else 1.6, rng.random())
        ring *= (1 - dent * np.cos(3 * np.arctan2(ring[:, 1], ring[:, 0])))[:, None]
        place = (np.array(divmod(k, side)) + 0.2 * rng.random(2)) @ box / side
        rings.append(place + ring + noise * rng.normal(size=ring.shape))
    return polygons(rings, delta, box)


def extrapolate(measure):
    """Arcs of 64 and 128 steps a quarter err as 1/steps^2."""
    return (4 * measure(128) - measure(64)) / 3


@pytest.mark.parametrize("delta", [1e-6, 0.1, 1.0, 20.0])
def test_convex_outline_obeys_steiner(delta):
    packing = polygons([SQUARE, regular_polygon(3, 1.0), regular_polygon(17, 2.0) + 3], delta)
    grown, w = rims(packing), delta / 2
    np.testing.assert_allclose(grown.area, packing.polygon_areas + packing.perimeters * w + np.pi * w**2, rtol=1e-13)
    np.testing.assert_allclose(grown.perimeter, packing.perimeters + 2 * np.pi * w, rtol=1e-13)


@pytest.mark.parametrize("w", [0.01, 0.2, 0.6])
def test_notch_of_a_right_angle(w):
    """Both rims cover a square of side w in the notch: the strips overlap by w^2 beyond Steiner's quarter disk."""
    packing = polygons([ANGLE], 2 * w)
    grown = rims(packing)
    np.testing.assert_allclose(grown.area, 3 + 8 * w + np.pi * w**2 - w**2 * (1 - np.pi / 4), rtol=1e-13)
    np.testing.assert_allclose(grown.perimeter, 8 + 2 * np.pi * w - 2 * w * (1 - np.pi / 4), rtol=1e-13)


@pytest.mark.parametrize(("noise", "dent", "delta"), [(0.03, 0.0, 0.25), (0.0, 0.3, 0.25), (0.02, 0.4, 0.6)])
def test_dented_outlines(noise, dent, delta):
    packing = dense_packing(1, noise, dent, delta, side=3)
    grown = rims(packing)
    np.testing.assert_allclose(grown.area, extrapolate(lambda s: shapely.area(capsule_unions(packing, s))), atol=4e-6)
    np.testing.assert_allclose(
        grown.perimeter, extrapolate(lambda s: shapely.length(capsule_unions(packing, s))), atol=4e-5
    )


@pytest.mark.parametrize("length", [0.0, 1e-13, 1e-9, 1e-5])
@pytest.mark.parametrize("direction", [0.3, 2.0, 5.5])
def test_edge_that_has_shrunk_to_a_point(length, direction):
    step = length * np.array([np.cos(direction), np.sin(direction)])
    ring = np.insert(SQUARE, 2, SQUARE[1] + step, axis=0)
    grown = rims(polygons([ring], 0.2))
    np.testing.assert_allclose(grown.area, 1 + 4 * 0.1 + np.pi * 0.01, atol=3e-5 if length == 1e-5 else 1e-8)


def test_ring_that_closes_keeps_its_hole():
    turn = np.linspace(0.05, 2 * np.pi - 0.05, 60)
    arc = np.column_stack([np.cos(turn), np.sin(turn)])
    packing = polygons([np.concatenate([2 * arc, arc[::-1]])], 0.4)
    hole = shapely.area(shapely.Polygon(shapely.get_interior_ring(rims(packing).outlines[0], 0)))
    np.testing.assert_allclose(hole, np.pi * 0.8**2, rtol=0.01)


def facing_squares(gap, w):
    return polygons([SQUARE, SQUARE + np.array([1 + gap, 0.0])], 2 * w)


def strip(gap, w):
    """Rims of two facing unit squares: a flat strip, and half a lens of two corner circles at either end."""
    lens = 2 * w**2 * np.arccos(gap / (2 * w)) - 0.5 * gap * np.sqrt(4 * w**2 - gap**2)
    return (2 * w - gap) + lens


@pytest.mark.parametrize("gap", [0.01, 0.1, 0.19])
def test_rims_of_two_facing_squares(gap):
    packing = facing_squares(gap, 0.1)
    overlaps = rim_overlaps(packing, rims(packing))
    assert (overlaps.owner.tolist(), overlaps.other.tolist()) == ([0, 1], [1, 0])
    np.testing.assert_allclose(shapely.area(overlaps.regions), strip(gap, 0.1), atol=2e-7)  # 2e-5 w^2
    np.testing.assert_allclose(shared_areas(packing), 1.4 + 0.01 * np.pi - strip(gap, 0.1) / 2, atol=1e-7)


def test_polygon_overlaps_its_own_images():
    packing = polygons([SQUARE + 5], 0.2, [[1.1, 0.0], [0.0, 20.0]])
    np.testing.assert_allclose(shared_areas(packing), 1.4 + 0.01 * np.pi - strip(0.1, 0.1), atol=1e-7)


def test_squares_that_fill_the_cell_share_it_equally():
    """Four rims meet in every corner."""
    box = np.array([[2.2, 0.0], [0.0, 2.2]])
    rings = [SQUARE + 1.1 * np.array([a, b]) for a in (0, 1) for b in (0, 1)]
    np.testing.assert_allclose(shared_areas(polygons(rings, 0.3, box)), 1.21, rtol=1e-12)


def test_shares_do_not_depend_on_origin_image_order_or_lattice_vectors():
    packing = dense_packing(3)
    rng = np.random.default_rng(4)
    shares = shared_areas(packing)
    rings = np.split(packing.positions, packing.offsets[1:-1])
    order = rng.permutation(packing.n)
    moved = [ring + rng.integers(-2, 3, 2) @ packing.box + [0.3, 0.7] for ring in rings]
    other = polygons([moved[k] for k in order], 0.25, packing.box + np.outer([0, 3], packing.box[0]))
    np.testing.assert_allclose(shared_areas(other), shares[order], rtol=1e-10)
