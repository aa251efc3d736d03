"""Outlines in any lattice: what is whole stays as it is, what the box cuts becomes whole again."""

import numpy as np
import pytest

import jamlab
from jamlab.errors import InputError

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


def test_rings_that_the_box_cuts_become_whole():
    """Edges below half of the shortest lattice vector."""
    rng = np.random.default_rng(1)
    for turn in range(150):
        box, shortest = lattice(rng)
        ring = star(rng, shortest * 0.24, rng.integers(3, 12)) + rng.random(2) @ box
        cut = wrapped_into(box, ring, bool(turn % 2))
        edges = np.roll(cut, -1, axis=0) - cut
        perimeter = np.hypot(*(edges[:, None] + IMAGES @ box).transpose(2, 0, 1)).min(axis=1).sum()
        p = jamlab.from_outlines([cut], box, wrapped=True)
        unit = box[0, 0] / p.box[0, 0]
        assert unit * p.perimeters[0] == pytest.approx(perimeter, rel=1e-11)
        x, y = (ring - ring[0]).T
        area = 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))
        assert unit**2 * p.polygon_areas[0] == pytest.approx(area, rel=1e-9)


def test_rings_that_are_whole_keep_their_bits():
    """By default also edges that leading through the box would shorten."""
    rng = np.random.default_rng(2)
    for _ in range(50):
        box, shortest = lattice(rng)
        long = rectangle(shortest * rng.uniform(0.5, 0.97), shortest * rng.uniform(0.1, 0.4), rng.random(2) @ box)
        for ring, how in ((star(rng, 0.2 * shortest, 9) - 2 * box[0], True), (long, False)):
            p = jamlab.from_outlines([ring], box, wrapped=how, rest_areas=[1.0])
            assert np.array_equal(p.positions, ring)


@pytest.mark.parametrize("tilt", [0.0, 1.5, 5.0, -4.0])
def test_droplets_that_files_hold_come_back_from_a_universe_and_as_outlines(tmp_path, tilt):
    box = np.array([[1.0, 0.0], [tilt, 1.0]])
    rings = [rectangle(0.6, 0.35, [0.1, 0.1]), rectangle(0.2, 0.2, [0.9, 0.6])]
    areas = np.array([0.21, 0.04])
    p = jamlab.from_outlines(rings, box, rest_areas=areas)
    unit = np.sqrt(areas).mean()
    assert p.polygon_areas == pytest.approx(areas / unit**2) and p.perimeters * unit == pytest.approx([1.9, 0.8])
    jamlab.write(tmp_path / "p.dump", [p])
    jamlab.write(tmp_path / "p.data", p)
    p.write(tmp_path / "p.h5")
    for name in ("p.dump", "p.data", "p.h5"):
        assert jamlab.read(tmp_path / name).positions == pytest.approx(p.positions, abs=1e-15)
        (q,) = jamlab.from_universe(jamlab.universe(tmp_path / name))
        assert q.positions == pytest.approx(p.positions, abs=1e-5)
    again = jamlab.from_outlines(np.split(p.positions, p.offsets[1:-1]), p.box, rest_areas=p.params["a0"])
    assert again.positions == pytest.approx(p.positions, rel=1e-12)


def test_a_first_vertex_that_is_repeated_at_the_end_is_no_vertex():
    ring = rectangle(0.2, 0.3, 0.1)
    p = jamlab.from_outlines([np.vstack([ring, ring[0]]), ring + 0.4], [1.0, 1.0])
    assert np.diff(p.offsets).tolist() == [4, 4]


@pytest.mark.parametrize(
    "act, word",
    [
        (lambda: jamlab.from_outlines([rectangle(0.1, 0.1, 0)], [1.0, 1.0], vertices=7), "vertices"),
        (lambda: jamlab.from_outlines([rectangle(0.1, 0.1, 0)], [1.0, 0.0]), "box"),
        (lambda: jamlab.from_outlines([rectangle(0.3, 0.3, 0), rectangle(0.3, 0.3, 0.1)], [1.0, 1.0]), "0 and 1"),
        (lambda: jamlab.from_outlines([[[0, 0.5], [1, 0.5], [2, 0.5]]], [3.0, 3.0], wrapped=True), "polygon 0"),
    ],
)
def test_what_is_no_outline_is_refused(act, word):
    with pytest.raises(InputError) as caught:
        act()
    assert word in str(caught.value)
