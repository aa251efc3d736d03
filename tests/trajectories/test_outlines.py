"""Outlines in any lattice: what is whole stays as it is, what the box cuts becomes whole again."""

import numpy as np
import pytest

import jamlab
from jamlab.errors import InputError
from jamlab.packing.outlines import polygon_areas
from jamlab.trajectories.sites import Rings

IMAGES = np.array([[i, j] for i in range(-60, 61) for j in range(-7, 8)])


def star(rng, reach, count):
    """A ring around the origin, no vertex of which is farther away than `reach`."""
    angle = 2 * np.pi * (np.arange(count) + rng.uniform(-0.2, 0.2, count) + rng.random()) / count
    return reach * rng.uniform(0.6, 1.0, (count, 1)) * np.column_stack([np.cos(angle), np.sin(angle)])


def rectangle(width, height, at):
    return np.array([[0, 0], [width, 0], [width, height], [0, height]]) + at


def wrapped_into(box, ring, rectangular=False):
    if rectangular:  # as codes do that keep x and y below the sides of a sheared box
        ring = ring - np.floor(ring[:, 1:] / box[1, 1]) * box[1]
        return ring - np.floor(ring[:, :1] / box[0, 0]) * box[0]
    return ring - np.floor(ring @ np.linalg.inv(box)) @ box


def lattice(rng):
    """A box of any tilt up to five widths, and the length of its shortest lattice vector."""
    width = rng.uniform(0.5, 2)
    box = np.array([[width, 0.0], [width * rng.uniform(-5, 5), rng.uniform(0.5, 2)]])
    vectors = IMAGES @ box
    return box, np.hypot(*vectors[np.any(IMAGES, axis=1)].T).min()


def one_ring(ring, box, wrapped):
    return Rings(np.arange(len(ring)), np.array([0, len(ring)])).polygons(ring, box, wrapped)


def test_rings_that_the_box_cuts_become_whole():
    """Edges below half of the shortest lattice vector."""
    rng = np.random.default_rng(1)
    for turn in range(150):
        box, shortest = lattice(rng)
        ring = star(rng, shortest * 0.24, rng.integers(3, 12)) + rng.random(2) @ box
        found = one_ring(wrapped_into(box, ring, bool(turn % 2)), box, True)
        moved = (found - ring) @ np.linalg.inv(box)
        np.testing.assert_allclose(moved, np.rint(moved[:1]).repeat(len(ring), axis=0), atol=1e-10)


def test_rings_that_are_whole_keep_their_bits():
    """Of droplets that are said to be whole also edges that leading through the box would shorten."""
    rng = np.random.default_rng(2)
    for _ in range(50):
        box, shortest = lattice(rng)
        long = rectangle(shortest * rng.uniform(0.5, 0.97), shortest * rng.uniform(0.1, 0.4), rng.random(2) @ box)
        for ring, wrapped in ((star(rng, 0.2 * shortest, 9) - 2 * box[0], True), (long, False)):
            assert np.array_equal(one_ring(ring, box, wrapped), ring)
    clockwise = one_ring(long[::-1], box, False)
    assert np.array_equal(clockwise[0], long[-1]) and polygon_areas(clockwise, np.array([0, 4]))[0] > 0
    with pytest.raises(InputError):  # around the box
        one_ring(np.array([[0, 0.5], [1, 0.5], [2, 0.5]]), 3 * np.eye(2), True)


@pytest.mark.parametrize("tilt", [0.0, 1.5, 5.0, -4.0])
def test_droplets_that_files_hold_come_back_from_a_universe(tmp_path, tilt):
    rings = [rectangle(0.6, 0.35, [0.1, 0.1]), rectangle(0.2, 0.2, [0.9, 0.6])]
    law = {"gamma": 0.4, "ka": 100.0, "eps": 1.0, "delta": 0.02, "eta": 0.0, "contact": "outline"}
    law["a0"] = np.array([0.21, 0.04])
    p = jamlab.Packing("dp", [[1.0, 0.0], [tilt, 1.0]], np.concatenate(rings), law, offsets=[0, 4, 8])
    jamlab.write(tmp_path / "p.dump", [p])
    jamlab.write(tmp_path / "p.data", p)
    jamlab.write(tmp_path / "p.h5", p)
    for name in ("p.dump", "p.data", "p.h5"):
        assert jamlab.read(tmp_path / name).positions == pytest.approx(p.positions, abs=1e-15)
        (q,) = jamlab.from_universe(jamlab.universe(tmp_path / name))
        assert q.positions == pytest.approx(p.positions, abs=1e-5)
