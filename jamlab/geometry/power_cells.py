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
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from jamlab.errors import InputError
from jamlab.geometry.intervals import sweep_intervals
from jamlab.packing.neighbors import Pairs, periodic_pairs
from jamlab.packing.packing import Packing

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

BLOCK = 1_000_000  # chord-against-line tests held in memory at a time: 0.2 GB
EMPTY = 1e-14  # a cell smaller than this part of R^2 is rounding: a hundred times that of a double in some sums


@dataclass(frozen=True)
class DiskCells:
    """Disks cut by their power cells.

    A disk that lies inside another (internally tangent counts as inside) has an empty cell. Of equal disks in one place
    the one with the lowest index keeps its cell.

    Attributes:
        area: (n,) area of each cut disk; the sum is the area of the union of all disks.
        perimeter: (n,) perimeter of each cut disk, arcs and chords; 0 where it is empty.
        free_angle: (n,) Theta, angle of the circle that no other disk covers; sum(R Theta) is the length of the
            boundary of the union.
        chord_i, chord_j: (m,) int64, chord m bounds disk i towards (an image of) disk j. Every overlap gives two rows,
            one from each side; disks with empty cells inside others give none. Sorted by i.
        chord_normal: (m, 2) unit vector from the centre of i to that of j.
        chord_height: (m,) h, distance of the chord from the centre of i along the normal; negative if the centre is cut
            off.
        chord_length: (m,) l, length of the part of the chord that bounds the cell; 0 if other disks hide it.
        chord_pair: (m,) int64, row of the same chord seen from disk j.
        chord_shift: (m, 2) int64, which image of disk j: multiples of the two rows of the box.
        arc_i: (k,) int64, disk that each free arc belongs to.
        arc_start: (k,) angle at which the arc begins; it runs counter-clockwise.
        arc_angle: (k,) angle that the arc spans.
        arc_from, arc_to: (k,) int64, rows of the chords at which the arc begins and ends; -1 for a whole circle.
    """

    area: Array
    perimeter: Array
    free_angle: Array
    chord_i: Indices
    chord_j: Indices
    chord_normal: Array
    chord_height: Array
    chord_length: Array
    chord_pair: Indices
    chord_shift: Indices
    arc_i: Indices
    arc_start: Array
    arc_angle: Array
    arc_from: Indices
    arc_to: Indices


@dataclass(frozen=True)
class _Chords:
    """Common chords seen from disk i, not yet clipped by other disks; sorted by i, first[i] is the first row of i."""

    i: Indices
    j: Indices
    normal: Array
    distance: Array
    height: Array
    half: Array
    pair: Indices
    shift: Indices
    first: Indices


def disk_cells(packing: Packing, touch: float = 0.0) -> DiskCells:
    """Cut every disk of an SP packing by its power cell.

    Args:
        packing: SP.
        touch: disks that overlap or stand apart by no more than this part of R_i + R_j are joined by a chord of length
            zero, which ends an arc on either disk where they touch.

    Raises:
        InputError: for a DP packing; if disks reach over more periodic images than fit in memory.
    """
    if packing.diameters is None:
        raise InputError(f"power cells cut disks (model sp), this packing has model {packing.model}")
    near = periodic_pairs(packing.positions, packing.box, float(packing.diameters.max()) * (1 + touch))
    return cut_disks(near, 0.5 * packing.diameters, touch)


def cut_disks(near: Pairs, radius: Array, touch: float = 0.0) -> DiskCells:
    """Cut disks of the given radii, (n,), of which all pairs that overlap (or touch) are listed; see `disk_cells`."""
    swallowed = _find_swallowed(near, radius)
    chords = _find_chords(near, radius, swallowed, touch)
    length = _clip_chords(chords)
    arc_i, arc_start, arc_angle, arc_from, arc_to = _find_free_arcs(chords, np.flatnonzero(~swallowed))
    n = len(radius)
    free = _sum_by_disk(arc_i, arc_angle, n)
    area = 0.5 * (radius**2 * free + _sum_by_disk(chords.i, chords.height * length, n))
    perimeter = radius * free + _sum_by_disk(chords.i, length, n)
    empty = area <= EMPTY * radius**2
    area[empty] = perimeter[empty] = 0.0
    length[empty[chords.i]] = 0.0
    return DiskCells(
        area, perimeter, free, chords.i, chords.j, chords.normal, chords.height, length, chords.pair, chords.shift,
        arc_i, arc_start, arc_angle, arc_from, arc_to,
    )  # fmt: skip


