"""Outlines of polygons as shapely geometries, those that cross themselves or others, and cross products of vectors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array, Indices
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.kernels.library import FLAGS, INTEGER, INTEGERS, REALS, kernel
from jamlab.packing.neighbors import periodic_pairs

if TYPE_CHECKING:
    from jamlab.packing.packing import Packing


def cross(a: Array, b: Array) -> Array:
    """(m,) a_x b_y - a_y b_x of vectors (m, 2): positive if b lies counter-clockwise of a."""
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def polygon_areas(positions: Array, offsets: Indices) -> Array:
    """(n,) areas of polygons without rims, positive if counter-clockwise; arguments as in `Packing`."""
    r = positions - np.repeat(positions[offsets[:-1]], np.diff(offsets), axis=0)
    following = np.arange(1, offsets[-1] + 1)
    following[offsets[1:] - 1] = offsets[:-1]
    return np.asarray(np.add.reduceat(0.5 * cross(r, positions[following] - positions), offsets[:-1]))


_doubtful_outlines = kernel("doubtful_outlines", INTEGER, INTEGERS, REALS, FLAGS)


@checked
def self_crossings(positions: Array, offsets: NDArray[np.int64]) -> NDArray[np.int64]:
    """Polygons whose outline crosses itself; edges shrunk to rounding size do not count.

    Contacts keep different polygons apart, but nothing in the energy of Boromand et al. keeps a polygon from folding
    over itself. A minimiser can do that far above onset or with weak line tension; no such state is a packing.

    Args:
        positions: (n_vertices, 2) float64, each polygon whole, as in `Packing.positions`.
        offsets: (n + 1,) int64, as in `Packing.offsets`.

    Returns:
        (m,) int64, ascending.

    Raises:
        InputError: shapes that are not these, or offsets that do not cut the vertices into polygons.

    Example:
        >>> bow = np.array([[1.0, 1.0], [2.0, 2.0], [2.0, 1.0], [1.0, 2.0]])
        >>> square = bow[[0, 2, 1, 3]] + 2
        >>> jamlab.self_crossings(np.vstack([square, bow]), np.array([0, 4, 8]))
        array([1])
    """
    positions, offsets = np.asarray(positions), np.asarray(offsets)
    if positions.ndim != 2 or positions.shape[1] != 2 or offsets.ndim != 1 or len(offsets) < 1:
        raise InputError(f"positions {positions.shape} and offsets {offsets.shape}: must be (vertices, 2) and (n + 1,)")
    if offsets[0] != 0 or offsets[-1] != len(positions) or (np.diff(offsets) < 3).any():
        raise InputError(f"offsets: must rise from 0 to {len(positions)}, the number of vertices, by 3 or more")
    positions, offsets = np.ascontiguousarray(positions, float), np.ascontiguousarray(offsets, np.int64)
    doubtful = np.empty(len(offsets) - 1, dtype=bool)
    if not _doubtful_outlines(len(doubtful), offsets, positions, doubtful):
        return np.empty(0, dtype=np.int64)
    import shapely  # only where outlines are looked at: disks have none

    shapes = outlines(positions, offsets, np.flatnonzero(doubtful))
    crossed = ~shapely.is_valid(shapes)
    suspects = np.flatnonzero(doubtful)[crossed]
    if not len(suspects):
        return np.asarray(suspects)
    size = float(np.ptp(positions, axis=0).max())
    points = shapely.remove_repeated_points(shapes[crossed], 1e-12 * size)
    return np.asarray(suspects[~shapely.is_valid(points)])


def outlines(
    positions: Array, offsets: NDArray[np.int64], kept: NDArray[np.int64] | None = None
) -> NDArray[np.object_]:
    """All polygons, or some, as shapely geometries."""
    import shapely

    size = np.diff(offsets)
    if kept is not None:
        some = np.zeros(len(size), dtype=bool)
        some[kept] = True
        positions, size = positions[np.repeat(some, size)], size[kept]
    return np.asarray(shapely.polygons(shapely.linearrings(positions, indices=np.repeat(np.arange(len(size)), size))))


def refuse_crossings(packing: Packing, *, within: bool = False) -> None:
    """Refuse droplets whose outlines cross, and one in the middle of another: no contact form keeps them apart from
    there. `within`: look only at those that may lie in the middle of others."""
    import shapely

    starts, shapes = np.asarray(packing.offsets)[:-1], packing.outlines()
    low, high = (bound.reduceat(packing.positions, starts, axis=0) for bound in (np.minimum, np.maximum))
    middle, size = 0.5 * (low + high), high - low
    near = periodic_pairs(middle, packing.box, 0.5 * np.hypot(*size.T))
    reach = size[near.i] - size[near.j] if within else size[near.i] + size[near.j]
    suspect = np.all(np.abs(near.r) <= 0.5 * np.abs(reach), axis=1)
    i, j = near.i[suspect], near.j[suspect]
    shift = np.repeat(near.r[suspect] - (middle[j] - middle[i]), shapely.get_num_coordinates(shapes[j]), axis=0)
    others = shapely.transform(shapes[j], lambda x: x + shift)
    crossed = np.flatnonzero(shapely.intersects(shapes[i], others) & ~shapely.touches(shapes[i], others))
    if len(crossed):
        raise crossing_error(int(i[crossed[0]]), int(j[crossed[0]]))


def crossing_error(m: int, n: int) -> InputError:
    """What is said of two polygons whose outlines cross."""
    return InputError(f"outlines of polygons {m} and {n} cross: no contact form keeps them apart from there")
