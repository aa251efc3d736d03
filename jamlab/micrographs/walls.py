"""Walls between droplets: how wide the dark gap is everywhere along them, which of it is film, which is void; outlines.

A wall is where two cells meet. The darkness on a strip along it, integrated across, is the width that the gap would
have were it sharp and black: blur spreads darkness but keeps the integral, and noise averages out. Two droplets touch
where that width falls to that of a film; what is wider, and all of a wall between droplets that do not touch, is void.
Voids that walls lead into one another are one void, with as many sides as droplets around it.

Droplets are known by levels of grey, or by labels of another program. `DropletSource` leaves open what differs: which
droplets are whole, how areas are counted, how far numbers are known.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
import shapely
from scipy import ndimage

from jamlab.arrays import Array, Indices, Mask
from jamlab.micrographs.illumination import Darkness, blur_of
from jamlab.micrographs.labels import ROUGH, Labelled, Note, label_darkness, label_segments
from jamlab.micrographs.picture_files import distance_inside, scikit_image
from jamlab.micrographs.segmentation import Segments, meetings

TOLERANCE = 0.012  # of the radius, by which a gap may be wider than a film
LEAST_TOLERANCE = 0.6  # pixels
BLURRED_TOLERANCE = 0.3  # pixels more for a pixel of blur: voids darken the ends of a contact
NOISY_TOLERANCE = 0.5  # pixels more where noise is as large as the contrast
LABEL_TOLERANCE = 0.3  # pixels more of labels, which end at whole pixels
WIDEST_STRIP = 0.3  # of the radius, half a strip: wider ones reach through droplets
BEYOND_STRIP = 1.2  # half strips: wider gaps between labels are known by the nearest pixels
SCATTERS = 2.0  # standard deviations of gaps between labels that touch, up to which they are contacts
THICKEST_FILM = 0.2  # of the radius: wider gaps are no contacts
ALONG = 2.5  # pixels along a wall over which its width is averaged
BLURS = 2.5  # standard deviations of blur in half a strip
STRIP = 0.04  # of the radius, in half a strip beside them, for films
SCATTERED_FILM = 0.16  # of the radius: the gaps of so wide films scatter by more than light and noise make them
MODES = 8  # Fourier modes of an outline
POINTS = 512  # even steps along an outline for the transform: two or more to a pixel up to a radius of 40
LEAST_WALL = 3  # pixels of a wall between neighbours: less is a corner where four cells meet


@dataclass(frozen=True)
class Walls:
    """Walls of a picture."""

    pairs: Indices  # (m, 2) int64, droplets i < j whose cells meet
    gap: Array  # (m,) pixels, narrowest width of the gap between them
    length: Array  # (m,) pixels of wall
    film: float  # width of films, pixels
    widest: float  # gaps up to this width are contacts, pixels
    touching: Mask  # (m,) bool
    void: Indices  # (h, w) int64, void that each pixel near a wall belongs to, from 0; -1 elsewhere and in films
    void_pixels: Mask  # (h, w) bool, pixels around a void whose darkness is its own, not that of a film
    width: Array  # (h, w) pixels, width of the gap at the pixels of walls, inf elsewhere
    inside: Array  # (h, w) pixels from each pixel to the end of its droplet, negative in gaps

    def contacts(self, widest: float) -> Indices:
        """(k, 2) pairs with a gap up to `widest`."""
        return np.asarray(self.pairs[self.gap <= widest])


def find_walls(
    cells: Indices, darkness: Darkness, radius: float, blur: float, film: float | None, labelled: bool = False
) -> Walls:
    """Measure the gaps along all walls.

    Args:
        cells: (h, w), droplet that each pixel belongs to.
        darkness: the picture without its background.
        radius: typical radius, pixels.
        blur: standard deviation of the blur, pixels.
        film: widest gap of a contact, pixels; None takes it from the gaps themselves.
        labelled: darkness is that of labels, between which walls may be left free that are wider than any film.
    """
    wall, pair = _wall_pixels(cells)
    if not wall.any():  # one cell
        return _no_walls(cells, darkness)
    half = min(BLURS * blur + 2.0 + STRIP * radius, WIDEST_STRIP * radius)
    tolerance = max(TOLERANCE * radius, LEAST_TOLERANCE)
    tolerance += LABEL_TOLERANCE if labelled else BLURRED_TOLERANCE * blur + NOISY_TOLERANCE * darkness.noise
    away, nearest = ndimage.distance_transform_edt(~wall, return_indices=True)
    names, short = np.unique(pair[wall], return_inverse=True)
    numbers = np.zeros(cells.shape, dtype=np.int64)
    numbers[wall] = short + 1
    narrowest = np.zeros(len(names))
    if labelled:  # a strip as wide as the widest contact: voids beside it darken wider ones
        free = distance_inside(darkness.values > 0.5)
        narrowest[:] = np.inf
        np.minimum.at(narrowest, short, 2 * free[wall])
        reach = 0.5 * (film or _film_between_labels(narrowest, tolerance)[1])
        half = min(reach + 1.0 + STRIP * radius, WIDEST_STRIP * radius)
    strips = np.where(away <= half, numbers[tuple(nearest)], 0)
    width, gaps, length = _measure_strips(strips, wall, darkness, half)
    gaps = np.where(narrowest > BEYOND_STRIP * half, np.maximum(narrowest, gaps), gaps)
    long = np.isfinite(gaps)
    names, gaps, length = names[long], gaps[long], length[long]
    pairs = np.column_stack(np.divmod(names, int(cells.max()) + 1))
    own, widest = _film_between_labels(gaps, tolerance) if labelled else _film_width(gaps, radius, tolerance)
    widest = widest if film is None else film
    touching = gaps <= widest
    touch_names = names[touching]
    is_film = wall & np.isin(pair, touch_names) & (width <= widest)
    open_wall = wall & ~is_film
    label, _ = ndimage.label(open_wall, np.ones((3, 3)))
    label = np.where(away <= 0, label, label[tuple(nearest)])
    reach = BLURS * blur + 1.5  # beyond, what is not black belongs to droplets
    dark = darkness.smooth >= 0.35
    if labelled:  # reach is less than two pixels
        near_void = (away <= half) | ndimage.binary_dilation(dark, np.ones((3, 3)))
    else:
        near_void = (away <= half) | (distance_inside(~dark) <= reach)
    void_pixels = ~is_film[tuple(nearest)] & near_void
    void = np.where(void_pixels, label, 0).astype(np.int64) - 1
    inside = 1 - 2 * darkness.values  # what is labelled is droplet
    if not labelled:
        inside = _inside(darkness, away, width[tuple(nearest)], half, blur)
    return Walls(pairs, gaps, length, own, widest, touching, void, np.asarray(void_pixels), width, inside)


def _measure_strips(strips: Indices, wall: Mask, darkness: Darkness, half: float) -> tuple[Array, Array, Array]:
    """(h, w) width of the gap at the pixels of walls, (k,) narrowest and (k,) length of each; inf for corners.

    Args:
        strips: (h, w) wall, from 1, of whose strip a pixel is, 0 in none.
        wall: (h, w) pixels of walls.
        darkness: the picture without its background.
        half: half-width of a strip.
    """
    boxes, along = ndimage.find_objects(strips), ALONG + 8.0 * darkness.noise
    width, gaps, length = np.full(wall.shape, np.inf), np.full(len(boxes), np.inf), np.zeros(len(boxes))
    for number, box in enumerate(boxes):
        mine = strips[box] == number + 1
        both = np.stack([mine * darkness.values[box], mine])
        mass, weight = ndimage.gaussian_filter(both, (0, along, along), mode="constant")
        on = mine & wall[box]
        local = 2 * half * mass[on] / np.maximum(weight[on], 1e-12)
        width[box][on] = local
        if on.sum() >= 2 * LEAST_WALL:  # pixels on either side
            gaps[number], length[number] = local.min(), 0.5 * on.sum()
    return width, gaps, length


def _no_walls(cells: Indices, darkness: Darkness) -> Walls:
    """What a single droplet has."""
    none, pairs, shape = np.zeros(0), np.zeros((0, 2), dtype=np.int64), cells.shape
    void, width = np.full(shape, -1), np.full(shape, np.inf)
    inside = np.where(darkness.smooth < 0.5, 1.0, -1.0)
    return Walls(pairs, none, none, 0.0, 0.0, none.astype(np.bool_), void, darkness.smooth > 0.5, width, inside)


def _inside(darkness: Darkness, away: Array, width: Array, half: float, blur: float) -> Array:
    """Distance to the end of the droplet: half the gap from a wall that is narrow, else where darkness is one half."""
    slope = np.sqrt(2 * np.pi * (blur**2 + darkness.filter**2 + 1 / 6))
    by_darkness = (0.5 - np.clip(darkness.smooth, 0, 1)) * slope
    by_gap = away + 0.5 - 0.5 * width
    wide = np.clip((width / (2 * half) - 0.3) / 0.3, 0, 1)
    wide = np.maximum(wide, np.clip(away / half - 1, 0, 1))  # a strip along a wall says nothing of what is beyond it
    return np.asarray(
        np.where(wide < 1, (1 - wide) * np.where(np.isfinite(by_gap), by_gap, 0.0), 0.0) + wide * by_darkness
    )


def _film_width(gaps: Array, radius: float, tolerance: float) -> tuple[float, float]:
    """Width of films and of the widest gap that is a contact. Of the six neighbours that a cell has on average three or
    more touch in a jammed packing, so the lower quarter of all gaps lies among contacts. Where that is wider than any
    film, droplets do not touch."""
    own = float(np.clip(np.quantile(gaps, 0.25), 0.0, None)) if len(gaps) else 0.0
    own = own if own <= THICKEST_FILM * radius else 0.0
    return _film_between_labels(gaps, tolerance) if own > SCATTERED_FILM * radius else (own, own + tolerance)


def _film_between_labels(gaps: Array, tolerance: float) -> tuple[float, float]:
    """Most frequent gap between labels, and the widest that is a contact. The shortest interval that holds half of all
    gaps lies among contacts; below its median there are only contacts, which scatter as far above it."""
    if not len(gaps):
        return 0.0, tolerance
    order, half = np.sort(gaps), (len(gaps) + 1) // 2
    start = int(np.argmin(order[half - 1 :] - order[: len(order) - half + 1]))
    own = float(np.median(order[start : start + half]))
    below = order[order < own] - own
    scatter = float(np.sqrt(np.mean(below**2))) if len(below) else 0.0
    return own, own + max(tolerance, SCATTERS * scatter + LABEL_TOLERANCE)


def _wall_pixels(cells: Indices) -> tuple[Mask, Indices]:
    """(h, w) pixels beside another cell, and the pair of cells there as one number; -1 elsewhere."""
    places = meetings(cells)
    low, high = np.sort([cells.ravel()[place] for place in places], axis=0)
    pair = np.full(cells.size, -1)
    for place in places:
        np.maximum.at(pair, place, low * (int(cells.max()) + 1) + high)
    return pair.reshape(cells.shape) >= 0, pair.reshape(cells.shape)


def outlines(cells: Indices, inside: Array) -> list[Array]:
    """Outlines of droplets, half a gap from the walls of their cells, smoothed to their first Fourier modes.

    The outline of pixels is longer than that of the droplet by steps of a pixel, however fine they are; its first modes
    hold flats and corners but not the steps. More modes hold more of the corners, and more of the noise: outlines of a
    packing at rho = 0.95, with rims and without noise, lose 0.009 of A with 8 modes and 0.004 with 16, but in good
    rendered pictures errors of A are -0.010 to 0.018 with 8 modes, -0.008 to 0.020 with 10, and pass
    0.024 with 16.

    Returns:
        (k, 2) outline of the droplet in every cell, x and y in pixels; (0, 2) where there is none.
    """
    skimage, inside = scikit_image(), np.clip(inside, -1, 1)
    found = []
    for label, box in enumerate(ndimage.find_objects(cells + 1)):
        if box is None:
            found.append(np.zeros((0, 2)))
            continue
        own = np.pad(np.where(cells[box] == label, inside[box], -0.5), 2, constant_values=-0.5)
        rings = skimage.measure.find_contours(own, 0.0)
        ring = max(rings, key=lambda ring: shapely.Polygon(ring).area, default=np.zeros((0, 2)))
        corner = np.array([box[0].start, box[1].start]) - 2
        found.append((_smoothen(ring) + corner)[:, ::-1] if len(ring) > 4 else np.zeros((0, 2)))
    return found


def _smoothen(ring: Array) -> Array:
    curve = ring @ np.array([1.0, 1j])
    place = np.concatenate([[0], np.cumsum(np.abs(np.diff(curve)))])
    modes = np.fft.fft(np.interp(np.linspace(0, place[-1], POINTS, endpoint=False), place, curve))
    modes[MODES + 1 : -MODES] = 0
    even = np.fft.ifft(modes)
    return np.column_stack([even.real, even.imag])


def shape_factor(outline: Array) -> float:
    """perimeter^2/(4 pi area) of a closed outline (k, 2); nan without area."""
    shape = shapely.Polygon(outline)
    return float(shape.length**2 / (4 * np.pi * shape.area)) if shape.area > 0 else float("nan")


EDGE_ZONE = 0.6  # of blur and denoising: a droplet that ends so near to the edge may be cut or not
EDGE_CHORD = 0.25  # radii of outline along the edge that cut a droplet: it then lacks a hundredth of its radius
CLEAR = 1.12  # inner radii from the middle of a droplet to the edge: more than the longest of a droplet in a packing
CONVEX = 0.93  # area of an outline over that of its convex hull: a label below is odd, as two droplets in one are
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

    def doubted(self, whole: Mask) -> int:
        """Number of labels that may be no droplet, several or part of one."""
        drawn = shapely.polygons([ring if len(ring) > 3 else np.zeros((4, 2)) for ring in self.outlines])
        bent = shapely.area(drawn) < CONVEX * shapely.area(shapely.convex_hull(drawn))  # of cut ones, too
        odd = bent | (whole & (np.pi * (self.segments.inner + ROUGH) ** 2 < ROUND * self.found.areas))
        return int(odd.sum()) + sum(note.doubt for note in self.notes)
