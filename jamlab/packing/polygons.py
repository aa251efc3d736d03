"""What is of polygons alone: edges, areas and perimeters of the outlines of a packing, without their rims."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array, Indices
from jamlab.errors import InputError
from jamlab.packing.bare_packing import BarePacking
from jamlab.packing.derived import per_packing
from jamlab.packing.kinds import kind_of
from jamlab.packing.outlines import outlines, polygon_areas


class Polygons:
    """The polygons of a packing, without their rims.

    Attributes:
        positions: (n_vertices, 2) vertices, those of one polygon after each other, counter-clockwise.
        offsets: (n + 1,) int64: vertices of polygon m are positions[offsets[m]:offsets[m + 1]].

    Raises:
        InputError: a packing of disks.

    Example:
        >>> polygons = jamlab.jam(8, "dp").polygons
        >>> first = slice(*polygons.offsets[:2])
        >>> bool(np.isclose(np.hypot(*polygons.edges[first].T).sum(), polygons.perimeters[0]))
        True
    """

    def __init__(self, packing: BarePacking) -> None:
        if packing.offsets is None:
            particles = kind_of(packing).particles
            raise InputError(f"a packing of {particles} (model {packing.model}) has no polygons: use one of droplets")
        self.offsets, self.positions = packing.offsets, packing.positions
        self._derived = packing._derived  # where `per_packing` keeps its answers

    @property
    @per_packing
    def successor(self) -> Indices:
        """(n_vertices,) number of the next vertex counter-clockwise on the same polygon."""
        following = np.arange(1, self.offsets[-1] + 1)
        following[self.offsets[1:] - 1] = self.offsets[:-1]
        return following

    @property
    @per_packing
    def edges(self) -> Array:
        """(n_vertices, 2) vector from each vertex to the next."""
        return np.asarray(self.positions[self.successor] - self.positions)

    @property
    @per_packing
    def areas(self) -> Array:
        """(n,) area of each polygon, positive if counter-clockwise."""
        return polygon_areas(self.positions, self.offsets)

    @property
    @per_packing
    def perimeters(self) -> Array:
        """(n,) perimeter of each polygon."""
        return np.add.reduceat(np.hypot(*self.edges.T), self.offsets[:-1])

    def shapes(self) -> NDArray[np.object_]:
        """(n,) the polygons as shapely geometries."""
        return outlines(self.positions, self.offsets)
