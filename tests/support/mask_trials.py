"""Label images of packings as a perfect segmenter draws them, with the truth of all that a picture of them shows.

The truth is geometry: no pixel, label or rule of `jamlab.micrographs` is in it. A picture shows a window of the
periodic packing, whose edges cut particles.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
import shapely

import jamlab
from jamlab.arrays import Array, Indices
from jamlab.geometry.rims import rims
from jamlab.geometry.voids.voids import void_paths
from jamlab.packing.packing import Packing

FINER = 3  # samples a pixel in each direction; the middle one is the label
QUADRANT = 64  # steps of a drawn circle to a quadrant
LEAST_VOID = 3.0, 1e-3  # pixels, and of a particle: area of what counts as a void, as `Micrograph` says


@dataclass(frozen=True)
class Trial:
    """Labels of a window, and what is true of it."""

    labels: Indices  # (h, w)
    truth: dict[str, float]  # by the names of `Micrograph.numbers`; lengths in pixels
    centres: Array  # (count, 2) x and y of the particles that are whole, pixels


def outlines(packing: Packing) -> list[shapely.Polygon]:
    """Particles as polygons, where they lie; what two of them share is divided by the chord between its ends."""
    if packing.model == "dp":
        return [
            shapely.transform(outline, lambda p, c=centre: p + c)
            for outline, centre in zip(rims(packing).outlines, packing.centroids, strict=True)
        ]
    return [
        shapely.Point(*centre).buffer(0.5 * diameter, quad_segs=QUADRANT)
        for centre, diameter in zip(packing.positions, packing.diameters, strict=True)
    ]


def trial(
    packing: Packing, pixels: int, line: float = 0.0, at: tuple[float, float] = (0.0, 0.0), part: float = 1.0
) -> Trial:
    """Draw a window.

    Args:
        packing: SP or DP in a rectangular box.
        pixels: width of one period.
        line: pixels without a label between particles in contact.
        at: corner of the window, of the period.
        part: width and height of the window, of the period.
    """
    size = packing.box[0, 0] / pixels
    box, corner = np.diag(packing.box) / size, np.array(at) * np.diag(packing.box) / size
    extent = np.rint(part * box)
    width, height = extent.astype(int)
    own = [shapely.transform(each, lambda p: p / size - corner) for each in outlines(packing)]
    images = [
        (k, shapely.transform(each, lambda p, m=move: p + np.array(m) * box))
        for k, each in enumerate(own)
        for move in product(range(-2, 3), repeat=2)
    ]
    images = [(k, each) for k, each in images if shapely.box(0, 0, *extent).intersects(each)]
    depth, owner = _depths([each for _, each in images], width, height)
    middle = FINER // 2
    apart = 0.5 * line
    labels = np.where(depth > apart, owner + 1, 0)[middle::FINER, middle::FINER]
    lows, highs = np.split(shapely.bounds([each for _, each in images]), 2, axis=1)
    whole = (lows > 0).all(axis=1) & (highs < extent).all(axis=1)
    kinds = np.array([k for k, _ in images])[whole]
    network = jamlab.contacts(packing)
    bearing = network.pairs[~network.rattlers[network.pairs].any(axis=1)]
    number = np.bincount(bearing.ravel(), minlength=packing.n)[kinds]
    area, shape = _areas(packing, size)
    held = ~network.rattlers[kinds]
    truth = {
        "count": float(whole.sum()),
        "area": float(area[kinds].mean()) if whole.any() else np.nan,
        "rho": float((depth > 0).mean()),
        "z": float(number[held].mean()) if held.any() else np.nan,
        "shape_factor_rim": float(shape[kinds].mean()) if whole.any() else np.nan,
        "voids": float(_voids(packing, size, corner, extent, box, float(area.mean()))),
    }
    centres = shapely.get_coordinates(shapely.centroid([each for _, each in images]))[whole]
    return Trial(labels.astype(np.int64), truth, centres)


def _depths(shapes: list[shapely.Polygon], width: int, height: int) -> tuple[Array, Indices]:
    """(h, w) of fine samples: how deep each lies in the particle in which it lies deepest, negative outside all, and
    the number of that one."""
    depth, owner = np.full((FINER * height, FINER * width), -np.inf), np.zeros((FINER * height, FINER * width), int)
    for number, each in enumerate(shapes):
        low_x, low_y, high_x, high_y = np.array(shapely.bounds(each)) * FINER + [-FINER, -FINER, FINER, FINER]
        rows = slice(max(int(low_y), 0), max(min(int(high_y) + 1, FINER * height), 0))
        columns = slice(max(int(low_x), 0), max(min(int(high_x) + 1, FINER * width), 0))
        y, x = (np.mgrid[rows, columns] + 0.5) / FINER
        if not x.size:
            continue
        ring = shapely.get_coordinates(each.exterior)
        if len(ring) == 4 * QUADRANT + 1:  # a circle
            (cx, cy), radius = ring[:-1].mean(axis=0), 0.5 * np.ptp(ring[:, 0])
            own = radius - np.hypot(x - cx, y - cy)
        else:
            shapely.prepare(each)
            inside = shapely.contains_xy(each, x, y)
            own = np.where(inside, 1, -1) * shapely.distance(each.exterior, shapely.points(x, y))
        here = depth[rows, columns]
        owner[rows, columns][own > here] = number
        depth[rows, columns] = np.maximum(here, own)
    return depth, owner


def _areas(packing: Packing, size: float) -> tuple[Array, Array]:
    """(n,) areas in pixels, what two share divided among them, and (n,) shape factors."""
    if packing.model == "dp":
        return rims(packing).area / size**2, jamlab.shape_factors(packing, rim=True)
    radii = 0.5 * packing.diameters
    area, length = np.pi * radii**2, 2 * np.pi * radii
    network = jamlab.contacts(packing)
    for (i, j), arm in zip(network.pairs, network.r, strict=True):
        apart = np.hypot(*arm)
        for a, b in ((i, j), (j, i)):
            to_chord = (apart**2 + radii[a] ** 2 - radii[b] ** 2) / (2 * apart)
            half = np.arccos(min(to_chord / radii[a], 1.0))
            area[a] -= radii[a] ** 2 * (half - np.sin(half) * np.cos(half))
            length[a] -= 2 * radii[a] * (half - np.sin(half))
    return area / size**2, length**2 / (4 * np.pi * area)


def _voids(packing: Packing, size: float, corner: Array, extent: Array, box: Array, area: float) -> int:
    """Voids that the window shows whole, as large as those that a picture counts."""
    found = jamlab.voids(packing)
    least, count = max(LEAST_VOID[0], LEAST_VOID[1] * area), 0
    for k, path in enumerate(void_paths(found)):
        if found.percolating[k] or found.area[k] / size**2 < least:
            continue
        points = path.vertices / size - corner
        for move in product(range(-3, 4), repeat=2):
            moved = points + np.array(move) * box
            count += bool((moved > 0).all() and (moved < extent).all())
    return count
