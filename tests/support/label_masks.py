"""Label images with a known truth, and the faults that segmenters and hands leave in them.

Every pixel of a rendered packing carries the number of the droplet that owns it; where two overlap, the one in which it
lies deeper. The truth is that of the droplets that the picture shows whole: number and mean area from a grid `FINER`
times as fine, rho, z and A from the packing itself.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import shapely
import skimage.draw
from scipy import ndimage

from jamlab.arrays import Indices
from jamlab.errors import InputError
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.geometry.particle_shape import shape_factors
from jamlab.geometry.rims import rims
from jamlab.micrographs.micrograph import micrograph
from jamlab.packing.packing import Packing

FINER = 3  # samples a pixel, in each direction; the middle one is the pixel


@dataclass(frozen=True)
class Drawn:
    """A label image and its truth."""

    labels: Indices  # (h, w), 0 on the ground
    truth: dict[str, float]  # names as in `Micrograph.numbers`


def draw_labels(packing: Packing, pixels: int) -> Drawn:
    """Draw one period of a packing in a rectangular box, `pixels` wide, cut by the edges of the picture."""
    scale = FINER * pixels / packing.box[0, 0]
    shape = FINER * round(pixels * packing.box[1, 1] / packing.box[0, 0]), FINER * pixels
    y, x = (np.arange(count) + 0.5 for count in shape)
    depth, owner = np.zeros(shape), np.zeros(shape, dtype=np.int64)
    places = packing.positions if packing.model == "sp" else packing.centroids
    outlines = None if packing.model == "sp" else rims(packing).outlines
    number, particle = 0, [-1]
    for k, move in product(range(packing.n), np.array(list(product((-2, -1, 0, 1, 2), repeat=2))) @ packing.box):
        centre = (places[k] + move) * scale
        if outlines is None:
            low, high = centre - 0.5 * packing.diameters[k] * scale, centre + 0.5 * packing.diameters[k] * scale
        else:
            ring = shapely.get_coordinates(outlines[k]) * scale + centre
            low, high = ring.min(axis=0), ring.max(axis=0)
        rows, columns = (
            slice(*np.searchsorted(line, [a, b])) for line, a, b in ((y, low[1], high[1]), (x, low[0], high[0]))
        )
        if rows.start == rows.stop or columns.start == columns.stop:
            continue
        if outlines is None:  # power distance: walls between disks that overlap are straight
            squares = (x[columns] - centre[0]) ** 2 + (y[rows, None] - centre[1]) ** 2
            inside = (0.5 * packing.diameters[k] * scale) ** 2 - squares
        else:
            first = np.floor(low[::-1]).astype(int) - 1
            size = np.ceil(high[::-1]).astype(int) + 1 - first
            own = skimage.draw.polygon2mask(tuple(size), ring[:, ::-1] - 0.5 - first)
            inside = ndimage.distance_transform_edt(own)[
                rows.start - first[0] : rows.stop - first[0], columns.start - first[1] : columns.stop - first[1]
            ]
        deeper = inside > depth[rows, columns]
        if deeper.any():
            number += 1
            particle.append(k)
            owner[rows, columns][deeper] = number
            depth[rows, columns][deeper] = inside[deeper]
    return Drawn(
        np.ascontiguousarray(owner[FINER // 2 :: FINER, FINER // 2 :: FINER]),
        _truth(packing, owner, np.array(particle)),
    )


def _truth(packing: Packing, owner: Indices, particle: Indices) -> dict[str, float]:
    edge = np.unique(np.concatenate([owner[0], owner[-1], owner[:, 0], owner[:, -1]]))
    whole = np.setdiff1d(np.unique(owner), np.append(edge, 0))
    areas = np.bincount(owner.ravel(), minlength=len(particle))[whole] / FINER**2
    network = contacts(packing)
    bearing = network.pairs[~network.rattlers[network.pairs].any(axis=1)]
    degree = np.bincount(bearing.ravel(), minlength=packing.n)
    held = particle[whole][~network.rattlers[particle[whole]]]
    known = {"count": float(len(whole)), "area": float(areas.mean()), "rho": packing_fraction(packing)}
    known["z"] = float(degree[held].mean())
    if packing.model == "dp":
        known["shape_rim"] = float(shape_factors(packing, rim=True)[particle[whole]].mean())
    return known


def inner(labels: Indices) -> Indices:
    """Labels of droplets off the edge."""
    edge = np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]])
    return np.setdiff1d(np.unique(labels), np.append(edge, 0))


def specks(labels: Indices, rng: Any, count: int = 20, largest: int = 3) -> Indices:
    """Stray labels of one to `largest` pixels in a row, anywhere."""
    found, new = labels.copy(), labels.max() + 1
    h, w = labels.shape
    for k in range(count):
        row, column = rng.integers(2, h - 6), rng.integers(2, w - 6)
        found[row, column : column + rng.integers(1, largest + 1)] = new + k
    return found


def holes(labels: Indices, rng: Any, share: float = 0.2, size: float = 0.35) -> Indices:
    """Square holes in the middle of a share of the droplets, `size` of their width."""
    found = labels.copy()
    for name in rng.choice(inner(labels), max(1, int(share * len(inner(labels)))), replace=False):
        y, x = np.nonzero(labels == name)
        half = max(1, int(0.5 * size * np.sqrt(len(y))))
        cy, cx = int(y.mean()), int(x.mean())
        found[cy - half : cy + half, cx - half : cx + half] = 0
    return found


def cracks(labels: Indices, rng: Any, count: int = 5, renamed: bool = True, width: float = 0.0) -> Indices:
    """Droplets parted along a line off their middle: `renamed`: the part beyond is a label of its own; `width`: of the
    line without a label."""
    found, new = labels.copy(), labels.max() + 1
    for k, name in enumerate(rng.choice(inner(labels), count, replace=False)):
        y, x = np.nonzero(labels == name)
        angle, radius = rng.uniform(0, 2 * np.pi), np.sqrt(len(y) / np.pi)
        away = (x - x.mean()) * np.cos(angle) + (y - y.mean()) * np.sin(angle) - rng.uniform(0, 0.5) * radius
        if renamed:
            found[y[away > 0], x[away > 0]] = new + k
        on = np.abs(away) < 0.5 * width
        found[y[on], x[on]] = 0
    return found


def merged(labels: Indices, rng: Any, count: int = 4) -> Indices:
    """Pairs of droplets that touch under one label."""
    found = labels.copy()
    for name in rng.choice(inner(labels), count, replace=False):
        around = np.unique(labels[ndimage.binary_dilation(labels == name)])
        others = np.setdiff1d(np.intersect1d(around, inner(labels)), [name])
        if len(others):
            found[found == others[0]] = name
    return found


def wrapped(labels: Indices, most: int = 64) -> Indices:
    """Numbers beyond the range of the file begin again at one."""
    return np.where(labels > 0, (labels - 1) % most + 1, 0)


def lines(labels: Indices) -> Indices:
    """A line of ground, one pixel wide, between all labels that touch."""
    low, high = (
        ndimage.minimum_filter(np.where(labels > 0, labels, labels.max() + 1), 2),
        ndimage.maximum_filter(labels, 2),
    )
    return np.where((low != high) & (high > 0) & (labels > 0) & (low > 0) & (low <= labels.max()), 0, labels)


def eroded(labels: Indices) -> Indices:
    """Labels without their outermost pixels."""
    return np.where(ndimage.grey_erosion(labels, 3) == ndimage.grey_dilation(labels, 3), labels, 0)


def without_gaps(labels: Indices) -> Indices:
    """Every pixel has the label of the nearest droplet."""
    return labels[tuple(ndimage.distance_transform_edt(labels == 0, return_indices=True, return_distances=False))]


def debris(labels: Indices, rng: Any, count: int = 12, ratio: float = 4.0) -> Indices:
    """Round objects, `ratio` times smaller than droplets, on the ground or over droplets."""
    found, new = labels.copy(), labels.max() + 1
    radius = np.sqrt((labels > 0).sum() / len(np.unique(labels)) / np.pi) / ratio
    y, x = np.indices(labels.shape)
    h, w = labels.shape
    for k in range(count):
        cy, cx = rng.uniform(2 * radius, h - 2 * radius), rng.uniform(2 * radius, w - 2 * radius)
        found[np.hypot(x - cx, y - cy) < radius] = new + k
    return found


def judge(source: Any, truth: dict[str, float], **how: Any) -> dict[str, tuple[float, float, str]]:
    """Error, half-width and quality of every number whose truth is known; all "refused" where the image is refused."""
    try:
        found = micrograph(labels=source, **how)
    except InputError:
        return dict.fromkeys(truth, (np.nan, np.nan, "refused"))
    return {
        name: (found.numbers[name].value - value, found.numbers[name].half_width, found.numbers[name].quality)
        for name, value in truth.items()
    }


def wrong(row: dict[str, tuple[float, float, str]]) -> list[str]:
    """Numbers that are called good and lie outside of their interval, or have none."""
    return [name for name, (error, half, quality) in row.items() if quality == "good" and not 0 < half >= abs(error)]


FAULTS: dict[str, Callable[[Indices, Any], Indices]] = {
    "perfect": lambda labels, rng: labels,
    "specks": specks,
    "many specks": lambda labels, rng: specks(labels, rng, 200, 6),
    "holes": holes,
    "large holes": lambda labels, rng: holes(labels, rng, 0.5, 0.6),
    "two labels each": cracks,
    "torn": lambda labels, rng: cracks(labels, rng, 5, False, 2.0),
    "torn and renamed": lambda labels, rng: cracks(labels, rng, 5, True, 2.0),
    "merged": merged,
    "wrapped numbers": lambda labels, rng: wrapped(labels),
    "lines": lambda labels, rng: lines(labels),
    "eroded": lambda labels, rng: eroded(labels),
    "mask": lambda labels, rng: (labels > 0).astype(int),
    "mask with lines": lambda labels, rng: 255 * (lines(labels) > 0),
    "mask with holes and specks": lambda labels, rng: specks(holes(lines(labels), rng), rng) > 0,
    "inverted mask": lambda labels, rng: labels == 0,
    "inverted mask with lines": lambda labels, rng: lines(labels) == 0,
    "without gaps": lambda labels, rng: without_gaps(labels),
    "debris": debris,
    "twice the pixels": lambda labels, rng: np.kron(labels, np.ones((2, 2), dtype=int)),
    "labelled ground": lambda labels, rng: labels + 1,
    "all at once": lambda labels, rng: specks(holes(cracks(merged(labels, rng, 2), rng, 2), rng), rng),
}
