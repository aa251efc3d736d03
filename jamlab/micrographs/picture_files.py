"""Read pictures: 8 or 16 bit, grey or colour, PNG, JPEG, BMP or TIFF, as grey values in float64."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from jamlab.arrays import Array, Mask
from jamlab.errors import InputError

MOST_PIXELS = 40_000_000  # of a picture: distances and labels take about 100 bytes for each
LEAST_SIDE = 8  # pixels
CHANNELS = ("grey", "red", "green", "blue")
REMEDY = "install it with pip install 'jamlab[images]'"


def read_grey(picture: str | Path | ArrayLike, channel: str = "grey") -> Array:
    """Read a picture as grey values between 0 and 1, its own darkest and brightest pixel.

    Args:
        picture: image file of one page, or (h, w) grey values, or (h, w, 3 or 4) colours; a fourth channel is opacity,
            and what is transparent is laid on white, as programs show it.
        channel: of a picture in colours, one of `CHANNELS`; "grey" is what the eye sees.

    Returns:
        (h, w) float64.
    """
    values = np.asarray(read_values(Path(picture)) if isinstance(picture, str | Path) else picture)
    if values.ndim not in (2, 3) or min(values.shape[:2]) < LEAST_SIDE or values.shape[2:] not in ((), (3,), (4,)):
        raise InputError(
            f"a picture must be (h, w) or (h, w, 3) and at least {LEAST_SIDE} x {LEAST_SIDE}, got {values.shape}"
        )
    check_pixels(values.shape)
    white = float(np.iinfo(values.dtype).max) if values.dtype.kind in "iu" else 1.0
    values = values.astype(np.float64)
    if values.ndim == 3:
        if values.shape[2] == 4 and np.isfinite(values).all() and np.ptp(values[..., 3]) > 0:
            if not 0 <= values.min() <= values.max() <= white:
                raise InputError(
                    f"values with opacity must be 0 to {white:g}, got {values.min():g} to {values.max():g}"
                )
            opacity = values[..., 3:] / white
            values = opacity * values[..., :3] + (1 - opacity) * white
        colour = CHANNELS.index(channel)
        values = values[..., colour - 1] if colour else scikit_image().color.rgb2gray(values[..., :3])
    elif channel != CHANNELS[0]:
        raise InputError(f"channel is {channel!r}, but the picture has no colours")
    if not np.isfinite(values).all() or np.abs(values).max() > 1e100 or np.ptp(values) <= 1e-9 * np.abs(values).max():
        raise InputError("the picture must hold finite values that are not all the same")
    return np.asarray((values - values.min()) / np.ptp(values))


def check_pixels(shape: tuple[int, ...]) -> None:
    """Refuse more pixels than memory holds."""
    if shape[0] * shape[1] > MOST_PIXELS:
        raise InputError(f"the picture is {shape[:2]}: cut it to {MOST_PIXELS:.0e} pixels at most")


def read_values(path: Path, numbers: bool = False) -> NDArray[Any]:
    """Read an image file as it is.

    Args:
        path: PNG, JPEG, BMP or TIFF of one page.
        numbers: of a picture with a palette give the numbers of its colours, as label images have them.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of damaged metadata: the pixels are read all the same
            with Image.open(path) as image:  # reads the size only
                _check_size(path, image.width, image.height, getattr(image, "n_frames", 1))
                return np.asarray(image) if numbers and image.mode == "P" else _pixels(image)
    except InputError:
        raise
    except Exception as error:  # whatever a damaged file makes Pillow raise, it is no picture
        if path.suffix.lower() in (".tif", ".tiff"):
            return _read_tiff(path, error)  # Pillow knows no colours of 16 bit
        raise _refusal(path, error) from None


def _pixels(image: Image.Image) -> NDArray[Any]:
    """Pixels with 1, 3 or 4 channels: palettes and other colour spaces become red, green, blue."""
    if image.mode in ("P", "PA"):
        image = image.convert("RGBA" if image.mode == "PA" or "transparency" in image.info else "RGB")
    elif image.mode == "LA":
        image = image.convert("RGBA")
    elif image.mode not in ("1", "L", "RGB", "RGBA", "F", "I") and not image.mode.startswith("I;16"):
        image = image.convert("RGB")
    return np.asarray(image)


def _read_tiff(path: Path, first: Exception) -> NDArray[Any]:
    """Read what Pillow cannot, with the library that scikit-image reads TIFF with."""
    try:
        import tifffile

        with tifffile.TiffFile(path) as file:
            shape = file.pages.first.shape
            _check_size(path, shape[1], shape[0], len(file.pages))
            return np.asarray(file.asarray())
    except InputError:
        raise
    except Exception:  # whatever a damaged or foreign file makes the library raise, it is no picture
        raise _refusal(path, first) from None


def _check_size(path: Path, width: int, height: int, pages: int) -> None:
    if pages > 1:
        raise InputError(f"{path} has {pages} pages: save one page as its own file")
    if width * height > MOST_PIXELS:
        raise InputError(f"{path} has {width} x {height} pixels: cut it to {MOST_PIXELS:.0e} pixels at most")


def _refusal(path: Path, error: Exception) -> InputError:
    if isinstance(error, OSError) and error.strerror:
        return InputError(f"{path}: {error.strerror}; check the name and its permissions")
    lines = str(error).splitlines() or [type(error).__name__]
    return InputError(f"{path} cannot be read as a picture: {lines[0]}")


def scikit_image() -> Any:
    """The package with the parts that pictures need."""
    try:
        import skimage.color
        import skimage.draw
        import skimage.filters
        import skimage.measure
        import skimage.morphology
        import skimage.segmentation
        import skimage.transform
    except ImportError:
        raise InputError(f"pictures need scikit-image: {REMEDY}") from None
    return skimage


def distance_inside(mask: Mask) -> Array:
    """Distance of each pixel of a mask from the nearest one of the picture that is not in it. `mask`: (h, w). Returns
    (h, w) pixels: 0 outside the mask, inf everywhere if all of the picture is in it."""
    try:
        import edt
    except ImportError:
        raise InputError(f"pictures need edt: {REMEDY}") from None
    squares = np.asarray(edt.edtsq(np.ascontiguousarray(mask)))  # whole numbers, exact to 2^24
    return np.sqrt(squares.astype(np.float64))
