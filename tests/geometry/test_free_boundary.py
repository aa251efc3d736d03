"""Boundaries of disks and droplets, and sums over voids, point by point and piece by piece in plain numpy."""

from pathlib import Path

import numpy as np
import pytest
import shapely
from drawn_overlaps import drawn_shares
from hypothesis import assume, given
from packings_by_hand import droplets
from plain_capsules import edge_rings
from plain_outlines import plain_pieces
from random_packings import disks, polygons

import jamlab
from jamlab.errors import BoundaryError, InputError
from jamlab.geometry.droplet_cover import Meeting, droplet_cover, shared_areas
from jamlab.geometry.voids.boundary_loops import trace_polygons
from jamlab.geometry.voids.voids import voids

TURN = 2 * np.pi
STATES = Path(__file__).parents[1] / "states"


def distances(packing, points):
    """(points,) from each to the nearest polygon in any image, 0 inside, by shapely."""
    reach = np.ptp(packing.positions, axis=0) + 1
    up = int(np.ceil(reach[1] / packing.box[1, 1]))
    across = int(np.ceil((reach[0] + up * abs(packing.box[1, 0])) / packing.box[0, 0]))
    moves = np.array([(a, b) for a in range(-across, across + 1) for b in range(-up, up + 1)]) @ packing.box
    outlines = packing.polygons.shapes()
    tree = shapely.STRtree(np.concatenate([shapely.transform(outlines, lambda x, m=m: x + m) for m in moves]))
    return tree.query_nearest(shapely.points(points), all_matches=False, return_distance=True)[1]


def inner_points(pieces, share):
    """A point of every piece, this share of the way along it."""
    angle = pieces.begin + share * pieces.angle
    on_arc = pieces.centre + pieces.radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    on_line = (1 - share) * pieces.start + share * pieces.end
    return np.where(pieces.radius[:, None] > 0, on_arc, on_line)


def on_a_piece(pieces, point):
    """Whether a point lies on a piece, within 1e-9."""
    ahead, along = point - pieces.start, pieces.end - pieces.start
    aside = np.abs(along[:, 0] * ahead[:, 1] - along[:, 1] * ahead[:, 0])
    size = np.hypot(*along.T)
    place = np.sum(ahead * along, axis=1)
    straight = (pieces.radius == 0) & (aside <= 1e-9 * size) & (place >= -1e-9) & (place <= size**2 + 1e-9)
    x, y = (point - pieces.centre).T
    turned = np.mod(np.arctan2(y, x) - pieces.begin + 1e-9, TURN) <= pieces.angle + 2e-9
    return (straight | (turned & (np.abs(np.hypot(x, y) - pieces.radius) < 1e-9) & (pieces.radius > 0))).any()


@given(polygons())
def test_free_pieces_are_a_rim_away_from_all_polygons_and_nothing_else_is(packing):
    try:
        pieces = trace_polygons(packing).pieces
    except BoundaryError:
        return
    w, edges = 0.5 * packing.params["delta"], edge_rings(packing)
    if len(pieces.particle):
        free = np.concatenate([inner_points(pieces, share) for share in (0.0, 0.31, 0.77, 1.0)])
        np.testing.assert_allclose(distances(packing, free), w, rtol=1e-9)
    first = np.arctan2(*edges.normal[edges.before].T[::-1])
    for share in (0.08, 0.45, 0.9):
        line = edges.tail + share * edges.length[:, None] * edges.along + w * edges.normal
        turned = first + share * edges.turn
        arc = edges.tail + w * np.column_stack([np.cos(turned), np.sin(turned)])
        points = np.concatenate([line, arc[edges.turn > 0]])
        visible = points[distances(packing, points) > w * (1 - 1e-12)]
        assert all(on_a_piece(pieces, point) for point in visible)


