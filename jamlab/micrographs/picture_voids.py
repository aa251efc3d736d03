"""Voids of a picture: the gaps between droplets, by number of sides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from jamlab.packing.short_repr import short_repr

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

SMALLEST = 3.0  # pixels of area: a corner between three walls has as much
SMALLEST_SHARE = 1e-3  # of a droplet


@dataclass(frozen=True)
class PictureVoids:
    """Voids that the picture shows whole, one entry each; names as in `jamlab.voids`.

    Attributes:
        sides: (m,) int64, l, droplets around the void.
        area: (m,) area, in the unit of length squared.
        centroid: (m, 2) x to the right and y down.
    """

    sides: Indices
    area: Array
    centroid: Array

    __repr__ = short_repr

    @property
    def probability(self) -> dict[int, float]:
        """P_l: share of the voids with l sides (Boromand et al. fig 8)."""
        kinds, number = np.unique(self.sides, return_counts=True)
        return {int(kind): float(count / len(self.sides)) for kind, count in zip(kinds, number, strict=True)}


def find_voids(
    void: Indices, cells: Indices, darkness: Array, outside: NDArray[np.bool_], radius: float
) -> PictureVoids:
    """Measure voids, lengths in pixels.

    Args:
        void: (h, w) void that a pixel belongs to, -1 in none.
        cells: (h, w) droplet that a pixel is nearest to.
        darkness: (h, w), 0 in droplets and 1 on the ground.
        outside: (h, w) pixels at and beyond the edge of what the picture shows: voids there are cut.
        radius: typical radius, pixels.
    """
    count = int(void.max()) + 1
    y, x = np.nonzero(void >= 0)
    label, weight = void[y, x], np.clip(darkness[y, x], 0, None)
    area = np.bincount(label, darkness[y, x], count)
    mass = np.maximum(np.bincount(label, weight, count), 1e-12)
    centre = np.column_stack([np.bincount(label, weight * p, count) / mass for p in (x, y)])
    near = (darkness[y, x] > 0.25) | ndimage.binary_dilation(_edges(cells), iterations=1)[y, x]
    width = int(cells.max()) + 1
    rows = np.unique(label[near] * width + cells[y, x][near])
    sides = np.bincount(rows // width, minlength=count)
    cut = np.zeros(count, dtype=bool)
    cut[np.unique(void[outside & (void >= 0)])] = True
    kept = ~cut & (area > max(SMALLEST, SMALLEST_SHARE * np.pi * radius**2)) & (sides >= 2)
    return PictureVoids(sides[kept].astype(np.int64), area[kept].astype(np.float64), centre[kept])


def _edges(cells: Indices) -> NDArray[np.bool_]:
    edge = np.zeros(cells.shape, dtype=bool)
    edge[1:] |= cells[1:] != cells[:-1]
    edge[:, 1:] |= cells[:, 1:] != cells[:, :-1]
    return edge
