"""How the droplets of a picture are known: by levels of grey, by labels of another program, or by their dark walls.

All three are droplets with cells, walls and outlines. They differ in which droplets are whole, in how areas and
interiors are counted, and in how far numbers are known: what `DropletSource` leaves open.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
import shapely
from scipy import ndimage
from scipy.special import expit, ndtr

from jamlab.arrays import Array, Mask
from jamlab.micrographs.illumination import Darkness, blur_of
from jamlab.micrographs.labels import ROUGH, Labelled, Note, label_darkness, label_segments
from jamlab.micrographs.picture_numbers import LIMITS
from jamlab.micrographs.ring_segmentation import Candidates, Rings
from jamlab.micrographs.segmentation import NECK, Segments, find_markers, meetings
from jamlab.micrographs.walls import find_walls, outlines, shape_factor

EDGE_CHORD = 0.25  # radii of outline along the edge that cut a droplet: it then lacks a hundredth of its radius
EDGE_ZONE = 0.6  # of blur and denoising: a droplet that ends so near to the edge may be cut or not
CLEAR = 1.12  # inner radii from the middle of a droplet to the edge: more than the longest of a droplet in a packing
BESIDE = 0.25  # of the radius: where the ground beside a droplet is looked for
LEAST_GROUND = 0.75  # of its darkness in wide voids: what is lighter is a blurred film
CONVEX = 0.93  # area of an outline over that of its convex hull: a label below is odd, as two droplets in one are
CLOSED_GAP = 0.5  # pixels of gap along a wall that show that a border is there
LEAST_RING = 4.0  # pixels, radius of the light in a ring: below, droplets are missed; set on the foams worked on
# half-widths of intervals of rings: the narrowest ones that hold 24 of the 25 counts of nine foams worked on and of 16
# rendered pictures; standard deviations of what chances say, twice if they were neither too sure nor related, and rings
RING_SIGMAS, RING_COUNT = 3.0, 0.25
RING_EDGE = 0.3  # pixels, by which the edge of the light in rings is uncertain
RING_LIGHT = 0.06  # of the picture: light of droplets at its edge, which hands draw and no wall closes
LABEL_Z, LABEL_LINE, LABEL_ODD_Z, LABEL_ODD_SHAPE = 22.0, 0.3, 3.0, 0.5
RELATIVE = {"count": 0.045, "area": 0.03, "voids": 0.1}  # largest errors of good rendered pictures, of the value
ROUND = 0.72  # area of the largest disc inside over area; a hexagon 0.91, a pentagon of aspect 1.2 about 0.75
COUNTED = 8  # pixels: radius of small droplets in the picture in which they are counted again


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
        """Most whole droplets that hold another number of markers than one, over other thresholds and other necks."""
        most, every = 0, max(1, int(self.segments.smallest / COUNTED))
        few, cells = self.darkness.smooth[::every, ::every], self.segments.cells[::every, ::every]
        for level, neck in ((0.35, NECK), (0.65, NECK), (0.5, 0.8), (0.5, 0.94)):
            markers, _ = find_markers(few < level, self.segments.radius / every, self.segments.smallest / every, neck)
            places = np.nonzero(markers)
            pairs = np.unique(markers[places] * self.segments.count + cells[places])
            held = np.bincount(pairs % self.segments.count, minlength=self.segments.count)
            most = max(most, int((held[whole] != 1).sum()))
        return most

    def errors(self, values: dict[str, float], whole: Mask, areas: Array, picture: int) -> dict[str, float]:
        """Largest errors of good rendered pictures, of numbers as large as those."""
        shares = {name: share * values[name] for name, share in RELATIVE.items()}
        same = {"rho": LIMITS["rho"], "interior_fraction": LIMITS["rho"]}
        return shares | same | {"z": LIMITS["z"], "shape_rim": LIMITS["shape"]}


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
        # beyond a line, up to which labels pass for touching, with the line, over the diameter
        gap = (walls.widest - (1 - LABEL_LINE) * walls.film) / (2 * self.segments.radius)
        share = doubt / max(values["count"], 1.0)
        edge = RING_EDGE + 0.5 * walls.film  # pixels by which an edge may be elsewhere: by itself, and for half a line
        covered = edge * beside / ground.size or 1.0  # without ground nothing says where droplets end
        noted = sum(note.area for note in self.notes) / max(values["count"], 1.0)
        return {
            "count": 1.0 + doubt,  # one that the edge of the picture hardly cuts may be whole
            "area": share * values["area"] + edge * perimeter + noted,
            "rho": covered,
            "interior_fraction": covered,
            "z": max(LIMITS["z"], LABEL_Z * gap) + LABEL_ODD_Z * share,
            "shape_rim": LIMITS["shape"] + LABEL_ODD_SHAPE * share,
            "voids": max(1.0, RELATIVE["voids"] * values["voids"]) + doubt,
        }


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


def ring_errors(candidates: Candidates, areas: Array, light: float, pixels: int) -> dict[str, float]:
    """Half-widths of the intervals of what is known of rings. `areas`: (n,) of the light inside droplets that count,
    pixels; `light`: share of the picture that it covers; `pixels`: of the picture."""
    chance, mean = expit(candidates.odds), float(areas.mean()) if len(areas) else float("nan")
    taken = np.arange(len(chance)) < candidates.taken
    wrong = chance - taken  # what the count lacks on average
    unsure = abs((wrong * candidates.areas).sum())
    unsure += RING_SIGMAS * np.sqrt((chance * (1 - chance) * candidates.areas**2).sum())
    above = np.sqrt(candidates.areas / np.pi) - LEAST_RING
    counts = chance * candidates.whole * ndtr(above / RING_EDGE)  # chance that it is one, whole and above the limit
    lacking = counts - (taken & candidates.whole & (above >= 0))
    spread, larger = counts * (1 - counts), candidates.areas - mean  # variance of each being one; what it adds
    rim = 2 * np.sqrt(np.pi * areas)  # pixels of area for a pixel by which the edge of the light is elsewhere
    count = abs(lacking.sum()) + RING_SIGMAS * np.sqrt(spread.sum())
    shift, scatter = abs((lacking * larger).sum()), np.sqrt((spread * larger**2).sum())
    area = shift + np.hypot(RING_SIGMAS * scatter, RING_EDGE * rim.sum())  # summed over rings; independent causes
    return {
        "count": float(count + RING_COUNT),
        "area": float(area / len(areas)) if len(areas) else float("nan"),
        "interior_fraction": float(
            RING_LIGHT + RING_EDGE * light * rim.sum() / max(areas.sum(), 1.0) + unsure / pixels
        ),
    }
