"""The boundary of the covered part of a packing: straight and circular pieces, chained into loops.

Every piece runs counter-clockwise around its particle, so that the void lies on its right. A piece ends where another
particle begins, and the loop continues along that particle. Loops live on a torus: each piece has a periodic image
relative to the first piece of its loop, and a loop may wind around the torus instead of closing.

A polygon with its rim is the union of the polygon and of a capsule around every edge: the points within w = delta/2 of
the edge. Its outline runs along the edges, moved outwards by w, and along arcs of radius w around convex corners. Each
of these elements is cut by the capsules of other edges: those of other particles, and of the same particle where it is
not convex. A capsule is convex, and two capsules around edges that do not cross meet in at most two points, so that a
capsule hides one interval of an element. What no capsule hides is free boundary.

Disks leave free arcs, each followed by the arc of the disk that it meets.
"""

from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array, Indices
from jamlab.errors import BoundaryError
from jamlab.geometry.particle_shape import disk_radii
from jamlab.geometry.power_cells import find_chords, find_free_arcs
from jamlab.geometry.rims import EdgeRings, edge_rings
from jamlab.packing.neighbors import periodic_neighbors, periodic_pairs
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
    order: list[int] = []
    begin, seen, ahead = [], [False] * len(following), following.tolist()
    for first in range(len(ahead)):
        if not seen[first]:
            begin.append(len(order))
        piece = first
        while not seen[piece]:
            seen[piece] = True
            order.append(piece)
            piece = ahead[piece]
    assert len(np.unique(following)) == len(order), "every piece follows one other"
    begins, along = np.array(begin, dtype=np.int64), np.array(order, dtype=np.int64)
    length = np.diff(np.append(begins, len(order)))
    loop, image = np.empty_like(following), np.empty_like(shift)
    loop[along] = np.repeat(np.arange(len(begins)), length)
    before = np.cumsum(shift[along], axis=0) - shift[along]
    image[along] = before - np.repeat(before[begins], length, axis=0)
    last = along[begins + length - 1]
    return Boundary(pieces, following, loop, image, image[last] + shift[last], along[begins])


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


# Disks nearer than this part of R_i + R_j touch: rounding of a minimum (forces to 1e-14) must not open a void.
TOUCH = 1e-12


def trace_disks(packing: Packing) -> Boundary:
    """Trace the boundary of the union of the disks of an SP packing."""
    radius = disk_radii(packing)
    near = periodic_pairs(packing.positions, packing.box, radius * (1 + 2 * TOUCH))
    chords = find_chords(near, radius, TOUCH)
    arcs = find_free_arcs(chords)
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


@dataclass(frozen=True)
class _Elements:
    """Edges moved outwards by the rim, or arcs around their tails: element i belongs to edge i."""

    extent: Array  # (m,) length of the edge, or exterior angle: not positive where there is no arc
    # of the intervals that a capsule hides: element, and where they lie on it
    number: Indices
    low: Array
    high: Array

    def free(self) -> tuple[Indices, Array, Array]:
        """Element, begin and end of what is not hidden, in this order."""
        low, high = np.maximum(self.low, 0.0), np.minimum(self.high, self.extent[self.number])
        kept = np.flatnonzero(low < high)
        kept = kept[np.lexsort((low[kept], self.number[kept]))]
        number, low, high = self.number[kept], low[kept], high[kept]
        place = np.arange(len(number)) - np.searchsorted(number, number)
        reached, found = np.zeros(len(self.extent)), []
        for k in range(place.max(initial=-1) + 1):  # the k-th interval of each element
            here = place == k
            which, gap = number[here], low[here] > reached[number[here]]
            found.append((which[gap], reached[which[gap]], low[here][gap]))
            reached[which] = np.maximum(reached[which], high[here])
        rest = np.flatnonzero(self.extent > reached)
        found.append((rest, reached[rest], self.extent[rest]))
        element, begin, end = (np.concatenate(values) for values in zip(*found, strict=True))
        order = np.lexsort((begin, element))
        return element[order], begin[order], end[order]


def trace_polygons(packing: Packing) -> Boundary:
    """Trace the boundary of the union of the polygons of a DP packing, each grown by its rim delta/2."""
    edges = edge_rings(packing)
    w, middle = edges.rim, edges.tail + 0.5 * edges.length[:, None] * edges.along
    near = periodic_pairs(middle, packing.box, 0.5 * edges.length + w * (1 + JOINT))
    i, j = np.concatenate([near.i, near.j]), np.concatenate([near.j, near.i])
    r = edges.tail[j] - edges.tail[i] + np.concatenate([near.shift, -near.shift]) @ packing.box
    own = (edges.particle[i] == edges.particle[j]) & np.tile((near.shift == 0).all(axis=1), 2)
    _refuse_crossings(edges, i[~own], j[~own], r[~own])
    # neighbors on one polygon hide each other only at reflex corners; on an image of it they are like any others
    dented = np.bincount(edges.particle, edges.turn < 0, packing.n) > 0
    before, after = own & (j == edges.before[i]), own & (j == edges.after[i])
    beside = (after & (edges.turn[j] >= 0)) | (before & (edges.turn[i] >= 0))
    apart = ~own | dented[edges.particle[i]]
    cut, round_cut = apart & ~beside, apart & ~before & (edges.turn[i] > 0)
    lines = _Elements(edges.length, *_cut_lines(edges, i[cut], j[cut], r[cut])).free()
    arcs = _Elements(edges.turn, *_cut_arcs(edges, i[round_cut], j[round_cut], r[round_cut])).free()
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


