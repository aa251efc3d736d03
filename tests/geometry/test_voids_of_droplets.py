"""Voids between deformable polygons: closed forms, notches, unions of capsules, short edges, outlines that cross."""

import numpy as np
import pytest
import shapely
from packings_by_hand import ANGLE, SQUARE, capsule_unions
from packings_by_hand import droplets as polygons

import jamlab
from jamlab.errors import BoundaryError
from jamlab.geometry.contact_network import without_rattlers
from jamlab.geometry.packing_fraction import exact_method, packing_fraction
from jamlab.geometry.particle_shape import particle_areas
from jamlab.geometry.voids.voids import voids
from jamlab.packing.free_droplet import regular_polygon


def uncovered(packing, steps):
    """What polygons and capsules around their edges leave of the cell, drawn with `steps` corners a quarter."""
    moves = np.stack(np.meshgrid(*[np.arange(-2, 3)] * 2), axis=-1).reshape(-1, 2) @ packing.box
    cell = shapely.Polygon(np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) @ packing.box)
    shapes = capsule_unions(packing, steps)
    tiles = np.concatenate([shapely.transform(shapes, lambda x, s=s: x + s) for s in moves])
    return cell.area - shapely.union_all(shapely.intersection(tiles[shapely.intersects(tiles, cell)], cell)).area


@pytest.mark.parametrize("ring", [SQUARE, regular_polygon(3, 1.0), regular_polygon(17, 2.0, 0.3)])
@pytest.mark.parametrize("w", [1e-6, 0.05, 0.5, 4.0])
def test_convex_polygon_obeys_steiner(ring, w):
    packing = polygons([ring + 8], 2 * w)
    found, a, p = voids(packing), packing.polygon_areas[0], packing.perimeters[0]
    assert [v.tolist() for v in (found.sides, found.islands, found.percolating)] == [[1], [1], [2]]
    np.testing.assert_allclose(400 - found.area[0], a + p * w + np.pi * w**2, rtol=1e-11)
    np.testing.assert_allclose(found.perimeter[0], p + 2 * np.pi * w, rtol=1e-13)


@pytest.mark.parametrize("w", [0.01, 0.2, 0.6])
def test_notch_of_a_right_angle(w):
    """Moved edges cross w beyond the notch; the arc of neither covers the other."""
    found = voids(polygons([ANGLE + 5], 2 * w))
    np.testing.assert_allclose(400 - found.area[0], 3 + 8 * w + np.pi * w**2 - w**2 * (1 - np.pi / 4), rtol=1e-13)
    np.testing.assert_allclose(found.perimeter[0], 8 + 2 * np.pi * w - 2 * w * (1 - np.pi / 4), rtol=1e-13)


@pytest.mark.parametrize(("gap", "w"), [(0.19, 0.1), (0.16, 0.1), (0.3, 0.2)])
@pytest.mark.parametrize("repeat", [1, 2])
def test_lattice_of_squares(gap, w, repeat):
    """Four rounded corners leave a star; flat rims overlap in strips that end in half lenses."""
    side = 1 + gap
    corners = np.stack(np.meshgrid(np.arange(repeat), np.arange(repeat)), axis=-1).reshape(-1, 2) * side
    packing = polygons([SQUARE + c + 0.3 for c in corners], 2 * w, repeat * side * np.eye(2))
    alpha = np.arccos(0.5 * gap / w)
    strip = (2 * w - gap) + 2 * w**2 * alpha - 0.5 * gap * np.sqrt(4 * w**2 - gap**2)
    assert alpha < np.pi / 4  # else the stars close
    found = voids(packing)
    np.testing.assert_array_equal(found.sides, np.full(repeat**2, 4))
    np.testing.assert_allclose(found.area, side**2 - (1 + 4 * w + np.pi * w**2 - 2 * strip), rtol=1e-10)
    np.testing.assert_allclose(found.perimeter, 4 * w * (np.pi / 2 - 2 * alpha), rtol=1e-11)
    centres = np.mod(corners + 1.3 + gap / 2, repeat * side)
    np.testing.assert_allclose(
        found.centroid[np.lexsort(np.round(found.centroid, 6).T)],
        centres[np.lexsort(np.round(centres, 6).T)],
        rtol=1e-9,
    )


def test_squares_whose_rims_close_every_gap():
    assert len(voids(polygons([SQUARE], 0.3, 1.1 * np.eye(2))).area) == 0


