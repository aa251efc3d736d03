"""Pieces of the boundary of what particles cover."""

from dataclasses import dataclass

from jamlab.arrays import Array, Indices


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
