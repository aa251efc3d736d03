"""Micrographs of droplets: measure in a picture what is measured in a simulated packing.

In order: read the picture, divide it by its background, fill in scale bars and labels, find droplets by granulometry and
watershed, measure the gaps along the walls of their cells, and judge whether the numbers can be trusted. The edge of the
picture is an edge: droplets that it cuts are marked and not counted, but they hold and touch others.

The packing fraction is one minus the darkness of all voids over the area that the picture shows. That share needs no
whole droplets, so that large droplets, which the edge cuts more often, weigh as much as they should (Horvitz-Thompson
with the same probability for every point). Films belong to the droplets beside them.

Sources: F. M. Schaller et al., Philos. Mag. 93, 3993 (2013), for cells; K. Desmond & E. R. Weeks, Soft Matter 11, 4662
(2015), for contacts of quasi-two-dimensional emulsions.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.geometry.rattlers import find_rattlers
from jamlab.micrographs import annotations
from jamlab.micrographs.annotations import Annotations
from jamlab.micrographs.droplet_outlines import outlines, shape_factor
from jamlab.micrographs.illumination import Darkness, blur_of, noise_level, remove_background
from jamlab.micrographs.picture_files import read_grey
from jamlab.micrographs.picture_voids import PictureVoids, find_voids
from jamlab.micrographs.polarity import droplets_are_bright
from jamlab.micrographs.quality import Checks, find_doubts
from jamlab.micrographs.segmentation import Segments, find_droplets
from jamlab.micrographs.size_distribution import SizeDistribution, size_distribution
from jamlab.micrographs.walls import Walls, find_walls
from jamlab.packing.short_repr import short_repr

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]

LARGEST = 1e100  # size of a pixel, so that areas are finite
MARGIN = 0.3  # of the picture, repeated around a periodic one: more than half of the largest droplet and its cell
OPEN_EDGE = 0.5  # of the edge of the picture is ground: droplets lie in the middle of it, and what is outside is no void
CLOSED_GAP = 0.5  # pixels of gap along a wall that show that a border is there


@dataclass(frozen=True)
class Micrograph:
    """Droplets that a picture shows whole; lengths in units of `pixel`, in pixels if that is None.

    Attributes:
        labels: (h, w) int64, droplet k is k + 1; 0 is the ground, -1 droplets cut by the edge of the picture.
        centres: (n, 2) centres of area, x to the right and y down.
        areas: (n,) with half of each film.
        shape: (n,) shape factors perimeter^2/(4 pi area) of the outlines.
        cells: (n,) areas of the cells; every pixel belongs to one.
        contacts: (n,) int64, droplets that each one touches, rattlers not counted, cut ones counted.
        rattlers: (n,) bool, fewer than three contacts, found recursively; cut droplets count as held.
        rho: packing fraction of all that the picture shows, films included.
        voids: sides, areas and centres of the voids, and P_l.
        sizes: sizes with a verdict: monodisperse, bidisperse, polydisperse.
        cut: number of droplets cut by the edge of the picture or by a label.
        bright: droplets are brighter than the ground.
        blur: standard deviation of the blur, pixels.
        noise: standard deviation of the noise, over the contrast between droplets and ground.
        light: brightest over dimmest light.
        film: width of films, in the unit of length.
        reasons: why the numbers may be wrong; empty if the picture is good.
        pixel: size of a pixel; None leaves all lengths in pixels.
        picture: (h, w) grey values, for drawing.
        outlines: (n,) outlines, (k, 2) each, in pixels of the picture; and of cut droplets.
        touching: (m, 2, 2) centres of droplets in contact, in pixels, for drawing.
    """

    labels: Indices
    centres: Array
    areas: Array
    shape: Array
    cells: Array
    contacts: Indices
    rattlers: Mask
    rho: float
    voids: PictureVoids
    sizes: SizeDistribution
    cut: int
    bright: bool
    blur: float
    noise: float
    light: float
    film: float
    reasons: tuple[str, ...]
    pixel: float | None
    picture: Array = field(repr=False)
    outlines: tuple[Array, ...] = field(repr=False)
    cut_outlines: tuple[Array, ...] = field(repr=False)
    touching: Array = field(repr=False)

    __repr__ = short_repr

    @property
    def count(self) -> int:
        """Number of droplets that the picture shows whole."""
        return len(self.areas)

    @property
    def quality(self) -> str:
        """Verdict of checks that need no truth: "good", or "doubtful" with `reasons`."""
        return "doubtful" if self.reasons else "good"

    @property
    def unit(self) -> str:
        """What lengths are measured in: "pixels", or "" for the unit that `pixel` was given in."""
        return "pixels" if self.pixel is None else ""

    @property
    def local_packing_fraction(self) -> Array:
        """(n,) area of each droplet over that of its cell."""
        return np.asarray(self.areas / self.cells)

    @property
    def z(self) -> float:
        """Mean number of contacts of the droplets that do not rattle; nan if all rattle."""
        return float(self.contacts[~self.rattlers].mean()) if (~self.rattlers).any() else float("nan")

    def measure(self) -> dict[str, float]:
        """What a picture shows of the columns of `jamlab.measure`: rho, z, rattlers, shape."""
        return {
            "rho": self.rho,
            "z": self.z,
            "rattlers": float(self.rattlers.sum()),
            "shape": float(self.shape.mean()),
        }

    def table(self) -> pd.DataFrame:
        """A row per droplet: droplet (its number in the overlay), x, y, area, radius, shape, contacts, rattler, cell, quality."""
        import pandas as pd

        return pd.DataFrame(
            {
                "droplet": np.arange(1, self.count + 1),
                "x": self.centres[:, 0],
                "y": self.centres[:, 1],
                "area": self.areas,
                "radius": np.sqrt(self.areas / np.pi),
                "shape": self.shape,
                "contacts": self.contacts,
                "rattler": self.rattlers,
                "cell": self.cells,
                "local_packing_fraction": self.local_packing_fraction,
                "quality": self.quality,
            }
        )

    def draw(self, path: str | Path) -> None:
        """Write the picture with outlines, numbers, contacts and voids over it, as PNG.

        Raises:
            StorageError: the file cannot be written.
        """
        from jamlab.micrographs.overlay import write_overlay

        write_overlay(self, path)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the same on axes of matplotlib."""
        from jamlab.micrographs.overlay import draw_overlay

        return draw_overlay(self, ax)


