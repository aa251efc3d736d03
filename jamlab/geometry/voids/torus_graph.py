"""Graphs on a torus: their connected components, and the periodic images in which the nodes of one lie.

Every link carries the lattice translation from the periodic image that its tail lies in to that of its head. Along a
spanning tree the translations add up to one for every node; a link that is not in the tree and disagrees with them
closes a path around the torus.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components

Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Components:
    """Connected components of a graph on a torus.

    Attributes:
        count: number of components.
        label: (n,) int64, component of each node.
        image: (n, 2) int64, translation of each node relative to the first node of its component, in lattice vectors.
        winding: (m, 2) int64, translation around the torus that each link closes; zero for links of the tree and for
            links that agree with it.
    """

    count: int
    label: Indices
    image: Indices
    winding: Indices


def find_components(n: int, tail: Indices, head: Indices, shift: Indices) -> Components:
    """Find the connected components of n nodes and their images.

    Args:
        n: nodes.
        tail, head: (m,) int64, nodes that each link joins.
        shift: (m, 2) int64, image of the head minus that of the tail, in lattice vectors.
    """
    count, label = connected_components(coo_array((np.ones(len(tail)), (tail, head)), shape=(n, n)), directed=False)
    first = np.unique(label, return_index=True)[1]

    # one more node, n, holds the first nodes of all components together: one search then covers all
    rows, columns = np.concatenate([tail, np.full(count, n)]), np.concatenate([head, first])
    _, before = breadth_first_order(coo_array((np.ones(len(rows)), (rows, columns)), (n + 1, n + 1)).tocsr(), n, False)
    before = before[:n].astype(np.int64)

    key = np.concatenate([tail * n + head, head * n + tail])
    steps = np.concatenate([shift, -shift])
    key, index = np.unique(key, return_index=True)
    grown = np.flatnonzero(before < n)
    image = np.zeros((n, 2), dtype=np.int64)
    image[grown] = steps[index[np.searchsorted(key, before[grown] * n + grown)]]
    before[before == n] = np.flatnonzero(before == n)
    image = sum_images(before, image)
    return Components(int(count), label.astype(np.int64), image, image[tail] + shift - image[head])


def sum_images(before: Indices, step: Indices) -> Indices:
    """Sum the steps from the root of a tree to each node, (n, 2).

    Args:
        before: (n,) int64, node that leads to each node; roots lead to themselves.
        step: (n, 2) int64, step from there; zero for roots.
    """
    while True:  # each node looks twice as far back every time
        further = before[before]
        if np.array_equal(further, before):
            return step
        step, before = step + step[before], further
