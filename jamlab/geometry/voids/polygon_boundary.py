"""The boundary of what deformable polygons with rims cover: straight pieces and arcs, in closed form.

A polygon with its rim is the union of the polygon and of a capsule around every edge: the points within w = delta/2 of
the edge. Its outline runs along the edges, moved outwards by w, and along arcs of radius w around convex corners. Each
of these elements is cut by the capsules of other edges: those of other particles, and of the same particle where it is
not convex. A capsule is convex, and two capsules around edges that do not cross meet in at most two points, so that a
capsule hides one interval of an element. What no capsule hides is free boundary.
"""

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from jamlab.errors import BoundaryError
from jamlab.geometry.cross_product import cross
from jamlab.geometry.edge_rings import EdgeRings, edge_rings
from jamlab.geometry.intervals import sweep_intervals
from jamlab.geometry.voids.boundary_loops import Boundary, Pieces, chain_pieces, join_loose_ends
from jamlab.packing.neighbors import periodic_copies
from jamlab.packing.packing import Packing

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class _Capsules:
    """Edges and the capsules (of edges) near them: r leads from the tail of the edge to the tail of the capsule.

    own: the capsule belongs to the same polygon, not to an image of it.
    """

    edge: Indices
    capsule: Indices
    r: Array
    own: NDArray[np.bool_]


def trace_polygons(packing: Packing) -> Boundary:
    """Trace the boundary of the union of the polygons of a DP packing, each grown by its rim delta/2.

    Raises:
        InputError: for an SP packing.
        BoundaryError: if outlines of two polygons cross, or too many boundaries meet in one point.
    """
    edges = edge_rings(packing)
    capsules = _find_capsules(packing, edges)
    m = len(edges.length)
    element, low, high = (
        np.concatenate(pair) for pair in zip(_cut_lines(edges, capsules), _cut_arcs(edges, capsules), strict=True)
    )
    # elements: 0 .. m - 1 are the moved edges, m .. 2 m - 1 the arcs at their tails
    extent = np.concatenate([edges.length, np.maximum(edges.turn, 0.0)])
    element, begin, end = _uncover(element, low, high, extent)
    pieces = _draw_pieces(edges, element, begin, end)

    successor = np.concatenate([np.where(edges.turn > 0, m, 0)[edges.after] + edges.after, np.arange(m)])
    at_start = np.full(2 * m, -1)
    natural = begin == 0
    at_start[element[natural]] = np.flatnonzero(natural)
    following = np.where(end == extent[element], at_start[successor[element]], -1)
    shift = np.zeros((len(element), 2), dtype=np.int64)
    join_loose_ends(pieces, following, shift, packing.box, edges.rim)
    return chain_pieces(pieces, following, shift)


def _find_capsules(packing: Packing, edges: EdgeRings) -> _Capsules:
    """Edges nearer than delta, as far as one may hide the outline of the other."""
    i, j, shift = _find_near_edges(packing, edges)
    own = (edges.particle[i] == edges.particle[j]) & ~shift.any(axis=1)
    r = edges.tail[j] - edges.tail[i] + shift @ packing.box
    a, b = edges.length[i][:, None] * edges.along[i], edges.length[j][:, None] * edges.along[j]
    crossed = (cross(a, r) * cross(a, r + b) < 0) & (cross(b, -r) * cross(b, a - r) < 0) & ~own
    if crossed.any():
        m, n = edges.particle[i[crossed][0]], edges.particle[j[crossed][0]]
        raise BoundaryError(f"outlines of polygons {m} and {n} cross: push them apart; their rims alone may overlap")
    return _Capsules(i, j, r, own)


