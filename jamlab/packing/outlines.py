"""Outlines of polygons as shapely geometries, those that cross themselves, and cross products of vectors."""

from __future__ import annotations  # short types in help

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array, Indices
from jamlab.kernels.library import INTEGER, INTEGERS, REALS, kernel

_suspects = kernel("suspect_outlines", INTEGER, INTEGERS, REALS, INTEGERS)


def cross(a: Array, b: Array) -> Array:
    """(m,) a_x b_y - a_y b_x of vectors (m, 2): positive if b lies counter-clockwise of a."""
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def polygon_areas(positions: Array, offsets: Indices) -> Array:
    """(n,) areas of polygons without rims, positive if counter-clockwise; arguments as in `Packing`."""
    r = positions - np.repeat(positions[offsets[:-1]], np.diff(offsets), axis=0)
    following = np.arange(1, offsets[-1] + 1)
    following[offsets[1:] - 1] = offsets[:-1]
    return np.asarray(np.add.reduceat(0.5 * cross(r, positions[following] - positions), offsets[:-1]))


def self_crossings(positions: Array, offsets: NDArray[np.int64]) -> NDArray[np.int64]:
    """(m,) polygons whose outline crosses itself, ascending; edges shrunk to rounding size do not count. Arguments as
    in `Packing`.

    Contacts keep different polygons apart, but nothing in the energy of Boromand et al. keeps a polygon from folding
    over itself. A minimiser can do that far above onset or with weak line tension; no such state is a packing.
    """
    if not len(offsets) > 1:
        return np.empty(0, dtype=np.int64)
    suspects = np.empty(len(offsets) - 1, dtype=np.int64)
    bounds = np.ascontiguousarray(offsets, dtype=np.int64)
    count = _suspects(len(suspects), bounds, np.ascontiguousarray(positions), suspects)
    suspects = suspects[:count]
    if not len(suspects):
        return suspects
    import shapely  # judges what no arithmetic with a margin for rounding does

    sites = np.concatenate([np.arange(bounds[p], bounds[p + 1]) for p in suspects])
    shapes = outlines(positions[sites], np.append(0, np.cumsum(np.diff(bounds)[suspects])))
    crossed = np.asarray(~shapely.is_valid(shapes), dtype=np.bool_)
    suspects, shapes = suspects[crossed], shapes[crossed]
    if not len(suspects):
        return suspects
    rounding = 1e-12 * float(np.ptp(positions, axis=0).max())
    crossed = shapely.area(shapes) <= rounding * shapely.length(shapes)  # its vertices lie in one or two places, or so
    wide = ~crossed
    crossed[wide] = ~shapely.is_valid(shapely.remove_repeated_points(shapes[wide], rounding))
    return np.asarray(suspects[crossed])


def outlines(positions: Array, offsets: NDArray[np.int64]) -> NDArray[np.object_]:
    """All polygons as shapely geometries; empty ones of single points, which flat walls are."""
    import shapely

    counts = np.diff(offsets)
    found = np.full(len(counts), shapely.Polygon(), dtype=object)
    whole = np.repeat(counts > 1, counts)
    rings = shapely.linearrings(positions[whole], indices=np.repeat(np.arange(len(counts)), counts)[whole])
    found[counts > 1] = shapely.polygons(rings[: np.sum(counts > 1)])
    return found
