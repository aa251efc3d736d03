"""Droplets with dark walls, and labels of other programs: known pictures come back, what is wrong is refused."""

import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from scipy import ndimage

import jamlab
from jamlab.errors import InputError
from jamlab.micrographs.labels import read_labels
from jamlab.micrographs.ring_segmentation import compactness, find_rings

pytest.importorskip("skimage")
RADIUS = 16.0
Y, X = np.mgrid[:200, :220] + 0.5


def distance(gap=0.0):
    """(h, w) distance to the nearest circle of a square lattice, positive outside, and number of the circle from 1."""
    a = 2 * RADIUS + gap
    column, row = np.floor(X / a), np.floor(Y / a)
    away = np.hypot(X - a * (column + 0.5), Y - a * (row + 0.5)) - RADIUS
    return away, (row * 100 + column + 1).astype(int)


def ring_picture(gap=6.0, wall=1.5, noise=0.0, light=1.0):
    """Bright droplets, bright ground, dark walls."""
    away, _ = distance(gap)
    picture = 1 - 0.8 * np.exp(-0.5 * (away / wall) ** 2)
    picture = picture * np.linspace(1, light, X.shape[1])
    return picture + noise * np.random.default_rng(1).normal(size=X.shape)


@pytest.fixture(scope="module")
def rings():
    return jamlab.micrograph(ring_picture(noise=0.02, light=0.6))


