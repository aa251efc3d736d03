"""The boundary of the covered part of a packing: straight and circular pieces, chained into loops.

Every piece runs counter-clockwise around its particle, so that the void lies on its right. A piece ends where another
particle begins, and the loop goes on there along that particle. Loops live on a torus: each piece has a periodic image
relative to the first piece of its loop, and a loop may wind around the torus instead of closing.

A polygon with its rim is the union of the polygon and of a capsule around every edge: the points within w = delta/2 of
the edge. Its outline runs along the edges, moved outwards by w, and along arcs of radius w around convex corners. Each
of these elements is cut by the capsules of other edges: those of other particles, and of the same particle where it is
not convex. A capsule is convex, and two capsules around edges that do not cross meet in at most two points, so that a
capsule hides one interval of an element. What no capsule hides is free boundary.

Disks leave free arcs, each followed by the arc of the disk that it meets.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from jamlab.arrays import Array, Indices
from jamlab.errors import BoundaryError
from jamlab.geometry.particle_shape import disk_radii
from jamlab.geometry.power_cells import find_chords, find_free_arcs
from jamlab.geometry.rims import edge_rings
from jamlab.kernels.library import INTEGER, INTEGERS, REAL, REALS, kernel
from jamlab.packing.neighbors import MOST_IMAGES, periodic_neighbors, periodic_pairs, search_lattice
from jamlab.packing.packing import Packing

JOINT = 1e-6  # ends of pieces this near, in radii, may be one corner: where circles graze, it errs by sqrt(rounding)

_chain_loops = kernel("chain_loops", INTEGER, INTEGERS, INTEGERS, INTEGERS, INTEGERS, INTEGERS, INTEGERS)


@dataclass(frozen=True)
class Pieces:
    """Pieces of a boundary, straight (radius 0) or circular, not yet chained."""

    particle: Indices  # (k,) int64, particle that each piece belongs to
    # start, end: (k, 2) end points
    start: Array
    end: Array
    centre: Array  # (k, 2) of the circle; of a straight piece its middle
    radius: Array  # (k,) of the circle; 0 for a straight piece
    begin: Array  # (k,) angle at which a circular piece begins; it runs counter-clockwise
    angle: Array  # (k,) angle that a circular piece spans, up to 2 pi; 0 for a straight piece


@dataclass(frozen=True)
class Boundary:
    """Pieces chained into loops."""

    pieces: Pieces  # the k pieces
    following: Indices  # (k,) int64, piece that comes next
    loop: Indices  # (k,) int64, loop that each piece belongs to
    image: Indices  # (k, 2) int64, lattice translation that puts each piece in line with the first of its loop
    winding: Indices  # (loops, 2) int64, lattice translation from the beginning of a loop to its end; zero if it closes
    origin: Indices  # (loops,) int64, piece with which each loop begins


def chain_pieces(pieces: Pieces, following: Indices, shift: Indices) -> Boundary:
    """Chain pieces into loops. `pieces`: k pieces; `following`: (k,) int64, a permutation: piece that comes next;
    `shift`: (k, 2) int64, which periodic image of it."""
    k = len(following)
    (loop, origin), (image, winding) = np.empty((2, k), dtype=np.int64), np.empty((2, k, 2), dtype=np.int64)
    loops = _chain_loops(k, following, shift, loop, image, winding, origin)
    assert loops >= 0, "every piece follows one other"
    return Boundary(pieces, following, loop, image, winding[:loops], origin[:loops])


def join_loose_ends(pieces: Pieces, following: Indices, shift: Indices, box: Array, size: float) -> None:
    """Fill in, in place, the pieces that come next where neighbours along the boundary are not known. Where three
    boundaries meet in one point, rounding may end a piece at one particle and begin the next at another. `pieces`: k
    pieces; `following`: (k,) int64, piece that comes next; -1 where it is not known; `shift`: (k, 2) int64, which
    periodic image of it; `box`: (2, 2); `size`: radius that `JOINT` refers to."""
    loose = np.flatnonzero(following < 0)
    if len(loose):
        free = np.setdiff1d(np.arange(len(following)), following)
        after, shift[loose] = match_ends(pieces.end[loose], pieces.start[free], box, JOINT * size)
        following[loose] = free[after]


def match_ends(ends: Array, starts: Array, box: Array, tolerance: float) -> tuple[Indices, Indices]:
    """Match ends of pieces with starts of pieces at the same place, one to one, with the least total distance. `ends`:
    (k, 2); `starts`: (k, 2); `box`: (2, 2); `tolerance`: largest distance. Returns (k,) int64, start that belongs to
    each end, and (k, 2) int64, which periodic image of it."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import min_weight_full_bipartite_matching

    near, k = periodic_neighbors(ends, starts, box, tolerance), len(ends)
    weight = np.hypot(*near.r.T) + 1e-3 * tolerance  # any positive constant will do: a sparse matrix would lose zeros
    try:
        end, start = min_weight_full_bipartite_matching(csr_array((weight, (near.i, near.j)), shape=(k, k)))
    except ValueError:
        lone = ends[np.bincount(near.i, minlength=k).argmin()]
        raise BoundaryError(
            f"the boundary of the particles does not close near {lone.tolist()}: too many "
            "boundaries meet in one point; move a particle there by 1e-6 of its size"
        ) from None
    key = near.i * k + near.j
    order = np.argsort(key, kind="stable")
    chosen = order[np.searchsorted(key[order], end * k + start)]
    return start[np.argsort(end)].astype(np.int64), near.shift[chosen][np.argsort(end)]


