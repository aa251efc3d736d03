"""Divide a picture into droplets and their cells: markers from granulometry, watershed from distance and darkness.

Granulometry gives the scale: what openings by discs of growing radius leave. It needs no segmentation, since droplets
that merge still hold discs of their own size. A droplet has a marker where the distance from the ground has a maximum
that stands out: on the way to any higher one the distance falls by the factor `neck` at least. Droplets smaller than
part of what granulometry finds are specks. The watershed floods from the markers over darkness - distance/radius: walls
run along dark films where there are any, and through the necks where droplets merge without one.

Sources: G. Matheron, Random Sets and Integral Geometry (1975), for granulometry; S. Beucher & C. Lantuejoul, Int.
Workshop on Image Processing, Rennes (1979), and F. Meyer, Signal Processing 38, 113 (1994), for the watershed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from jamlab.arrays import Array, Indices, Mask
from jamlab.micrographs.picture_files import distance_inside, scikit_image


@dataclass(frozen=True)
class Division:
    """How a picture is divided into droplets."""

    radii: int = 20  # discs, in equal ratios
    longest: int = 600  # pixels along a side on which openings are made
    coarsest: int = 14  # pixels that the largest disc keeps there
    smallest_share: float = 0.08  # of the area of droplets that lies in smaller discs than those of small droplets
    # two maxima are one droplet if the neck is wider than this part of the smaller; a hexagon in contact: 0.58
    neck: float = 0.88
    speck: float = 0.25  # of the smallest droplets by granulometry: what is smaller is no droplet
    # the same of what is cut off by the edge of the picture, where a droplet may show a small part only
    edge_speck: float = 0.1
    coarse: int = 10  # pixels: radius of small droplets in the picture on which markers are found
    # of the radius, of the distance from the ground: its ridges are rough on the scale of pixels
    smoothing: float = 0.05
    # of the smallest radius, over which walls are straightened: in itself, and per noise
    straight: tuple[float, float] = (0.05, 0.4)
    straightest: float = 0.15  # of the smallest radius: a circle of that radius then moves in by a hundredth of it
    # pixels, standard deviation of a Gaussian whose middle pixel holds most of it, so that no pixel moves
    narrow: float = 0.4
    film: float = 1.0  # weight of darkness beside distance over radius


PARTING = Division()


def edge_of(values: NDArray[Any]) -> NDArray[Any]:
    """Values along the edge of a picture, (h, w)."""
    return np.concatenate([values[0], values[-1], values[:, 0], values[:, -1]])


def meetings(values: NDArray[Any]) -> tuple[Indices, Indices]:
    """Where neighbours in a picture differ: flat places of pixels, and of the one above or to the left of each."""
    above, left = np.flatnonzero(values[1:] != values[:-1]), np.flatnonzero(values[:, 1:] != values[:, :-1])
    left += left // max(values.shape[1] - 1, 1)
    return np.concatenate([above + values.shape[1], left + 1]), np.concatenate([above, left])


def granulometry(mask: Mask) -> tuple[float, float]:
    """Open a mask by discs. `mask`: (h, w), True in droplets. Returns two radii in pixels: half of the droplets lies in
    larger discs, and all but 8 %; 0 without droplets."""
    step = max(1, int(np.ceil(max(mask.shape) / PARTING.longest)))
    step *= max(1, int(_depth(mask[::step, ::step]).max() / PARTING.coarsest))
    depth = _depth(mask[::step, ::step])
    if depth.max() <= 0.5:
        return 0.0, 0.0
    radii = np.geomspace(1.0, max(1.01 * depth.max(), 1.1), PARTING.radii)
    left = [np.count_nonzero(distance_inside(depth < radius) < radius) for radius in radii[:-1]] + [0]
    lost = np.maximum.accumulate(1 - np.array(left) / np.count_nonzero(depth))
    half, few = step * np.interp((0.5, PARTING.smallest_share), lost, radii)
    return float(half), float(few)


def _depth(mask: Mask) -> Array:
    """Distance from the background; droplets are assumed to continue beyond the edge of the picture."""
    return np.zeros(mask.shape) if mask.all() else distance_inside(mask)


@dataclass(frozen=True)
class Segments:
    """Droplets of a picture."""

    cells: Indices  # (h, w) int64, every pixel belongs to a droplet, from 0
    droplets: Mask  # (h, w) bool, pixels brighter than half-way to the ground
    inner: Array  # (n,) radius of the largest disc inside each droplet, pixels
    middle: Array  # (n, 2) row and column of its centre
    radius: float  # pixels, typical radius by granulometry

    @property
    def count(self) -> int:
        """Number of droplets, cut ones included."""
        return len(self.inner)


def find_droplets(smooth: Array, noise: float = 0.0) -> Segments | None:
    """Divide denoised darkness into droplets; None if there are none.

    Args:
        smooth: (h, w), 0 in droplets and 1 on the ground.
        noise: standard deviation of the noise before denoising; where no film shows, it leads the watershed.
    """
    droplets = smooth < 0.5
    radius, smallest = granulometry(droplets)
    if radius <= 0 or droplets.all():
        return None
    markers, count = find_markers(droplets, radius, smallest)
    if not count:
        return None
    depth = distance_inside(droplets)
    seen, even = (
        ndimage.gaussian_filter(field, PARTING.smoothing * radius) for field in (np.clip(smooth, 0, 1), depth)
    )
    cells = _flood(PARTING.film * seen - even / radius, markers, _thinning(smallest)) - 1
    cells = _straighten(cells, min(PARTING.straight[0] + PARTING.straight[1] * noise, PARTING.straightest) * smallest)
    cells = (np.cumsum(np.bincount(cells.ravel()) > 0) - 1)[cells]
    names = np.arange(cells.max() + 1)
    inner, middle = ndimage.maximum(depth, cells, names), np.array(ndimage.maximum_position(even, cells, names))
    return Segments(cells, droplets, inner, middle, radius)


def roundness(segments: Segments | None) -> float:
    """Area of the largest discs inside segments off the edge over the area of the segments; 0 without any."""
    if segments is None:
        return 0.0
    cells = segments.cells
    area = np.bincount(cells[segments.droplets], minlength=segments.count).astype(np.float64)
    area[edge_of(cells)] = 0.0  # cut
    return float(np.minimum(np.pi * segments.inner**2, area).sum() / max(area.sum(), 1.0))


def _thinning(smallest: float) -> int:
    """Pixels of the picture to one of the grid on which markers are found."""
    return max(1, round(smallest / PARTING.coarse))


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


def borders(cells: Indices) -> Mask:
    """(h, w) pixels whose upper or left neighbour belongs to another cell."""
    found = np.zeros(cells.shape, dtype=bool)
    found.flat[meetings(cells)[0]] = True
    return found


def find_markers(droplets: Mask, radius: float, smallest: float, neck: float = PARTING.neck) -> tuple[Indices, int]:
    """Maxima of the distance from the ground that stand out: what rises above the reconstruction of the distance times
    `neck` below the distance itself, and reaches its full height there.

    Args:
        droplets: (h, w).
        radius: typical radius, pixels.
        smallest: radius of small droplets, pixels.
        neck: see `PARTING.neck`.

    Returns:
        (h, w) int64, a number from 1 in each marker, 0 elsewhere; number of those that lie off the edge.
    """
    step = _thinning(smallest)
    depth = step * distance_inside(droplets[::step, ::step])
    even = ndimage.gaussian_filter(depth, PARTING.smoothing * radius / step)
    lowest = max(PARTING.edge_speck * smallest, 1.0)
    height = np.log(np.maximum(even, 0.5 * lowest)).astype(np.float32)  # sorts faster, to a millionth of its range
    above = height - scikit_image().morphology.reconstruction(height + np.float32(np.log(neck)), height)
    label, count = ndimage.label(above > 0, np.ones((3, 3)))
    full = (above > -np.log(neck) * (1 - 1e-4)) & (even >= lowest)
    top, edge = np.zeros(count + 1), np.zeros(count + 1, dtype=bool)
    np.maximum.at(top, label[full], even[full])
    edge[edge_of(label)] = True
    inner = (top >= max(PARTING.speck * smallest, 1.0)) & ~edge
    kept = inner | (edge & (top > 0))
    inner[0] = kept[0] = False
    markers = np.zeros(droplets.shape, dtype=np.int64)
    markers[::step, ::step] = np.where(kept, np.cumsum(kept), 0)[label]
    return markers, int(inner.sum())


def _straighten(cells: Indices, width: float) -> Indices:
    """Give each pixel to the cell that fills most of its surroundings, so that walls do not follow noise."""
    if width < PARTING.narrow:
        return cells
    best, owner = np.full(cells.shape, -1.0), cells.copy()
    reach = int(np.ceil(4 * width))
    for label, box in enumerate(ndimage.find_objects(cells + 1)):
        wide = tuple(slice(max(side.start - reach, 0), side.stop + reach) for side in box)
        share = ndimage.gaussian_filter((cells[wide] == label).astype(np.float64), width, mode="nearest")
        wins = share > best[wide]
        owner[wide][wins] = label
        best[wide][wins] = share[wins]
    return owner
