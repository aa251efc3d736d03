"""Droplets with dark walls, and labels of other programs: known pictures come back, what is wrong is refused."""

import json

import numpy as np
import pytest
from commands import call
from PIL import Image
from scipy import ndimage

import jamlab
from jamlab.errors import InputError
from jamlab.micrographs.labels import labelled, read_labels
from jamlab.micrographs.micrograph import find_contrast
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
    np.testing.assert_allclose(rings.centres % a, a / 2 - 0.5, atol=0.3)


def test_rings_are_always_doubted(rings):
    """Of rendered rings to which nothing else objected, some had a wrong z."""
    assert rings.quality == "doubtful" and "droplets are rings" in rings.reasons[0]
    same = jamlab.micrograph(labels=np.maximum(rings.labels, 0))
    assert not any("rings" in reason for reason in same.reasons)


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


def test_half_a_disc_at_the_edge_is_as_compact_as_its_mirror_image():
    y, x = np.mgrid[:200, :100] + 0.5
    on = np.hypot(x, y - 100) < 60
    sums = np.array([on.sum(), x[on].sum(), y[on].sum(), (x[on] ** 2).sum(), (y[on] ** 2).sum()])
    cut = np.array([True, False, False, False])
    assert compactness(sums, cut, on.shape) == pytest.approx(1, rel=2e-3)
    assert compactness(sums, ~cut & False, on.shape) < 0.8


def test_bright_and_dark_droplets_are_no_rings():
    away, _ = distance(6.0)
    bright = 1 / (1 + np.exp(away))
    assert find_contrast(bright) == "bright" and find_contrast(1 - bright) == "dark"


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


def test_rotated_and_renumbered_labels_say_the_same(numbers):
    found, turned = jamlab.micrograph(labels=numbers), jamlab.micrograph(labels=np.rot90(numbers) * 7)
    assert (turned.count, turned.z) == (found.count, found.z) and turned.rho == pytest.approx(found.rho)
    np.testing.assert_array_equal(np.sort(turned.areas), np.sort(found.areas))


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


@pytest.mark.parametrize(
    ("labels", "message"),
    [
        (np.ones((50, 50), dtype=int), "every pixel has the label 1"),
        (np.zeros((50, 50), dtype=int), "every pixel has the label 0"),
        (-np.eye(50, dtype=int), "lowest label is -1"),
        (np.eye(50) / 2, "whole numbers"),
        (np.full((50, 50), np.nan), "whole numbers"),
        (np.dstack([np.eye(50), np.zeros((50, 50)), np.eye(50)]), "labels are colours"),
        (np.array([["a", "b"]]), "labels"),
        ("nowhere.npy", "nowhere.npy cannot be read as labels"),
        ("nowhere.tif", "nowhere.tif: No such file"),
    ],
)
def test_labels_that_are_none_are_refused(labels, message):
    with pytest.raises(InputError, match=message) as error:
        jamlab.micrograph(labels=labels)
    assert "\n" not in str(error.value)


def test_labels_of_another_size_and_options_that_contradict(numbers):
    with pytest.raises(InputError, match=r"labels are \(200, 220\), the picture is \(60, 60\)"):
        jamlab.micrograph(np.random.default_rng(1).random((60, 60)), labels=numbers)
    with pytest.raises(InputError, match="nothing to find"):
        jamlab.micrograph(labels=numbers, contrast="ring")
    with pytest.raises(InputError, match="give a picture, or labels"):
        jamlab.micrograph()
    with pytest.raises(InputError, match="no colours"):
        jamlab.micrograph(ring_picture(), channel="red")


def test_labels_in_pieces_are_doubted(numbers):
    torn = numbers.copy()
    torn[torn == numbers[80, 80]] = numbers[80, 144]
    assert any("several pieces" in reason for reason in jamlab.micrograph(labels=torn).reasons)
    assert labelled(torn).pieces == 1


def test_command_takes_labels_and_contrast(tmp_path, numbers):
    np.save(tmp_path / "mask.npy", numbers)
    grey = (255 * ring_picture().clip(0, 1)).astype(np.uint8)
    Image.fromarray(grey).save(tmp_path / "photo.png")
    shown = json.loads(call(tmp_path, "analyze", "photo.png", "--labels", "mask.npy", "--json").stdout)
    assert shown["contrast"] == "labels" and shown["z"] == [4.0]
    shown = json.loads(call(tmp_path, "analyze", "photo.png", "--contrast", "ring", "--json").stdout)
    assert shown["contrast"] == "ring"
    done = call(tmp_path, "analyze", "photo.png", "--contrast", "striped")
    assert done.exit_code == 1 and "striped" in done.stderr


def test_old_name_of_contrast_still_works():
    away, _ = distance(2.0)
    with pytest.warns(FutureWarning, match="contrast='bright'"):
        found = jamlab.micrograph(1 / (1 + np.exp(away)), bright=True)
    assert found.contrast == "bright"
