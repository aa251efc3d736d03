"""Edges of the polygons of droplets, and the rims around them."""

from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array, Indices
from jamlab.errors import InputError
from jamlab.kernels.library import INTEGER, INTEGERS, REALS, kernel
from jamlab.packing.packing import Packing

_edge_rings = kernel("edge_rings", INTEGER, INTEGERS, REALS, INTEGERS, INTEGERS, REALS, REALS, REALS)


@dataclass(frozen=True)
class EdgeRings:
    """Edges of the polygons of a DP packing, counter-clockwise, m of them."""

    particle: Indices  # (m,) polygon of each edge, ascending
    before: Indices  # (m,) edge that ends at the tail
    turn: Array  # (m,) exterior angle at the tail, from -pi to pi; positive at convex corners
    tail: Array  # (m, 2) position at which each edge begins
    normal: Array  # (m, 2) unit vectors that point outwards


def edge_rings(packing: Packing) -> EdgeRings:
    """Edges of a DP packing; an edge shorter than 1e-12 of the perimeter has no direction and is left out."""
    vertices = len(packing.positions)
    particle, before = np.empty((2, vertices), dtype=np.int64)
    turn, (tail, normal) = np.empty(vertices), np.empty((2, vertices, 2))
    given = (packing.polygons.offsets, packing.positions)
    count = _edge_rings(packing.n, *given, particle, before, turn, tail, normal)
    return EdgeRings(particle[:count], before[:count], turn[:count], tail[:count], normal[:count])


def rim_width(packing: Packing) -> float:
    """Width of the rim around the polygons of a DP packing, delta/2."""
    if "delta" not in packing.params:
        raise InputError(f"{packing.kind.particles} (model {packing.model}) have no edges with rims: use droplets")
    return 0.5 * float(packing.params["delta"])
