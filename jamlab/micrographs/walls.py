"""Walls between droplets: how wide the dark gap is everywhere along them, which of it is film, which is void; outlines.

A wall is where two cells meet. The darkness on a strip along it, integrated across, is the width that the gap would
have were it sharp and black: blur spreads darkness but keeps the integral, and noise averages out. Two droplets touch
where that width falls to that of a film; what is wider, and all of a wall between droplets that do not touch, is void.
Voids that walls lead into one another are one void, with as many sides as droplets around it.

Between labels of another program, which leave the ground free, the gap is counted in pixels.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from scipy import ndimage

from jamlab.arrays import Array, Indices, Mask
from jamlab.micrographs.illumination import Darkness, blur_of
from jamlab.micrographs.labels import Note
from jamlab.micrographs.picture_files import NoDropletsError, distance_inside, scikit_image
from jamlab.micrographs.segmentation import Segments, edge_of, meetings


@dataclass(frozen=True)
class Gaps:
    """How gaps between droplets are measured, and outlines are drawn."""

    tolerance: float = 0.012  # of the radius, by which a gap may be wider than a film
    least_tolerance: float = 0.6  # pixels
    blurred_tolerance: float = 0.3  # pixels more for a pixel of blur: voids darken the ends of a contact
    noisy_tolerance: float = 0.5  # pixels more where noise is as large as the contrast
    label_tolerance: float = 0.3  # pixels more of labels, which end at whole pixels
    widest_strip: float = 0.3  # of the radius, half a strip: wider ones reach through droplets
    scatters: float = 2.0  # standard deviations of gaps between labels that touch, up to which they are contacts
    thickest_film: float = 0.2  # of the radius: wider gaps are no contacts
    along: float = 2.5  # pixels along a wall over which its width is averaged
    blurs: float = 2.5  # standard deviations of blur in half a strip
    strip: float = 0.04  # of the radius, in half a strip beside them, for films
    modes: int = 8  # Fourier modes of an outline
    points: int = 512  # even steps along an outline for the transform: two or more to a pixel up to a radius of 40
    edge_chord: float = 0.4  # radii of droplet along the edge that cut it: it then lacks a fiftieth of its radius
    # inner radii from the middle of a droplet to the edge: more than the longest of a droplet in a packing
    clear: float = 1.12
    least_wall: int = 3  # pixels of a wall between neighbours: less is a corner where four cells meet


GAPS = Gaps()


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
    line: float  # pixels left free between labels that touch, as narrow as it gets; 0 without labels
    inside: Array  # (h, w) pixels from each pixel to the end of its droplet, negative in gaps


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
    if not wall.any():
        raise NoDropletsError("only one droplet is found: show several, since the walls between them are measured")
    away, nearest = ndimage.distance_transform_edt(~wall, return_indices=True)
    names, short, count = np.unique(pair[wall], return_inverse=True, return_counts=True)
    tolerance = max(GAPS.tolerance * radius, GAPS.least_tolerance)
    numbers = np.zeros(cells.shape, dtype=np.int64)
    numbers[wall] = short + 1
    free = np.zeros(cells.shape)
    if labelled:
        near_void, inside = darkness.values > 0.5, 1 - 2 * darkness.values
        free = _pixels_between_labels(cells, near_void)
        width = _averaged(free, numbers, wall, GAPS.along)
        tolerance += GAPS.label_tolerance
    else:
        half = min(GAPS.blurs * blur + 2.0 + GAPS.strip * radius, GAPS.widest_strip * radius)
        strips = np.where(away <= half, numbers[tuple(nearest)], 0)
        width = 2 * half * _averaged(darkness.values, strips, wall, GAPS.along + 8.0 * darkness.noise)
        inside = _inside(darkness, away, width[tuple(nearest)], half, blur)
        tolerance += GAPS.blurred_tolerance * blur + GAPS.noisy_tolerance * darkness.noise
        reach = GAPS.blurs * blur + 1.5  # beyond, what is not black belongs to droplets
        near_void = (away <= half) | (distance_inside(darkness.smooth < 0.35) <= reach)
    gaps, narrowest = np.full((2, len(names)), np.inf)
    np.minimum.at(gaps, short, width[wall])
    np.minimum.at(narrowest, short, free[wall])
    long = count >= 2 * GAPS.least_wall  # pixels on either side
    names, gaps, narrowest, length = names[long], gaps[long], narrowest[long], 0.5 * count[long].astype(np.float64)
    pairs = np.column_stack(np.divmod(names, int(cells.max()) + 1))
    own, widest = _film_between_labels(gaps, tolerance) if labelled else _film_width(gaps, radius, tolerance)
    widest = widest if film is None else film
    touching = gaps <= widest
    # what an average along a wall adds to the gap of circles that touch
    line = (
        max(float(np.median(narrowest[touching])), own - GAPS.along**2 / radius) if labelled and touching.any() else 0.0
    )
    is_film = wall & np.isin(pair, names[touching]) & (width <= widest)
    label, _ = ndimage.label(wall & ~is_film, np.ones((3, 3)))
    label = np.where(away <= 0, label, label[tuple(nearest)])
    void_pixels = ~is_film[tuple(nearest)] & near_void
    void = np.where(void_pixels, label, 0).astype(np.int64) - 1
    return Walls(pairs, gaps, length, own, widest, touching, void, np.asarray(void_pixels), line, inside)


def _pixels_between_labels(cells: Indices, ground: Mask) -> Array:
    """(h, w) pixels of ground on either side of a wall, at its pixels; 0 elsewhere."""
    free, width = distance_inside(ground).ravel(), np.zeros(cells.size)
    first, second = meetings(cells)
    for place in (first, second):
        np.maximum.at(width, place, free[first] + free[second])
    return width.reshape(cells.shape)


def _averaged(values: Array, strips: Indices, wall: Mask, along: float) -> Array:
    """(h, w) means of values (h, w) over each strip, at the pixels of its wall; inf elsewhere.

    Args:
        strips: (h, w) wall, from 1, of whose strip a pixel is, 0 in none.
        wall: (h, w) pixels of walls.
        along: standard deviation of the weights along a wall, pixels.
    """
    found = np.full(wall.shape, np.inf)
    for number, box in enumerate(ndimage.find_objects(strips), 1):
        mine = strips[box] == number
        both = np.stack([mine * values[box], mine])
        mass, weight = ndimage.gaussian_filter(both, (0, along, along), mode="constant")
        on = mine & wall[box]
        found[box][on] = mass[on] / np.maximum(weight[on], 1e-12)
    return found


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
    own = own if own <= GAPS.thickest_film * radius else 0.0
    return own, own + tolerance


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
    return own, own + max(tolerance, GAPS.scatters * scatter + GAPS.label_tolerance)


def _wall_pixels(cells: Indices) -> tuple[Mask, Indices]:
    """(h, w) pixels beside another cell, and the pair of cells there as one number; -1 elsewhere."""
    places = meetings(cells)
    low, high = np.sort([cells.ravel()[place] for place in places], axis=0)
    pair = np.full(cells.size, -1)
    for place in places:
        np.maximum.at(pair, place, low * (int(cells.max()) + 1) + high)
    return pair.reshape(cells.shape) >= 0, pair.reshape(cells.shape)


def traced_outlines(cells: Indices, inside: Array) -> list[Array]:
    """Outlines of droplets, half a gap from the walls of their cells, smoothed to their first Fourier modes.

    The outline of pixels is longer than the outline of the droplet by steps of a pixel, however fine they are; its
    first modes hold flats and corners but not the steps. More modes hold more of the corners and of the noise: outlines
    of a packing at rho = 0.95, with rims and without noise, lose 0.009 of A with 8 modes and 0.004 with 16, but in good
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
    modes = np.fft.fft(np.interp(np.linspace(0, place[-1], GAPS.points, endpoint=False), place, curve))
    modes[GAPS.modes + 1 : -GAPS.modes] = 0
    even = np.fft.ifft(modes)
    return np.column_stack([even.real, even.imag])


