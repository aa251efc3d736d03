"""Periodic neighbours against brute force over lattice translations."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from jamlab.errors import InputError
from jamlab.packing.neighbors import (
    periodic_copies,
    periodic_neighbors,
    periodic_pairs,
    shortest_images,
)

SQUARE = np.eye(2)


def brute_force(a, b, box, cutoff, layers):
    """Rows (i, j, s0, s1) of every image within the cutoff, trying all |s| <= layers."""
    s = np.stack(np.meshgrid(*[np.arange(-k, k + 1) for k in layers], indexing="ij"), axis=-1).reshape(-1, 2)
    r = b[None, :, None, :] - a[:, None, None, :] + (s @ box)
    i, j, image = np.nonzero(np.hypot(r[..., 0], r[..., 1]) < cutoff)
    return np.column_stack([i, j, s[image]])


def rows(pairs):
    return np.column_stack([pairs.i, pairs.j, pairs.shift])


@st.composite
def scenes(draw):
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    tilt = draw(st.sampled_from([0.0, 0.3, 0.5, -0.5, 0.8, -1.7, 4.2]))
    box = np.array([[1.0, 0.0], [tilt, draw(st.sampled_from([0.4, 1.0, 2.5]))]])
    spread = draw(st.sampled_from([1.0, 3.0]))
    a, b = (spread * rng.uniform(-0.5, 1.5, (draw(st.integers(1, 5)), 2)) @ box for _ in range(2))
    return a, b, box, draw(st.sampled_from([0.05, 0.3, 0.7, 1.1, 1.9]))


def layers_for(a, b, box, cutoff):
    """Enough translations for brute force: extent of the points and the cutoff, along y, then along x."""
    extent = np.ptp(np.concatenate([a, b]), axis=0) + cutoff
    along_y = int(np.ceil(extent[1] / box[1, 1]))
    along_x = int(np.ceil((extent[0] + along_y * abs(box[1, 0])) / box[0, 0]))
    return along_x, along_y


@given(scenes())
def test_neighbors_are_those_of_brute_force(scene):
    a, b, box, cutoff = scene
    found = periodic_neighbors(a, b, box, cutoff)
    expected = brute_force(a, b, box, cutoff, layers_for(*scene))
    np.testing.assert_array_equal(rows(found), expected[np.lexsort(expected.T[::-1])])
    np.testing.assert_allclose(found.r, b[found.j] - a[found.i] + found.shift @ box, atol=1e-14)


def test_vector_keeps_the_precision_of_nearby_points():
    gap = 1e-13
    far = np.array([[1000.25, 0.5], [1000.25 + 2 * gap, 0.5]])
    pairs = periodic_pairs(far, SQUARE, 0.1)
    assert pairs.r[0, 0] == far[1, 0] - far[0, 0] > 0
    across = periodic_pairs(np.array([[1e-13, 0.0], [-1e-13, 0.0]]), SQUARE, 0.1)  # wrapped to both ends of the cell
    np.testing.assert_array_equal(across.r, [[-2e-13, 0.0]])


def test_cutoff_is_strict_and_coincident_points_are_neighbors():
    points = np.array([[0.25, 0.25], [0.5, 0.25], [0.25, 0.25]])
    pairs = periodic_pairs(points, SQUARE, 0.25)
    assert rows(pairs).tolist() == [[0, 2, 0, 0]]
    assert len(periodic_pairs(points, SQUARE, np.nextafter(0.25, 1)).i) == 3


def test_no_points_have_no_neighbors():
    empty = np.empty((0, 2))
    assert periodic_pairs(empty, SQUARE, 1.0).r.shape == (0, 2)
    assert periodic_neighbors(empty, np.zeros((1, 2)), SQUARE, 1.0).shift.shape == (0, 2)


def test_cutoffs_and_points_that_no_search_can_take_are_refused():
    for cutoff in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(InputError, match=str(cutoff).removesuffix(".0")):
            periodic_pairs(np.zeros((1, 2)), SQUARE, cutoff)
    with pytest.raises(InputError):
        periodic_pairs(np.zeros((1, 2)), SQUARE, 1e5)
    with pytest.raises(InputError):
        periodic_pairs(np.array([[1e17, 0.0]]), SQUARE, 0.5)


@given(scenes(), st.integers(0, 2**32 - 1))
def test_cutoffs_that_vary_are_the_sums_of_reaches(scene, seed):
    points, _, box, cutoff = scene
    reach = cutoff * np.random.default_rng(seed).choice([0.1, 0.5, 1.0], len(points))
    whole = periodic_pairs(points, box, 2 * cutoff)
    kept = np.hypot(*whole.r.T) < reach[whole.i] + reach[whole.j]
    np.testing.assert_array_equal(rows(periodic_pairs(points, box, reach)), rows(whole)[kept])


@pytest.mark.parametrize("flat", [1e-4, 1e4])
def test_flat_boxes_with_many_points_have_the_pairs_of_brute_force(flat):
    points = np.random.default_rng(2).random((40, 2)) * [1.0, flat]
    box = np.diag([1.0, flat])
    cutoff = 0.3 * min(1.0, flat)
    wanted = brute_force(points, points, box, cutoff, (1, 1))
    wanted = wanted[(wanted[:, 0] < wanted[:, 1])]
    np.testing.assert_array_equal(rows(periodic_pairs(points, box, cutoff)), wanted[np.lexsort(wanted.T[::-1])])


@given(scenes())
def test_copies_are_those_of_brute_force(scene):
    points, _, box, reach = scene
    source, shift = periodic_copies(points, box, reach)
    assert source[: len(points)].tolist() == list(range(len(points)))
    home = points + shift[: len(points)] @ box
    found = set(zip(source.tolist(), *shift.T.tolist(), strict=True))
    assert len(found) == len(source)
    for a in home:  # whatever lies within reach of a point of the cell is among the copies
        near = brute_force(a[None], points, box, reach, layers_for(a[None], points, box, reach))
        assert {(j, s, t) for _, j, s, t in near.tolist()} <= found


def test_shortest_images_are_those_of_brute_force():
    """Any tilt, vectors many boxes long; one that is shortest, or as short as another image, stays as it is."""
    rng = np.random.default_rng(3)
    images = np.stack(np.meshgrid(np.arange(-130, 131), np.arange(-12, 13), indexing="ij"), axis=-1).reshape(-1, 2)
    for _ in range(60):
        width = rng.uniform(0.3, 3)
        box = np.array([[width, 0.0], [width * rng.uniform(-5, 5), rng.uniform(0.3, 3)]])
        vectors = rng.uniform(-2, 2, (20, 2)) @ box
        short = vectors - shortest_images(vectors, box) @ box
        least = np.hypot(*(vectors[:, None] + images @ box).transpose(2, 0, 1)).min(axis=1)
        np.testing.assert_allclose(np.hypot(*short.T), least, rtol=1e-11)
        assert not shortest_images(short, box).any()
    assert shortest_images(np.array([[0.5, -0.5], [0.51, 0.0]]), SQUARE).tolist() == [[0, 0], [1, 0]]
