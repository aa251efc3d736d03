"""Outlines of polygons with rims, and the voids they leave: closed forms, notches, unions of capsules."""

import numpy as np
import pytest
import random_packings
import shapely
from drawn_overlaps import drawn_shares
from hypothesis import example, given
from packings_by_hand import ANGLE, SQUARE, capsule_unions
from packings_by_hand import droplets as polygons

import jamlab
from jamlab.errors import BoundaryError
from jamlab.geometry.contact_network import remove_rattlers
from jamlab.geometry.droplet_cover import shared_areas
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.geometry.particle_shape import particle_areas
from jamlab.geometry.rims import rims
from jamlab.geometry.voids.voids import voids
from jamlab.models.droplets import regular_polygon


def by_rims(packing):
    """Area and perimeter of the outlines with their rims."""
    grown = rims(packing)
    return grown.area.sum(), grown.perimeter.sum()


def by_voids(packing):
    """The same of what voids leave of the cell."""
    found = voids(packing)
    return packing.area - found.area.sum(), found.perimeter.sum()


WAYS = pytest.mark.parametrize("measure", [by_rims, by_voids])


@WAYS
@pytest.mark.parametrize("ring", [SQUARE, regular_polygon(3, 1.0), regular_polygon(17, 2.0, 0.3)])
@pytest.mark.parametrize("w", [1e-6, 0.05, 0.5, 4.0])
def test_convex_outlines_obey_steiner(measure, ring, w):
    packing = polygons([ring + 8], 2 * w)
    a, p = packing.polygons.areas[0], packing.polygons.perimeters[0]
    np.testing.assert_allclose(measure(packing), [a + p * w + np.pi * w**2, p + 2 * np.pi * w], rtol=1e-11)


@WAYS
@pytest.mark.parametrize("w", [0.01, 0.2, 0.6])
def test_notch_of_a_right_angle(measure, w):
    """Both rims cover a square of side w in the notch: the strips overlap by w^2 beyond Steiner's quarter disk."""
    lost = 1 - np.pi / 4
    wanted = [3 + 8 * w + np.pi * w**2 - w**2 * lost, 8 + 2 * np.pi * w - 2 * w * lost]
    np.testing.assert_allclose(measure(polygons([ANGLE + 5], 2 * w)), wanted, rtol=1e-12)


@WAYS
@pytest.mark.parametrize("length", [0.0, 1e-13, 1e-9, 1e-5, 1e-3])
@pytest.mark.parametrize("direction", [0.3, 2.0, 5.5])
def test_edge_that_has_shrunk_to_a_point(measure, length, direction):
    step = length * np.array([np.cos(direction), np.sin(direction)])
    ring = np.insert(SQUARE, 2, SQUARE[1] + step, axis=0)
    box = 1.19 * np.eye(2) if measure is by_voids else 5 * np.eye(2)
    one, other = (measure(polygons([points], 0.2, box)) for points in (ring, SQUARE))
    np.testing.assert_allclose(one[0], other[0], atol=3 * max(length, 1e-8))


@given(random_packings.polygons())
def test_outlines_are_those_of_capsules_around_all_edges(packing):
    grown, (coarse, fine) = rims(packing), (capsule_unions(packing, steps) for steps in (64, 128))
    for found, size, error in ((grown.area, shapely.area, 4e-6), (grown.perimeter, shapely.length, 4e-5)):
        np.testing.assert_allclose(found, (4 * size(fine) - size(coarse)) / 3, atol=error)  # arcs err as 1/steps^2


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
    np.testing.assert_allclose(shared_areas(packing), 1.4 + 0.01 * np.pi - strip(gap, 0.1) / 2, atol=1e-14)


def test_polygon_overlaps_its_own_images():
    packing = polygons([SQUARE + 5], 0.2, [[1.1, 0.0], [0.0, 20.0]])
    np.testing.assert_allclose(shared_areas(packing), 1.4 + 0.01 * np.pi - strip(0.1, 0.1), atol=1e-14)


def test_squares_that_fill_the_cell_share_it_equally():
    """Four rims meet in every corner."""
    box = np.array([[2.2, 0.0], [0.0, 2.2]])
    rings = [SQUARE + 1.1 * np.array([a, b]) for a in (0, 1) for b in (0, 1)]
    np.testing.assert_allclose(shared_areas(polygons(rings, 0.3, box)), 1.21, rtol=1e-12)


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
    one, other = (x[np.lexsort(np.round(x, 6).T)] for x in (found.centroid, centres))
    np.testing.assert_allclose(one, other, rtol=1e-9)


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


def test_compressed_droplets(dp_onset, dp_dense):
    for packing in (dp_onset, dp_dense):
        found = voids(packing)
        np.testing.assert_allclose(1 - found.area.sum() / packing.area, packing_fraction(packing), rtol=1e-14)
        np.testing.assert_allclose(particle_areas(packing), drawn_shares(packing), atol=1e-6)
        assert (found.shape_factor > 1).all()
    assert (voids(dp_dense).sides <= 6).all()
    # every void has a corner less of its own than faces of the contact network would need: Euler on the torus
    network, found = jamlab.contacts(dp_dense), voids(remove_rattlers(dp_dense))
    assert len(found.area) == network.n_contacts - network.n_backbone
    assert found.sides.sum() == 2 * network.n_contacts


def test_outlines_that_cross_or_hold_another_are_refused():
    with pytest.raises(BoundaryError, match=r"0\D+1"):
        voids(polygons([SQUARE + 3, SQUARE + 3.5], 0.1))
    packing = polygons([4 * SQUARE, SQUARE + 1.5], 0.1)
    with pytest.raises(BoundaryError, match=r"0\D+1"):
        voids(packing)
    np.testing.assert_allclose(packing_fraction(packing), (16 + 16 * 0.05 + np.pi * 0.0025) / 400, rtol=1e-14)


@pytest.mark.parametrize("way", [(0.5, 0.5), (0.3, -0.6)])
def test_squares_that_cross(way):
    """Their overlap has two rounded corners and two right ones."""
    w, (a, b) = 0.05, 1 - np.abs(way)
    packing = polygons([SQUARE + 3, SQUARE + 3 + np.array(way)], 2 * w)
    both = (a + 2 * w) * (b + 2 * w) - 2 * (1 - np.pi / 4) * w**2
    np.testing.assert_allclose(shared_areas(packing), 1 + 4 * w + np.pi * w**2 - both / 2, rtol=1e-14)


def resting_on_its_own_image():
    """A triangle whose tip lies in the rim of its own image's base: an edge hides the neighbour of its own image."""
    corners = [[0.72, 0.85], [0.14, 0.3], [0.82, 0.39], [1.54, 0.92], [1.19, 0.26], [1.71, 0.27]]
    law = {"gamma": 1.0, "ka": 500.0, "eps": 1.0, "delta": 0.375, "eta": 0.0, "contact": "outline", "a0": [0.3, 1.0]}
    return jamlab.Packing("dp", [[2.0, 0.0], [0.0, 1.0]], corners, law, offsets=[0, 3, 6])


@example(resting_on_its_own_image())
@given(random_packings.polygons())
def test_rho_shared_among_particles_and_left_to_voids(packing):
    rho = jamlab.packing_fraction(packing)
    drawn = drawn_shares(packing)
    assert drawn.sum() / packing.area == pytest.approx(rho, abs=3e-7)
    np.testing.assert_allclose(jamlab.particle_areas(packing), drawn, atol=3e-7 * packing.area)
    assert 1 - jamlab.voids(packing).area.sum() / packing.area == pytest.approx(rho, abs=1e-12)