@given(disks() | polygons())
def test_voids_are_sums_over_their_pieces(packing):
    try:
        found = voids(packing)
    except BoundaryError:
        return
    pieces, boundary = found.boundary.pieces, found.boundary
    for void in range(len(found.area)):
        own = np.flatnonzero(found.void == void)
        p, q = (x[own] + found.image[own] @ packing.box for x in (pieces.start, pieces.end))
        length = np.where(pieces.radius[own] > 0, pieces.radius[own] * pieces.angle[own], np.hypot(*(q - p).T))
        np.testing.assert_allclose(found.perimeter[void], length.sum(), rtol=1e-12)
        if found.percolating[void]:
            assert found.sides[void] <= len(np.unique(pieces.particle[own]))
            continue
        angle, radius = pieces.angle[own], pieces.radius[own]
        wedge = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
        area = -np.sum(0.5 * wedge + 0.5 * radius**2 * (angle - np.sin(angle)))
        np.testing.assert_allclose(found.area[void], area, atol=1e-12 * packing.area)
        ring = [inner_points(pieces, share)[own] + found.image[own] @ packing.box for share in np.linspace(0, 1, 400)]
        a, b = np.concatenate(ring[:-1]) - p[0], np.concatenate(ring[1:]) - p[0]
        wedges = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])[:, None]
        centre = p[0] + np.sum((a + b) * wedges, axis=0) / (3 * np.sum(wedges))
        apart = np.linalg.solve(packing.box.T, centre - found.centroid[void])
        moment = found.area[void] * np.hypot(*((apart - np.rint(apart)) @ packing.box))
        assert moment < 2e-5 * packing.area**1.5  # arcs drawn as polygons
        if not found.islands[void]:
            corners = {(*row,) for row in np.column_stack([pieces.particle[own], found.image[own]])[length > 1e-8]}
            assert len(corners) == found.sides[void]
    inward = np.unique(boundary.following)
    np.testing.assert_array_equal(inward, np.arange(len(inward)))


def same_as_plain(packing):
    found, (pieces, following) = droplet_cover(packing), plain_pieces(packing)
    np.testing.assert_array_equal(found.following, following)
    for name, wanted in vars(pieces).items():
        np.testing.assert_allclose(getattr(found.pieces, name), wanted, atol=1e-12 * packing.box.max(), err_msg=name)


@given(polygons())
def test_pieces_of_droplets_are_those_of_plain_numpy(packing):
    assume(droplet_cover(packing).meeting is Meeting.APART)
    same_as_plain(packing)


@pytest.mark.parametrize("state", ["compressed_droplets", "stable_droplets", "droplets_on_a_saddle"])
def test_pieces_of_states_are_those_of_plain_numpy(state):
    same_as_plain(jamlab.read(STATES / f"{state}.h5"))


def hostile_rings(rng, box, grid):
    """Stars anywhere: they cross, hold each other and their own images, share corners and edges on a grid."""
    for _ in range(rng.integers(1, 4)):
        turn = np.sort(rng.uniform(0, TURN, rng.integers(3, 10)))
        reach = rng.uniform(0.1, 0.6, (len(turn), 1)) * np.column_stack([np.cos(turn), np.sin(turn)])
        ring = rng.uniform(-1, 2, 2) @ box + reach
        yield np.round(ring * grid) / grid if grid else ring


@pytest.mark.parametrize("grid", [None, 8])
def test_shares_of_any_polygons_are_those_of_drawn_ones(grid):
    rng, meetings = np.random.default_rng(3), set()
    for _ in range(60):
        side = rng.uniform(0.8, 2.0)
        box = side * np.array([[1.0, 0.0], [rng.choice([0.0, 0.4, -1.3]), rng.uniform(0.6, 1.6)]])
        try:
            packing = droplets(list(hostile_rings(rng, box, grid)), rng.choice([0.02, 0.3]), box)
        except InputError:
            continue
        found, w = droplet_cover(packing), 0.5 * packing.params["delta"]
        assert found.gap < 1e-9 * w
        if found.area.sum() < 1.6 * packing.area:  # drawn overlaps take long where many cover a point
            np.testing.assert_allclose(found.share, drawn_shares(packing), atol=1e-4 * w**2 + 1e-9)
            meetings.add(found.meeting)
    assert {Meeting.APART, Meeting.CROSSING} <= meetings


