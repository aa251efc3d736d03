"""How the droplets of a picture are known: by levels of grey, or by labels of another program.

Both are droplets with cells, walls and outlines. They differ in which droplets are whole, in how areas are counted, and
in how far numbers are known: what `DropletSource` leaves open.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
import shapely

from jamlab.arrays import Array, Indices, Mask
from jamlab.micrographs.illumination import Darkness, blur_of
from jamlab.micrographs.labels import ROUGH, Labelled, Note, label_darkness, label_segments
from jamlab.micrographs.picture_numbers import LIMITS
from jamlab.micrographs.segmentation import Segments, meetings
from jamlab.micrographs.walls import find_walls, outlines, shape_factor

EDGE_ZONE = 0.6  # of blur and denoising: a droplet that ends so near to the edge may be cut or not
EDGE_CHORD = 0.25  # radii of outline along the edge that cut a droplet: it then lacks a hundredth of its radius
CLEAR = 1.12  # inner radii from the middle of a droplet to the edge: more than the longest of a droplet in a packing
CONVEX = 0.93  # area of an outline over that of its convex hull: a label below is odd, as two droplets in one are
LABEL_EDGE = 0.3  # pixels, by which the edge of a label is uncertain
LABEL_Z, LABEL_LINE, LABEL_ODD_Z, LABEL_ODD_SHAPE = 22.0, 0.3, 3.0, 0.5
RELATIVE = {"count": 0.045, "area": 0.03, "voids": 0.1}  # largest errors of good rendered pictures, of the value
ROUND = 0.72  # area of the largest disc inside over area; a hexagon 0.91, a pentagon of aspect 1.2 about 0.75


class DropletSource(ABC):
    """Droplets of a picture, cut ones included, with their cells, walls and outlines.

    Attributes:
        contrast: "bright", "dark" or "labels".
        labelled: droplets are known by labels, not by levels of grey.
        open_edge: share of the edge of the picture from which on it is open ground.
        outside: (h, w) pixels at the edge of the picture.
        size: (n,) pixels of each droplet.
        centres: (n, 2) row and column of their middle.
    """

    contrast: str
    labelled: bool
    open_edge: float
    blur = 0.0
    notes: tuple[Note, ...] = ()

    def __init__(self, darkness: Darkness, segments: Segments, film: float | None) -> None:
        self.darkness, self.segments, cells = darkness, segments, segments.cells
        self.walls = find_walls(cells, darkness, segments.radius, self.blur, film, self.labelled)
        self.outlines = outlines(cells, self.walls.inside)
        self.outside = np.ones(cells.shape, dtype=bool)
        self.outside[1:-1, 1:-1] = False
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
    def errors(self, values: dict[str, float], whole: Mask) -> dict[str, float]:
        """Half-widths of the intervals of numbers in pixels."""


class GreyDroplets(DropletSource):
    """Bright or dark droplets."""

    labelled = False
    open_edge = 0.5

    def __init__(self, contrast: str, darkness: Darkness, segments: Segments, film: float | None) -> None:
        self.contrast, self.blur = contrast, blur_of(darkness)
        super().__init__(darkness, segments, film)

    def whole(self) -> tuple[Mask, int]:
        last: Indices = np.flip(self.outside.shape) - 1  # of x and y
        whole = np.asarray((self.size > 0) & [len(ring) > 0 for ring in self.outlines])
        middle = self.segments.middle
        away = np.minimum(middle, np.array(self.outside.shape) - 1 - middle).min(axis=1)
        clear = away > CLEAR * self.segments.inner  # though a sliver of another one has no film that shows
        unsure, zone = 0, EDGE_ZONE * np.hypot(self.blur, self.darkness.filter)
        for number in np.flatnonzero(whole):
            ring, inner = self.outlines[number], self.segments.inner[number]
            x, y = np.clip(np.rint(ring).astype(np.int64), 0, last).T
            length = np.hypot(*np.diff(ring, axis=0, append=ring[:1]).T)[self.outside[y, x]].sum()
            whole[number] = length <= EDGE_CHORD * inner or clear[number]
            near = min(ring.min(), (last - ring).min()) < zone
            unsure += near and length**2 < 8 * inner * zone and not clear[number]  # a chord c is cut c^2/(8 r) deep
        return whole, unsure

    def areas(self) -> Array:
        cells, void, n = self.segments.cells, self.walls.void_pixels, self.segments.count
        dark = np.bincount(cells[void], self.darkness.values[void], n)
        return np.asarray(np.maximum(np.bincount(cells.ravel(), minlength=n) - dark, 1.0))

    def errors(self, values: dict[str, float], whole: Mask) -> dict[str, float]:
        """Largest errors of good rendered pictures, of numbers as large as those."""
        shares = {name: share * values[name] for name, share in RELATIVE.items()}
        return shares | {"rho": LIMITS["rho"], "z": LIMITS["z"], "shape_rim": LIMITS["shape"]}


class LabelledDroplets(DropletSource):
    """Droplets of a label image."""

    contrast = "labels"
    labelled = True
    open_edge = 0.65  # wet foams have half of it

    def __init__(self, found: Labelled, film: float | None) -> None:
        self.found, self.notes = found, found.notes
        super().__init__(label_darkness(found), label_segments(found), film)

    def whole(self) -> tuple[Mask, int]:
        whole = self.size > 0
        whole[np.unique(self.segments.cells[self.outside & self.segments.droplets])] = False
        return whole, 0

    def areas(self) -> Array:
        return self.found.areas

    def errors(self, values: dict[str, float], whole: Mask) -> dict[str, float]:
        kept, walls = np.flatnonzero(whole), self.walls
        drawn = shapely.polygons([ring if len(ring) > 3 else np.zeros((4, 2)) for ring in self.outlines])
        bent = shapely.area(drawn) < CONVEX * shapely.area(shapely.convex_hull(drawn))  # of cut ones, too
        odd = bent | (whole & (np.pi * (self.segments.inner + ROUGH) ** 2 < ROUND * self.found.areas))
        doubt = int(odd.sum()) + sum(note.doubt for note in self.notes)
        shapes = np.array([shape_factor(self.outlines[k]) for k in kept])
        perimeter = float((2 * np.sqrt(np.pi * self.found.areas[kept] * shapes)).mean())
        ground = self.found.labels == 0
        beside = len(meetings(ground)[0]) * np.pi / 4  # an edge of pixels is longer
        # beyond a line, up to which labels pass for touching, with the line, over the diameter
        gap = (walls.widest - (1 - LABEL_LINE) * walls.film) / (2 * self.segments.radius)
        share = doubt / max(values["count"], 1.0)
        edge = LABEL_EDGE + 0.5 * walls.film  # pixels by which an edge may be elsewhere: by itself, and for half a line
        return {
            "count": 1.0 + doubt,  # one that the edge of the picture hardly cuts may be whole
            "area": share * values["area"] + edge * perimeter,
            "rho": edge * beside / ground.size or 1.0,  # without ground nothing says where droplets end
            "z": max(LIMITS["z"], LABEL_Z * gap) + LABEL_ODD_Z * share,
            "shape_rim": LIMITS["shape"] + LABEL_ODD_SHAPE * share,
            "voids": max(1.0, RELATIVE["voids"] * values["voids"]) + doubt,
        }
