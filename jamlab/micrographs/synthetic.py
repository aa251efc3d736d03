"""Render droplets as a camera would see them, with known truth: light, films, blur, noise, scale bar, edges.

These pictures test `jamlab.micrograph`, or any other program that measures droplets: the packing has what it must find.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy import ndimage

from jamlab.arrays import Array, Mask
from jamlab.checks import check_choice, check_seed, checked
from jamlab.errors import InputError
from jamlab.geometry.rims import rims
from jamlab.packing.neighbors import moves_home
from jamlab.packing.packing import Packing

FINER = 2  # samples a pixel, in each direction
MARGIN = 0.1  # of the period, around whole droplets
BAR = (0.2, 0.012, 0.04)  # length and height of a scale bar and its distance from the corner, of the width
TINT = (1.0, 0.92, 0.8)  # of red, green and blue in a colour picture: warm light
RANGES = {  # of the arguments
    **{"pixels": (32, 6000), "film": (0.0, 100.0), "blur": (0.0, 100.0), "noise": (0.0, 10.0)},
    **{"light": (1e-6, 1.0), "vignette": (0.0, 1 - 1e-6)},
}


@dataclass(frozen=True)
class _Scene:
    """Distances at fine samples: how many rims cover each, and how far the nearest two polygons are."""

    covers: NDArray[np.int64]
    nearest: Array
    second: Array


@checked
def synthetic_micrograph(
    packing: Packing,
    pixels: int = 512,
    film: float = 2.0,
    blur: float = 0.7,
    noise: float = 0.0,
    seed: int = 0,
    light: float = 1.0,
    vignette: float = 0.0,
    scale_bar: bool = False,
    borders: str = "cut",
    dark: bool = False,
    colour: bool = False,
) -> Array:
    """Render a packing of droplets.

    Args:
        packing: DP in a rectangular box.
        pixels: width of the picture of one period; a pixel is box[0, 0]/pixels wide.
        film: width in pixels of the dark film that divides droplets whose rims overlap; beside, where droplets do not
            touch, gaps narrower than a film are darker by the same width.
        blur: standard deviation of the blur, in pixels.
        noise: standard deviation of the noise, where droplets in full light are 1 and the ground is 0.
        seed: of the noise.
        light: brightness at the right edge, 1 at the left; it falls evenly.
        vignette: part of the light that the corners lack; it falls with the square of the distance from the middle.
        scale_bar: a white bar in the lower right corner of the picture with row 0 on top, drawn over everything else.
        borders: "cut": one period, whose edges cut droplets; "whole": every droplet once, whole, on dark ground.
        dark: droplets are dark on a bright ground.
        colour: red, green and blue instead of grey.

    Returns:
        (h, w) float64, or (h, w, 3); y of the cell runs with the rows.

    Raises:
        InputError: an SP packing, a tilted box, fewer than 32 or more than 6000 pixels, an argument out of range.

    Example:
        >>> *_, dense = jamlab.compress(jamlab.jam(model="dp", n=8, seed=1), to=0.93, step=0.03)
        >>> jamlab.synthetic_micrograph(dense, 256, blur=1.5, noise=0.1, light=0.5, seed=1).shape[1]
        256
    """
    given = {"pixels": pixels, "film": film, "blur": blur, "noise": noise, "light": light, "vignette": vignette}
    _check(packing, seed, borders, given)
    scene = _scene(packing, pixels, film, borders == "whole")
    width = film * packing.box[0, 0] / pixels
    fine = ((scene.covers > 0) & ~_in_film(scene, width, 0.5 * packing.params["delta"])).astype(np.float64)
    h, w = (count // FINER for count in fine.shape)
    picture = fine.reshape(h, FINER, w, FINER).mean(axis=(1, 3))
    picture = ndimage.gaussian_filter(picture, blur, mode="wrap" if borders == "cut" else "nearest")
    if dark:
        picture = 1 - picture
    picture = picture * _light((h, w), light, vignette)
    picture = picture + noise * np.random.default_rng(seed).normal(size=picture.shape)
    if colour:
        picture = picture[..., None] * np.array(TINT)
    if scale_bar:
        length, height, corner = (max(round(part * w), 2) for part in BAR)
        picture[h - corner - height : h - corner, w - corner - length : w - corner] = max(1.0, float(picture.max()))
    return np.asarray(picture)


def _in_film(scene: _Scene, width: float, rim: float) -> Mask:
    """Where a film of a width divides the two nearest droplets, narrower by the gap between their rims."""
    known = np.isfinite(scene.second)
    nearest, second = (np.where(known, distance, far) for distance, far in ((scene.nearest, 0.0), (scene.second, 1e9)))
    gap = np.maximum(nearest + second - 2 * rim, 0.0)
    return np.asarray((second - nearest < width + gap) & (gap < width))


def _check(packing: Packing, seed: int, borders: str, given: dict[str, float]) -> None:
    if packing.offsets is None:
        raise InputError("synthetic pictures show droplets (model dp); this packing has model sp")
    if packing.box[1, 0] != 0:
        raise InputError(f"box[1, 0] is {packing.box[1, 0]:.6g}: a picture needs a rectangular box")
    for name, value in given.items():
        low, high = RANGES[name]
        if not low <= value <= high:
            raise InputError(f"{name} is {value}: must be a number from {low:g} to {high:g}")
    check_choice("borders", borders, ("cut", "whole"))
    check_seed(seed)


def _light(shape: tuple[int, int], light: float, vignette: float) -> Array:
    y, x = np.meshgrid(*(np.linspace(-1, 1, count) for count in shape), indexing="ij")
    return np.asarray((1 - (1 - light) * 0.5 * (1 + x)) * (1 - vignette * 0.5 * (x**2 + y**2)))


def _scene(packing: Packing, pixels: int, film: float, whole: bool) -> _Scene:
    """Draw every droplet, and its periodic images if the edges cut."""
    size = packing.box[0, 0] / (FINER * pixels)
    home = moves_home(packing.centroids, packing.box)
    edge = MARGIN * packing.box[0, 0] if whole else 0.0
    extent = [packing.box[0, 0] + 2 * edge, packing.box[1, 1] + 2 * edge]
    if whole:  # droplets that stick out of the cell need more room
        low, high = _reach(packing, home)
        start, extent = low - edge, list(high - low + 2 * edge)
    else:
        start = np.zeros(2)
    shape = FINER * round(extent[1] / (FINER * size)), FINER * round(extent[0] / (FINER * size))
    y, x = ((np.arange(count) + 0.5) * size + begin for count, begin in zip(shape, start[::-1], strict=True))
    covers, nearest = np.zeros(shape, dtype=np.int64), np.full(shape, np.inf)
    second = np.full(shape, np.inf)
    around = np.array([-1, -1, 1, 1]) * (film + 1) * FINER * size  # a film reaches over into a neighbour
    moves = np.zeros((1, 2)) if whole else np.array(list(product((-1, 0, 1), repeat=2))) @ packing.box
    for outline, polygon, centre, own in zip(
        rims(packing).outlines, packing.outlines(), packing.centroids, home, strict=True
    ):
        for move in moves + own:
            grown = shapely.transform(outline, lambda p, c=centre + move: p + c)
            low_x, low_y, high_x, high_y = shapely.bounds(grown) + around
            rows = slice(*np.searchsorted(y, [low_y, high_y]))
            columns = slice(*np.searchsorted(x, [low_x, high_x]))
            if rows.start == rows.stop or columns.start == columns.stop:
                continue
            points = shapely.points(*np.meshgrid(x[columns], y[rows]))
            shapely.prepare(grown)
            covers[rows, columns] += shapely.contains(grown, points)
            distance = shapely.distance(shapely.transform(polygon, lambda p, m=move: p + m), points)
            near = nearest[rows, columns]
            second[rows, columns] = np.where(distance < near, near, np.minimum(second[rows, columns], distance))
            nearest[rows, columns] = np.minimum(near, distance)
    return _Scene(covers, nearest, second)


def _reach(packing: Packing, home: Array) -> tuple[Array, Array]:
    """(2,) lowest and highest coordinates of all outlines, each moved into the cell."""
    box = shapely.bounds(rims(packing).outlines) + np.tile(packing.centroids + home, 2)
    return box[:, :2].min(axis=0), box[:, 2:].max(axis=0)
