"""The boundary of the covered part of a packing: straight and circular pieces, chained into loops.

Every piece runs counter-clockwise around its particle, so that the void lies on its right. A piece ends where another
particle begins, and the loop continues along that particle. Loops live on a torus: each piece has a periodic image
relative to the first piece of its loop, and a loop may wind around the torus instead of closing.

A polygon with its rim is the union of the polygon and of a capsule around every edge: the points within w = delta/2 of
the edge. Its outline runs along the edges, moved outwards by w, and along arcs of radius w around convex corners. Each
of these elements is cut by the capsules of other edges: those of other particles, and of the same particle where it is
not convex. Each capsule hides one interval of an element, and what no capsule hides is free boundary.

Disks leave free arcs, each followed by the arc of the disk that it meets.
"""

from dataclasses import dataclass, fields

import numpy as np

from jamlab.arrays import Array, Indices
from jamlab.errors import BoundaryError
from jamlab.geometry.edge_capsules import EdgeRings, cut_arcs, cut_lines, edge_rings, free_parts, near_edges
from jamlab.geometry.mirrored_slab import mirrored
from jamlab.geometry.power_cells import free_arcs
from jamlab.packing.neighbors import periodic_neighbors
from jamlab.packing.outlines import cross
from jamlab.packing.packing import Packing

JOINT = 1e-6  # ends of pieces this near, in radii, may be one corner: where circles graze, it errs by sqrt(rounding)


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
    """Chain pieces into loops.

    Args:
        pieces: k pieces.
        following: (k,) int64, a permutation: piece that comes next.
        shift: (k, 2) int64, which periodic image of it.
    """
    assert (np.bincount(following, minlength=len(following)) == 1).all(), "every piece follows one other"
    first, ahead = np.arange(len(following)), following
    while not np.array_equal(lower := np.minimum(first, first[ahead]), first):  # twice as far ahead every time
        first, ahead = lower, ahead[ahead]
    behind, image = np.empty_like(following), np.zeros_like(shift)
    behind[following], image[following] = np.arange(len(following)), shift
    origin = np.flatnonzero(first == np.arange(len(first)))
    last, winding = behind[origin], image[origin].copy()
    behind[origin], image[origin] = origin, 0
    while (behind != first).any():
        image, behind = image + image[behind], behind[behind]
    loop = np.empty_like(following)
    loop[origin] = np.arange(len(origin))
    return Boundary(pieces, following, loop[first], image, image[last] + winding, origin)


def join_loose_ends(pieces: Pieces, following: Indices, shift: Indices, box: Array, size: float) -> None:
    """Fill in, in place, the pieces that come next where neighbours along the boundary are not known. Where three
    boundaries meet in one point, rounding may end a piece at one particle and begin the next at another.

    Args:
        pieces: k pieces.
        following: (k,) int64, piece that comes next; -1 where it is not known.
        shift: (k, 2) int64, which periodic image of it.
        box: (2, 2).
        size: radius that `JOINT` refers to.
    """
    known, taken = following >= 0, np.zeros(len(following), dtype=bool)
    taken[following[known]] = True
    loose, free = np.flatnonzero(~known), np.flatnonzero(~taken)
    if len(loose):
        after, shift[loose] = match_ends(pieces.end[loose], pieces.start[free], box, JOINT * size)
        following[loose] = free[after]


