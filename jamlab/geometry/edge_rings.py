"""Rings of edges around polygons, without edges of zero length."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from jamlab.arrays import Array, Indices
from jamlab.errors import InputError
from jamlab.kernels.library import INTEGER, INTEGERS, REAL, REALS, kernel
from jamlab.packing.packing import Packing

SHORTEST = 1e-12  # of the perimeter: rounding of the vertices (1e-16) still leaves a shorter edge a direction to 1e-4

_OUT = (INTEGERS, REALS, REALS, REALS, REALS, INTEGERS, INTEGERS, REALS)
_edge_rings = kernel("edge_rings", INTEGER, INTEGERS, REALS, REAL, *_OUT)


@dataclass(frozen=True)
class EdgeRings:
    """Edges of the polygons of a DP packing, counter-clockwise, m of them."""

    particle: Indices  # (m,) polygon of each edge, ascending
    tail: Array  # (m, 2) position at which each edge begins
    length: Array  # (m,)
    along: Array  # (m, 2) unit vectors
    normal: Array  # (m, 2) unit vectors that point outwards
    # before, after: (m,) edges that end at the tail and begin at the head
    before: Indices
    after: Indices
    turn: Array  # (m,) exterior angle at the tail, from -pi to pi; positive at convex corners
    rim: float  # width of the rim around the polygons, delta/2


def edge_rings(packing: Packing) -> EdgeRings:
    """Edges of a DP packing; an edge shorter than 1e-12 of the perimeter has no direction and is left out."""
    if packing.offsets is None:
        raise InputError("only deformable polygons (model dp) have outlines and rims; this packing has model sp")
    size = len(packing.positions)
    (particle, before, after), (length, turn) = np.empty((3, size), dtype=np.int64), np.empty((2, size))
    tail, along, normal = np.empty((3, size, 2))
    rings: tuple[Any, ...] = (particle, tail, length, along, normal, before, after, turn)
    m = _edge_rings(packing.n, packing.offsets, packing.positions, SHORTEST, *rings)
    return EdgeRings(*[*(values[:m] for values in rings), 0.5 * packing.params["delta"]])