_draw_arcs = kernel(
    "draw_arcs", INTEGER, INTEGERS, REALS, REALS, INTEGERS, INTEGERS, INTEGER, INTEGERS, INTEGERS, REALS, REALS,
    REALS, REALS, REALS, REALS, INTEGERS, INTEGERS,
)  # fmt: skip

# Disks nearer than this part of R_i + R_j touch: rounding of a minimum (forces to 1e-14) must not open a void.
TOUCH = 1e-12


def trace_disks(packing: Packing) -> Boundary:
    """Trace the boundary of the union of the disks of an SP packing."""
    radius = disk_radii(packing)
    near = periodic_pairs(packing.positions, packing.box, radius * (1 + 2 * TOUCH))
    chords = find_chords(near, radius, TOUCH)
    arcs = find_free_arcs(chords)
    m = len(arcs.i)
    (start, end, centre), size = np.empty((3, m, 2)), np.empty(m)
    following, shift = np.empty(m, dtype=np.int64), np.empty((m, 2), dtype=np.int64)
    _draw_arcs(
        m, arcs.i, arcs.start, arcs.angle, arcs.begin, arcs.end, len(chords.i), chords.pair, chords.shift,
        packing.positions, radius, start, end, centre, size, following, shift,
    )  # fmt: skip
    pieces = Pieces(arcs.i, start, end, centre, size, arcs.start, arcs.angle)
    join_loose_ends(pieces, following, shift, packing.box, float(radius.max()))
    return chain_pieces(pieces, following, shift)


_RINGS = (INTEGERS, REALS, REALS, REALS, REALS, INTEGERS, INTEGERS, REALS, REAL)
_OUT = (INTEGERS, REALS, REALS, REALS, REALS, REALS, REALS, INTEGERS, INTEGERS, REALS)
_free_outlines = kernel("free_outlines", INTEGER, INTEGER, *_RINGS, REALS, REAL, INTEGER, *_OUT)
_OUTLINES_CROSS = -3


def trace_polygons(packing: Packing) -> Boundary:
    """Trace the boundary of the union of the polygons of a DP packing, each grown by its rim delta/2."""
    edges, crossing = edge_rings(packing), np.zeros(2, dtype=np.int64)

    def fill(room: int, search: Array) -> tuple[int, tuple[Any, ...]]:
        (owner, following), (radius, begin, angle) = np.empty((2, room), dtype=np.int64), np.empty((3, room))
        pieces = (owner, *np.empty((3, room, 2)), radius, begin, angle)
        count = _free_outlines(
            len(edges.tail), packing.n, *vars(edges).values(), packing.box, MOST_IMAGES, room,
            *pieces, following, crossing, search,
        )  # fmt: skip
        if count == _OUTLINES_CROSS:
            m, n = crossing
            raise BoundaryError(
                f"outlines of polygons {m} and {n} cross: push them apart; their rims alone may overlap"
            )
        return count, (*pieces, following)

    *traced, following = search_lattice(fill, 3 * len(edges.tail) + 64)
    pieces, shift = Pieces(*traced), np.zeros((len(following), 2), dtype=np.int64)
    join_loose_ends(pieces, following, shift, packing.box, edges.rim)
    return chain_pieces(pieces, following, shift)
