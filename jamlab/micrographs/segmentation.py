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
NEIGHBOURS = ((0, 1), (1, -1), (1, 0), (1, 1), (0, -1), (-1, 1), (-1, 0), (-1, -1))  # rows and columns away


@dataclass(frozen=True)
class Segments:
    """Droplets of a picture."""

    cells: Indices  # (h, w) int64, every pixel belongs to a droplet, from 0
    droplets: Mask  # (h, w) bool, pixels brighter than half-way to the ground
    inner: Array  # (n,) radius of the largest disc inside each droplet, pixels
    middle: Indices  # (n, 2) row and column of its centre
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
    markers, count = find_basins(droplets, scale.radius, scale.smallest).markers(scale.smallest)
    if not count:
        return None
    depth = ndimage.distance_transform_edt(droplets)
    width = SMOOTHING * scale.radius
    seen, even = (ndimage.gaussian_filter(field, width) for field in (np.clip(smooth, 0, 1), depth))
    cells = _flood(FILM * seen - even / scale.radius, markers, _thinning(scale.smallest)) - 1
    cells = _straighten(cells, min(STRAIGHT[0] + STRAIGHT[1] * noise, STRAIGHTEST) * scale.smallest)
    cells = (np.cumsum(np.bincount(cells.ravel()) > 0) - 1)[cells]
    inner, middle = highest(depth, cells)[0], highest(even, cells)[1]
    return Segments(cells, droplets, inner, middle, scale.radius, scale.smallest)


def _thinning(smallest: float) -> int:
    """Pixels of the picture to one of the grid on which markers are found."""
    return max(1, round(smallest / COARSE))


def _flood(landscape: Array, markers: Indices, step: int) -> Indices:
    """(h, w) watershed from markers, which lie on every `step`th pixel: on those first, then near its walls on all."""
    watershed = scikit_image().segmentation.watershed
    coarse = watershed(landscape[::step, ::step], markers[::step, ::step]).astype(np.int64)
    if step == 1:
        return np.asarray(coarse)
    sure = ndimage.maximum_filter(coarse, 3) == ndimage.minimum_filter(coarse, 3)
    h, w = landscape.shape
    cells, sure = (np.kron(part, np.ones((step, step), dtype=part.dtype))[:h, :w] for part in (coarse, sure))
    near = ndimage.binary_dilation(~sure, np.ones((3, 3)))
    seeds = np.where(markers > 0, markers, np.where(sure, cells, 0))  # a cell may be too narrow to hold a sure pixel
    return np.where(near, watershed(landscape, seeds, mask=near), cells)


def highest(values: Array, cells: Indices) -> tuple[Array, Indices]:
    """(n,) largest value in each cell, and (n, 2) row and column of it. `values`: (h, w); `cells`: (h, w) from 0."""
    most, place = np.full(int(cells.max()) + 1, -np.inf), np.zeros(int(cells.max()) + 1, dtype=np.int64)
    np.maximum.at(most, cells.ravel(), values.ravel())
    at = np.flatnonzero(values == most[cells])[::-1]
    place[cells.ravel()[at]] = at  # the first one
    return most, np.column_stack(np.divmod(place, cells.shape[1]))


@dataclass(frozen=True)
class Basins:
    """Distance from the ground as a landscape: every pixel uphill belongs to the basin of one maximum."""

    even: Array  # (h, w) smoothed distance from the ground, on every `step`th pixel
    basin: Indices  # (h, w) basin from 0, -1 on the ground
    peaks: Indices  # (k,) flat place of each maximum
    saddles: tuple[tuple[float, int, int], ...]  # height of the pass between two basins, highest first
    lowest: float  # distance that counts at the edge of the picture
    step: int  # pixels of the picture to one of the landscape
    shape: tuple[int, ...]  # of the picture

    def markers(self, smallest: float, neck: float = NECK) -> tuple[Indices, int]:
        """Maxima that stand out. `smallest`: radius of small droplets, pixels; `neck`: see `NECK`. Returns (h, w)
        int64, a number from 1 in each marker, 0 elsewhere; number of those that lie off the edge.

        A marker is what is connected to its maximum above `neck` times it: basins join over their highest passes
        first, and what joins a higher maximum above that is part of its marker."""
        top, fall = np.log(self.even.ravel()[self.peaks]), -np.log(neck)
        owner, open_, held = list(range(len(top))), [True] * len(top), [True] * len(top)
        root = owner.copy()  # of the basins that have joined by now
        for height, a, b in self.saddles:
            a, b = _root_of(root, a), _root_of(root, b)
            if a == b:
                continue
            a, b = (a, b) if top[a] >= top[b] else (b, a)
            root[b] = a
            if open_[a] and height > top[a] - fall:
                owner[b] = a
            else:
                open_[a] = False
                held[b] = held[b] and top[b] - height > fall * (1 - 1e-6)
        own = np.array([_root_of(owner, k) for k in range(len(top))], dtype=np.int64)
        stands = np.array(held, dtype=bool) & (self.even.ravel()[self.peaks] >= self.lowest)
        label = np.zeros(self.even.shape, dtype=np.int64)
        high = self.basin >= 0
        mine = own[self.basin[high]]
        label[high] = np.where(stands[mine] & (np.log(self.even[high]) > top[mine] - fall), mine + 1, 0)
        kept = self.even.ravel()[self.peaks] >= max(SPECK * smallest, 1.0)
        edge = np.zeros(len(top) + 1, dtype=bool)
        edge[np.unique(np.concatenate([label[0], label[-1], label[:, 0], label[:, -1]]))] = True
        number = np.zeros(len(top) + 1, dtype=np.int64)
        places, found = np.flatnonzero(label), label.ravel()
        first = np.full(len(top) + 1, -1)
        first[found[places[::-1]]] = places[::-1]  # of each marker, its first pixel
        names = np.flatnonzero((first >= 0) & (np.append(False, kept) | edge))
        number[names[np.argsort(first[names])]] = np.arange(1, len(names) + 1)
        fine = np.zeros(self.shape, dtype=np.int64)
        fine[:: self.step, :: self.step] = number[label]
        return fine, int((~edge[names]).sum())


