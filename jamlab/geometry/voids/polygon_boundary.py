"""The boundary of what deformable polygons with rims cover: straight pieces and arcs, in closed form.

A polygon with its rim is the union of the polygon and of a capsule around every edge: the points within w = delta/2 of
the edge. Its outline runs along the edges, moved outwards by w, and along arcs of radius w around convex corners. Each
of these elements is cut by the capsules of other edges: those of other particles, and of the same particle where it is
not convex. A capsule is convex, and two capsules around edges that do not cross meet in at most two points, so that a
capsule hides one interval of an element. What no capsule hides is free boundary.

Disks leave free arcs, each followed by the arc of the disk that it meets.
"""

from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import BoundaryError
from jamlab.geometry.particle_shape import disk_radii
from jamlab.geometry.power_cells import find_chords, find_free_arcs
from jamlab.geometry.rims import edge_rings
from jamlab.geometry.voids.boundary_loops import Boundary, Pieces, chain_pieces, join_loose_ends
from jamlab.kernels.library import INTEGER, INTEGERS, REAL, REALS, kernel
from jamlab.packing.neighbors import MOST_IMAGES, periodic_pairs, search_lattice
from jamlab.packing.packing import Packing

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
