"""Read pictures: 8 or 16 bit, grey or colour, PNG, JPEG, BMP or TIFF, as grey values in float64."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from jamlab.arguments.choices import Channel
from jamlab.arrays import Array, ArrayLike, Mask
from jamlab.errors import InputError


@dataclass(frozen=True)
class Pictures:
    """Pictures that are read, in pixels."""

    most: int = 40_000_000  # of a picture: distances and labels take about 100 bytes for each
    side: int = 8  # pixels


PICTURES = Pictures()

REMEDY = "install it with pip install 'jamlab[images]'"
LOSSY_TIFF = (6, 7, 33003, 33005, 34712, 34892, 50001)  # the same by the tag of compression


class NoDropletsError(InputError):
    """A picture without droplets, which a series may hold."""


def read_grey(picture: str | Path | ArrayLike, channel: Channel = "grey") -> Array:
    """Read a picture as grey values between 0 and 1, its own darkest and brightest pixel.

    Args:
        picture: image file of one page, or (h, w) grey values, or (h, w, 3 or 4) colours; a fourth channel is opacity,
            and what is transparent is laid on white, as programs show it.
        channel: of a picture in colours, one of `Channel`; "grey" is what the eye sees.

    Returns:
        (h, w) float64.
    """
    values = np.asarray(read_values(Path(picture)) if isinstance(picture, str | Path) else picture)
    if values.ndim not in (2, 3) or min(values.shape[:2]) < PICTURES.side or values.shape[2:] not in ((), (3,), (4,)):
        raise InputError(
            f"a picture must be (h, w) or (h, w, 3) and at least {PICTURES.side} x {PICTURES.side}, got {values.shape}"
        )
    check_pixels(values.shape)
    if values.ndim == 3:
        colours = scikit_image().color
        values = colours.rgba2rgb(values) if values.shape[2] == 4 else values
        values = values[..., get_args(Channel).index(channel) - 1] if channel != "grey" else colours.rgb2gray(values)
    elif channel != "grey":
        raise InputError(f"channel is {channel!r}, but the picture has no colours")
    values = values.astype(np.float64)
    if not np.isfinite(values).all() or np.abs(values).max() > 1e100:
        raise InputError("the picture must hold finite values")
    if np.ptp(values) <= 1e-9 * np.abs(values).max():
        raise NoDropletsError("the picture is dark or empty: all of its values are the same")
    return np.asarray((values - values.min()) / np.ptp(values))


def check_pixels(shape: tuple[int, ...], name: str = "the picture") -> None:
    """Refuse more pixels than memory holds; `name`: of the file."""
    if shape[0] * shape[1] > PICTURES.most:
        raise InputError(f"{name} is {shape[:2]}: cut it to {PICTURES.most:.0e} pixels at most")


def read_values(path: Path, numbers: bool = False) -> NDArray[Any]:
    """Read an image file of one page as it is.

    Args:
        path: PNG, JPEG, BMP or TIFF, or NPY of numbers.
        numbers: of labels: numbers as they are stored, whatever a palette or a table makes of them.
    """
    pages = read_pages(path, numbers)
    if len(pages) > 1:
        raise InputError(
            f"{path} has several pages, {len(pages)} of {pages[0].shape}: save one as its own file, or follow droplets "
            "through all with track_droplets"
        )
    return pages[0]


def read_pages(path: Path, numbers: bool = False) -> list[NDArray[Any]]:
    """Read all pages of an image file; arguments as of `read_values`. Returns (h, w) or (h, w, colours) of each."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of damaged metadata: the pixels are read all the same
            if path.suffix.lower() in (".npy", ".npz"):
                return _of_array(path)
            if numbers and path.suffix.lower() in (".tif", ".tiff") and (found := _stored_numbers(path)):
                return found
            try:
                return _of_pillow(path, numbers)
            except OSError:
                if path.suffix.lower() not in (".tif", ".tiff"):
                    raise
                return _pages_of(tifffile().imread(path))  # Pillow knows no colours of 16 bit
    except InputError:
        raise
    except Exception as error:  # whatever a damaged file makes a library raise, it is no picture
        lines = str(getattr(error, "strerror", None) or error).splitlines() or [type(error).__name__]
        raise InputError(f"{path} cannot be read as a picture: {lines[0]}") from None