def _cut_lines(edges: EdgeRings, i: Indices, j: Indices, r: Array) -> tuple[Indices, Array, Array]:
    """Parts of moved edges i in the capsules around edges j, whose tails lie at r from those of i. A capsule is the
    union of two disks around its ends and of a rectangle, and the part of a line in it is one interval."""
    w, u, v, extent = edges.rim, edges.along[i], edges.along[j], edges.length[j]
    r = r - w * edges.normal[i]
    low, high, aside = np.full(len(i), np.inf), np.full(len(i), -np.inf), []
    for end in (r, r + extent[:, None] * v):
        place, across = (end * u).sum(axis=1), cross(u, end)
        half = np.sqrt(np.maximum((w - across) * (w + across), 0.0))
        low = np.where(half > 0, np.minimum(low, place - half), low)
        high = np.where(half > 0, np.maximum(high, place + half), high)
        aside.append(across)
    enter, leave = np.full(len(i), -np.inf), np.full(len(i), np.inf)
    slabs = ((-(r * v).sum(axis=1), (u * v).sum(axis=1), 0.0, extent), (-cross(v, r), cross(v, u), -w, w))
    with np.errstate(divide="ignore", invalid="ignore"):
        for start, slope, least, most in slabs:  # where least < start + slope s < most
            one, two, inside = (least - start) / slope, (most - start) / slope, (least < start) & (start < most)
            across = np.where(inside, np.inf, -np.inf)
            enter = np.maximum(enter, np.where(slope == 0, -across, np.minimum(one, two)))
            leave = np.minimum(leave, np.where(slope == 0, across, np.maximum(one, two)))
    through = enter < leave
    low, high = np.where(through, np.minimum(low, enter), low), np.where(through, np.maximum(high, leave), high)
    meets = ~((np.minimum(*aside) >= w) | (np.maximum(*aside) <= -w))
    return i[meets], low[meets], high[meets]


def _cut_arcs(edges: EdgeRings, i: Indices, j: Indices, r: Array) -> tuple[Indices, Array, Array]:
    """Parts of the arcs around the tails of edges i in the capsules around edges j, whose tails lie at r from those.

    In the frame of the capsule, x along it and y >= 0 the distance of the corner from its line, directions are counted
    from the one straight at the line, (sine, cosine): the circle crosses the near side y = w of the capsule at +-beta,
    cos(beta) = y/w - 1, if it does so between its ends, else it crosses the disk around that end."""
    w, v, length = edges.rim, edges.along[j], edges.length[j]
    x, across = -(r * v).sum(axis=1), -cross(v, r)
    beyond = x - np.clip(x, 0.0, length)
    meets = np.hypot(beyond, across) < 2 * w
    i, v, length, x, across, beyond = (values[meets] for values in (i, v, length, x, across, beyond))
    y, side, first = np.abs(across), np.where(across >= 0, 1.0, -1.0), edges.normal[edges.before[i]]
    down, ends = side[:, None] * np.column_stack([v[:, 1], -v[:, 0]]), []
    for sign in (-side, side):
        cosine = np.clip(y / w - 1, -1.0, 1.0)
        sine = sign * np.sqrt((1 - cosine) * (1 + cosine))
        crossing = x + w * sine
        aside = np.where(crossing > length, length, 0.0) - x
        apart = np.hypot(aside, y)
        toward = np.where(apart > 0, (aside, y), ((0.0,), (1.0,))) / np.where(apart > 0, apart, 1.0)
        c = np.minimum(0.5 * apart / w, 1.0)
        s = sign * np.sqrt((1 - c) * (1 + c))
        between = (crossing >= 0) & (crossing <= length)
        local = np.where(between, (sine, cosine), (toward[0] * c + toward[1] * s, toward[1] * c - toward[0] * s))
        direction = v * local[0][:, None] + down * local[1][:, None]
        ends.append(np.arctan2(cross(first, direction), (first * direction).sum(axis=1)))
    # the interval spans more than 2 pi/3 from nearer than w/2, and less than 4 pi/3 from further away
    width = ends[1] - ends[0]
    width += np.where(width < np.where(np.hypot(beyond, y) < 0.5 * w, 1.0, -1.0), 2 * np.pi, 0.0)
    begin = np.where(ends[0] < 0, ends[0] + 2 * np.pi, ends[0])
    begin = np.concatenate([begin, begin - 2 * np.pi])  # one that runs through the beginning shows at both ends
    return np.tile(i, 2), begin, begin + np.tile(width, 2)


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
