"""Files of pictures: what cameras and programs write is read, what is no picture is refused in one line."""

import numpy as np
import pytest
from PIL import Image

from jamlab.errors import InputError
from jamlab.micrographs.picture_files import read_grey

pytest.importorskip("skimage")
RAMP = np.add.outer(np.arange(20), 2 * np.arange(30)).astype(np.float64)
GREY = (255 * RAMP / RAMP.max()).astype(np.uint8)
EXPECTED = GREY / 255


def write_tiff(path, values, **how):
    tifffile = pytest.importorskip("tifffile")
    tifffile.imwrite(path, values, **how)


@pytest.mark.parametrize("mode", ["L", "LA", "P", "RGB", "RGBA", "CMYK"])
def test_modes_of_pillow(tmp_path, mode):
    path = tmp_path / ("picture.tif" if mode == "CMYK" else "picture.png")
    Image.fromarray(GREY).convert(mode).save(path)
    np.testing.assert_allclose(read_grey(path), EXPECTED, atol=0.01)


@pytest.mark.parametrize("ending", ["png", "tif"])
def test_16_bit_grey(tmp_path, ending):
    path = tmp_path / f"picture.{ending}"
    Image.fromarray(GREY.astype(np.uint16) * 257).save(path)
    np.testing.assert_allclose(read_grey(path), EXPECTED, atol=1e-4)


def test_16_bit_colours_that_pillow_does_not_know(tmp_path):
    write_tiff(tmp_path / "c.tif", np.dstack([GREY.astype(np.uint16) * 257] * 3), photometric="rgb")
    np.testing.assert_allclose(read_grey(tmp_path / "c.tif"), EXPECTED, atol=1e-4)


def test_several_pages_and_damaged_files_are_refused(tmp_path):
    write_tiff(tmp_path / "pages.tif", np.stack([GREY] * 3), photometric="minisblack")
    Image.fromarray(GREY).save(tmp_path / "whole.png")
    (tmp_path / "half.png").write_bytes((tmp_path / "whole.png").read_bytes()[:60])
    (tmp_path / "text.tif").write_text("no picture")
    (tmp_path / "empty.png").touch()
    for name in ("pages.tif", "half.png", "text.tif", "empty.png"):
        with pytest.raises(InputError) as error:
            read_grey(tmp_path / name)
        assert name in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize("top", [255, 65535, 1.0])
def test_what_is_transparent_lies_on_white(tmp_path, top):
    """A half-transparent pixel is half-way from its colour to white."""
    grey = np.where(RAMP > RAMP.max() / 2, 0, top)
    opacity = np.where(RAMP % 3 > 0, top, top // 2 if top > 1 else 0.5)
    values = np.dstack([grey] * 3 + [opacity]).astype(float if top == 1.0 else f"uint{8 if top == 255 else 16}")
    expected = 1 - (1 - grey / top) * opacity / top
    np.testing.assert_allclose(read_grey(values), (expected - expected.min()) / np.ptp(expected), atol=0.005)
    if top == 255:
        Image.fromarray(values).save(tmp_path / "a.png")
        np.testing.assert_allclose(read_grey(tmp_path / "a.png"), read_grey(values), atol=1e-12)
        palette = Image.fromarray(GREY).convert("P")
        palette.info["transparency"] = 0  # the darkest colour
        palette.save(tmp_path / "p.png", transparency=0)
        assert read_grey(tmp_path / "p.png")[0, 0] == 1 and GREY[0, 0] == 0


def test_levels_do_not_matter():
    np.testing.assert_allclose(read_grey(RAMP * 7 - 3), RAMP / RAMP.max(), atol=1e-12)