def cuts_overlap(near: Pairs, radius: Array) -> bool:
    """Whether a point lies inside three disks, or a disk inside another.

    What three disks share is bounded by arcs that lie in two other disks, so that two cuts of a circle overlap.
    """
    swallowed = _find_swallowed(near, radius)
    if swallowed.any():
        return True
    chords = _find_chords(near, radius, swallowed, 0.0)
    theta = np.arctan2(chords.normal[:, 1], chords.normal[:, 0])
    alpha = np.arctan2(chords.half, chords.height)
    order = np.lexsort((theta, chords.i))
    disk, theta, alpha = chords.i[order], theta[order], alpha[order]
    first = np.searchsorted(disk, disk)
    last = np.append(disk, -1)[1:] != disk
    after = np.where(last, first, np.arange(1, len(disk) + 1))
    room = theta[after] - theta + np.where(last, 2 * np.pi, 0.0)
    return bool((room < alpha + alpha[after]).any())


def radical_height(distance: Array, radius: Array, other: Array) -> Array:
    """h = (r^2 + R_i^2 - R_j^2)/(2 r), distance of the radical line from the centre of disk i; r > 0."""
    return 0.5 * (distance + (radius - other) * (radius + other) / distance)


def nested(distance: Array, radius: Array, other: Array) -> NDArray[np.bool_]:
    """Whether a disk lies inside the other, r + R_i <= R_j, which is h <= -R_i."""
    return np.asarray(distance + radius <= other)


def _sum_by_disk(disk: Indices, values: Array, n: int) -> Array:
    return np.asarray(np.bincount(disk, values, minlength=n), dtype=np.float64)


def _find_swallowed(near: Pairs, radius: Array) -> NDArray[np.bool_]:
    distance = np.hypot(*near.r.T)
    i_inside = nested(distance, radius[near.i], radius[near.j])
    j_inside = nested(distance, radius[near.j], radius[near.i])
    swallowed = np.zeros(len(radius), dtype=bool)
    swallowed[near.j[j_inside]] = True  # of two equal disks in one place, i < j stays
    swallowed[near.i[i_inside & ~j_inside]] = True
    return swallowed


def _find_chords(near: Pairs, radius: Array, swallowed: NDArray[np.bool_], touch: float) -> _Chords:
    kept = ~(swallowed[near.i] | swallowed[near.j])
    i, j, r, shift = near.i[kept], near.j[kept], near.r[kept], near.shift[kept]
    distance = np.hypot(*r.T)
    height, height_j = (radical_height(distance, radius[a], radius[b]) for a, b in ((i, j), (j, i)))
    reach = radius[i] + radius[j]
    cut = (distance < reach) & (np.abs(height) < radius[i]) & (np.abs(height_j) < radius[j])
    if touch > 0:
        touching = np.abs(distance - reach) <= touch * reach
        height, height_j = np.where(touching, radius[i], height), np.where(touching, radius[j], height_j)
        cut |= touching
    i, j, r, shift = i[cut], j[cut], r[cut], shift[cut]
    distance, height, height_j = distance[cut], height[cut], height_j[cut]
    half = np.sqrt((radius[i] - height) * (radius[i] + height))
    normal = r / distance[:, None]

    both = np.concatenate([i, j])
    order = np.argsort(both, kind="stable")
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    first = np.concatenate([[0], np.cumsum(np.bincount(both, minlength=len(radius)))])
    return _Chords(
        both[order],
        np.concatenate([j, i])[order],
        np.concatenate([normal, -normal])[order],
        np.tile(distance, 2)[order],
        np.concatenate([height, height_j])[order],
        np.tile(half, 2)[order],
        np.roll(place, -len(i))[order],
        np.concatenate([shift, -shift])[order],
        first,
    )


def _clip_chords(chords: _Chords) -> Array:
    """(m,) length of each chord inside all other half planes n_k . x <= h_k of its disk, block by block."""
    tests = np.diff(chords.first)[chords.i]
    blocks = np.unique(np.searchsorted(np.cumsum(tests), np.arange(0, tests.sum(), BLOCK)))
    bounds = [*blocks, len(tests)]
    return np.concatenate([np.empty(0), *(_clip_block(chords, a, b, tests[a:b]) for a, b in pairwise(bounds))])


