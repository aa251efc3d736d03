"""Find neighbours in a periodic parallelogram, exactly for any tilt and for boxes smaller than the cutoff.

The lattice is first reduced to its shortest vectors (Lagrange-Gauss), so that few images are needed even in a strongly
sheared box. The points are then wrapped into the reduced cell and sorted into bins, of which every point searches those
that the cutoff reaches, in compiled code (`plugin/kernels/periodic_grid.h`). Wrapping only serves the search: the
vectors returned are computed from the points as they were given.

The library vesin lists pairs too. It knows neither two sets of points, nor cutoffs that
vary from pair to pair, nor the copies that cells need.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array, Indices, Mask
from jamlab.errors import InputError
from jamlab.kernels.library import INTEGER, INTEGERS, REAL, REALS, kernel
from jamlab.packing.magnitudes import ROUNDING

MOST_IMAGES = 20_000_000  # copies of points that a search may reach: more take minutes, and gigabytes to list

_OUT = (INTEGER, INTEGERS, INTEGERS, REALS, INTEGERS, REALS)
_neighbors = kernel("periodic_neighbors", INTEGER, REALS, REALS, INTEGER, REALS, REALS, REALS, INTEGER, REAL, *_OUT)
_TOO_MANY_IMAGES = -1  # as in periodic_grid.h


@dataclass(frozen=True)
class Pairs:
    """Pairs of points nearer than a cutoff, sorted by i, then j, then shift."""

    i: Indices  # (m,) int64, first point
    j: Indices  # (m,) int64, second point
    r: Array  # (m, 2) float64, vector from i to the periodic image of j: x_j - x_i + shift @ box
    shift: Indices  # (m, 2) int64, which image of j: multiples of the two rows of the box

    def select(self, rows: NDArray[np.bool_] | Indices) -> "Pairs":
        """Keep some rows, by mask or by number."""
        return Pairs(self.i[rows], self.j[rows], self.r[rows], self.shift[rows])

    def among(self, held: Mask) -> "Pairs":
        """Those between points that are held, (n,), numbered as if there were no others."""
        number, found = np.cumsum(held) - 1, self.select(held[self.i] & held[self.j])
        return Pairs(number[found.i], number[found.j], found.r, found.shift)


def positive_image(shift: Indices) -> NDArray[np.bool_]:
    """(m,) whether an image (m, 2) stands for itself and its opposite: the first shift that is not 0 is positive."""
    return np.asarray((shift[:, 0] > 0) | ((shift[:, 0] == 0) & (shift[:, 1] > 0)))


def moves_home(points: Array, box: Array) -> Array:
    """(n, 2) translations that bring each point into the cell."""
    return np.asarray(-np.floor(points @ np.linalg.inv(box)) @ box)


def shortest_images(vectors: Array, box: Array) -> Indices:
    """(m, 2) lattice vectors to take off each vector (m, 2) to leave its shortest image, `vectors - found @ box`.

    Exact for any tilt: the lattice is reduced, and of the nine images around the rounded one the shortest is taken. A
    vector that no image is shorter than, but for rounding, has zeros. `box`: (2, 2), rows are the lattice vectors."""
    cell, whole = reduced_cell(box)
    found = np.zeros(vectors.shape, dtype=np.int64)
    long = np.flatnonzero(np.hypot(*vectors.T) >= 0.5 * np.hypot(*cell[0]) * (1 - ROUNDING))
    around = np.array([[i, j] for i in (-1, 0, 1) for j in (-1, 0, 1)])
    near = np.rint(vectors[long] @ np.linalg.inv(cell))[:, None] + around
    lengths = np.hypot(*np.moveaxis(vectors[long, None] - near @ cell, -1, 0))
    best = lengths.argmin(axis=1)[:, None]
    shorter = np.take_along_axis(lengths, best, axis=1)[:, 0] < np.hypot(*vectors[long].T) * (1 - ROUNDING)
    taken = np.take_along_axis(near, best[..., None], axis=1)[:, 0].astype(np.int64) @ whole
    found[long] = np.where(shorter[:, None], taken, 0)
    return found


def reduced_cell(box: Array) -> tuple[Array, Indices]:
    """Shortest vectors of a lattice, and how many of each vector of the box they are: whole @ box."""
    cell, whole = np.array(box), np.eye(2, dtype=np.int64)
    while True:
        if cell[1] @ cell[1] < cell[0] @ cell[0]:
            cell, whole = cell[::-1], whole[::-1]
        times = int(np.rint((cell[0] @ cell[1]) / (cell[0] @ cell[0])))
        shorter = cell[1] - times * cell[0]
        if not shorter @ shorter < cell[1] @ cell[1]:
            return cell, whole
        cell, whole = np.array([cell[0], shorter]), np.array([whole[0], whole[1] - times * whole[0]])


def periodic_pairs(points: Array, box: Array, cutoff: float | Array) -> Pairs:
    """Find every pair of points of one set nearer than the cutoff, once.

    Args:
        points: (n, 2), anywhere (need not lie inside the box).
        box: (2, 2), rows are the lattice vectors, box[0, 1] = 0, any tilt box[1, 0].
        cutoff: distance, in the unit of the points; or (n,) a reach of each point, the cutoff of two is the sum.

    Returns:
        Pairs with i <= j. Several images of one pair each have their own row. i == j is a point and its own image; of
        the two opposite images the one with positive shift is listed.
    """
    return _search(points, points, box, cutoff, once=True)


def periodic_neighbors(points_a: Array, points_b: Array, box: Array, cutoff: float) -> Pairs:
    """Find every point of set b, in every periodic image, that is nearer than the cutoff to a point of set a.

    Args:
        points_a: (n_a, 2), anywhere.
        points_b: (n_b, 2), anywhere.
        box: (2, 2), rows are the lattice vectors, box[0, 1] = 0, any tilt box[1, 0].
        cutoff: distance, in the unit of the points.

    Returns:
        Pairs with i from set a and j from set b; points that coincide are neighbours at r = 0.
    """
    return _search(points_a, points_b, box, cutoff, once=False)


def periodic_copies(points: Array, box: Array, reach: float) -> tuple[Indices, Indices]:
    """Copy the points of the primitive cell to all places within reach of it.

    Args:
        points: (n, 2), anywhere.
        box: (2, 2), rows are the lattice vectors, box[0, 1] = 0, any tilt box[1, 0].
        reach: distance, in the unit of the points.

    Returns:
        (m,) int64, point, and (m, 2) int64, shift of its copy in lattice vectors: points + shift @ box. The first n
        rows are the points 0 .. n - 1 moved into one cell.
    """
    cell, whole = reduced_cell(box)
    place = points @ np.linalg.inv(cell)
    wrap = np.floor(place)
    margin = reach * np.hypot(*cell[::-1].T) / abs(np.linalg.det(cell)) + 1e-9  # in fractions of the cell, and rounding
    layers = np.ceil(margin)
    if not (2 * layers + 1).prod() * len(points) <= MOST_IMAGES:
        raise InputError(f"cutoff {reach:.6g} reaches over too many periodic images of box {cell.tolist()}")
    first, second = (np.arange(-layer, layer + 1) for layer in layers)
    images = np.stack(np.meshgrid(first, second, indexing="ij"), axis=-1).reshape(-1, 2)
    images = images[np.argsort((images != 0).any(axis=1), kind="stable")]  # the cell itself comes first
    f = place - wrap + images[:, None]
    which, source = np.nonzero(((f >= -margin) & (f <= 1 + margin)).all(axis=2))
    return source, (images[which] - wrap[source]).astype(np.int64) @ whole


def search_lattice(fill: Callable[[int, Array], tuple[int, tuple[Any, ...]]], room: int) -> tuple[Any, ...]:
    """Call a kernel that searches a periodic lattice with as much room as it needs.

    Args:
        fill: (room, search) -> what the kernel returned, and its arrays with so many rows; search: (5,) out, reach and
            reduced cell of the search.
        room: rows to try first.
    """
    search = np.zeros(5)
    count, arrays = fill(room, search)
    if count > room:
        count, arrays = fill(count, search)
    if count < 0:
        reach, cell = search[0], search[1:].reshape(2, 2).tolist()
        if count == _TOO_MANY_IMAGES:
            raise InputError(f"cutoff {reach:.6g} reaches over too many periodic images of box {cell}")
        raise InputError(f"a point lies more than {2**52:.2g} boxes away from box {cell}: move it into the box")
    return tuple(array[:count] for array in arrays)


def _search(points_a: Array, points_b: Array, box: Array, cutoff: float | Array, once: bool) -> Pairs:
    if not (np.isfinite(cutoff).all() and np.min(cutoff) >= 0 and np.max(cutoff) > 0):
        raise InputError(f"cutoff is {cutoff}: must be a positive finite number, the reach of a point 0 or more")
    a, b, box = (np.ascontiguousarray(values, dtype=np.float64) for values in (points_a, points_b, box))
    reach_a = np.ascontiguousarray(np.broadcast_to(cutoff, len(a)), dtype=np.float64)
    reach_b = reach_a if np.ndim(cutoff) else np.zeros(len(b))

    def fill(room: int, search: Array) -> tuple[int, tuple[Any, ...]]:
        i, j = np.empty(room, dtype=np.int64), np.empty(room, dtype=np.int64)
        r, shift = np.empty((room, 2)), np.empty((room, 2), dtype=np.int64)
        arguments = (len(a), a, reach_a, len(b), b, reach_b, box, once, MOST_IMAGES, room)
        return _neighbors(*arguments, i, j, r, shift, search), (i, j, r, shift)

    return Pairs(*search_lattice(fill, 4 * (len(a) + len(b)) + 64))
