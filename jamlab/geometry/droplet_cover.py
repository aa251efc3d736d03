"""What droplets cover: their outlines with rims, cut exactly where they overlap, and the boundary that is left.

A polygon with its rim is the union of the polygon and of a capsule around every edge: the points within w = delta/2 of
the edge. Its outline runs along the edges, moved outwards by w, and along arcs of radius w around convex corners. Each
of these elements is cut by the capsules of other edges: those of other particles, and of the same particle where it is
not convex. Each capsule covers one interval of an element. Where polygons cross, or one lies in another, their insides
cover elements as well. By Green's theorem a part from p to q of the outline of a particle, with k others above it,
adds (p x q)/2 and the bulge of an arc, with weight 1/(k + 1), to the area of the particle, and with weight
1/(k + 1) - 1/k to the areas of the k others. The area of the union is the sum of these shares.
"""

from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any

import numpy as np

from jamlab.arrays import Array, Indices
from jamlab.errors import BoundaryError
from jamlab.geometry.boundary_pieces import Pieces
from jamlab.geometry.edge_rings import rim_width
from jamlab.kernels.library import INTEGER, INTEGERS, REAL, REALS, kernel
from jamlab.packing.derived import per_packing
from jamlab.packing.neighbors import MOST_IMAGES, search_lattice
from jamlab.packing.packing import Packing

LARGEST_GAP = 1e-6  # of a rim, in the boundary of a share: where outlines graze, their ends err by sqrt(rounding)
ROUNDINGS = 100  # of a coordinate, in the boundary of a share, which many pieces make: rims may be thinner than that

_OUT = (REALS, REALS, REALS, INTEGERS, REALS, INTEGERS, *[REALS] * 6, INTEGERS, REALS)
_cover = kernel("droplet_cover", INTEGER, INTEGERS, REALS, REALS, REAL, REAL, INTEGER, *_OUT)


class Meeting(IntEnum):
    """How outlines of polygons without rims meet, as in plugin/kernels/droplet_outlines.h."""

    APART = 0
    DOUBTFUL = 1  # some touch, within rounding
    INSIDE = 2  # one lies in another
    CROSSING = 3


@dataclass(frozen=True)
class DropletCover:
    """What the droplets of a DP packing cover."""

    share: Array  # (n,) area of each with its rim, every overlap shared equally between the particles that meet there
    area: Array  # (n,) area with its rim; a + p w + pi w^2 for a convex polygon
    perimeter: Array  # (n,) length of the outline with its rim; p + 2 pi w for a convex polygon
    meeting: Meeting  # of outlines without rims: the worst that two of them do
    met: tuple[int, int]  # the two, the lower number first; -1 where all are apart
    gap: float  # by which the boundary of a share fails to close: rounding, or several cuts in one point
    pieces: Pieces  # of the boundary of what all cover, first the straight ones
    following: Indices  # (k,) piece that comes next on the same outline; -1: one of another particle


@per_packing
def droplet_cover(packing: Packing) -> DropletCover:
    """Cut the outlines of a DP packing where they overlap. An edge shorter than 1e-12 of the perimeter has no direction
    and is left out. Where outlines coincide, or more than two cross in one point, so that the cuts do not fit, vertices
    are moved by 1e-10 of the rim, or by ten times their rounding."""
    found = _cut(packing, packing.positions)
    if _closes(packing, found):
        return found
    return replace(_cut(packing, packing.positions + _aside(packing)), meeting=found.meeting, met=found.met)


def _closes(packing: Packing, found: DropletCover) -> bool:
    gap = found.gap
    return gap <= LARGEST_GAP * rim_width(packing) or gap <= ROUNDINGS * _rounding(packing)


def _rounding(packing: Packing) -> float:
    return float(np.finfo(np.float64).eps * (np.abs(packing.positions).max() + np.abs(packing.box).max()))


def _aside(packing: Packing) -> Array:
    """(n_vertices, 2) moves that no two polygons share, alike for vertices in one place."""
    rng, n, w = np.random.default_rng(1), packing.n, rim_width(packing)
    wave, phase = rng.normal(size=(n, 2, 2)) / w, rng.uniform(0, 2 * np.pi, (n, 2))
    x = packing.positions - packing.positions[packing.polygons.offsets[:-1]][packing.particle]
    angle = np.einsum("vj,vjk->vk", x, wave[packing.particle]) + phase[packing.particle]
    return np.asarray(max(1e-10 * w, 10 * _rounding(packing)) * np.sin(angle))


def _cut(packing: Packing, positions: Array) -> DropletCover:
    n = packing.n
    share, area, perimeter = np.empty((3, n))
    meeting, gap = np.empty(3, dtype=np.int64), np.empty(1)

    def fill(room: int, search: Array) -> tuple[int, tuple[Any, ...]]:
        particle, following = np.empty((2, room), dtype=np.int64)
        start, end, centre = np.empty((3, room, 2))
        radius, begin, angle = np.empty((3, room))
        pieces = (particle, start, end, centre, radius, begin, angle, following)
        count = _cover(
            n, packing.polygons.offsets, positions, packing.box, rim_width(packing), MOST_IMAGES, room,
            share, area, perimeter, meeting, gap, *pieces, search,
        )  # fmt: skip
        return count, pieces

    *pieces, following = search_lattice(fill, 3 * len(positions) + 64)
    how, i, j = meeting.tolist()
    return DropletCover(share, area, perimeter, Meeting(how), (i, j), float(gap[0]), Pieces(*pieces), following)


def shared_areas(packing: Packing) -> Array:
    """(n,) area of each droplet with its rim, overlaps shared equally between those that meet there."""
    found = droplet_cover(packing)
    if not _closes(packing, found):
        raise BoundaryError(
            f"the outlines of the droplets do not close, by {found.gap:.3g}: too many boundaries meet in one point; "
            "move a particle there by 1e-6 of its size"
        )
    return found.share