def test_squares_in_one_place_share_it():
    """All their outlines coincide, so that vertices move by 1e-10 of the rim."""
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    packing = droplets([square, square, square + np.array([0.5, 0.0])], 0.1, 4 * np.eye(2))
    first, second, _ = shared_areas(packing)
    np.testing.assert_allclose(first, second, atol=2e-11)
    np.testing.assert_allclose(shared_areas(packing).sum(), 1.5 + 5 * 0.05 + np.pi * 0.0025, atol=2e-11)


def bumpy(vertices, seed, size=0.42):
    rng, turn = np.random.default_rng(seed), TURN * np.arange(vertices) / vertices
    return size * (1 + 0.2 * rng.uniform(-1, 1, (vertices, 1))) * np.column_stack([np.cos(turn), np.sin(turn)])


@pytest.mark.parametrize("parts", [2, 7, 60])
def test_collinear_vertices_change_nothing(parts):
    """One edge as long as fifty others, whole or in parts."""
    plank = np.array([[0.0, 0.0], [25.0, 0.0], [25.0, 0.7], [0.0, 0.7]])
    cut = np.concatenate([np.linspace(a, b, parts + 1)[:-1] for a, b in zip(plank, np.roll(plank, -1, 0), strict=True)])
    balls = [np.add(bumpy(12, k, 0.38), [1.0 + k, 1.35]) for k in range(24)]
    found = [voids(droplets([ring + 0.1, *balls], 0.2, [[26.0, 0.0], [3.0, 1.9]])) for ring in (plank, cut)]
    np.testing.assert_allclose(np.sort(found[0].area), np.sort(found[1].area), atol=1e-12)
    np.testing.assert_array_equal(np.sort(found[0].sides), np.sort(found[1].sides))


def test_edges_over_too_many_images_are_refused():
    ring = np.array([[0.0, 0.0], [200.0, 0.0], [200.0, 1.0], [0.0, 1.0]])
    with pytest.raises(InputError, match="box"):
        voids(droplets([ring], 0.1, 0.04 * np.eye(2)))


def test_pieces_that_follow_each_other_share_an_end():
    """At onset outlines graze, where an end is known to sqrt(rounding), but from both sides alike."""
    packing = jamlab.read(STATES / "droplets_at_onset.h5")
    boundary = voids(packing).boundary
    pieces = boundary.pieces
    gap = (pieces.end - pieces.start[boundary.following]) @ np.linalg.inv(packing.box)
    np.testing.assert_allclose(gap - np.round(gap), 0.0, atol=2e-15)


@pytest.mark.parametrize("delta", [1e-15, 1e-12, 1e-9])
def test_voids_of_rims_thinner_than_rounding_of_coordinates(delta):
    """A dented polygon is an island: its concave corners close, and the ray beside its tip meets it from outside."""
    rng, box = np.random.default_rng(5), np.array([[2.0, 0.0], [0.6, 2.0]])
    for _ in range(20):
        turn = 2 * np.pi * (np.arange(7) + rng.uniform(-0.3, 0.3, 7)) / 7
        ring = rng.uniform(0.3, 0.8, (7, 1)) * np.column_stack([np.cos(turn), np.sin(turn)]) + rng.uniform(-2, 2, 2)
        packing = droplets([ring], delta, box)
        found = jamlab.voids(packing)
        assert found.area.tolist() == [pytest.approx(packing.area - packing.polygons.areas[0], rel=1e-8)]


def test_ray_beside_a_thin_tip():
    """The highest vertex is the rightmost one: a ray from there along x meets the tip of the next image."""
    box = np.array([[4.34088317, 0.0], [0.0, 6.1]])
    ring = np.array([[1.19713154, 0.8480542], [1.2949115764, 1.2055948121], [0.85400211, 1.15820266]])
    for move in np.linspace(0, 1, 20):
        packing = droplets([ring + move], 4.3e-9, box)
        found = jamlab.voids(packing)
        assert found.area.tolist() == [pytest.approx(packing.area - packing.polygons.areas[0], rel=1e-8)]