@checked
def micrograph(
    picture: str | Path | ArrayLike,
    pixel: float | None = None,
    film: float | None = None,
    bright: bool | None = None,
    periodic: bool = False,
) -> Micrograph:
    """Find and measure the droplets of a picture, and say whether the numbers can be trusted.

    Handles uneven light, noise, blur, scale bars and labels. How large the errors are, by each of these, is drawn by
    `jamlab figure micrograph-errors`; beyond what can be handled `quality` is "doubtful", with `reasons`.

    >>> m = jamlab.micrograph("droplets.png", pixel=0.65)  # a pixel is 0.65 micrometres wide
    >>> m.quality, m.count, m.rho, m.z
    ('good', 48, 0.9504, 5.65)
    >>> m.draw("overlay.png")
    >>> m.table().to_csv("droplets.csv", index=False)

    Args:
        picture: image file, or (h, w) grey values, or (h, w, 3 or 4) colours.
        pixel: size of a pixel in the unit of length wanted; None measures lengths in pixels.
        film: widest gap, in pixels, between droplets in contact; None takes it from the gaps of the picture.
        bright: droplets are brighter than the ground, True or False; None finds out.
        periodic: the picture is one period of a periodic one, as rendered from a simulation.

    Raises:
        InputError: without scikit-image; if the file is no picture, values are not finite, arguments are not positive,
            nothing stands out from noise, or no whole droplet is found.
    """
    for name, value in (("pixel", pixel), ("film", film)):
        if value is not None and not 1 / LARGEST <= value <= LARGEST:  # beyond, areas are 0 or infinite
            raise InputError(f"{name} is {value}: must be a positive number, {1 / LARGEST:g} to {LARGEST:g}")
    grey = read_grey(picture)
    is_bright = droplets_are_bright(grey) if bright is None else bool(bright)
    darkness, drawn = _without_background(grey if is_bright else 1 - grey)
    margin = int(np.ceil(MARGIN * min(grey.shape))) if periodic else 0
    return _Measurement(grey, is_bright, darkness, drawn, film, margin).result(pixel)


