"""Divide a picture into droplets and their cells: markers from granulometry, watershed from distance and darkness.

A droplet has a marker where the distance from the ground has a maximum that stands out: on the way to any higher one
the distance falls by the factor `NECK` at least. Droplets smaller than part of what granulometry finds are specks. The
watershed floods from the markers over darkness - distance/radius: walls run along dark films where there are any, and
through the necks where droplets merge without one.

Sources: S. Beucher & C. Lantuejoul, Int. Workshop on Image Processing, Rennes (1979); F. Meyer, Signal Processing 38,
113 (1994).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from jamlab.arrays import Array, Indices, Mask
from jamlab.micrographs.granulometry import granulometry
from jamlab.micrographs.picture_files import scikit_image

NECK = 0.88  # two maxima are one droplet if the neck is wider than this part of the smaller; a hexagon in contact: 0.58
SPECK = 0.25  # of the smallest droplets by granulometry: what is smaller is no droplet
EDGE_SPECK = 0.1  # the same of what is cut off by the edge of the picture, where a droplet may show a small part only
COARSE = 15  # pixels: radius of small droplets in the picture on which markers are found
SMOOTHING = 0.05  # of the radius, of the distance from the ground: its ridges are rough on the scale of pixels
STRAIGHT = (0.05, 0.4)  # of the smallest radius, over which walls are straightened: in itself, and per noise
STRAIGHTEST = 0.15  # of the smallest radius: a circle of that radius then moves in by a hundredth of it
FILM = 1.0  # weight of darkness beside distance over radius


@dataclass(frozen=True)
class Segments:
    """Droplets of a picture."""

    cells: Indices  # (h, w) int64, every pixel belongs to a droplet, from 0
    droplets: Mask  # (h, w) bool, pixels brighter than half-way to the ground
    inner: Array  # (n,) radius of the largest disc inside each droplet, pixels
    middle: Array  # (n, 2) row and column of its centre
    radius: float  # pixels, typical radius by granulometry
    smallest: float  # pixels, radius of small droplets by granulometry

    @property
    def count(self) -> int:
        """Number of droplets, cut ones included."""
        return len(self.inner)


def find_droplets(smooth: Array, noise: float = 0.0) -> Segments | None:
    """Divide denoised darkness into droplets; None if there are none. `smooth`: (h, w), 0 in droplets and 1 on the
    ground; `noise`: standard deviation of the noise before denoising; where no film shows, it leads the watershed."""
    droplets = smooth < 0.5
    scale = granulometry(droplets)
    if scale.radius <= 0 or droplets.all():
        return None
    markers, count = find_markers(droplets, scale.radius, scale.smallest)
    if not count:
        return None
    depth = ndimage.distance_transform_edt(droplets)
    width = SMOOTHING * scale.radius
    seen, even = (ndimage.gaussian_filter(field, width) for field in (np.clip(smooth, 0, 1), depth))
    cells = scikit_image().segmentation.watershed(FILM * seen - even / scale.radius, markers).astype(np.int64) - 1
    cells = _straighten(cells, min(STRAIGHT[0] + STRAIGHT[1] * noise, STRAIGHTEST) * scale.smallest)
    cells = np.unique(cells, return_inverse=True)[1].reshape(cells.shape).astype(np.int64)
    every = np.arange(cells.max() + 1)
    inner, middle = ndimage.maximum(depth, cells, every), ndimage.maximum_position(even, cells, every)
    return Segments(cells, droplets, np.asarray(inner), np.array(middle), scale.radius, scale.smallest)


def find_markers(droplets: Mask, radius: float, smallest: float, neck: float = NECK) -> tuple[Indices, int]:
    """Maxima of the distance from the ground that stand out. `droplets`: (h, w); `radius`: typical radius, pixels;
    `smallest`: radius of small droplets, pixels; `neck`: see `NECK`. Returns (h, w) int64, a number from 1 in each
    marker, 0 elsewhere; number of those that lie off the edge."""
    reconstruction, step = scikit_image().morphology.reconstruction, max(1, int(smallest / COARSE))
    depth = step * ndimage.distance_transform_edt(droplets[::step, ::step])
    even = ndimage.gaussian_filter(depth, SMOOTHING * radius / step)
    lowest = max(EDGE_SPECK * smallest, 1.0)
    height = np.log(np.maximum(even, 0.5 * lowest))
    filled = reconstruction(height + np.log(neck), height)
    tops = (height - filled > -np.log(neck) * (1 - 1e-6)) & (even >= lowest)
    label, _ = ndimage.label(height > filled, np.ones((3, 3)))
    topped = np.zeros(label.max() + 1, dtype=bool)
    topped[label[tops]] = True
    topped[0] = False
    label, count = np.where(topped, np.cumsum(topped), 0)[label], int(topped.sum())
    high = np.concatenate(
        [[False], ndimage.maximum(even, label, np.arange(1, count + 1)) >= max(SPECK * smallest, 1.0)]
    )
    edge = np.zeros(count + 1, dtype=bool)
    edge[np.unique(np.concatenate([label[0], label[-1], label[:, 0], label[:, -1]]))] = True
    kept = high | edge
    kept[0] = False
    label = np.where(kept, np.cumsum(kept), 0)[label].astype(np.int64)
    fine = np.zeros(droplets.shape, dtype=np.int64)
    fine[::step, ::step] = label
    return fine, int((kept & ~edge).sum())


def _straighten(cells: Indices, width: float) -> Indices:
    """Give each pixel to the cell that fills most of its surroundings, so that walls do not follow noise."""
    best, owner = np.full(cells.shape, -1.0), cells.copy()
    reach = int(np.ceil(4 * width))
    for label, box in enumerate(ndimage.find_objects(cells + 1)):
        wide = tuple(slice(max(side.start - reach, 0), side.stop + reach) for side in box)
        share = ndimage.gaussian_filter((cells[wide] == label).astype(np.float64), width, mode="nearest")
        wins = share > best[wide]
        owner[wide][wins] = label
        best[wide][wins] = share[wins]
    return owner
