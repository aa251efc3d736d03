"""Drawn outlines of droplets: polygons grown by their rim delta/2.

Circulo-lines have width delta, so a particle fills its polygon and a rim of half that width around it: the Minkowski
sum with a disk of radius w = delta/2. Its outline is drawn here as a polygon: edges moved outwards by w, joined at
convex corners by arcs in steps of at most `ARC_STEP`. The inner points of an arc lie slightly outside the true circle,
so that the polygon below the arc has exactly the area of the circular sector. A convex outline then has exactly area
a + p w + pi w^2 (Steiner), and overlaps of outlines err only where an arc is cut, by about w^2 ARC_STEP^3/12 per cut.
"""

from dataclasses import dataclass
from typing import Any

import lazy_loader
import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array, Indices
from jamlab.geometry.edge_rings import edge_rings, rim_width
from jamlab.packing.packing import Packing

shapely: Any = lazy_loader.load("shapely")  # only where outlines are drawn: disks have none
Geometries = NDArray[np.object_]

ARC_STEP = np.pi / 64  # largest step of an arc, radians: an overlap then errs by 1e-5 w^2 at most


@dataclass(frozen=True)
class Rims:
    """Outlines of a DP packing with their rims."""

    outlines: Geometries  # (n,) shapely geometries, each relative to the centroid of its polygon
    area: Array  # (n,) area inside each outline; a + p delta/2 + pi delta^2/4 for a convex polygon
    # (n,) length of each outline; p + pi delta for a convex polygon. Where an arc is partly hidden in a notch of the
    # same polygon its length errs by at most 1e-4 of the arc.
    perimeter: Array


def rims(packing: Packing) -> Rims:
    """Grow every polygon of a DP packing by delta/2.

    The ring of moved edges and arcs winds exactly once around every point of a grown convex polygon. At a reflex corner
    the ring returns to the vertex between the two moved edges; it then winds at least once around every point within
    delta/2 of the polygon and not at all around the others, and keeping the parts with winding number > 0 (GEOS buffer
    of width zero) gives the outline.
    """
    w, rings, n = rim_width(packing), edge_rings(packing), packing.n
    particle, turn = rings.particle, rings.turn
    corner = rings.tail - packing.centroids[particle]
    arrival = rings.normal[rings.before]
    normal = np.arctan2(arrival[:, 1], arrival[:, 0])  # direction of the outward normal of the edge that arrives
    convex = turn > 0
    steps, lift = _divide_arcs(np.where(convex, turn, 0.0))
    lift[~convex] = 0.0

    point = np.repeat(np.arange(len(corner)), steps + 1)
    step = np.arange(len(point)) - np.searchsorted(point, point)
    angle = normal[point] + turn[point] * step / steps[point]
    reach = w * np.where((step == 0) | (step == steps[point]), 1.0, lift[point])
    ring = corner[point] + reach[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    outlines = np.asarray(shapely.buffer(shapely.polygons(shapely.linearrings(ring, indices=particle[point])), 0.0))

    half = 0.5 * turn / steps
    drawn = 2 * np.sqrt((1 - lift) ** 2 + 4 * lift * np.sin(half) ** 2) + 2 * (steps - 2) * lift * np.sin(half)
    missing = w * np.bincount(particle, np.where(convex, turn - drawn, 0.0), minlength=n)
    return Rims(outlines, shapely.area(outlines), shapely.length(outlines) + missing)


def _divide_arcs(turn: Array) -> tuple[Indices, Array]:
    """Divide arcs: steps of each, and the radius u of inner points, in radii of the ends, that keeps the sector's area.
    With k steps of psi = turn/k: u sin(psi) + (k - 2)/2 u^2 sin(psi) = k psi/2."""
    steps = np.maximum(np.ceil(turn / ARC_STEP), 2).astype(np.int64)
    share = 0.5 * steps / np.sinc(turn / (steps * np.pi))
    return steps, 2 * share / (1 + np.sqrt(1 + 2 * (steps - 2) * share))
