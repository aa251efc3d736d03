"""Micrographs of droplets: measure in a picture what is measured in a simulated packing.

Bright droplets on a dark ground (or the other way round) are separated by Otsu's threshold and, where they merge, by
a watershed of the distance from the ground. A gap between two droplets that is no wider than the film counts as a
film: the droplets are in contact there, and either takes half of it. Every pixel belongs to the set-Voronoi cell of the
droplet nearest to it. Outlines are smoothed to their first Fourier modes, because those of pixels are too long.

Sources: N. Otsu, IEEE Trans. SMC 9, 62 (1979); F. M. Schaller et al., Philos. Mag. 93, 3993 (2013).
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image
from scipy import ndimage

from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.geometry.rattlers import find_rattlers
from jamlab.packing.short_repr import short_repr

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

LARGEST = 1e100  # size of a pixel, so that areas are finite
MOST_PIXELS = 40_000_000  # of a picture: distances and labels take about 100 bytes for each
MODES = 16  # Fourier modes of an outline: enough for flats and corners (shape within 0.008), too few for pixel steps
OUTLINE_POINTS = 512  # even steps along an outline for the transform: two or more to a pixel up to a radius of 40
SMALLEST = 30  # pixels, of a droplet: below, radius 3, noise looks the same
WATERSHED_DEPTH = 0.1  # droplets merge if the neck between them is less than this part narrower than the smaller one
SMOOTHING = 1.0  # pixels, of the distance from the ground: its ridges are rough on the scale of a pixel
MARGIN = 0.3  # of the picture, repeated around a periodic one: more than half of the largest droplet and its cell
LEAST_WALL = 2  # pixels of film that make a contact: one alone may be a corner
HALF_PIXEL = 0.5  # gaps are measured between pixel centres
NEIGHBOURS = ((np.s_[1:, :], np.s_[:-1, :]), (np.s_[:, 1:], np.s_[:, :-1]))  # pixels below and above, right and left


@dataclass(frozen=True)
class Micrograph:
    """Droplets of a picture; lengths in units of `pixel`. Droplets cut by the edge of the picture are left out.

    Attributes:
        labels: (h, w) int64, droplet k is k + 1, films included; 0 is the ground, -1 droplets that are left out.
        centres: (n, 2) centres of area, x to the right and y down.
        areas: (n,) with half of each film.
        shape: (n,) shape factors perimeter^2/(4 pi area), of the droplets without films.
        cells: (n,) areas of the set-Voronoi cells.
        contacts: (n,) int64, droplets that each one touches, rattlers not counted.
        rattlers: (n,) bool, fewer than three contacts, found recursively; droplets at the edge count as held.
    """

    labels: Indices
    centres: Array
    areas: Array
    shape: Array
    cells: Array
    contacts: Indices
    rattlers: NDArray[np.bool_]

    __repr__ = short_repr

    @property
    def local_packing_fraction(self) -> Array:
        """(n,) area of each droplet over that of its cell."""
        return np.asarray(self.areas / self.cells)

    @property
    def z(self) -> float:
        """Mean number of contacts of the droplets that do not rattle; nan if all rattle."""
        return float(self.contacts[~self.rattlers].mean()) if (~self.rattlers).any() else float("nan")

    def measure(self) -> dict[str, float]:
        """What a picture shows of the columns of `jamlab.measure`: rho, z, rattlers, shape."""
        return {
            "rho": float(self.areas.sum() / self.cells.sum()),
            "z": self.z,
            "rattlers": float(self.rattlers.sum()),
            "shape": float(self.shape.mean()),
        }


@checked
def micrograph(
    picture: str | Path | ArrayLike,
    pixel: float = 1.0,
    film: float = 2.0,
    bright: bool = True,
    periodic: bool = False,
) -> Micrograph:
    """Find and measure the droplets of a picture.

    Droplets of 25 pixels radius or more, films 2 pixels wide, noise of 5 %: rho comes out up to 0.006 too high (films
    run on into the corners of voids), the mean shape factor within 0.008 of that of the polygons, z right but for gaps
    narrower than a film, which count as contacts (up to 0.6 at onset, 0.4 at rho = 0.92).

    Args:
        picture: image file, or (h, w) grey values, or (h, w, 3 or 4) colours.
        pixel: size of a pixel in the unit of length wanted.
        film: widest gap, in pixels, that is a film between droplets in contact.
        bright: droplets are brighter than the ground.
        periodic: the picture is one period of a periodic one, as rendered from a simulation.

    Raises:
        InputError: without scikit-image; if the file is no picture, values are not finite, arguments are not positive,
            or no whole droplet is found.
    """
    for name, value in (("pixel", pixel), ("film", film)):
        if not 1 / LARGEST <= value <= LARGEST:  # beyond, areas are 0 or infinite
            raise InputError(f"{name} is {value}: must be a positive number, {1 / LARGEST:g} to {LARGEST:g}")
    grey = _read_grey(picture)
    height, width = grey.shape
    margin = int(np.ceil(MARGIN * min(grey.shape))) if periodic else 0
    window = slice(margin, margin + height), slice(margin, margin + width)
    grey = np.pad(grey, margin, mode="wrap")
    droplets = _segment(grey if bright else -grey)

    ground, nearest = ndimage.distance_transform_edt(droplets == 0, return_indices=True)
    cells = droplets[tuple(nearest)]
    filled = np.where((ground == 0) | _find_films(cells, ground, film), cells, 0)
    count = int(droplets.max())
    centres, inside = _find_whole(filled, cells, window)
    if not inside.any():
        raise InputError(f"no whole droplet among {count} found: check `bright` ({bright}) and the size of the picture")

    pairs = _find_contacts(cells, ground, film)
    rattlers, bearing = find_rattlers(pairs, inside)
    contacts = np.bincount(pairs[bearing].ravel(), minlength=count)
    kept = np.flatnonzero(inside)
    names = np.full(count + 1, -1)
    names[0], names[kept + 1] = 0, np.arange(1, len(kept) + 1)
    return Micrograph(
        names[filled][window],
        (centres[kept, ::-1] - margin) * pixel,
        np.float64(pixel**2) * np.bincount(filled.ravel(), minlength=count + 1)[kept + 1],
        _measure_shapes(droplets, kept + 1),
        np.float64(pixel**2) * np.bincount(cells.ravel(), minlength=count + 1)[kept + 1],
        contacts[kept],
        rattlers[kept],
    )


def _skimage() -> Any:
    try:
        import skimage.color
        import skimage.filters
        import skimage.measure
        import skimage.morphology
        import skimage.segmentation
    except ImportError:
        raise InputError("pictures need scikit-image: install it with pip install 'jamlab[images]'") from None
    return skimage


def _read_grey(picture: str | Path | ArrayLike) -> Array:
    skimage = _skimage()
    if isinstance(picture, str | Path):
        picture = _read_file(picture)
    values = np.asarray(picture, dtype=np.float64)
    if values.ndim == 3 and values.shape[2] in (3, 4):
        values = skimage.color.rgb2gray(values[..., :3])
    if values.ndim != 2 or min(values.shape) < 8:
        raise InputError(f"a picture must be (h, w) or (h, w, 3) and at least 8 x 8, got {values.shape}")
    if not np.isfinite(values).all() or np.ptp(values) == 0:
        raise InputError("the picture must hold finite values that are not all the same")
    return values


def _read_file(path: str | Path) -> NDArray[Any]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(path) as image:  # reads the size only
                if image.width * image.height > MOST_PIXELS:
                    raise InputError(
                        f"{path} has {image.width} x {image.height} pixels: cut it to {MOST_PIXELS:.0e} pixels at most"
                    )
                return np.asarray(image)
    except (Image.DecompressionBombError, Image.DecompressionBombWarning):
        raise InputError(f"{path} is too large: cut it to {MOST_PIXELS:.0e} pixels at most") from None
    except InputError:
        raise
    except (OSError, ValueError, SyntaxError, EOFError) as error:  # SyntaxError: what Pillow calls a broken PNG
        raise InputError(f"{path} cannot be read as a picture: {error}") from None


def _segment(grey: Array) -> Indices:
    """Label of the droplet that each pixel belongs to, 0 for the ground."""
    skimage = _skimage()
    mask = grey > skimage.filters.threshold_otsu(grey)
    depth = ndimage.gaussian_filter(ndimage.distance_transform_edt(mask), SMOOTHING)
    tops = ndimage.label(skimage.morphology.h_maxima(depth, WATERSHED_DEPTH * depth.max()))[0]
    labels = skimage.segmentation.watershed(-depth, tops, mask=mask)
    sizes = np.bincount(labels.ravel())
    labels = np.where(sizes[labels] < SMALLEST, 0, labels)
    return np.unique(labels, return_inverse=True)[1].reshape(labels.shape).astype(np.int64)


def _find_whole(filled: Indices, cells: Indices, window: tuple[slice, slice]) -> tuple[Array, NDArray[np.bool_]]:
    """(n, 2) centres of all droplets, row and column, and (n,) which lie in the window and clear of the edge."""
    every = np.arange(1, cells.max() + 1)
    centres = np.array(ndimage.center_of_mass(filled > 0, filled, every)).reshape(-1, 2)
    low, high = np.array([[side.start for side in window], [side.stop for side in window]])
    edge = np.concatenate([cells[0], cells[-1], cells[:, 0], cells[:, -1]])
    return centres, ((centres >= low) & (centres < high)).all(axis=1) & ~np.isin(every, edge)


def _find_contacts(cells: Indices, ground: Array, film: float) -> Indices:
    """(m, 2) droplets i < j, from 0, whose cells share a wall of `LEAST_WALL` pixels or more with a film across it."""
    rows = []
    for a, b in NEIGHBOURS:
        thin = (cells[a] != cells[b]) & (ground[a] + ground[b] <= film + HALF_PIXEL)
        rows.append(np.sort(np.column_stack([cells[a][thin], cells[b][thin]]), axis=1))
    pairs, wall = np.unique(np.concatenate(rows), axis=0, return_counts=True)
    return np.asarray(pairs[wall >= LEAST_WALL] - 1)


def _find_films(cells: Indices, ground: Array, film: float) -> NDArray[np.bool_]:
    """Ground within half a film of a wall between droplets that are no further apart than a film."""
    wall = np.zeros(cells.shape, dtype=bool)
    for a, b in NEIGHBOURS:
        thin = (cells[a] != cells[b]) & (ground[a] + ground[b] <= film + HALF_PIXEL)
        wall[a] |= thin
        wall[b] |= thin
    if not wall.any():
        return wall
    return np.asarray(ndimage.distance_transform_edt(~wall) <= 0.5 * film)


def _measure_shapes(droplets: Indices, labels: Indices) -> Array:
    """Shape factors of labelled droplets, from the first Fourier modes of their outlines."""
    skimage, boxes = _skimage(), ndimage.find_objects(droplets)
    shapes = np.empty(len(labels))
    for row, label in enumerate(labels):
        mask = np.pad(droplets[boxes[label - 1]] == label, 2).astype(np.float64)
        outline = max(skimage.measure.find_contours(mask, 0.5), key=len) @ np.array([1j, 1.0])
        steps = np.abs(np.diff(outline))
        place = np.concatenate([[0], np.cumsum(steps)])
        even = np.interp(np.linspace(0, place[-1], OUTLINE_POINTS, endpoint=False), place, outline)
        modes = np.fft.fft(even)
        modes[MODES + 1 : -MODES] = 0
        smooth = np.fft.ifft(modes)
        step = np.diff(smooth, append=smooth[0])
        area = abs(0.5 * np.imag(np.conj(smooth) * step).sum())
        shapes[row] = np.abs(step).sum() ** 2 / (4 * np.pi * area)
    return shapes
