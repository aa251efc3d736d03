"""Outlines with edges of equal length: points spread along a closed polygon until neighbours are equally far apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import InputError


@dataclass(frozen=True)
class Spreading:
    """Vertices that are spread along an outline until all edges are equal."""

    equal: float = 1e-10  # relative spread of the lengths at which spreading ends
    rounds: int = 200  # rounds of it
    allowed: float = 1e-2  # relative spread that is taken for equal


SPREADING = Spreading()


def equal_edges(outline: Array, count: int, name: str = "outline") -> Array:
    """Spread vertices along a closed polygon so that the edges between them are equally long, and keep its area.

    Edges cut corners, so the new polygon is scaled about its centroid.

    Args:
        outline: (m, 2) vertices, counter-clockwise; the first one stays a vertex, but for the scale.
        count: number of new vertices, 3 or more.
        name: of the outline, in errors.

    Returns:
        (count, 2).

    Raises:
        InputError: edges of so few vertices that they do not become equal, or cut off all of the area.
    """
    closed = np.vstack([outline, outline[:1]])
    along = np.append(0.0, np.cumsum(np.hypot(*np.diff(closed, axis=0).T)))
    place = np.linspace(0.0, along[-1], count + 1)
    for _ in range(SPREADING.rounds):
        points = np.column_stack([np.interp(place, along, closed[:, k]) for k in (0, 1)])
        lengths = np.hypot(*np.diff(points, axis=0).T)
        if np.ptp(lengths) <= SPREADING.equal * lengths.mean():
            break
        covered = np.append(0.0, np.cumsum(lengths))
        place = np.interp(np.linspace(0.0, covered[-1], count + 1), covered, place)
    centre, area = _centroid(outline)
    centre_of_new, new_area = _centroid(points[:-1])
    if np.ptp(lengths) > SPREADING.allowed * lengths.mean() or new_area <= 0:
        raise InputError(f"{name}: {count} vertices are too few for edges of equal length; use more")
    return np.asarray(centre + (points[:-1] - centre_of_new) * np.sqrt(area / new_area))


def _centroid(ring: Array) -> tuple[Array, float]:
    """Centroid and area of a polygon."""
    r = ring - ring[0]
    s = np.roll(r, -1, axis=0)
    wedge = r[:, 0] * s[:, 1] - r[:, 1] * s[:, 0]
    area = 0.5 * float(wedge.sum())
    return ring[0] + ((r + s) * wedge[:, None]).sum(axis=0) / (6 * area), area
