"""Outlines of droplets, polygons grown by their rim delta/2, and the places where they overlap.

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
from jamlab.geometry.edge_capsules import edge_rings
from jamlab.packing.neighbors import periodic_pairs
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
    rings, n = edge_rings(packing), packing.n
    particle, turn, w = rings.particle, rings.turn, rings.rim
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
    """Divide arcs: steps of each, and the radius u of inner points, in that of the ends, that keeps the sector's area.
    With k steps of psi = turn/k: u sin(psi) + (k - 2)/2 u^2 sin(psi) = k psi/2."""
    steps = np.maximum(np.ceil(turn / ARC_STEP), 2).astype(np.int64)
    share = 0.5 * steps / np.sinc(turn / (steps * np.pi))
    return steps, 2 * share / (1 + np.sqrt(1 + 2 * (steps - 2) * share))


def shared_areas(packing: Packing) -> Array:
    """(n,) area of each grown outline, every overlap shared equally between the particles that meet there.

    A point that m outlines cover counts 1/m for each of them. By inclusion and exclusion, with the sums over the
    overlaps O_a = (outline of the particle) intersected with that of its neighbour a,

        area - (1/2) sum_a |O_a| + (1/3) sum_{a<b} |O_a O_b| - (1/4) sum_{a<b<c} |O_a O_b O_c| + ...

    The series ends by itself where no more outlines meet; the sum over particles is the area of their union.
    """
    grown, n = rims(packing), packing.n
    reach = np.hypot(*np.abs(shapely.bounds(grown.outlines)).reshape(-1, 2, 2).max(axis=1).T)
    near = periodic_pairs(packing.centroids, packing.box, reach)
    common = shapely.intersection(grown.outlines[near.i], moved(grown.outlines[near.j], near.r))
    real = shapely.area(common) > 0
    near, common = near.select(real), common[real]
    # every overlap from both sides, relative to the centroid of the owner; owners ascend
    owner = np.concatenate([near.i, near.j])
    order = np.argsort(owner, kind="stable")
    owner, overlaps = owner[order], np.concatenate([common, moved(common, -near.r)])[order]
    stop = np.searchsorted(owner, np.arange(n), side="right")
    shares, covers, regions, last = grown.area.copy(), 2, overlaps, np.arange(len(owner))
    while len(regions):
        sign = 1 if covers % 2 else -1
        shares += sign / covers * np.bincount(owner, shapely.area(regions), minlength=n)
        more = stop[owner] - last - 1
        region = np.repeat(np.arange(len(regions)), more)
        added = last[region] + 1 + np.arange(len(region)) - np.searchsorted(region, region)
        common = shapely.intersection(regions[region], overlaps[added])
        real = shapely.area(common) > 0
        owner, regions, last, covers = owner[region[real]], common[real], added[real], covers + 1
    return shares


def moved(shapes: Geometries, r: Array) -> Geometries:
    """The same shapes, each moved by its row of r, (m, 2)."""
    points, index = shapely.get_coordinates(shapes, return_index=True)
    return np.asarray(shapely.set_coordinates(shapes.copy(), points + r[index]))
