"""Files of labels: numbers as stored, sizes of pixels, stacks; what changes numbers or could run code is refused."""

import os

import numpy as np
import pytest
from PIL import Image

import jamlab
from jamlab.errors import InputError
from jamlab.micrographs.labels import read_labels
from jamlab.micrographs.picture_files import read_pages
from jamlab.micrographs.pixel_size import common_size, stated_size

pytest.importorskip("skimage")
tifffile = pytest.importorskip("tifffile")
Y, X = np.mgrid[:90, :120] + 0.5
LABELS = np.where(np.hypot(X % 30 - 15, Y % 30 - 15) < 14, np.floor(Y / 30) * 4 + np.floor(X / 30) + 1, 0).astype(int)


@pytest.mark.parametrize("kind", ["uint8", "uint16"])
@pytest.mark.parametrize("mask", [False, True])
@pytest.mark.parametrize("how", [{}, {"compression": "zlib", "tile": (16, 16)}])
def test_a_table_that_shows_white_as_zero_changes_no_number(tmp_path, kind, mask, how):
    """ImageJ writes masks so; Pillow turns 8 bit round, and the ground would be droplets."""
    values = (255 * (LABELS > 0) if mask else LABELS).astype(kind)
    tifffile.imwrite(tmp_path / "white.tif", values, photometric="miniswhite", **how)
    found, _ = read_labels(tmp_path / "white.tif", None)
    np.testing.assert_array_equal(found > 0, LABELS > 0)
    assert found.max() == 12


def test_pillow_reads_what_tifffile_cannot_and_turns_nothing_round(tmp_path):
    Image.fromarray(LABELS.astype(np.uint8)).save(tmp_path / "lzw.tif", compression="tiff_lzw")
    np.testing.assert_array_equal(read_labels(tmp_path / "lzw.tif", None)[0], LABELS)


def test_jpeg_is_refused_by_name(tmp_path):
    Image.fromarray(LABELS.astype(np.uint8)).save(tmp_path / "a.jpg")
    Image.fromarray(LABELS.astype(np.uint8)).save(tmp_path / "b.tif", compression="jpeg")
    for name in ("a.jpg", "b.tif"):
        with pytest.raises(InputError, match=r"JPEG.* changes numbers"):
            jamlab.micrograph(labels=tmp_path / name)


class Evil:
    """Runs code when it is unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return os.mkdir, (str(self.path),)


def test_files_that_could_run_code_are_named_and_not_opened(tmp_path):
    for name, word in (("a_seg.npy", "Cellpose"), ("objects.npy", "Python objects")):
        np.save(tmp_path / name, np.array({"masks": Evil(tmp_path / "ran")}), allow_pickle=True)
        with pytest.raises(InputError, match=word):
            jamlab.micrograph(labels=tmp_path / name)
    np.savez(tmp_path / "a.npz", LABELS)
    with pytest.raises(InputError, match="archive"):
        jamlab.micrograph(labels=tmp_path / "a.npz")
    assert not (tmp_path / "ran").exists()


SIZES = {
    "imagej": ({"imagej": True, "resolution": (1 / 0.65, 1 / 0.65), "metadata": {"unit": "um"}}, (0.65, "um")),
    "micron": ({"imagej": True, "resolution": (4, 4), "metadata": {"unit": "micron"}}, (0.25, "um")),
    "escaped": ({"imagej": True, "resolution": (4, 4), "metadata": {"unit": "\\u00B5m"}}, (0.25, "um")),
    "imagej pixels": ({"imagej": True, "resolution": (4, 4), "metadata": {"unit": "pixel"}}, None),
    "cm": ({"resolution": (2e4, 2e4), "resolutionunit": "CENTIMETER"}, (5e-5, "cm")),
    "screen": ({"resolution": (72, 72), "resolutionunit": "INCH"}, None),
    "none": ({}, None),
}


@pytest.mark.parametrize("name", SIZES)
def test_sizes_of_pixels(tmp_path, name):
    how, expected = SIZES[name]
    tifffile.imwrite(tmp_path / "a.tif", LABELS.astype(np.uint16), **how)
    found = common_size(None, tmp_path / "a.tif")
    assert (found is None) == (expected is None)
    if expected is not None:
        assert found.width == pytest.approx(expected[0], rel=1e-6) and found.unit == expected[1]


def write_ome(path, x, y, unit_x="µm", unit_y="µm"):
    how = {"PhysicalSizeX": x, "PhysicalSizeY": y, "PhysicalSizeXUnit": unit_x, "PhysicalSizeYUnit": unit_y}
    tifffile.imwrite(path, LABELS.astype(np.uint16), ome=True, metadata={"axes": "YX"} | how)


def test_lengths_are_in_the_unit_of_the_file(tmp_path):
    write_ome(tmp_path / "a.ome.tif", 0.5, 0.5)
    found, pixels = (jamlab.micrograph(labels=tmp_path / "a.ome.tif", **how) for how in ({}, {"pixel": 1.0}))
    assert (found.unit, found.pixel, pixels.unit) == ("um", 0.5, "")
    assert jamlab.micrograph(labels=LABELS).unit == "pixels"
    np.testing.assert_allclose(found.areas, 0.25 * pixels.areas)
    for name in ("area", "rho"):
        scale = 0.25 if name == "area" else 1.0
        assert found.numbers[name].uncertainty == pytest.approx(scale * pixels.numbers[name].uncertainty)
    assert found.table().attrs["unit"] == "um" and found.to_dataframe().equals(found.table())


def test_pixels_that_are_not_square_or_differ_are_refused(tmp_path):
    write_ome(tmp_path / "a.tif", 0.5, 1.0)
    with pytest.raises(InputError, match=r"0\.5 by 1 um, which are not square"):
        jamlab.micrograph(labels=tmp_path / "a.tif")
    assert jamlab.micrograph(labels=tmp_path / "a.tif", pixel=0.5).pixel == 0.5
    write_ome(tmp_path / "b.tif", 0.5, 0.5)
    write_ome(tmp_path / "c.tif", 500.0, 500.0, "nm", "nm")
    write_ome(tmp_path / "d.tif", 0.6, 0.6)
    assert stated_size(tmp_path / "c.tif").unit == "nm" and common_size(tmp_path / "b.tif", tmp_path / "c.tif")
    with pytest.raises(InputError, match="give pixel="):
        common_size(tmp_path / "b.tif", tmp_path / "d.tif")


def test_pages(tmp_path):
    stack = np.stack([LABELS] * 3).astype(np.uint16)
    tifffile.imwrite(tmp_path / "t.tif", stack, imagej=True, metadata={"axes": "TYX"})
    tifffile.imwrite(tmp_path / "tc.tif", np.stack([stack] * 2), imagej=True, metadata={"axes": "TCYX"})
    np.save(tmp_path / "t.npy", stack)
    for name in ("t.tif", "t.npy"):
        np.testing.assert_array_equal(read_pages(tmp_path / name, numbers=True), stack)
        with pytest.raises(InputError, match="track_droplets"):
            jamlab.micrograph(labels=tmp_path / name)
    with pytest.raises(InputError, match="stack of stacks"):
        read_pages(tmp_path / "tc.tif", numbers=True)
