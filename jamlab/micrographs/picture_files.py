"""Read pictures: 8 or 16 bit, grey or colour, PNG, JPEG, BMP or TIFF, as grey values in float64."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from jamlab.arrays import Array, ArrayLike, Mask
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
    if values.ndim == 3:
        colours = scikit_image().color
        values = colours.rgba2rgb(values) if values.shape[2] == 4 else values
        values = values[..., CHANNELS.index(channel) - 1] if channel != CHANNELS[0] else colours.rgb2gray(values)
    elif channel != CHANNELS[0]:
        raise InputError(f"channel is {channel!r}, but the picture has no colours")
    values = values.astype(np.float64)
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
    plain = ("1", "L", "RGB", "RGBA", "F", "I", "I;16", "I;16B", *(("P",) if numbers else ()))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of damaged metadata: the pixels are read all the same
            try:
                if numbers and path.suffix.lower() == ".npy":
                    return np.asarray(np.load(path, allow_pickle=False))
                with Image.open(path) as image:  # reads the size only
                    check_pixels((image.height, image.width))
                    pages = getattr(image, "n_frames", 1)
                    colours = "RGBA" if image.has_transparency_data else "RGB"
                    values = np.asarray(image if image.mode in plain else image.convert(colours))
            except OSError:
                if path.suffix.lower() not in (".tif", ".tiff"):
                    raise
                import tifffile  # comes with scikit-image; Pillow knows no colours of 16 bit

                values, pages = tifffile.imread(path), 1
    except Exception as error:  # whatever a damaged file makes a library raise, it is no picture
        lines = str(getattr(error, "strerror", None) or error).splitlines() or [type(error).__name__]
        raise InputError(f"{path} cannot be read as a picture: {lines[0]}") from None
    if pages > 1 or (values.ndim > 2 and values.shape[2] > 4):
        raise InputError(f"{path} has several pages, {values.shape}: save one page as its own file")
    return values


def scikit_image() -> Any:
    """The package, which loads its parts where they are used."""
    try:
        import skimage
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
