"""The boundary of what disks cover: free arcs, each followed by the arc of the disk that it meets."""

import numpy as np

from jamlab.geometry.power_cells import find_chords, find_free_arcs, near_disks
from jamlab.geometry.voids.boundary_loops import Boundary, Pieces, chain_pieces, join_loose_ends
from jamlab.kernels.library import INTEGER, INTEGERS, REALS, kernel
from jamlab.packing.packing import Packing

_draw_arcs = kernel(
    "draw_arcs", INTEGER, INTEGERS, REALS, REALS, INTEGERS, INTEGERS, INTEGER, INTEGERS, INTEGERS, REALS, REALS,
    REALS, REALS, REALS, REALS, INTEGERS, INTEGERS,
)  # fmt: skip

# Disks nearer than this part of R_i + R_j touch: rounding of a minimum (forces to 1e-14) must not open a void.
TOUCH = 1e-12


def trace_disks(packing: Packing) -> Boundary:
    """Trace the boundary of the union of the disks of an SP packing.

    Raises:
        BoundaryError: where the arcs cannot be chained (see `match_ends`).
    """
    assert packing.diameters is not None
    radius = 0.5 * packing.diameters
    chords = find_chords(near_disks(packing, TOUCH), radius, TOUCH)
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
