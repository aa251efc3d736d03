"""How the droplets of a picture are known: by levels of grey, by labels of another program, or by their dark walls.

All three are droplets with cells, walls and outlines. They differ in which droplets are whole, in how areas and
interiors are counted, and in how far numbers are known: what `DropletSource` leaves open.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
import shapely
from scipy import ndimage

from jamlab.arrays import Array, Mask
from jamlab.micrographs.illumination import Darkness, blur_of
from jamlab.micrographs.label_objects import Note
from jamlab.micrographs.labels import ROUGH, Labelled, label_darkness, label_segments
from jamlab.micrographs.quality import (
    LABEL_LINE,
    LEAST_RING,
    ROUND,
    label_errors,
    rendered_errors,
    ring_errors,
    unstable_droplets,
)
from jamlab.micrographs.ring_segmentation import Rings
from jamlab.micrographs.segmentation import Segments, meetings
from jamlab.micrographs.walls import find_walls, outlines, shape_factor

EDGE_CHORD = 0.25  # radii of outline along the edge that cut a droplet: it then lacks a hundredth of its radius
EDGE_ZONE = 0.6  # of blur and denoising: a droplet that ends so near to the edge may be cut or not
CLEAR = 1.12  # inner radii from the middle of a droplet to the edge: more than the longest of a droplet in a packing
BESIDE = 0.25  # of the radius: where the ground beside a droplet is looked for
LEAST_GROUND = 0.75  # of its darkness in wide voids: what is lighter is a blurred film
CONVEX = 0.93  # area of an outline over that of its convex hull: a label below is odd, as two droplets in one are
CLOSED_GAP = 0.5  # pixels of gap along a wall that show that a border is there


class DropletSource(ABC):
    """Droplets of a picture, cut ones included, with their cells, walls and outlines.

    Attributes:
        contrast: "bright", "dark", "labels" or "ring".
        labelled: droplets are known by labels or walls, not by levels of grey.
        open_edge: share of the edge of the picture from which on it is open ground.
        thick: (h, w) pixels that count as outside of the picture.
        annotated: share of the picture under bars and labels.
        size: (n,) pixels of each droplet.
        centres: (n, 2) row and column of their middle.
    """

    contrast: str
    labelled = True
    open_edge = 0.65  # wet foams have half of it
    annotated = 0.0
    blur = 0.0
    notes: tuple[Note, ...] = ()
    pieces = 0  # labels in several pieces

    def __init__(self, darkness: Darkness, segments: Segments, film: float | None, thick: Mask | None = None) -> None:
        self.darkness, self.segments, cells = darkness, segments, segments.cells
        self.walls = find_walls(cells, darkness, segments.radius, self.blur, film, self.labelled)
        self.outlines = outlines(cells, self.walls.inside)
        self.thick = np.zeros(cells.shape, dtype=bool) if thick is None else thick
        self.outside = ndimage.binary_dilation(self.thick, np.ones((3, 3)), iterations=2)  # with the edge itself
        self.outside[0] = self.outside[-1] = self.outside[:, 0] = self.outside[:, -1] = True
        body = self.walls.inside > 0
        self.size = np.bincount(cells[body], minlength=segments.count)
        sums = [np.bincount(cells[body], place, segments.count) for place in np.nonzero(body)]
        self.centres = np.column_stack(sums) / np.maximum(self.size, 1)[:, None]

    @abstractmethod
    def whole(self) -> tuple[Mask, int]:
        """(n,) droplets that the edge does not cut, and how many may be cut or not."""

    @abstractmethod
    def areas(self) -> Array:
        """(n,) areas in pixels."""

    @abstractmethod
    def interiors(self, window: tuple[slice, ...]) -> tuple[Array, float]:
        """(n,) areas without films, and the share of the picture that they cover."""

    def roundness(self, areas: Array) -> Array:
        """(n,) area of the largest disc inside each droplet over its area; nan where that cannot be judged."""
        return np.asarray(np.pi * self.segments.inner**2 / areas)

    def closed(self) -> Array:
        """(n,) share of the walls of each cell along which something darker is seen, 1 where that is known before."""
        return np.ones(self.segments.count)

    def widest(self, window: tuple[slice, ...]) -> float:
        """Radius of the largest disc between rings, over their typical radius; 0 of other droplets."""
        return 0.0

    def unstable(self, whole: Mask) -> int:
        """Number of droplets that split or merge if they are looked for otherwise."""
        return 0

    @abstractmethod
    def errors(self, values: dict[str, float], whole: Mask, areas: Array, picture: int) -> dict[str, float]:
        """Half-widths of the intervals of numbers in pixels; `areas`: of what counts; `picture`: pixels of it."""


class GreyDroplets(DropletSource):
    """Bright or dark droplets."""

    labelled = False
    open_edge = 0.5

    def __init__(
        self, contrast: str, darkness: Darkness, segments: Segments, film: float | None, thick: Mask, annotated: float
    ) -> None:
        self.contrast, self.blur, self.annotated = contrast, blur_of(darkness), annotated
        super().__init__(darkness, segments, film, thick)

    def whole(self) -> tuple[Mask, int]:
        last = np.array(self.outside.shape)[::-1] - 1  # of x and y
        whole = (self.size > 0) & np.array([len(ring) > 0 for ring in self.outlines])
        unsure, zone = 0, EDGE_ZONE * np.hypot(self.blur, self.darkness.filter)
        for number in np.flatnonzero(whole):
            ring, inner = self.outlines[number], self.segments.inner[number]
            x, y = np.clip(np.rint(ring).astype(np.int64), 0, last).T
            length = np.hypot(*np.diff(ring, axis=0, append=ring[:1]).T)[self.outside[y, x]].sum()
            clear = self._clear(int(number))
            whole[number] = length <= EDGE_CHORD * inner or clear
            gap = min(ring.min(), (last - ring).min())
            unsure += gap < zone and length**2 < 8 * inner * zone and not clear  # a chord c is cut c^2/(8 r) deep
        return whole, unsure

    def _clear(self, number: int) -> bool:
        """Whether a droplet ends before the edge, though a sliver of another one beyond it has no film that shows."""
        middle, away = self.segments.middle[number], CLEAR * self.segments.inner[number]
        row, column = middle.astype(np.int64)
        reach = int(away) + 2
        near = self.thick[max(row - reach, 0) : row + reach, max(column - reach, 0) : column + reach]
        return bool(min(middle.min(), (np.array(self.thick.shape) - 1 - middle).min()) > away and not near.any())

    def areas(self) -> Array:
        cells, void, n = self.segments.cells, self.walls.void_pixels, self.segments.count
        dark = np.bincount(cells[void], self.darkness.values[void], n)
        return np.asarray(np.maximum(np.bincount(cells.ravel(), minlength=n) - dark, 1.0))

    def interiors(self, window: tuple[slice, ...]) -> tuple[Array, float]:
        """What is brighter than half-way from droplets to what is beside them, which glow may keep from being black."""
        reach = 2 * int(BESIDE * self.segments.radius) + 1
        ground = np.clip(ndimage.maximum_filter(self.darkness.smooth, reach), LEAST_GROUND, 1.0)
        inside = self.darkness.smooth < 0.5 * ground
        areas = np.bincount(self.segments.cells[inside], minlength=self.segments.count)
        return areas.astype(np.float64), float(inside[window].mean())

    def closed(self) -> Array:
        gap, cells, n = self.walls.width, self.segments.cells, self.segments.count
        on = np.isfinite(gap)
        dark = np.bincount(cells[on & (gap > max(CLOSED_GAP, self.walls.film))], minlength=n)
        return np.asarray(dark / np.maximum(np.bincount(cells[on], minlength=n), 1))

    def unstable(self, whole: Mask) -> int:
        return unstable_droplets(self.darkness.smooth, self.segments, whole)

    def errors(self, values: dict[str, float], whole: Mask, areas: Array, picture: int) -> dict[str, float]:
        return rendered_errors(values)


class LabelledDroplets(DropletSource):
    """Droplets of a label image."""

    contrast = "labels"

    def __init__(self, found: Labelled, film: float | None) -> None:
        self.found, self.notes, self.pieces = found, found.notes, found.pieces
        super().__init__(label_darkness(found), label_segments(found), film)

    def whole(self) -> tuple[Mask, int]:
        whole = self.size > 0
        whole[np.unique(self.segments.cells[self.outside & self.segments.droplets])] = False
        return whole, 0

    def areas(self) -> Array:
        return self.found.areas

    def interiors(self, window: tuple[slice, ...]) -> tuple[Array, float]:
        return self.found.light_areas, self.found.light_share

    def errors(self, values: dict[str, float], whole: Mask, areas: Array, picture: int) -> dict[str, float]:
        kept, walls = np.flatnonzero(whole), self.walls
        drawn = shapely.polygons([ring if len(ring) > 3 else np.zeros((4, 2)) for ring in self.outlines])
        bent = shapely.area(drawn) < CONVEX * shapely.area(shapely.convex_hull(drawn))  # of cut ones, too
        odd = bent | (whole & (np.pi * (self.segments.inner + ROUGH) ** 2 < ROUND * self.found.areas))
        doubt = int(odd.sum()) + sum(note.doubt for note in self.notes)
        shapes = np.array([shape_factor(self.outlines[k]) for k in kept])
        perimeter = float((2 * np.sqrt(np.pi * self.found.areas[kept] * shapes)).mean())
        ground = self.found.labels == 0
        beside = len(meetings(ground)[0]) * np.pi / 4  # an edge of pixels is longer
        gap = (walls.widest - (1 - LABEL_LINE) * walls.film) / (2 * self.segments.radius)
        errors = label_errors(values, doubt, walls.film, gap, (perimeter, beside / ground.size))
        errors["area"] += sum(note.area for note in self.notes) / max(values["count"], 1.0)
        return errors


class RingDroplets(LabelledDroplets):
    """Droplets with dark walls and light on both sides."""

    contrast = "ring"

    def __init__(self, found: Labelled, film: float | None, rings: Rings) -> None:
        self.candidates = rings.candidates
        super().__init__(found, film)

    def whole(self) -> tuple[Mask, int]:
        return (self.size > 0) & self.candidates.whole[self.found.names - 1], 0  # the light inside is off the edge

    def roundness(self, areas: Array) -> Array:
        round_as = np.minimum(np.pi * (self.segments.inner + ROUGH) ** 2 / areas, 1.0)
        return np.where(self.found.light_areas < np.pi * LEAST_RING**2, np.nan, round_as)

    def widest(self, window: tuple[slice, ...]) -> float:
        return float(self.found.nearest[0][window].max() / self.segments.radius)

    def errors(self, values: dict[str, float], whole: Mask, areas: Array, picture: int) -> dict[str, float]:
        return ring_errors(self.candidates, areas, values["interior_fraction"], picture)
