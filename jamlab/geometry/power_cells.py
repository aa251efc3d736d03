"""Power (Laguerre) cells of disks: the exact union of overlapping disks, in closed form.

The power of a point x to disk i is |x - x_i|^2 - R_i^2, and the power cell of i holds the points whose power to i is
the smallest. Cutting every disk by its power cell divides the union of the disks without gap or overlap, however deeply
they are compressed. Two disks that overlap, at distance r along n_ij, meet on the radical line n_ij . x = h_ij,

    h_ij = (r^2 + R_i^2 - R_j^2) / (2 r)        (measured from the centre of i; h_ij + h_ji = r),

which carries their common chord of half length c = sqrt(R_i^2 - h_ij^2). What is left of disk i is bounded by free
arcs, of total angle Theta_i, and by those parts of the chords, of length l_ij, that no other disk cuts away. The
divergence theorem gives

    area_i      = (1/2) R_i^2 Theta_i + (1/2) sum_j h_ij l_ij
    perimeter_i = R_i Theta_i + sum_j l_ij.

Source: F. Aurenhammer, SIAM J. Comput. 16, 78 (1987); H. Edelsbrunner, Discrete Comput. Geom. 13, 415 (1995).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array, Indices
from jamlab.geometry.particle_shape import disk_radii
from jamlab.geometry.vertex_contacts import touching_disks
from jamlab.kernels.library import FLAGS, INTEGER, INTEGERS, REAL, REALS, kernel
from jamlab.packing.derived import per_packing
from jamlab.packing.neighbors import Pairs
from jamlab.packing.packing import Packing

EMPTY = 1e-14  # a cell smaller than this part of R^2 is rounding: a hundred times that of a double in some sums

_disk_chords = kernel(
    "disk_chords", INTEGER, INTEGERS, INTEGERS, REALS, INTEGERS, INTEGER, REALS, REAL,
    INTEGERS, INTEGERS, REALS, REALS, REALS, REALS, INTEGERS, INTEGERS, INTEGERS, FLAGS,
)  # fmt: skip
_clip_chords = kernel("clip_chords", INTEGER, INTEGERS, REALS, REALS, REALS, REALS, REALS)
_free_arcs = kernel(
    "free_arcs", INTEGER, INTEGERS, REALS, REALS, REALS, FLAGS, INTEGERS, REALS, REALS, INTEGERS, INTEGERS
)
_cuts_overlap = kernel("cuts_overlap", INTEGER, INTEGERS, REALS, REALS, REALS)


@dataclass(frozen=True)
class Chords:
    """Common chords of overlapping disks: chord m bounds disk i towards (an image of) disk j. Every overlap gives two
    rows, one from each side; disks inside others give none."""

    i: Indices  # (m,) int64, ascending
    j: Indices
    normal: Array  # (m, 2) unit vector from the centre of i to that of j
    distance: Array  # (m,) of the centres
    # (m,) h, distance of the chord from the centre of i along the normal; negative if the centre is cut off
    height: Array
    half: Array  # (m,) half length of the whole chord
    pair: Indices  # (m,) int64, row of the same chord seen from disk j
    shift: Indices  # (m, 2) int64, which image of disk j: multiples of the two rows of the box
    first: Indices  # (n + 1,) int64, first row of each disk
    swallowed: NDArray[np.bool_]  # (n,) bool, disks inside others


@dataclass(frozen=True)
class Arcs:
    """Arcs of circles that no other disk covers."""

    i: Indices  # (k,) int64, disk of each arc
    start: Array  # (k,) angle at which the arc begins; it runs counter-clockwise
    angle: Array  # (k,) angle that the arc spans
    # begin, end: (k,) int64, rows of the chords at which the arc begins and ends; -1 for a whole circle
    begin: Indices
    end: Indices


@dataclass(frozen=True)
class DiskCells:
    """Disks cut by their power cells. A disk that lies inside another (internally tangent counts as inside) has an
    empty cell. Of equal disks in one place the one with the lowest index keeps its cell."""

    area: Array  # (n,) area of each cut disk; the sum is the area of the union of all disks
    perimeter: Array  # (n,) perimeter of each cut disk, arcs and chords; 0 where it is empty
    # (n,) Theta, angle of the circle that no other disk covers; sum(R Theta) is the length of the boundary of the union
    free_angle: Array
    chords: Chords
    length: Array  # (m,) l, length of the part of each chord that bounds the cell; 0 if other disks hide it
    arcs: Arcs


@per_packing
def disk_cells(packing: Packing) -> DiskCells:
    """Cut every disk of an SP packing by its power cell."""
    return cut_disks(disk_chords(packing), disk_radii(packing))


@per_packing
def disk_chords(packing: Packing) -> Chords:
    """Find the common chords of the disks of an SP packing that overlap."""
    return find_chords(touching_disks(packing), disk_radii(packing))


def cut_disks(chords: Chords, radius: Array) -> DiskCells:
    """Cut disks of the given radii, (n,), by the chords of all pairs that overlap; see `disk_cells`."""
    arcs, length, n = find_free_arcs(chords), np.empty(len(chords.i)), len(radius)
    _clip_chords(n, chords.first, chords.normal, chords.distance, chords.height, chords.half, length)
    free = _sum_by_disk(arcs.i, arcs.angle, n)
    area = 0.5 * (radius**2 * free + _sum_by_disk(chords.i, chords.height * length, n))
    perimeter = radius * free + _sum_by_disk(chords.i, length, n)
    empty = area <= EMPTY * radius**2
    area[empty] = perimeter[empty] = 0.0
    length[empty[chords.i]] = 0.0
    return DiskCells(area, perimeter, free, chords, length, arcs)


def cuts_overlap(chords: Chords) -> bool:
    """Whether a point lies inside three disks, or a disk inside another. What three disks share is bounded by arcs that
    lie in two other disks, so that two cuts of a circle overlap."""
    if chords.swallowed.any():
        return True
    return bool(_cuts_overlap(len(chords.swallowed), chords.first, chords.normal, chords.height, chords.half))


def radical_height(distance: Array, radius: Array, other: Array) -> Array:
    """h = (r^2 + R_i^2 - R_j^2)/(2 r), distance of the radical line from the centre of disk i; r > 0."""
    return 0.5 * (distance + (radius - other) * (radius + other) / distance)


def _sum_by_disk(disk: Indices, values: Array, n: int) -> Array:
    return np.asarray(np.bincount(disk, values, minlength=n), dtype=np.float64)


def find_chords(near: Pairs, radius: Array, touch: float = 0.0) -> Chords:
    """Find the chords of all pairs that overlap or touch, seen from both disks. `touch`: disks that overlap or stand
    apart by no more than this part of R_i + R_j are joined by a chord of length zero, which ends an arc on either disk
    where they touch."""
    n, room = len(radius), 2 * len(near.i)
    i, j, pair = np.empty((3, room), dtype=np.int64)
    distance, height, half = np.empty((3, room))
    normal, shift = np.empty((room, 2)), np.empty((room, 2), dtype=np.int64)
    first, swallowed = np.empty(n + 1, dtype=np.int64), np.empty(n, dtype=bool)
    rows: tuple[Any, ...] = (i, j, normal, distance, height, half, pair, shift)
    count = _disk_chords(len(near.i), near.i, near.j, near.r, near.shift, n, radius, touch, *rows, first, swallowed)
    return Chords(*[*(values[:count] for values in rows), first, swallowed])


def find_free_arcs(chords: Chords) -> Arcs:
    """Find what no other disk covers of the circles that have chords, then the whole circles."""
    n = len(chords.swallowed)
    (disk, begin, end), (start, angle) = np.empty((3, len(chords.i) + n), np.int64), np.empty((2, len(chords.i) + n))
    rows: tuple[Any, ...] = (disk, start, angle, begin, end)
    count = _free_arcs(n, chords.first, chords.normal, chords.height, chords.half, chords.swallowed, *rows)
    return Arcs(*(values[:count] for values in rows))
