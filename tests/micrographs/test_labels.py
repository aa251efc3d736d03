"""Labels of other programs: known pictures come back; what rules change does too; no good number is wrong."""

import json

import label_masks
import numpy as np
import pytest
from commands import call
from label_masks import FAULTS, judge, judged, seen, wrong
from PIL import Image

import jamlab
from jamlab.micrographs.labels import looks_labelled, read_labels, sort_objects

pytest.importorskip("skimage")
RADIUS, SPACING = 14.0, 28.5
Y, X = np.mgrid[:250, :256] + 0.5


@pytest.fixture(scope="module")
def drawn():
    """Circles of a square lattice whose outermost are cut, 36 of them whole."""
    column, row = np.floor((X + 10) / SPACING), np.floor((Y + 13) / SPACING)
    away = np.hypot((X + 10) % SPACING - SPACING / 2, (Y + 13) % SPACING - SPACING / 2)
    labels = np.where(away < RADIUS, row * 10 + column + 1, 0).astype(int)
    sizes = np.bincount(labels.ravel())[label_masks.inner(labels)]
    share = np.pi * (RADIUS / SPACING) ** 2
    truth = {"count": len(sizes), "area": np.pi * RADIUS**2, "rho": share, "z": 4.0}
    return labels, truth, np.sort(sizes)


EXACT = ("specks", "holes", "large holes", "wrapped numbers", "labelled ground")


@pytest.mark.parametrize("fault", FAULTS)
def test_no_good_number_is_wrong(drawn, fault):
    labels, truth, sizes = drawn
    faulty, scale = FAULTS[fault](labels, np.random.default_rng(1)), 4 if fault == "twice the pixels" else 1
    truth = truth | {"area": truth["area"] * scale}
    found = seen(faulty)
    row = judged(found, truth)
    assert wrong(row, truth) == []
    if fault.startswith("inverted"):
        assert {quality for _, quality in row.values()} == {"doubtful"}
    if fault in EXACT:
        np.testing.assert_allclose(np.sort(found.areas), sizes, atol=3)
        assert found.label_notes


@pytest.mark.parametrize("count", [1, 4])
def test_each_label_that_is_two_droplets_counts_as_doubtful(drawn, count):
    labels, truth, _ = drawn
    off, quality = judge(label_masks.merged(labels, np.random.default_rng(2), count), truth)["count"]
    assert off < 0 and (quality == "good") == (1 - off <= 0.1 * truth["count"])


def test_turned_labels_have_the_same_z(drawn):
    assert jamlab.micrograph(labels=drawn[0].T[::-1]).z == pytest.approx(jamlab.micrograph(labels=drawn[0]).z, abs=0.2)


