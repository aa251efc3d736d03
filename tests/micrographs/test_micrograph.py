"""Micrographs: a rendered packing comes back with its own numbers; discs in known places; published points."""

import numpy as np
import pytest
from jamlab.figures.synthetic_micrograph import synthetic_micrograph
from PIL import Image

import jamlab
from jamlab.errors import InputError, StorageError
from jamlab.measure import COLUMNS
from jamlab.statistics.published_points import read_points


@pytest.fixture
def skimage():
    return pytest.importorskip("skimage")


def discs(centres, radius, shape=(200, 240)):
    y, x = np.mgrid[: shape[0], : shape[1]] + 0.5
    picture = np.zeros(shape)
    for cx, cy in centres:
        picture = np.maximum(picture, np.clip(radius - np.hypot(x - cx, y - cy) + 0.5, 0, 1))
    return picture


def lattice(gap, radius=20):
    """Hexagonal lattice that the edge of the picture cuts."""
    a = 2 * radius + gap
    k, m = np.meshgrid(np.arange(-6, 12), np.arange(-2, 10))
    centres = np.column_stack([(a * (k + 0.5 * m)).ravel(), (a * np.sqrt(0.75) * m).ravel()])
    return discs(centres + 3, radius)


def test_hexagonal_lattice(skimage):
    found = jamlab.micrograph(lattice(2.0), pixel=0.5)
    assert len(found.areas) >= 10
    np.testing.assert_allclose(found.areas.mean(), np.pi * 10**2, rtol=0.06)  # films and their corners
    np.testing.assert_allclose(found.shape, 1.0, atol=0.006)
    np.testing.assert_allclose(found.cells.mean(), np.sqrt(0.75) * 21**2, rtol=0.01)
    assert found.z == 6.0 and not found.rattlers.any()
    row = found.measure()
    assert set(row) <= set(COLUMNS) and row["z"] == found.z and row["shape"] == found.shape.mean()
    np.testing.assert_allclose(row["rho"], found.areas.sum() / found.cells.sum(), rtol=1e-14)


def test_droplets_apart_have_no_contacts(skimage):
    found = jamlab.micrograph(lattice(8.0))
    assert np.isnan(found.z) and found.rattlers.all() and not found.contacts.any()


def test_dark_droplets(skimage):
    dark, bright = jamlab.micrograph(1 - lattice(2.0), bright=False), jamlab.micrograph(lattice(2.0))
    np.testing.assert_array_equal(dark.areas, bright.areas)


def test_merged_droplets_are_divided(skimage):
    found = jamlab.micrograph(lattice(-3.0))
    assert len(found.areas) >= 10 and found.z == 6.0
    np.testing.assert_allclose(found.cells, np.sqrt(0.75) * 37**2, rtol=0.03)


@pytest.mark.parametrize(("state", "error"), [("dp_onset", 0.6), ("dp_dense", 0.4)])
def test_rendered_packing_comes_back(skimage, request, state, error):
    packing = request.getfixturevalue(state)
    picture = synthetic_micrograph(packing, 300, noise=0.05)
    found = jamlab.micrograph(picture, pixel=packing.box[0, 0] / 300, periodic=True)
    truth = jamlab.measure(packing)
    assert len(found.areas) == packing.n
    assert 0 < found.measure()["rho"] - truth["rho"] < 0.008
    np.testing.assert_allclose(found.cells.sum(), packing.area, rtol=0.01)
    assert abs(found.shape.mean() - truth["shape"]) < 0.008
    assert abs(found.z - truth["z"]) <= error
    # droplet by droplet: nearest centres, local packing fractions
    apart = found.centres[:, None] - packing.centroids
    apart -= np.rint(apart @ np.linalg.inv(packing.box)) @ packing.box
    distance = np.hypot(apart[..., 0], apart[..., 1])
    assert distance.min(axis=1).max() < 0.02 and len(set(distance.argmin(axis=1))) == packing.n
    local = jamlab.local_packing_fraction(packing)[distance.argmin(axis=1)]
    np.testing.assert_allclose(found.local_packing_fraction, local, atol=0.015)


def test_finer_pictures_are_nearer(skimage, dp_dense):
    errors = []
    for pixels in (150, 300):
        picture = synthetic_micrograph(dp_dense, pixels)
        found = jamlab.micrograph(picture, pixel=dp_dense.box[0, 0] / pixels, periodic=True)
        errors.append(found.measure()["rho"] - jamlab.packing_fraction(dp_dense))
    assert 0 < errors[1] < 0.7 * errors[0]


def test_file(skimage, tmp_path):
    grey = (255 * lattice(2.0)).astype(np.uint8)
    Image.fromarray(np.dstack([grey, grey, grey])).save(tmp_path / "picture.png")
    found = jamlab.micrograph(tmp_path / "picture.png")
    np.testing.assert_allclose(found.areas.mean(), jamlab.micrograph(grey).areas.mean(), rtol=1e-3)


@pytest.mark.parametrize(
    ("picture", "options", "message"),
    [
        (np.zeros((20, 20)), {}, "not all the same"),
        (np.full((20, 20), np.nan), {}, "finite"),
        (np.zeros((20, 20, 7)), {}, r"\(20, 20, 7\)"),
        (np.eye(20), {"film": 0.0}, "film is 0"),
        (np.eye(20), {"pixel": -1.0}, "pixel is -1"),
        ("nowhere.png", {}, "nowhere.png cannot be read"),
        (np.pad(np.ones((4, 4)), 40), {}, "no whole droplet"),
    ],
)
def test_refusals(skimage, picture, options, message):
    with pytest.raises(InputError, match=message):
        jamlab.micrograph(picture, **options)


def test_text_is_no_picture(skimage, tmp_path):
    (tmp_path / "notes.png").write_text("no picture")
    with pytest.raises(InputError, match=r"notes\.png cannot be read"):
        jamlab.micrograph(tmp_path / "notes.png")


def test_rendering_refuses_disks_and_tilt(dp_onset, sp_jammed):
    with pytest.raises(InputError, match="model sp"):
        synthetic_micrograph(sp_jammed)
    with pytest.raises(InputError, match=r"box\[1, 0\]"):
        synthetic_micrograph(dp_onset.with_state(box=dp_onset.box + np.array([[0, 0], [0.1, 0]])))
    with pytest.raises(InputError, match="pixels is 5"):
        synthetic_micrograph(dp_onset, 5)


def test_published_points(tmp_path):
    path = tmp_path / "points.csv"
    path.write_text("# read off by eye\nrho, z\n0.84,4.0\n\n0.9,\n")
    points = read_points(path, ("rho", "z"))
    np.testing.assert_array_equal(points["rho"], [0.84, 0.9])
    np.testing.assert_array_equal(points["z"], [4.0, np.nan])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty"),
        ("rho,a\n1,2", "has columns rho, a: needs rho, z"),
        ("rho,z\n1,2,3", "line 2: 3 fields, needs 2"),
        ("rho,z\n0.8,4\n0.9,four", "line 3: 'four' in column z"),
    ],
)
def test_bad_points_are_named(tmp_path, text, message):
    path = tmp_path / "points.csv"
    path.write_text(text)
    with pytest.raises(StorageError, match=message):
        read_points(path, ("rho", "z"))


def test_missing_points(tmp_path):
    with pytest.raises(StorageError, match=r"none\.csv cannot be read"):
        read_points(tmp_path / "none.csv")