def count_pages(path: Path) -> int:
    """Number of pages of an image file; 1 of one that is not there, or that has no more."""
    ending = path.suffix.lower()
    return len(read_pages(path, numbers=True)) if ending in (".tif", ".tiff", ".npy") and path.is_file() else 1


def _of_pillow(path: Path, numbers: bool) -> list[NDArray[Any]]:
    plain = ("1", "L", "RGB", "RGBA", "F", "I", "I;16", "I;16B", *(("P",) if numbers else ()))
    with Image.open(path) as image:  # reads the size only
        if numbers and image.format in ("JPEG", "MPO", "JPEG2000", "WEBP"):  # formats that change numbers
            raise InputError(f"{path} is {image.format}, which changes numbers: save labels as TIFF, PNG or NPY")
        check_pixels((image.height, image.width), str(path))
        found = []
        for page in range(getattr(image, "n_frames", 1)):
            image.seek(page)
            colours = "RGBA" if image.has_transparency_data else "RGB"
            values = np.asarray(image if image.mode in plain else image.convert(colours))
            inverted = numbers and image.mode in ("1", "L") and dict(getattr(image, "tag_v2", {})).get(262) == 0
            found.append(values.max(initial=255).astype(values.dtype) - values if inverted else values)
    return found


def _of_array(path: Path) -> list[NDArray[Any]]:
    """Pages of a file of numpy. What holds Python objects is never opened: it can run code."""
    if path.suffix.lower() == ".npz":
        raise InputError(f"{path} is an archive of arrays: give one of them, as numpy.load(path)[name]")
    with path.open("rb") as file:
        version = np.lib.format.read_magic(file)
        header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        objects = header(file)[2].hasobject
    if objects and path.name.endswith("_seg.npy"):
        raise InputError(
            f"{path} is a file of Cellpose, which can run code when it is opened: save the masks as PNG or TIFF there, "
            "or, if you trust it, give numpy.load(path, allow_pickle=True).item()['masks']"
        )
    if objects:
        raise InputError(f"{path} holds Python objects, which can run code when they are opened: save numbers only")
    return _pages_of(np.load(path, allow_pickle=False))


def _stored_numbers(path: Path) -> list[NDArray[Any]]:
    """Pages of a TIFF with the numbers as they are stored, also where its table shows white as zero; none where they
    are compressed in a way that only Pillow reads."""
    with tifffile().TiffFile(path) as file:
        page, series = file.pages[0], file.series[0]
        check_pixels((page.imagelength, page.imagewidth), str(path))
        if int(page.compression) in LOSSY_TIFF:
            raise InputError(f"{path} is compressed as JPEG, which changes numbers: save labels without that")
        try:
            values = series.asarray()
        except (ValueError, ImportError):  # a codec that tifffile lacks
            return []
        axes = [(axis, n) for axis, n in zip(series.axes, series.shape, strict=True) if n > 1 or axis in "YX"]
        return _pages_of(values.reshape([n for _, n in axes]), "".join(axis for axis, _ in axes))


def _pages_of(values: NDArray[Any], axes: str | None = None) -> list[NDArray[Any]]:
    """Pages of an array (pages, h, w), with colours behind or without. `axes`: letters, of which S are colours."""
    colours = axes.endswith("S") if axes else values.ndim > 2 and values.shape[-1] in (3, 4)
    pages = values.ndim - 2 - colours
    if pages > 1:
        shape = f"{values.shape}{f', axes {axes}' if axes else ''}"
        raise InputError(f"the file is a stack of stacks, {shape}: save one channel, one plane, or one series of times")
    return [*values] if pages == 1 else [values]


def tifffile() -> Any:
    """The package, which comes with scikit-image."""
    try:
        import tifffile
    except ImportError:
        raise InputError(f"pictures need tifffile: {REMEDY}") from None
    return tifffile


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