def _find_near_edges(packing: Packing, edges: EdgeRings) -> tuple[Indices, Indices, Indices]:
    """Pairs of edges whose bounding boxes are nearer than delta, from both sides, and which image of the second."""
    reach = 2 * edges.rim
    half = 0.5 * edges.length[:, None] * edges.along
    source, shift = periodic_copies(edges.tail + half, packing.box, reach + float(edges.length.max()))
    middle, size = (edges.tail + half)[source] + shift @ packing.box, np.abs(half)[source]
    low, high = middle - size, middle + size
    tree, m = shapely.STRtree(shapely.box(*low.T, *high.T)), len(half)
    i, copy = tree.query(shapely.box(*(low[:m] - reach).T, *(high[:m] + reach).T))
    j, shift = source[copy], shift[copy] - shift[i]
    moved = shift.any(axis=1)
    dented = np.zeros(packing.n, dtype=bool)
    dented[edges.particle[edges.turn < 0]] = True
    own = (edges.particle[i] == edges.particle[j]) & ~moved
    kept = (~own | dented[edges.particle[i]]) & ((i != j) | moved)
    return i[kept], j[kept], shift[kept]


def _cut_lines(edges: EdgeRings, capsules: _Capsules) -> tuple[Indices, Array, Array]:
    """Intervals of the moved edges that lie in capsules: edge, and from where to where along it.

    A capsule is the union of two disks around its ends and of a rectangle; the part of a line in it is one interval.
    """
    i, j, w = capsules.edge, capsules.capsule, edges.rim
    # neighbours on the same polygon hide each other only at reflex corners; on an image of it they are like any others
    beside = ((j == edges.after[i]) & (edges.turn[j] >= 0)) | ((j == edges.before[i]) & (edges.turn[i] >= 0))
    keep = ~(beside & capsules.own)
    i, j, r = i[keep], j[keep], capsules.r[keep]
    u, v = edges.along[i], edges.along[j]
    r = r - w * edges.normal[i]  # from the beginning of the moved edge to the tail of the capsule
    low, high = np.full(len(i), np.inf), np.full(len(i), -np.inf)
    for centre in (r, r + edges.length[j][:, None] * v):
        place, aside = np.einsum("ij,ij->i", centre, u), cross(u, centre)
        half = np.sqrt(np.maximum((w - aside) * (w + aside), 0.0))
        low = np.where(half > 0, np.minimum(low, place - half), low)
        high = np.where(half > 0, np.maximum(high, place + half), high)
    cosine, sine = np.einsum("ij,ij->i", u, v), cross(v, u)
    x, y = -np.einsum("ij,ij->i", r, v), -cross(v, r)
    enter_x, leave_x = _cross_slab(x, cosine, np.zeros(len(i)), edges.length[j])
    enter_y, leave_y = _cross_slab(y, sine, np.full(len(i), -w), np.full(len(i), w))
    enter, leave = np.maximum(enter_x, enter_y), np.minimum(leave_x, leave_y)
    inside = enter < leave
    low, high = np.where(inside, np.minimum(low, enter), low), np.where(inside, np.maximum(high, leave), high)
    low, high = np.maximum(low, 0.0), np.minimum(high, edges.length[i])
    real = low < high
    return i[real], low[real], high[real]


def _cross_slab(x: Array, slope: Array, lower: Array, upper: Array) -> tuple[Array, Array]:
    """Interval of s with lower < x + slope s < upper."""
    flat = slope == 0
    safe = np.where(flat, 1.0, slope)
    a, b = (lower - x) / safe, (upper - x) / safe
    always = flat & (lower < x) & (x < upper)
    enter = np.where(flat, np.where(always, -np.inf, np.inf), np.minimum(a, b))
    return enter, np.where(flat, np.where(always, np.inf, -np.inf), np.maximum(a, b))


