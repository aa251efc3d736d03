"""Free pieces of the outlines of droplets in plain numpy: the reference of plugin/kernels/droplet_cover.cpp."""

import numpy as np
from plain_capsules import cut_lines, edge_rings, near_edges, sort_intervals

from jamlab.geometry.boundary_pieces import Pieces
from jamlab.packing.outlines import cross


def plain_pieces(packing):
    """Pieces of the boundary of polygons with rims that do not cross, and the piece that comes next; -1: another's."""
    edges, near = edge_rings(packing), near_edges(packing)
    w, i, j, r, own = edges.rim, near.i, near.j, near.r, near.own
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
    return _draw(edges, lines, arcs)


def free_parts(extent, number, low, high):
    """Element, begin and end of what no interval hides, in this order; see `sort_intervals`. Elements are edges moved
    outwards by the rim, or arcs around their tails, whose extent is not positive where there is no arc."""
    number, low, high, hidden = sort_intervals(number, low, high, extent)
    reached = np.zeros(len(extent))
    np.maximum.at(reached, number, high)
    gap, rest = np.flatnonzero(low > hidden), np.flatnonzero(extent > reached)
    element, begin = np.append(number[gap], rest), np.append(hidden[gap], reached[rest])
    order = np.lexsort((begin, element))
    return element[order], begin[order], np.append(low[gap], extent[rest])[order]


def cut_arcs(edges, i, j, r):
    """Parts of the arcs around the tails of edges i in the capsules around edges j, whose tails lie at r from those.

    In the frame of the capsule, x along it and y >= 0 the distance of the corner from its line, directions are counted
    from the one straight at the line, (sine, cosine): the circle crosses the near side y = w of the capsule at +-beta,
    cos(beta) = y/w - 1, if it does so between its ends, else it crosses the disk around that end."""
    w, v, length = edges.rim, edges.along[j], edges.length[j]
    x, across = -(r * v).sum(axis=1), -cross(v, r)
    beyond = x - np.clip(x, 0.0, length)
    meets = np.hypot(beyond, across) < 2 * w
    i, v, length = i[meets], v[meets], length[meets]
    x, across, beyond = x[meets], across[meets], beyond[meets]
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


def _draw(edges, lines, arcs):
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
