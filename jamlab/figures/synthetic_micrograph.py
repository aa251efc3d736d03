"""Render droplets as a camera would see them: bright droplets, dark ground and films, blur and noise.

These pictures test `jamlab.micrograph`, which must measure in them what the packing has.
"""

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy import ndimage

from jamlab.errors import InputError
from jamlab.figures.packing_pictures import home_moves, periodic_moves
from jamlab.geometry.rims import rims
from jamlab.packing.packing import Packing

Array = NDArray[np.float64]

FINER = 2  # samples a pixel, in each direction


def synthetic_micrograph(
    packing: Packing, pixels: int = 512, film: float = 2.0, blur: float = 0.7, noise: float = 0.0, seed: int = 0
) -> Array:
    """Render one period of a packing of droplets.

    Args:
        packing: DP in a rectangular box.
        pixels: width of the picture; a pixel is box[0, 0]/pixels wide.
        film: width in pixels of the dark film between droplets whose rims overlap.
        blur: standard deviation of the blur, in pixels.
        noise: standard deviation of noise, where droplets are 1 and the ground is 0.
        seed: of the noise.

    Returns:
        (h, pixels) float64, row 0 at the bottom of the cell.

    Raises:
        InputError: an SP packing, a tilted box, fewer than 32 pixels.
    """
    if packing.offsets is None:
        raise InputError("synthetic pictures show droplets (model dp); this packing has model sp")
    if packing.box[1, 0] != 0:
        raise InputError(f"box[1, 0] is {packing.box[1, 0]:.6g}: a picture needs a rectangular box")
    if pixels < 32:
        raise InputError(f"pixels is {pixels}: must be at least 32")
    size = packing.box[0, 0] / (FINER * pixels)
    shape = FINER * round(pixels * packing.box[1, 1] / packing.box[0, 0]), FINER * pixels
    y, x = ((np.arange(count) + 0.5) * size for count in shape)
    covers, nearest = np.zeros(shape, dtype=np.int64), np.full(shape, np.inf)
    second = np.full(shape, np.inf)
    moves = periodic_moves(packing)
    homes = home_moves(packing)
    for outline, polygon, centre, home in zip(
        rims(packing).outlines, packing.outlines(), packing.centroids, homes, strict=True
    ):
        for move in moves + home:
            grown = shapely.transform(outline, lambda p, c=centre + move: p + c)
            low_x, low_y, high_x, high_y = shapely.bounds(grown)
            rows = slice(*np.searchsorted(y, [low_y, high_y]))
            columns = slice(*np.searchsorted(x, [low_x, high_x]))
            if rows.start == rows.stop or columns.start == columns.stop:
                continue
            points = shapely.points(*np.meshgrid(x[columns], y[rows]))
            shapely.prepare(grown)
            covers[rows, columns] += shapely.contains(grown, points)
            moved = shapely.transform(polygon, lambda p, m=move: p + m)
            distance = shapely.distance(moved, points)
            closer = distance < nearest[rows, columns]
            second[rows, columns] = np.where(
                closer, nearest[rows, columns], np.minimum(second[rows, columns], distance)
            )
            nearest[rows, columns] = np.minimum(nearest[rows, columns], distance)
    # the wall between two droplets lies where both are equally far; it is about half the difference away
    in_film = (covers > 1) & (second < nearest + film * FINER * size)
    fine = ((covers > 0) & ~in_film).astype(np.float64)
    picture = fine.reshape(shape[0] // FINER, FINER, shape[1] // FINER, FINER).mean(axis=(1, 3))
    picture = ndimage.gaussian_filter(picture, blur, mode="wrap")
    return np.asarray(picture + noise * np.random.default_rng(seed).normal(size=picture.shape))