def _without_background(grey: Array) -> tuple[Darkness, Annotations]:
    """Darkness of a picture of bright droplets, and what was drawn into it, already filled in."""
    noise = noise_level(grey)
    flat = annotations.find_flat(grey, noise)
    grown = annotations.sort_annotations(flat, 0.0).thick
    darkness = remove_background(annotations.fill_in(grey, grown), ~grown)
    if darkness is None:
        raise InputError("no droplets stand out from light and noise: check the picture")
    drawn = flat | annotations.find_drawn(darkness.smooth, annotations.left_noise(darkness), darkness.radius)
    found = annotations.sort_annotations(drawn, darkness.radius)
    if found.count:
        hidden = found.thin | found.thick
        again = remove_background(annotations.fill_in(grey, hidden), ~hidden)
        if again is None:
            raise InputError("no droplets stand out from light and noise beside bars and labels: cut them off")
        darkness = again.covered(found.thick)
    return darkness, found


class _Measurement:
    """A picture, repeated around itself if it is periodic, on its way to a `Micrograph`."""

    def __init__(
        self, grey: Array, bright: bool, darkness: Darkness, drawn: Annotations, film: float | None, margin: int
    ) -> None:
        self.grey, self.bright, self.margin, self.drawn = grey, bright, margin, drawn
        height, width = grey.shape
        self.window = slice(margin, margin + height), slice(margin, margin + width)
        self.darkness = darkness.wrapped(margin)
        self.thick = np.pad(drawn.thick, margin, mode="wrap")
        segments = find_droplets(self.darkness.smooth, self.darkness.noise)
        if segments is None:
            raise InputError(f"no droplet found: check `bright` ({bright}) and the picture")
        self.segments: Segments = segments
        self.blur = blur_of(self.darkness)
        self.walls: Walls = find_walls(segments.cells, self.darkness, segments.radius, self.blur, film)
        self.rings = outlines(segments.cells, self.walls.inside)
        self.outside = self._outside()
        self.whole, self.centres = self._whole()
        if not self.whole.any():
            raise InputError(
                f"no whole droplet among {segments.count} found: check `bright` ({bright}) and the size of the picture"
            )

    def _outside(self) -> Mask:
        """Pixels at the edge of the picture and beside labels."""
        edge = ndimage.binary_dilation(self.thick, np.ones((3, 3)), iterations=2) if self.drawn.count else self.thick.copy()
        edge[0] = edge[-1] = edge[:, 0] = edge[:, -1] = True
        return np.asarray(edge)

    def _whole(self) -> tuple[Mask, Array]:
        """(n,) droplets that are whole and in the window, and (n, 2) centres, row and column."""
        cells, count = self.segments.cells, self.segments.count
        body = self.walls.inside > 0
        size = np.bincount(cells[body], minlength=count)
        y, x = np.nonzero(body)
        sums = [np.bincount(cells[body], place, count) / np.maximum(size, 1) for place in (y, x)]
        centres = np.column_stack(sums)
        whole = (size > 0) & np.array([len(ring) > 0 for ring in self.rings])
        for number in np.flatnonzero(whole):
            x, y = np.rint(self.rings[number]).astype(np.int64).T
            whole[number] = not self.outside[np.clip(y, 0, len(cells) - 1), np.clip(x, 0, cells.shape[1] - 1)].any()
        low = np.array([side.start for side in self.window])
        high = np.array([side.stop for side in self.window])
        self.seen = (size > 0) & ((centres >= low) & (centres < high)).all(axis=1)
        return whole & self.seen, centres

    def _coordination(self, widest: float) -> tuple[Indices, Mask, float]:
        """(n,) contacts that bear force, (n,) rattlers, and z, with gaps up to `widest` as contacts."""
        pairs = self.walls.contacts(widest)
        rattlers, bearing = find_rattlers(pairs, self.whole)
        contacts = np.bincount(pairs[bearing].ravel(), minlength=self.segments.count)
        held = self.whole & ~rattlers
        return contacts, rattlers, float(contacts[held].mean()) if held.any() else float("nan")

    def _shown(self) -> Mask:
        """Pixels over which rho is measured: the picture, or the cells in its middle if its edge is ground."""
        shown = np.zeros(self.thick.shape, dtype=bool)
        shown[self.window] = True
        shown &= ~self.thick
        if not self.margin:
            smooth = self.darkness.smooth
            edge = np.concatenate([smooth[0], smooth[-1], smooth[:, 0], smooth[:, -1]])
            if (edge > 0.5).mean() > OPEN_EDGE:
                cells = self.segments.cells
                open_ = np.unique(np.concatenate([cells[0], cells[-1], cells[:, 0], cells[:, -1]]))
                inner = shown & ~np.isin(cells, open_)
                return inner if inner.any() else shown
        return shown

    def _closed(self) -> Array:
        """(n,) share of the walls of each cell along which something darker is seen."""
        gap, cells = self.walls.width, self.segments.cells
        on = np.isfinite(gap)
        total = np.bincount(cells[on], minlength=self.segments.count)
        least = max(CLOSED_GAP, self.walls.film)
        dark = np.bincount(cells[on & (gap > least)], minlength=self.segments.count)
        return np.asarray(dark / np.maximum(total, 1))

    def result(self, pixel: float | None) -> Micrograph:
        """Numbers of the droplets that are whole."""
        segments, walls, n = self.segments, self.walls, self.segments.count
        cells, values, kept = segments.cells, self.darkness.values, np.flatnonzero(self.whole)
        scale = np.float64(1.0 if pixel is None else pixel)
        cell_areas = np.bincount(cells.ravel(), minlength=n).astype(np.float64)
        dark = np.bincount(cells[walls.void_pixels], values[walls.void_pixels], n)
        areas = np.maximum(cell_areas - dark, 1.0)
        contacts, rattlers, z = self._coordination(walls.widest)
        shown = self._shown()
        void_dark = float(values[shown & walls.void_pixels].sum())
        black = float((shown & walls.void_pixels & (self.darkness.smooth > 0.5)).sum())
        area = float(shown.sum())
        low, high = (self._coordination(walls.film + f * (walls.widest - walls.film))[2] for f in (0.7, 1.4))
        checks = Checks(
            self.whole,
            np.pi * segments.inner**2 / areas,
            self._closed(),
            np.sqrt(areas / np.pi),
            1 - void_dark / area,
            1 - black / area,
            (z, low, high),
            float((self.drawn.thin | self.drawn.thick).mean()),
        )
        names = np.full(n, -1)
        names[kept] = np.arange(1, len(kept) + 1)
        labels = np.where(walls.inside > 0, names[cells], 0)[self.window]
        voids = find_voids(walls.void, cells, values, self.outside, segments.radius)
        inside = _in_window(voids.centroid, self.window)
        centres = self.centres[:, ::-1] - self.margin
        pairs = walls.pairs[walls.touching & (self.whole[walls.pairs].any(axis=1))]
        cut = np.flatnonzero(~self.whole & self.seen)
        return Micrograph(
            labels,
            centres[kept] * scale,
            areas[kept] * scale**2,
            np.array([shape_factor(self.rings[k]) for k in kept]),
            cell_areas[kept] * scale**2,
            contacts[kept],
            rattlers[kept],
            checks.rho,
            PictureVoids(
                voids.sides[inside], voids.area[inside] * scale**2, (voids.centroid[inside] - self.margin) * scale
            ),
            size_distribution(areas[kept] * scale**2),
            len(cut),
            self.bright,
            self.blur,
            self.darkness.noise,
            self.darkness.light,
            float(walls.film * scale),
            find_doubts(self.darkness, self.blur, segments, walls, checks),
            pixel,
            self.grey,
            tuple(self.rings[k] - self.margin for k in kept),
            tuple(self.rings[k] - self.margin for k in cut),
            centres[pairs],
        )


def _in_window(places: Array, window: tuple[slice, slice]) -> Mask:
    rows, columns = window
    x, y = places.T
    return np.asarray((x >= columns.start) & (x < columns.stop) & (y >= rows.start) & (y < rows.stop))