def test_rings_are_seen_as_such_and_borders_are_no_droplets(rings):
    a = 2 * RADIUS + 6.0
    assert rings.contrast == "ring"
    assert rings.count == (Y.max() // a) * (X.max() // a)
    # a droplet ends half a pixel within the darkest line of its wall
    np.testing.assert_allclose(np.sqrt(rings.areas / np.pi), RADIUS - 0.5, atol=0.3)
    assert np.pi * (RADIUS - 4) ** 2 < rings.interiors.mean() < rings.areas.mean()
    assert rings.interior_fraction < rings.rho
    np.testing.assert_allclose(rings.centres % a, a / 2 - 0.5, atol=0.3)


def test_count_and_area_of_rings_have_intervals_and_their_walls_are_not_known(rings):
    """Of rendered rings to which nothing else objected, some had a wrong z."""
    numbers = rings.numbers
    assert {numbers[name].quality for name in ("rho", "z", "shape_rim", "voids")} == {"doubtful"}
    assert (numbers["count"].value, numbers["area"].value) == (rings.count, rings.interiors.mean())
    # hands draw the edge of the light between the steepest rise, a standard deviation off the line, and the line
    for value, number in ((25, numbers["count"]), (np.pi * (RADIUS - 1.0) ** 2, numbers["area"])):
        low, high = number.interval
        assert low < value < high and high - low < 0.6 * value  # voids of the lattice might be droplets
    assert rings.quality == max(numbers["count"].quality, numbers["area"].quality, key=("good", "doubtful").index)
    same = jamlab.micrograph(labels=np.maximum(rings.labels, 0))
    assert same.numbers["count"].quality == "good" and not any("rings" in reason for reason in same.reasons)


def test_rings_below_the_limit_of_detection_are_told(rings):
    assert rings.measurable.all()
    tiny = replace(rings, interiors=np.where(np.arange(rings.count) < 3, np.pi * 3.9**2, rings.interiors))
    assert np.flatnonzero(~tiny.measurable).tolist() == [0, 1, 2]
    assert replace(tiny, pixel=0.5).measurable.all() and replace(tiny, contrast="labels").measurable.all()


def test_dark_walls_all_around_touching_droplets():
    """Without a gap, four borders around a droplet are as light as it is, and concave."""
    found = find_rings(ring_picture(gap=0.0))
    _, names = distance()
    inner = ndimage.binary_erosion(np.ones(X.shape), iterations=34)
    whole = np.unique(names[inner])
    places = [tuple(np.rint(ndimage.center_of_mass(names == k)).astype(int) * found.finer) for k in whole]
    assert all(found.labels[place] > 0 for place in places)
    corner = int(2 * RADIUS) * found.finer
    assert found.labels[corner, corner] == 0


@pytest.mark.parametrize(("shape", "expected"), [("disc", 1.0), ("square", 3 / np.pi), ("two", 2 / 3)])
def test_compactness_of_known_shapes(shape, expected):
    y, x = np.mgrid[:400, :400] + 0.5
    masks = {
        "disc": np.hypot(x - 200, y - 200) < 90,
        "square": (abs(x - 200) < 90) & (abs(y - 200) < 90),
        "two": np.minimum(np.hypot(x - 110, y - 200), np.hypot(x - 290, y - 200)) < 90,
    }
    x, y = x[masks[shape]], y[masks[shape]]
    sums = np.array([len(x), x.sum(), y.sum(), (x * x).sum(), (y * y).sum()])
    assert compactness(sums, np.zeros(4, dtype=bool), (400, 400)) == pytest.approx(expected, rel=2e-3)


@pytest.fixture(scope="module")
def numbers():
    away, names = distance()
    return np.where(away < 0, names, 0)


def test_labels_come_back_exactly(numbers):
    found = jamlab.micrograph(labels=numbers)
    edge = np.unique(np.concatenate([numbers[0], numbers[-1], numbers[:, 0], numbers[:, -1]]))
    whole = np.setdiff1d(np.unique(numbers), edge)
    assert found.count == len(whole) and found.contrast == "labels"
    sizes = np.bincount(numbers.ravel())
    np.testing.assert_array_equal(np.sort(found.areas), np.sort(sizes[whole]))
    assert found.rho == pytest.approx((numbers > 0).mean(), abs=1e-12)
    assert found.z == 4.0 and "4 whole droplets" not in " ".join(found.reasons)


@pytest.mark.parametrize("kind", ["tif8", "tif16", "tif32", "npy", "palette", "mask", "grey rgb", "json"])
def test_files_of_labels(tmp_path, numbers, kind):
    small = np.unique(numbers, return_inverse=True)[1].reshape(numbers.shape)
    path = tmp_path / f"mask.{ {'npy': 'npy', 'json': 'json'}.get(kind, 'tif' if kind.startswith('tif') else 'png') }"
    if kind.startswith("tif"):
        pytest.importorskip("tifffile").imwrite(path, small.astype(f"uint{kind[3:]}"))
    elif kind == "npy":
        np.save(path, numbers)
    elif kind == "palette":
        image = Image.fromarray(small.astype(np.uint8)).convert("P")
        image.putpalette(np.random.default_rng(1).integers(0, 255, 768).tolist())
        image.putdata(small.ravel().tolist())
        image.save(path)
    elif kind == "json":
        whole = jamlab.micrograph(labels=numbers)
        path.write_text(json.dumps([ring.tolist() for ring in whole.outlines]))
        assert len(read_labels(path, numbers.shape).areas) == whole.count
        return
    else:
        apart = distance()[0] < -1.5
        value = small.astype(np.uint8) if kind == "grey rgb" else (apart * 255).astype(np.uint8)
        Image.fromarray(np.dstack([value] * 3) if kind == "grey rgb" else value).save(path)
    assert len(read_labels(path, numbers.shape).areas) == small.max()


def mask(change=lambda on: on):
    return change(distance(4.0)[0] < 0).astype(int)


@pytest.mark.parametrize("line", [0.0, 1.0, 2.5, 5.0])
def test_lines_of_any_width_between_labels_are_films(line):
    """Circles of a square lattice touch their four neighbours, however wide the line that hands leave."""
    labels = np.where(distance()[0] < -line / 2, distance()[1], 0)[10:, 10:]  # the edge cuts and holds the outer ones
    found = jamlab.micrograph(labels=labels)
    assert found.z == 4.0
    assert found.film == pytest.approx(line, abs=1.6)  # walls of circles widen within the 2.5 pixels of a mean
    wide = found.film > 0.2 * RADIUS
    assert any("touch is a guess" in reason for reason in found.reasons) == wide
    assert wide or found.z_range == (4.0, 4.0)


def test_outlines_of_imagej(tmp_path, numbers):
    roifile = pytest.importorskip("roifile")
    whole = jamlab.micrograph(labels=numbers)
    rois = [roifile.ImagejRoi.frompoints(ring, name=str(k)) for k, ring in enumerate(whole.outlines)]
    roifile.roiwrite(tmp_path / "set.zip", rois)
    found = read_labels(tmp_path / "set.zip", numbers.shape)
    np.testing.assert_allclose(np.sort(found.areas), np.sort(whole.areas), rtol=0.05)
    (tmp_path / "torn.zip").write_bytes((tmp_path / "set.zip").read_bytes()[:90])
    with pytest.raises(InputError):
        read_labels(tmp_path / "torn.zip", numbers.shape)


def test_a_mask_of_truth_values_is_one_of_numbers(numbers):
    apart = distance()[0] < -1.5
    found, same = jamlab.micrograph(labels=apart), jamlab.micrograph(labels=255 * apart)
    assert found.count == same.count > 1 and found.rho == same.rho
    np.testing.assert_array_equal(found.interiors, found.areas)