def find_basins(droplets: Mask, radius: float, smallest: float) -> Basins:
    """Landscape of the distance from the ground. `droplets`: (h, w); `radius`: typical radius, pixels; `smallest`:
    radius of small droplets, pixels."""
    step = _thinning(smallest)
    depth = step * ndimage.distance_transform_edt(droplets[::step, ::step])
    even = np.asarray(ndimage.gaussian_filter(depth, SMOOTHING * radius / step))
    lowest = max(EDGE_SPECK * smallest, 1.0)
    basin, peaks = _basins_of(np.where(even > 0.5 * lowest, even, 0.0))
    passes = _saddles_of(basin, np.log(np.maximum(even, 0.5 * lowest)), len(peaks))
    return Basins(even, basin, peaks, passes, lowest, step, droplets.shape)


def _basins_of(values: Array) -> tuple[Indices, Indices]:
    """(h, w) maximum that leads uphill from each pixel, from 0, -1 where `values`, (h, w), are not positive; and flat
    places of the maxima."""
    uphill = _uphill(values)
    while ((further := uphill[uphill]) != uphill).any():
        uphill = further
    high = values.ravel() > 0
    peaks = np.flatnonzero(high & (uphill == np.arange(values.size)))
    name = np.full(values.size, -1)
    name[peaks] = np.arange(len(peaks))
    return np.where(high, name[uphill], -1).reshape(values.shape), peaks


def _root_of(parent: list[int], k: int) -> int:
    while parent[k] != k:
        parent[k] = k = parent[parent[k]]
    return k


def _uphill(values: Array) -> Indices:
    """(h w) flat place of the highest of each pixel and its eight neighbours."""
    wide = np.pad(values, 1, constant_values=-1.0)
    best, way = values.copy(), np.zeros(values.shape, dtype=np.int64)
    h, w = values.shape
    for row, column in NEIGHBOURS:
        near = wide[1 + row : 1 + row + h, 1 + column : 1 + column + w]
        higher = near > best
        np.copyto(best, near, where=higher)
        way[higher] = row * w + column
    return np.asarray(way.ravel() + np.arange(values.size))


def _saddles_of(basin: Indices, values: Array, count: int) -> tuple[tuple[float, int, int], ...]:
    """Highest pass between each two basins that meet, and which, highest first."""
    names, heights = [], []
    h, w = basin.shape
    for row, column in NEIGHBOURS[:4]:
        low, high = max(-column, 0), w - max(column, 0)
        here = np.s_[: h - row, low:high]
        there = np.s_[row:, low + column : high + column]
        on = (basin[here] != basin[there]) & (basin[here] >= 0) & (basin[there] >= 0)
        first, second = basin[here][on], basin[there][on]
        names.append(np.minimum(first, second) * count + np.maximum(first, second))
        heights.append(np.minimum(values[here][on], values[there][on]))
    pairs, short = np.unique(np.concatenate(names), return_inverse=True)
    best = np.full(len(pairs), -np.inf)
    np.maximum.at(best, short, np.concatenate(heights))
    order = np.argsort(-best, kind="stable")
    rows = best[order], *np.divmod(pairs[order], max(count, 1))
    return tuple(zip(*(row.tolist() for row in rows), strict=True))


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