def _cut_arcs(edges: EdgeRings, capsules: _Capsules) -> tuple[Indices, Array, Array]:
    """Intervals of the arcs that lie in capsules, as element number (edges come first) and angles from their beginning.

    In the frame of the capsule, x along it, y >= 0 the distance of the corner from its line, and the angle psi counted
    from the direction straight at the line: the circle crosses the far side y = w of the capsule at +-beta,
    cos(beta) = y/w - 1, if it does so between its ends, else it crosses the disk around that end.
    """
    i, j, w = capsules.edge, capsules.capsule, edges.rim
    keep = (edges.turn[i] > 0) & ~((j == edges.before[i]) & capsules.own)
    i, j, r = i[keep], j[keep], capsules.r[keep]
    v, length = edges.along[j], edges.length[j]
    x, y = -np.einsum("ij,ij->i", r, v), -cross(v, r)  # of the corner
    closest = np.clip(x, 0.0, length)
    near = np.hypot(x - closest, y) < 2 * w
    i, j, v, length, x, y = i[near], j[near], v[near], length[near], x[near], y[near]
    side, y = np.where(y >= 0, 1.0, -1.0), np.abs(y)
    beta = np.arccos(np.clip(y / w - 1, -1.0, 1.0))

    def end(sign: float) -> Array:
        crossing = x + sign * w * np.sin(beta)
        cap = np.where(crossing > length, length, 0.0)
        toward, apart = np.arctan2(cap - x, y), np.hypot(cap - x, y)
        round_cap = toward + sign * np.arccos(np.minimum(0.5 * apart / w, 1.0))
        return np.asarray(np.where((crossing >= 0) & (crossing <= length), sign * beta, round_cap))

    low, high = end(-1.0), end(1.0)
    low, high = np.where(side > 0, low, -high), np.where(side > 0, high, -low)
    zero = np.arctan2(v[:, 1], v[:, 0]) - 0.5 * np.pi * side
    before = edges.normal[edges.before[i]]
    low, width = np.mod(zero + low - np.arctan2(before[:, 1], before[:, 0]), 2 * np.pi), high - low
    # an interval that runs through the beginning of the arc shows at both ends of the circle
    element, low = np.tile(i, 2), np.concatenate([low, low - 2 * np.pi])
    high = np.minimum(low + np.tile(width, 2), edges.turn[element])
    low = np.maximum(low, 0.0)
    real = low < high
    return element[real] + len(edges.length), low[real], high[real]


def _uncover(element: Indices, low: Array, high: Array, extent: Array) -> tuple[Indices, Array, Array]:
    """What intervals leave of [0, extent] of each element: element, begin and end of every free part."""
    present = np.flatnonzero(extent > 0)
    none = np.zeros(len(present))
    element = np.concatenate([present, element, present])
    low, high = np.concatenate([none - 1, low, extent[present]]), np.concatenate([none, high, extent[present] + 1])
    order, last = sweep_intervals(element, low, high)
    element, low, reached = element[order], low[order], high[last]
    free = np.flatnonzero((element[1:] == element[:-1]) & (low[1:] > reached[:-1]))
    return element[free], reached[free], low[free + 1]


def _draw_pieces(edges: EdgeRings, element: Indices, begin: Array, end: Array) -> Pieces:
    m = len(edges.length)
    edge, round_ = element % m, element >= m
    first = edges.normal[np.where(round_, edges.before[edge], edge)]
    angle = np.arctan2(first[:, 1], first[:, 0])

    def point(place: Array) -> Array:
        turned = angle + place
        on_arc = edges.rim * np.column_stack([np.cos(turned), np.sin(turned)])
        on_line = place[:, None] * edges.along[edge] + edges.rim * edges.normal[edge]
        return np.asarray(edges.tail[edge] + np.where(round_[:, None], on_arc, on_line))

    start, stop = point(begin), point(end)
    return Pieces(
        edges.particle[edge],
        start,
        stop,
        np.where(round_[:, None], edges.tail[edge], 0.5 * (start + stop)),
        np.where(round_, edges.rim, 0.0),
        np.where(round_, angle + begin, 0.0),
        np.where(round_, end - begin, 0.0),
    )
