"""Graphs on a torus against brute force: the graph laid out on k by k copies of the cell, nodes joined one by one."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from jamlab.geometry.voids.void_rays import find_components

COPIES = 6  # divisible by 2 and 3: tells the windings of a few links apart


@st.composite
def graphs(draw):
    """n, tail, head, shift; links may run to a node's own images and stand twice."""
    n = draw(st.integers(1, 6))
    node, step = st.integers(0, n - 1), st.integers(-2, 2)
    links = draw(st.lists(st.tuples(node, node, step, step), max_size=9))
    rows = np.array(links, dtype=np.int64).reshape(-1, 4)
    return n, rows[:, 0], rows[:, 1], rows[:, 2:]


def joined(count, pairs):
    """Representative of each of so many nodes, by joining sets."""
    parent = list(range(count))

    def root(a):
        while parent[a] != a:
            a = parent[a]
        return a

    for a, b in pairs:
        parent[root(a)] = root(b)
    return [root(a) for a in range(count)]


def laid_out(n, tail, head, shift):
    """Pairs of nodes on COPIES x COPIES cells, with periodic ends."""
    for a, b, (u, v) in zip(tail.tolist(), head.tolist(), shift.tolist(), strict=True):
        for x, y in np.ndindex(COPIES, COPIES):
            there = (x + u) % COPIES * COPIES + (y + v) % COPIES
            yield a * COPIES**2 + x * COPIES + y, b * COPIES**2 + there


def reached(windings):
    """How many cells of COPIES x COPIES the windings lead to."""
    cells, new = {(0, 0)}, [(0, 0)]
    while new:
        x, y = new.pop()
        for u, v in windings.tolist():
            cell = (x + u) % COPIES, (y + v) % COPIES
            if cell not in cells:
                cells.add(cell)
                new.append(cell)
    return len(cells)


@given(graphs())
def test_components_images_and_windings(graph):
    n, tail, head, shift = graph
    found = find_components(n, tail, head, shift)
    alone = joined(n, zip(tail.tolist(), head.tolist(), strict=True))
    assert found.count == len(set(alone)) == len(set(found.label.tolist()))
    assert len(set(zip(alone, found.label.tolist(), strict=True))) == found.count
    assert np.array_equal(found.winding, found.image[tail] + shift - found.image[head])
    copies = joined(n * COPIES**2, laid_out(n, tail, head, shift))
    for label in range(found.count):
        nodes = np.flatnonzero(found.label == label)
        pieces = len({copies[a * COPIES**2 + k] for a in nodes for k in range(COPIES**2)})
        windings = found.winding[found.label[tail] == label]
        assert pieces == COPIES**2 // reached(windings)
        # images lead along links: every node lies, in its own cell moved so, in the piece of the first
        first = copies[nodes[0] * COPIES**2]
        for a in nodes:
            x, y = (found.image[a] - found.image[nodes[0]]) % COPIES
            assert copies[a * COPIES**2 + x * COPIES + y] == first