def _clip_block(chords: _Chords, begin: int, end: int, tests: Indices) -> Array:
    """Points on chord e are h_e n_e + t tau_e, |t| <= c_e; line k keeps t (n_k . tau_e) <= h_k - h_e n_k . n_e.

    With s = n_k . tau_e = sin and q = n_k . n_e = cos of the angle between the normals, 1 - |q| = s^2/(1 + |q|) keeps
    the right-hand side exact where the lines are nearly parallel: both chords must agree on which line is in front. Of
    lines that coincide, that of the more distant disk is in front.
    """
    starts = np.cumsum(tests) - tests
    e = np.repeat(np.arange(begin, end), tests)
    k = np.arange(len(e)) - np.repeat(starts, tests) + chords.first[chords.i[e]]
    (n_ex, n_ey), (n_kx, n_ky) = chords.normal[e].T, chords.normal[k].T
    h_e, h_k = chords.height[e], chords.height[k]
    sine = n_ky * n_ex - n_kx * n_ey
    cosine = n_kx * n_ex + n_ky * n_ey
    facing = np.where(cosine < 0, -h_e, h_e)
    room = (h_k - facing) + facing * sine**2 / (1 + np.abs(cosine))

    parallel = sine == 0
    farther = (chords.distance[k] > chords.distance[e]) | ((chords.distance[k] == chords.distance[e]) & (k < e))
    hidden = parallel & ((room < 0) | ((room == 0) & (cosine > 0) & farther))
    with np.errstate(over="ignore"):  # nearly parallel lines may meet at infinity
        place = np.divide(room, sine, out=np.full_like(room, np.inf), where=~parallel)
    upper = np.where(hidden, -np.inf, np.where(sine >= 0, place, np.inf))
    lower = np.where(sine < 0, place, -np.inf)
    half = chords.half[begin:end]
    above = np.maximum(np.maximum.reduceat(lower, starts), -half)
    below = np.minimum(np.minimum.reduceat(upper, starts), half)
    return np.asarray(np.maximum(below - above, 0.0))


def _find_free_arcs(chords: _Chords, disks: Indices) -> tuple[Indices, Array, Array, Indices, Indices]:
    """Arcs outside the union of the cut angles [theta - alpha, theta + alpha], alpha = arctan2(c, h), of every disk.

    Angles are counted from the start of the first cut of each disk, so that no free arc runs through zero.
    """
    turn = 2 * np.pi
    theta = np.arctan2(chords.normal[:, 1], chords.normal[:, 0])
    alpha = np.arctan2(chords.half, chords.height)
    zero = (theta - alpha)[chords.first[chords.i]]
    start = np.mod(theta - alpha - zero, turn)
    end = start + 2 * alpha
    past = np.flatnonzero(end > turn)  # cuts that run through zero cover its other side too
    row = np.concatenate([np.arange(len(start)), past])
    disk = chords.i[row]
    start = np.concatenate([start, np.zeros(len(past))])
    end = np.concatenate([np.minimum(end, turn), end[past] - turn])

    order, reached = sweep_intervals(disk, start, end)
    begin_row, begin_at = row[reached], end[reached]  # the cut so far that ends last, disk by disk
    row, disk, start = row[order], disk[order], start[order]
    last = np.append(disk, -1)[1:] != disk
    gap = np.where(last, turn, np.append(start, 0.0)[1:]) - begin_at
    free = np.flatnonzero(gap > 0)
    begins, disk, last = begin_row[free], disk[free], last[free]
    ends = np.where(last, chords.first[disk], np.append(row, -1)[1:][free])  # after the last gap comes the cut at zero
    whole = disks[chords.first[disks] == chords.first[disks + 1]]
    none = np.full(len(whole), -1)
    return (
        np.concatenate([disk, whole]),
        np.concatenate([np.mod((theta + alpha)[begins], turn), np.zeros(len(whole))]),
        np.concatenate([gap[free], np.full(len(whole), turn)]),
        np.concatenate([begins, none]),
        np.concatenate([ends, none]),
    )