def match_ends(ends: Array, starts: Array, box: Array, tolerance: float) -> tuple[Indices, Indices]:
    """Match ends of pieces with starts of pieces at the same place, one to one, with the least total distance. `ends`:
    (k, 2); `starts`: (k, 2); `box`: (2, 2); `tolerance`: largest distance. Returns (k,) int64, start that belongs to
    each end, and (k, 2) int64, which periodic image of it."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import min_weight_full_bipartite_matching

    near, k = periodic_neighbors(ends, starts, box, tolerance), len(ends)
    if len(near.i) == k and (np.bincount(near.i, minlength=k) * np.bincount(near.j, minlength=k) == 1).all():
        return near.j, near.shift
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


def trace(packing: Packing) -> Boundary:
    """Trace the boundary of what particles cover, flat walls with all behind their planes. Where it would go on with a
    mirror image it goes on along the plane, to the next piece that comes from one."""
    whole: Boundary = packing.kind.boundary(mirrored(packing))
    if not packing.flat_walls.any():
        return whole
    (low, high), width, n = packing.planes, float(packing.box[0, 0]), packing.n - 2
    kept, after, comes = whole.pieces.particle < n, whole.following, np.zeros(len(whole.following), dtype=bool)
    comes[after] = ~kept
    parts = [Pieces(*(getattr(whole.pieces, f.name)[kept] for f in fields(Pieces)))]
    for points in (parts[0].start, parts[0].end, parts[0].centre):
        points[:, 1] += low
    order = [np.where(kept[after], (np.cumsum(kept) - 1)[after], -1)[kept]]
    walls = np.argsort(packing.centroids[n:, 1] % packing.box[1, 1])
    for wall, plane, way in zip(n + walls, (low, high), (-1, 1), strict=True):
        ends, starts = (
            np.flatnonzero(loose & (np.abs(points[:, 1] - plane) < 0.5 * (high - low)))
            for loose, points in ((order[0] < 0, parts[0].end), (comes[kept], parts[0].start))
        )
        begin, goal = np.array([[0.0, plane]]), np.array([[way * width, plane]])  # nothing touches the plane
        if len(ends):
            begin, x = parts[0].end[ends], parts[0].start[starts, 0]
            starts = starts[np.mod(way * (x - begin[:, :1]), width).argmin(axis=1)]
            goal = parts[0].start[starts]
            goal[:, 0] += np.ceil(way * (begin - goal)[:, 0] / width) * way * width
        count, flat = sum(map(len, order)), np.zeros(len(begin))
        made = np.arange(count, count + len(begin))
        order[0][ends] = made[: len(ends)]
        order.append(starts if len(ends) else made)
        parts.append(Pieces(np.full(len(made), wall), begin, goal, 0.5 * (begin + goal), flat, flat, flat))
    pieces = Pieces(*(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Pieces)))
    following = np.concatenate(order)
    step = np.round((pieces.end - pieces.start[following])[:, 0] / width).astype(np.int64)
    return chain_pieces(pieces, following, np.column_stack([step, 0 * step]))


def trace_disks(packing: Packing) -> Boundary:
    """Trace the boundary of the union of the disks of an SP packing."""
    (chords, arcs), radius = free_arcs(packing), 0.5 * packing.disk_diameters
    m, w, centre = len(arcs.i), radius[arcs.i], packing.positions[arcs.i]
    begin, end = (
        centre + w[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        for angle in (arcs.start, arcs.start + arcs.angle)
    )
    pieces = Pieces(arcs.i, begin, end, centre, w, arcs.start, arcs.angle)
    whole = arcs.end < 0
    begins_at = np.full(len(chords.i) + 1, -1)
    begins_at[arcs.begin[~whole]] = np.flatnonzero(~whole)
    following = np.where(whole, np.arange(m), begins_at[np.append(chords.pair, -1)[arcs.end]])
    shift = np.where(whole[:, None], 0, np.append(chords.shift, [[0, 0]], axis=0)[arcs.end])
    join_loose_ends(pieces, following, shift, packing.box, float(radius.max()))
    return chain_pieces(pieces, following, shift)


def trace_polygons(packing: Packing) -> Boundary:
    """Trace the boundary of the union of the polygons of a DP packing, each grown by its rim delta/2."""
    edges, near = edge_rings(packing), near_edges(packing)
    w, i, j, r, own = edges.rim, near.i, near.j, near.r, near.own
    _refuse_crossings(edges, i[~own], j[~own], r[~own])
    # neighbors on one polygon hide each other only at reflex corners; on an image of it they are like any others
    dented = np.bincount(edges.particle, edges.turn < 0, packing.n) > 0
    before, after = own & (j == edges.before[i]), own & (j == edges.after[i])
    beside = (after & (edges.turn[j] >= 0)) | (before & (edges.turn[i] >= 0))
    apart = ~own | dented[edges.particle[i]]
    cut, round_cut = apart & ~beside, apart & ~before & (edges.turn[i] > 0)
    i_cut = i[cut]
    rows, low, high = cut_lines(edges, i_cut, j[cut], r[cut] - w * edges.normal[i_cut], w)
    lines = free_parts(edges.length, i_cut[rows], low, high)
    arcs = free_parts(edges.turn, *cut_arcs(edges, i[round_cut], j[round_cut], r[round_cut]))
    pieces, following = _draw(edges, lines, arcs)
    shift = np.zeros((len(following), 2), dtype=np.int64)
    join_loose_ends(pieces, following, shift, packing.box, w)
    return chain_pieces(pieces, following, shift)


def _refuse_crossings(edges: EdgeRings, i: Indices, j: Indices, r: Array) -> None:
    a, b = edges.along[i], edges.along[j]
    end_i, end_j = edges.length[i, None] * a, r + edges.length[j, None] * b
    crossing = (cross(a, r) * cross(a, end_j) < 0) & (cross(b, -r) * cross(b, end_i - r) < 0)
    if crossing.any():
        m, n = (int(edges.particle[edge[crossing][0]]) for edge in (i, j))
        raise BoundaryError(f"outlines of polygons {m} and {n} cross: separate them; only their rims may overlap")


_Parts = tuple[Indices, Array, Array]


def _draw(edges: EdgeRings, lines: _Parts, arcs: _Parts) -> tuple[Pieces, Indices]:
    """Pieces, first the straight ones, and the piece that comes next on the same outline; -1: another particle's."""
    (line, low, high), (arc, begin, end), w = lines, arcs, edges.rim
    tail, along, aside = edges.tail[line], edges.along[line], w * edges.normal[line]
    starts, stops = (tail + (along * place[:, None] + aside) for place in (low, high))
    normal = edges.normal[edges.before[arc]]
    angle = np.arctan2(normal[:, 1], normal[:, 0])
    corner, rim = edges.tail[arc], np.full(len(arc), w)
    rounds = [corner + w * np.column_stack([np.cos(angle + at), np.sin(angle + at)]) for at in (begin, end)]
    ends = (np.concatenate([starts, rounds[0]]), np.concatenate([stops, rounds[1]]))
    centre, none = np.concatenate([0.5 * (starts + stops), corner]), np.zeros(len(line))
    of_circle = [np.concatenate([none, values]) for values in (rim, angle + begin, end - begin)]
    pieces = Pieces(edges.particle[np.concatenate([line, arc])], *ends, centre, *of_circle)
    line_at, arc_at = np.full((2, len(edges.tail)), -1)  # pieces that begin where their element does
    line_at[line[low == 0]] = np.flatnonzero(low == 0)
    arc_at[arc[begin == 0]] = len(line) + np.flatnonzero(begin == 0)
    after = edges.after[line]
    behind_line = np.where(edges.turn[after] > 0, arc_at[after], line_at[after])
    behind_line[high != edges.length[line]] = -1
    behind_arc = np.where(end == edges.turn[arc], line_at[arc], -1)
    return pieces, np.concatenate([behind_line, behind_arc])
