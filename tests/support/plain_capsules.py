"""Edges of droplets and the capsules around them in plain numpy: the reference of plugin/kernels/edge_rings.cpp,
droplet_outlines.cpp and contact_lengths.cpp.

A capsule holds the points within a distance of an edge. It is convex, so that it hides one interval of a straight
line; what several hide is the union of their intervals.
"""

from dataclasses import dataclass

import numpy as np

from jamlab.packing.neighbors import periodic_pairs
from jamlab.packing.outlines import cross

# of the perimeter: rounding of the vertices (1e-16) leaves a shorter edge a direction to 1e-4
SHORTEST = 1e-12
MARGIN = 1e-6  # of the rim, beyond which edges are not looked at


@dataclass(frozen=True)
class EdgeRings:
    """Edges of the polygons of a DP packing, counter-clockwise, m of them."""

    particle: np.ndarray  # (m,) polygon of each edge, ascending
    tail: np.ndarray  # (m, 2) position at which each edge begins
    length: np.ndarray  # (m,)
    along: np.ndarray  # (m, 2) unit vectors
    normal: np.ndarray  # (m, 2) unit vectors that point outwards
    # before, after: (m,) edges that end at the tail and begin at the head
    before: np.ndarray
    after: np.ndarray
    turn: np.ndarray  # (m,) exterior angle at the tail, from -pi to pi; positive at convex corners
    rim: float  # width of the rim around the polygons, delta/2


def edge_rings(packing):
    """Edges of a DP packing; an edge shorter than 1e-12 of the perimeter has no direction and is left out."""
    x, low, high = packing.positions, packing.polygons.offsets[:-1], packing.polygons.offsets[1:]
    after = np.arange(1, len(x) + 1)
    after[high - 1] = low
    length = np.hypot(*(x[after] - x).T)
    particle = np.repeat(np.arange(packing.n), high - low)
    kept = length > SHORTEST * np.add.reduceat(length, low)[particle]
    particle, tail = particle[kept], x[kept]
    end = np.cumsum(np.bincount(particle, minlength=packing.n))
    begin = np.append(0, end[:-1])
    begin, end = begin[begin < end], end[begin < end]
    before, after = np.arange(len(tail)) - 1, np.arange(len(tail)) + 1
    before[begin], after[end - 1] = end - 1, begin
    edge = tail[after] - tail
    length = np.hypot(*edge.T)
    along = edge / length[:, None]
    normal, arriving = np.column_stack([along[:, 1], -along[:, 0]]), along[before]
    turn = np.arctan2(cross(arriving, along), (arriving * along).sum(axis=1))
    return EdgeRings(particle, tail, length, along, normal, before, after, turn, 0.5 * packing.params["delta"])


@dataclass(frozen=True)
class NearEdges:
    """Pairs of edges of a DP packing whose rims may overlap, each pair from both sides."""

    i: np.ndarray
    j: np.ndarray
    r: np.ndarray  # (m, 2) from the tail of edge i to that of the image of edge j
    shift: np.ndarray  # (m, 2) which image of edge j
    own: np.ndarray  # (m,) both belong to one polygon, and not to two images of it


def near_edges(packing):
    """Find the edges of a DP packing nearer than delta to each other, and some more."""
    edges = edge_rings(packing)
    middle = edges.tail + 0.5 * edges.length[:, None] * edges.along
    near = periodic_pairs(middle, packing.box, 0.5 * edges.length + edges.rim * (1 + MARGIN))
    i, j = np.concatenate([near.i, near.j]), np.concatenate([near.j, near.i])
    shift = np.concatenate([near.shift, -near.shift])
    r = edges.tail[j] - edges.tail[i] + shift @ packing.box
    return NearEdges(i, j, r, shift, (edges.particle[i] == edges.particle[j]) & (shift == 0).all(axis=1))


def latest(owner, end):
    """(m,) of the intervals of one owner up to each, that which ends last. Owners, (m,), ascend."""
    order = np.lexsort((end, owner))
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    return np.asarray(order[np.maximum.accumulate(rank)])


def sort_intervals(number, low, high, extent):
    """Intervals, (m,), within 0 and the extents of the elements, (k,), that they lie on, by element and begin; and how
    far those before each one on its element reach."""
    low, high = np.maximum(low, 0.0), np.minimum(high, extent[number])
    kept = np.flatnonzero(low < high)
    kept = kept[np.lexsort((low[kept], number[kept]))]
    number, low, high = number[kept], low[kept], high[kept]
    before = np.zeros(len(kept))
    if len(kept):
        before[1:] = np.where(number[1:] == number[:-1], high[latest(number, high)][:-1], 0.0)
    return number, low, high, before


def cut_lines(edges, i, j, r, w):
    """Parts of lines parallel to edges i in the capsules of radius w around edges j, whose tails lie at r from the
    beginnings of the lines: rows, and from where to where. A capsule is the union of two disks around its ends and of a
    rectangle, and the part of a line in it is one interval."""
    u, v, extent = edges.along[i], edges.along[j], edges.length[j]
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
    meets = np.flatnonzero((low < high) & (np.minimum(*aside) < w) & (np.maximum(*aside) > -w))
    return meets, low[meets], high[meets]


def plain_contact_lengths(packing):
    """Pairs (m, 2) of droplets i <= j, and the part (m,) of their outlines nearer than delta, a mean over both."""
    edges, near = edge_rings(packing), near_edges(packing)
    other = ~near.own
    i, j, shift = near.i[other], near.j[other], near.shift[other]
    rows, low, high = cut_lines(edges, i, j, near.r[other], 2 * edges.rim)
    # parts of one edge near one image of a polygon
    sides, part = np.unique(np.column_stack([i, edges.particle[j], shift])[rows], axis=0, return_inverse=True)
    part, low, high, before = sort_intervals(part.ravel(), low, high, edges.length[sides[:, 0]])
    covered = np.bincount(part, np.maximum(high - np.maximum(low, before), 0.0), len(sides))
    one, two, image = edges.particle[sides[:, 0]], sides[:, 1], sides[:, 2:]
    # seen from both sides a pair has one name
    turned = (one > two) | ((one == two) & ((image[:, 0] < 0) | ((image[:, 0] == 0) & (image[:, 1] < 0))))
    turn = np.where(turned, -1, 1)[:, None]
    names = np.column_stack([np.minimum(one, two), np.maximum(one, two), turn * image])
    pairs, pair = np.unique(names, axis=0, return_inverse=True)
    length = 0.5 * np.bincount(pair.ravel(), covered, len(pairs))
    return pairs[length > 0, :2], length[length > 0]
