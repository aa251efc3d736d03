"""Render droplets as a camera would see them, with known truth: light, films, blur, noise.

These pictures test `jamlab.micrograph`, or any other program that measures droplets: the packing has what it must find.
"""

from __future__ import annotations

from itertools import product

import numpy as np
import shapely
from scipy import ndimage

from jamlab.arrays import Array, Mask
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.geometry.rims import rims
from jamlab.packing.neighbors import moves_home
from jamlab.packing.packing import Packing

FINER = 2  # samples a pixel, in each direction


@checked
def synthetic_micrograph(
    packing: Packing,
    pixels: int = 512,
    film: float = 2.0,
    blur: float = 0.7,
    noise: float = 0.0,
    seed: int = 0,
    light: float = 1.0,
) -> Array:
    """Render a packing of droplets.

    Args:
        packing: DP in a rectangular box.
        pixels: width of the picture of one period; a pixel is box[0, 0]/pixels wide.
        film: width in pixels of the dark film between droplets in contact.
        blur: standard deviation of the blur, in pixels.
        noise: standard deviation of the noise; droplets in full light are 1, the background is 0.
        seed: seed of the noise.
        light: brightness at the right edge relative to the left edge, with a linear gradient.

    Returns:
        (h, w) float64, one period; its edges cut droplets. Rows follow the y axis of the cell.

    Raises:
        InputError: an SP packing, a tilted box, fewer than 32 or more than 6000 pixels, an argument out of range.

    Example:
        >>> *_, dense = jamlab.compress(jamlab.jam(8, "dp"), to=0.93, step=0.03)
        >>> jamlab.synthetic_micrograph(dense, 256, blur=1.5, noise=0.1, light=0.5, seed=1).shape[1]
        256
    """
    if packing.offsets is not None and not packing.kind.has_outlines:
        raise InputError(f"{packing.kind.particles} (model {packing.model}) have no outlines to picture: use droplets")
    if packing.box[1, 0] != 0:
        raise InputError(f"box[1, 0] is {packing.box[1, 0]:.6g}: a picture needs a rectangular box")
    covered, nearest, second = _scene(packing, pixels, film)
    width, rims_apart = film * packing.box[0, 0] / pixels, nearest + second - packing.params["delta"]
    gap = np.maximum(rims_apart, 0.0)  # a film between two droplets is narrower by the gap between their rims
    in_film = np.isfinite(second) & (second < nearest + width + gap) & (gap < width)
    fine = (covered & ~in_film).astype(np.float64)
    h, w = (count // FINER for count in fine.shape)
    picture = fine.reshape(h, FINER, w, FINER).mean(axis=(1, 3))
    picture = ndimage.gaussian_filter(picture, blur, mode="wrap")
    picture = picture * (1 - (1 - light) * np.linspace(0, 1, w))
    picture = picture + noise * np.random.default_rng(seed).normal(size=picture.shape)
    return np.asarray(picture)


def _scene(packing: Packing, pixels: int, film: float) -> tuple[Mask, Array, Array]:
    """At fine samples: whether a rim of a droplet or an image of it covers each, and how far the nearest two polygons
    are; inf where none is near."""
    outlines, home = packing.polygons.shapes(), moves_home(packing.centroids, packing.box)
    size = packing.box[0, 0] / (FINER * pixels)
    shape = FINER * round(packing.box[1, 1] / (FINER * size)), FINER * pixels
    y, x = ((np.arange(count) + 0.5) * size for count in shape)
    covered, nearest, second = np.zeros(shape, dtype=bool), np.full(shape, np.inf), np.full(shape, np.inf)
    around = np.array([-1, -1, 1, 1]) * (film + 1) * FINER * size  # a film reaches over into a neighbour
    moves = np.array(list(product((-1, 0, 1), repeat=2))) @ packing.box
    for outline, polygon, centre, own in zip(rims(packing).outlines, outlines, packing.centroids, home, strict=True):
        for move in moves + own:
            grown = shapely.transform(outline, lambda p, c=centre + move: p + c)
            low_x, low_y, high_x, high_y = shapely.bounds(grown) + around
            rows = slice(*np.searchsorted(y, [low_y, high_y]))
            columns = slice(*np.searchsorted(x, [low_x, high_x]))
            if rows.start == rows.stop or columns.start == columns.stop:
                continue
            points = shapely.points(*np.meshgrid(x[columns], y[rows]))
            shapely.prepare(grown)
            covered[rows, columns] |= shapely.contains(grown, points)
            distance = shapely.distance(shapely.transform(polygon, lambda p, m=move: p + m), points)
            near = nearest[rows, columns]
            second[rows, columns] = np.where(distance < near, near, np.minimum(second[rows, columns], distance))
            nearest[rows, columns] = np.minimum(near, distance)
    return covered, nearest, second