def shape_factor(outline: Array) -> float:
    """perimeter^2/(4 pi area) of a closed outline (k, 2); nan without area."""
    shape = shapely.Polygon(outline)
    return float(shape.length**2 / (4 * np.pi * shape.area)) if shape.area > 0 else float("nan")


class SeenDroplets:
    """Droplets of a picture, cut ones included, with their cells, walls and outlines.

    Attributes:
        contrast: "bright", "dark" or "labels".
        labelled: droplets are known by labels, not by levels of grey.
        size: (n,) pixels of each droplet.
        centres: (n, 2) row and column of their middle.
        areas: (n,) pixels, with half of each film; of labels up to their edges.
        whole: (n,) droplets that the edge does not cut.
        notes: what was found in labels.
    """

    def __init__(
        self, contrast: str, darkness: Darkness, segments: Segments, film: float | None, notes: tuple[Note, ...] = ()
    ) -> None:
        self.contrast, self.darkness, self.segments, self.notes = contrast, darkness, segments, notes
        self.labelled, cells, n = contrast == "labels", segments.cells, segments.count
        self.blur = 0.0 if self.labelled else blur_of(darkness)
        self.walls = find_walls(cells, darkness, segments.radius, self.blur, film, self.labelled)
        self.outlines = traced_outlines(cells, self.walls.inside)
        body = self.walls.inside > 0
        self.size = np.bincount(cells[body], minlength=n)
        sums = [np.bincount(cells[body], place, n) for place in np.nonzero(body)]
        self.centres = np.column_stack(sums) / np.maximum(self.size, 1)[:, None]
        self.areas = self.size.astype(np.float64)
        if not self.labelled:
            void = self.walls.void_pixels
            dark = np.bincount(cells[void], darkness.values[void], n)
            self.areas = np.maximum(np.bincount(cells.ravel(), minlength=n) - dark, 1.0)
        chord = np.bincount(edge_of(cells)[edge_of(body)], minlength=n)
        away = np.minimum(segments.middle, np.array(cells.shape) - 1 - segments.middle).min(axis=1)
        near = (chord > GAPS.edge_chord * segments.inner) & (away <= GAPS.clear * segments.inner)
        cut = chord > 0 if self.labelled else near
        self.whole = ~cut & [len(ring) > 0 for ring in self.outlines]