def test_droplet_in_a_ring_of_polygons_is_an_island():
    turn = np.linspace(0.05, 2 * np.pi - 0.05, 60)
    arc = np.column_stack([np.cos(turn), np.sin(turn)])
    packing = polygons([np.concatenate([2 * arc, arc[::-1]]) + 5, 0.2 * SQUARE + 4.9], 0.4)
    found = voids(packing)
    inner = found.percolating == 0
    assert [v[inner].tolist() for v in (found.sides, found.islands)] == [[1], [1]]
    island = 0.04 + 0.8 * 0.2 + np.pi * 0.04
    np.testing.assert_allclose(found.area[inner], np.pi * 0.8**2 - island, rtol=0.02)


@pytest.mark.parametrize("length", [0.0, 1e-13, 1e-9, 1e-5, 1e-3])
@pytest.mark.parametrize("direction", [0.3, 2.0, 5.5])
def test_edge_that_has_shrunk_to_a_point(length, direction):
    step = length * np.array([np.cos(direction), np.sin(direction)])
    ring = np.insert(SQUARE, 2, SQUARE[1] + step, axis=0)
    packing = polygons([ring], 0.2, 1.19 * np.eye(2))
    whole = voids(polygons([SQUARE], 0.2, 1.19 * np.eye(2)))
    found = voids(packing)
    np.testing.assert_allclose(found.area, whole.area, atol=2 * max(length, 1e-14))
    assert found.sides.tolist() == [4] and np.isfinite(found.shape).all()


@pytest.mark.parametrize(
    ("seed", "tilt", "delta"),
    [pytest.param(0, 0.0, 0.25, marks=pytest.mark.slow), (1, 0.3, 0.1), (2, 0.0, 0.45), (5, 0.7, 0.25)],
)
def test_random_polygons_against_unions_of_capsules(random_polygons, seed, tilt, delta):
    packing = random_polygons(tilt, seed=seed, delta=delta)
    expected = (4 * uncovered(packing, 192) - uncovered(packing, 96)) / 3  # corners err as 1/steps^2
    found = voids(packing)
    np.testing.assert_allclose(found.area.sum(), expected, atol=3e-7)
    assert exact_method(packing) == "boundary"
    np.testing.assert_allclose(packing_fraction(packing), 1 - expected / packing.area, atol=1e-7)
    np.testing.assert_allclose(particle_areas(packing).sum() / packing.area, packing_fraction(packing), atol=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_voids_do_not_depend_on_origin_image_order_or_lattice_vectors(random_polygons, seed):
    packing, rng = random_polygons(0.2, seed=seed), np.random.default_rng(seed)
    rings = np.split(packing.positions, packing.offsets[1:-1])
    order = rng.permutation(packing.n)
    moved = [ring + rng.integers(-2, 3, 2) @ packing.box + [0.3, 0.7] for ring in rings]
    rolled = [np.roll(moved[k], 3, axis=0) for k in order]
    box = packing.box + np.outer([0, rng.integers(-2, 3)], packing.box[0])
    found, other = voids(packing), voids(polygons(rolled, packing.params["delta"], box))
    for name in ("sides", "area", "perimeter", "islands", "percolating"):
        np.testing.assert_allclose(np.sort(getattr(other, name)), np.sort(getattr(found, name)), rtol=1e-8, atol=1e-12)


def test_compressed_droplets(dp_onset, dp_dense):
    for packing in (dp_onset, dp_dense):
        found = voids(packing)
        np.testing.assert_allclose(1 - found.area.sum() / packing.area, packing_fraction(packing), rtol=1e-14)
        np.testing.assert_allclose(particle_areas(packing).sum() / packing.area, packing_fraction(packing), atol=5e-7)
        assert (found.shape > 1).all()
    assert (voids(dp_dense).sides <= 6).all()
    # every void has a corner less of its own than faces of the contact network would need: Euler on the torus
    network, found = jamlab.contacts(dp_dense), voids(without_rattlers(dp_dense))
    assert len(found.area) == network.count - network.backbone
    assert found.sides.sum() == 2 * network.count


def test_outlines_that_cross_are_refused():
    with pytest.raises(BoundaryError, match="polygons 0 and 1 cross"):
        voids(polygons([SQUARE + 3, SQUARE + 3.5], 0.1))


def test_polygon_inside_another_is_refused():
    packing = polygons([4 * SQUARE, SQUARE + 1.5], 0.1)
    with pytest.raises(BoundaryError, match="particle 1 lies inside particle 0"):
        voids(packing)
    np.testing.assert_allclose(packing_fraction(packing), (16 + 16 * 0.05 + np.pi * 0.0025) / 400, rtol=1e-2)
