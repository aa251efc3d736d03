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

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array, Indices
from jamlab.kernels.library import INTEGER, INTEGERS, REALS, kernel
from jamlab.packing.derived import per_packing
from jamlab.packing.neighbors import Pairs, periodic_pairs
from jamlab.packing.packing import Packing


@dataclass(frozen=True)
class CellRounding:
    """What rounding leaves of cells and gaps."""

    # a cell smaller than this part of R^2, or a void than this of A/n, is a hundred times rounding
    empty: float = 1e-14
    # Disks nearer than this part of R_i + R_j touch: rounding of a minimum (forces to 1e-14) must not open a
    # void.
    touch: float = 1e-12


CELL_ROUNDING = CellRounding()


_TURN = 2 * np.pi
_clip_chords = kernel("clip_chords", INTEGER, INTEGERS, INTEGERS, REALS, REALS, REALS, REALS, REALS)


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
    chords: Chords
    length: Array  # (m,) l, length of the part of each chord that bounds the cell; 0 if other disks hide it


@per_packing
def disk_cells(packing: Packing) -> DiskCells:
    """Cut every disk of an SP packing by its power cell."""
    chords, arcs = free_arcs(packing)
    return cut_disks(chords, arcs, 0.5 * packing.disk_diameters)


@per_packing
def free_arcs(packing: Packing) -> tuple[Chords, Arcs]:
    """Common chords of the disks of an SP packing that overlap, or touch within `touch`, and the arcs between them."""
    radius = 0.5 * packing.disk_diameters
    near = periodic_pairs(packing.positions, packing.box, radius * (1 + 2 * CELL_ROUNDING.touch))
    chords = find_chords(near, radius)
    return chords, find_free_arcs(chords)


def cut_disks(chords: Chords, arcs: Arcs, radius: Array) -> DiskCells:
    """Cut disks of the given radii, (n,), by the chords of all pairs that overlap; see `disk_cells`."""
    length, n = _clip(chords), len(radius)
    free = _sum_by_disk(arcs.i, arcs.angle, n)
    area = 0.5 * (radius**2 * free + _sum_by_disk(chords.i, chords.height * length, n))
    perimeter = radius * free + _sum_by_disk(chords.i, length, n)
    empty = area <= CELL_ROUNDING.empty * radius**2
    area[empty] = perimeter[empty] = 0.0
    length[empty[chords.i]] = 0.0
    return DiskCells(area, perimeter, chords, length)


def _clip(chords: Chords) -> Array:
    """(m,) length of each chord inside all other half planes n_k . x <= h_k of its disk."""
    length = np.empty(len(chords.i))
    lines = (chords.normal, chords.height, chords.distance, chords.half)
    _clip_chords(len(length), chords.i, chords.first, *lines, length)
    return length


def radical_height(distance: Array, radius: Array, other: Array) -> Array:
    """h = (r^2 + R_i^2 - R_j^2)/(2 r), distance of the radical line from the centre of disk i; r > 0."""
    return 0.5 * (distance + (radius - other) * (radius + other) / distance)


def _sum_by_disk(disk: Indices, values: Array, n: int) -> Array:
    return np.asarray(np.bincount(disk, values, minlength=n), dtype=np.float64)


def find_chords(near: Pairs, radius: Array) -> Chords:
    """Find the chords of all pairs that overlap or touch, seen from both disks. Disks that overlap or stand apart by no
    more than `touch` are joined by a chord of length zero, which ends an arc on either disk where they touch."""
    n, swallowed, apart = len(radius), np.zeros(len(radius), dtype=bool), np.hypot(*near.r.T)
    inside = apart + radius[near.j] <= radius[near.i]
    swallowed[near.j[inside]] = True  # of two equal disks in one place, i < j stays
    swallowed[near.i[~inside & (apart + radius[near.i] <= radius[near.j])]] = True
    near = near.select(~(swallowed[near.i] | swallowed[near.j]))
    distance, radius_i, radius_j = np.hypot(*near.r.T), radius[near.i], radius[near.j]
    height_i, height_j = radical_height(distance, radius_i, radius_j), radical_height(distance, radius_j, radius_i)
    tangent = np.abs(distance - radius_i - radius_j) <= CELL_ROUNDING.touch * (radius_i + radius_j)
    height_i, height_j = np.where(tangent, radius_i, height_i), np.where(tangent, radius_j, height_j)
    cut = (distance < radius_i + radius_j) & (np.abs(height_i) < radius_i) & (np.abs(height_j) < radius_j)
    real = tangent | cut
    near, distance, height_i, height_j = near.select(real), distance[real], height_i[real], height_j[real]
    half = np.sqrt((radius_i[real] - height_i) * (radius_i[real] + height_i))
    disk, unit = np.concatenate([near.i, near.j]), near.r / distance[:, None]
    order = np.argsort(disk, kind="stable")
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    shift, height = np.concatenate([near.shift, -near.shift]), np.concatenate([height_i, height_j])
    return Chords(
        disk[order], np.concatenate([near.j, near.i])[order], np.concatenate([unit, -unit])[order],
        np.tile(distance, 2)[order], height[order], np.tile(half, 2)[order], np.roll(place, len(half))[order],
        shift[order], np.searchsorted(disk[order], np.arange(n + 1)), swallowed,
    )  # fmt: skip


def find_free_arcs(chords: Chords) -> Arcs:
    """Find what no other disk covers of the circles that have chords, then the whole circles. A chord cuts the angles
    from theta - alpha to theta + alpha, alpha = arctan2(c, h), out of its circle. They are counted from the start of
    the first cut of each disk, so that no free arc runs through zero."""
    m, first = len(chords.i), chords.first
    theta, alpha = np.arctan2(*chords.normal.T[::-1]), np.arctan2(chords.half, chords.height)
    start = np.mod(theta - alpha - (theta - alpha)[first[chords.i]], _TURN)
    through = np.flatnonzero(start + 2 * alpha > _TURN)  # zero: they cover its other side too
    row = np.concatenate([np.arange(m), through])
    start, end = np.append(start, np.zeros(len(through))), start + 2 * alpha
    end = np.append(np.minimum(end, _TURN), end[through] - _TURN)
    order = np.lexsort((np.arange(len(row)), start, chords.i[row]))
    row, start, end = row[order], start[order], end[order]
    disk = chords.i[row]
    so_far = _latest(disk, end)  # the cut of the disk up to here that ends last
    covered, by = end[so_far], row[so_far]
    last = np.append(disk[1:] != disk[:-1], np.ones(min(len(disk), 1), dtype=bool))
    following = np.where(last, first[disk], np.append(row[1:], 0)[: len(row)])  # after the last gap comes that at zero
    gap = np.where(last, _TURN, np.append(start[1:], 0.0)[: len(row)]) - covered
    free, whole = np.flatnonzero(gap > 0), np.flatnonzero((np.diff(first) == 0) & ~chords.swallowed)
    none, begins = np.full(len(whole), -1), np.mod((theta + alpha)[by[free]], _TURN)
    return Arcs(
        np.append(disk[free], whole), np.append(begins, np.zeros(len(whole))),
        np.append(gap[free], np.full(len(whole), _TURN)), np.append(by[free], none), np.append(following[free], none),
    )  # fmt: skip


def _latest(owner: Indices, end: Array) -> Indices:
    """(m,) of the intervals of one owner up to each, that which ends last. Owners, (m,), ascend."""
    order = np.lexsort((end, owner))
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    return np.asarray(order[np.maximum.accumulate(rank)])
