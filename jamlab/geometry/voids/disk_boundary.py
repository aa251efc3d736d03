"""The boundary of what disks cover: free arcs, each followed by the arc of the disk that it meets."""

import numpy as np

from jamlab.geometry.power_cells import disk_cells
from jamlab.geometry.voids.boundary_loops import Boundary, Pieces, chain_pieces, join_loose_ends
from jamlab.packing.packing import Packing

# Disks nearer than this part of R_i + R_j touch: rounding of a minimum (forces to 1e-14) must not open a void.
TOUCH = 1e-12


def trace_disks(packing: Packing) -> Boundary:
    """Trace the boundary of the union of the disks of an SP packing.

    Raises:
        BoundaryError: where the arcs cannot be chained (see `match_ends`).
    """
    assert packing.diameters is not None
    radius = 0.5 * packing.diameters
    cells = disk_cells(packing, TOUCH)
    disk = cells.arc_i
    stop = cells.arc_start + cells.arc_angle
    centre = packing.positions[disk]
    start, end = (
        centre + radius[disk][:, None] * np.column_stack([np.cos(a), np.sin(a)]) for a in (cells.arc_start, stop)
    )
    pieces = Pieces(disk, start, end, centre, radius[disk], cells.arc_start, cells.arc_angle)

    arcs = np.arange(len(disk))
    cut = cells.arc_from >= 0
    begins_at = np.full(len(cells.chord_i), -1)
    begins_at[cells.arc_from[cut]] = arcs[cut]
    following, shift = arcs.copy(), np.zeros((len(arcs), 2), dtype=np.int64)
    following[cut] = begins_at[cells.chord_pair[cells.arc_to[cut]]]
    shift[cut] = cells.chord_shift[cells.arc_to[cut]]
    join_loose_ends(pieces, following, shift, packing.box, float(radius.max()))
    return chain_pieces(pieces, following, shift)