def test_walls_of_a_cell_are_not_seen_and_leave_z_doubtful():
    """Of k x k circles of a square lattice 2 N_c/N is 4 (k - 1)/k."""
    k, spacing = 6, 28.0
    inside = (X > 20) & (X < 20 + k * spacing) & (Y > 20) & (Y < 20 + k * spacing)
    away = np.hypot((X - 20) % spacing - spacing / 2, (Y - 20) % spacing - spacing / 2)
    circles = (away < RADIUS) & inside
    names = np.where(circles, 1 + (X - 20) // spacing + k * ((Y - 20) // spacing), 0).astype(int)
    found = jamlab.micrograph(labels=names)
    assert found.count == k**2 and found.z_all == pytest.approx(4 * (k - 1) / k)
    assert found.numbers["z"].quality == found.numbers["rho"].quality == "doubtful"


def disc(x, y, radius):
    return np.hypot(X - x, Y - y) < radius


def numbered(*masks):
    """Labels of masks, the later ones on top."""
    labels = np.zeros(X.shape, dtype=np.int64)
    for number, mask in enumerate(masks, 1):
        labels[mask] = number
    return labels


def test_what_is_kept():
    """Each of these is a droplet, though a rule comes near to it."""
    places = [(20 + 40 * k, 60 + 80 * (k % 2)) for k in range(6)]
    sizes = numbered(*(disc(x, y, 4.2 * 1.35**k) for k, (x, y) in enumerate(places)))  # small
    objects, notes = sort_objects(sizes)
    assert objects.max() == 6 and notes == []
    two = numbered(*(disc(x, y, (8, 18)[k % 2]) for k, (x, y) in enumerate(places)))  # a sixth of the area
    assert sort_objects(two)[1] == []
    beside = numbered(disc(80, 80, 20), (abs(X - 102) < 2) & (abs(Y - 80) < 15))
    assert sort_objects(beside)[0].max() == 2


def test_labels_are_not_read_as_a_photograph(tmp_path, drawn):
    labels = drawn[0]
    rng = np.random.default_rng(1)
    colours = rng.integers(20, 256, (labels.max() + 1, 3)).astype(np.uint8)[labels]
    pictures = {"labels": labels, "floats": 1.0 * labels, "mask": labels > 0, "colours": colours}
    assert {name: looks_labelled(values) for name, values in pictures.items()} == dict.fromkeys(pictures, True)
    soft = (200 / (1 + np.exp(np.hypot(X % 30 - 15, Y % 30 - 15) - 13))).astype(np.uint8)
    noise = rng.integers(0, 9, labels.shape)
    for values in (soft, X.astype(int), (labels > 0) * 1.0, noise, np.dstack([soft] * 3)):
        assert not looks_labelled(values)
    Image.fromarray(labels.astype(np.uint16)).save(tmp_path / "mask.tif")
    refused = call(tmp_path, "analyze", "mask.tif")
    assert refused.exit_code == 1 and "--labels" in refused.stderr
    shown = json.loads(call(tmp_path, "analyze", "--labels", "mask.tif", "--json").stdout)
    assert shown["contrast"] == "labels" and shown["count"] == [drawn[1]["count"]]
    assert call(tmp_path, "analyze").exit_code == 1


@pytest.mark.parametrize("radius", [2.5, 3.3])
def test_a_class_of_small_droplets_leaves_no_good_number(radius):
    """Large droplets in rows with a small one in every gap: too small to be told from debris."""
    y, x = np.mgrid[:330, :330]
    labels = np.zeros((330, 330), dtype=int)
    for k, (row, column) in enumerate((row, column) for row in range(7) for column in range(7)):
        labels[np.hypot(x - 28 - 45 * column, y - 28 - 45 * row) <= 20] = 1 + 2 * k
        labels[np.hypot(x - 50.5 - 45 * column, y - 50.5 - 45 * row) <= radius] = 2 + 2 * k
    numbers = jamlab.micrograph(labels=labels).numbers
    for name, truth in (("count", 98), ("area", (labels > 0).sum() / 98)):
        assert numbers[name].reasons or abs(numbers[name].value / truth - 1) <= 0.1


# a lattice of touching circles ----------------------------------------------------------------------------------------

WIDE = 16.0
ROW, COLUMN = np.mgrid[:200, :220] + 0.5


def distance():
    """(h, w) distance to the nearest circle of a square lattice, positive outside, and number of the circle from 1."""
    column, row = np.floor(COLUMN / (2 * WIDE)), np.floor(ROW / (2 * WIDE))
    away = np.hypot(COLUMN - 2 * WIDE * (column + 0.5), ROW - 2 * WIDE * (row + 0.5)) - WIDE
    return away, (row * 100 + column + 1).astype(int)


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


@pytest.mark.parametrize("kind", ["tif8", "tif16", "tif32", "npy", "palette", "mask", "grey rgb"])
def test_files_of_labels(tmp_path, numbers, kind):
    small = np.unique(numbers, return_inverse=True)[1].reshape(numbers.shape)
    path = tmp_path / f"mask.{'npy' if kind == 'npy' else 'tif' if kind.startswith('tif') else 'png'}"
    if kind.startswith("tif"):
        pytest.importorskip("tifffile").imwrite(path, small.astype(f"uint{kind[3:]}"))
    elif kind == "npy":
        np.save(path, numbers)
    elif kind == "palette":
        image = Image.fromarray(small.astype(np.uint8)).convert("P")
        image.putpalette(np.random.default_rng(1).integers(0, 255, 768).tolist())
        image.putdata(small.ravel().tolist())
        image.save(path)
    else:
        apart = distance()[0] < -1.5
        value = small.astype(np.uint8) if kind == "grey rgb" else (apart * 255).astype(np.uint8)
        Image.fromarray(np.dstack([value] * 3) if kind == "grey rgb" else value).save(path)
    assert read_labels(path, numbers.shape)[0].max() == small.max()


@pytest.mark.parametrize("line", [0.0, 1.0, 2.5, 5.0])
def test_lines_of_any_width_between_labels_are_films(line):
    """Circles of a square lattice touch their four neighbours, however wide the line that hands leave."""
    labels = np.where(distance()[0] < -line / 2, distance()[1], 0)[10:, 10:]  # the edge cuts and holds the outer ones
    found = jamlab.micrograph(labels=labels)
    assert found.z == 4.0
    assert found.film == pytest.approx(line, abs=1.6)  # walls of circles widen within the 2.5 pixels of a mean
    wide = found.film > 0.35 * (WIDE - line / 2)
    assert any("touch is a guess" in reason for reason in found.reasons) == wide


def test_a_mask_of_truth_values_is_one_of_numbers(numbers):
    apart = distance()[0] < -1.5
    found, same = jamlab.micrograph(labels=apart), jamlab.micrograph(labels=255 * apart)
    assert found.count == same.count > 1 and found.rho == same.rho
