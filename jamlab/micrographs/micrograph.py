"""Micrographs of droplets: measure in a picture what is measured in a simulated packing.

In order: read the picture, find out whether droplets are bright or dark, divide it by its background, find droplets,
measure the gaps along the walls of their cells, and judge whether the numbers can be trusted. Labels of another program
replace all but the last two. The edge of the picture is an edge: droplets that it cuts are marked and not counted, but
they hold and touch others.

The packing fraction is one minus the darkness of all voids over the area that the picture shows. That share needs no
whole droplets, so that large droplets, which the edge cuts more often, weigh as much as they should (Horvitz-Thompson
with the same probability for every point). Films belong to the droplets beside them.

Sources: F. M. Schaller et al., Philos. Mag. 93, 3993 (2013), for cells; K. Desmond & E. R. Weeks, Soft Matter 11, 4662
(2015), for contacts of quasi-two-dimensional emulsions.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from scipy import ndimage

from jamlab.arrays import Array, Indices, Mask
from jamlab.checks import check_choice, checked
from jamlab.errors import InputError
from jamlab.geometry.contact_network import find_rattlers
from jamlab.micrographs.illumination import noise_level, read_darkness, remove_background
from jamlab.micrographs.labels import looks_labelled, read_labels
from jamlab.micrographs.measured_droplets import Micrograph
from jamlab.micrographs.picture_files import CHANNELS, read_grey, read_values, scikit_image
from jamlab.micrographs.picture_numbers import Number, PictureVoids, find_voids
from jamlab.micrographs.quality import LOOSE, Checks, doubt_few, find_doubts
from jamlab.micrographs.segmentation import edge_of, find_droplets, roundness
from jamlab.micrographs.walls import THICKEST_FILM, DropletSource, GreyDroplets, LabelledDroplets, shape_factor

CONTRASTS = ("auto", "dark", "bright")
TRIED = 256  # pixels along a side on which bright and dark are tried
LARGEST = 1e100  # size of a pixel, so that areas are finite
MARGIN = 0.3  # of the picture, repeated around a periodic one: more than half of the largest droplet and its cell


@checked
def micrograph(
    picture: str | Path | ArrayLike | None = None,
    pixel: float | None = None,
    film: float | None = None,
    periodic: bool = False,
    contrast: str = "auto",
    labels: str | Path | ArrayLike | Mask | None = None,
    channel: str = "grey",
) -> Micrograph:
    """Detect and measure droplets in a micrograph, with a reliability check.

    Uneven light, noise and blur are corrected; if they are too strong, `quality` is "doubtful", with `reasons`. Cut off
    scale bars first. Droplets with dark walls, such as bubbles in brightfield, need `labels`.

    Args:
        picture: image file, (h, w) grey values or (h, w, 3 or 4) colours; optional with `labels`.
        pixel: pixel size in the unit of length of the results. None: lengths in pixels.
        film: largest gap that counts as a contact, in pixels. None: estimated from the picture.
        periodic: True if the picture is one period of a periodic picture.
        contrast: "bright" (droplets on dark background), "dark", or "auto" (the one that gives the roundest droplets).
        labels: droplets found by another program: (h, w) integers, 0 for the background, or a file of them. Only the
            size of the picture is then used. In a mask (True in droplets) each piece is a droplet; touching droplets
            are split at their necks. Specks are removed and holes filled; `label_notes` counts them, and many of them
            make numbers doubtful.
        channel: "grey", "red", "green" or "blue", for pictures in colours.

    Raises:
        InputError: scikit-image or edt is missing, the file is not a picture, the picture looks like labels, arguments
            are invalid, or no whole droplet is found.

    Example:
        >>> *_, dense = jamlab.compress(jamlab.jam(model="dp", n=8, seed=1), to=0.93, step=0.03)
        >>> picture = jamlab.synthetic_micrograph(dense, 256)
        >>> m = jamlab.micrograph(picture, pixel=dense.box[0, 0] / 256, periodic=True)
        >>> abs(m.rho - jamlab.packing_fraction(dense)) < 0.02, len(m.table()) == m.count
        (True, True)
        >>> m.draw("overlay.png")
        >>> y, x = np.indices((60, 90))
        >>> two = 1 * (np.hypot(x - 24, y - 30) < 20) + 2 * (np.hypot(x - 65, y - 30) < 20)
        >>> again = jamlab.micrograph(labels=two)
        >>> again.count, again.contrast
        (2, 'labels')
    """
    for name, value in (("pixel", pixel), ("film", film)):
        if value is not None and not 1 / LARGEST <= value <= LARGEST:  # beyond, areas are 0 or infinite
            raise InputError(f"{name} is {value}: must be a positive number, {1 / LARGEST:g} to {LARGEST:g}")
    if contrast == "ring":
        raise InputError(
            'contrast is "ring": not supported; segment the droplets with Cellpose or StarDist, and give labels='
        )
    check_choice("contrast", contrast, CONTRASTS)
    check_choice("channel", channel, CHANNELS)
    if picture is None and labels is None:
        raise InputError("give a picture, or labels, or both")
    if isinstance(picture, str | Path):
        picture = read_values(Path(picture))
    grey = None if picture is None else read_grey(picture, channel)
    if labels is not None:
        if periodic or contrast != CONTRASTS[0]:
            raise InputError("`periodic` and `contrast` do not apply to labels: leave them out")
        found = read_labels(labels, None if grey is None else grey.shape)
        shown = (found.labels > 0).astype(np.float64) if grey is None else grey
        return Measurement(shown, LabelledDroplets(found, film)).result(pixel)
    assert grey is not None and picture is not None
    if contrast == "auto":
        if looks_labelled(np.asarray(picture)):
            levels = "the picture looks like labels or a mask"
            raise InputError(f"{levels}: give it as labels= or --labels; if it is a photograph, give contrast=")
        contrast = find_contrast(grey)
    margin = int(np.ceil(MARGIN * min(grey.shape))) if periodic else 0
    return Measurement(grey, _find_by_grey(grey, contrast, margin, film), margin).result(pixel)


def _find_by_grey(grey: Array, contrast: str, margin: int, film: float | None) -> DropletSource:
    """Bright or dark droplets of a picture repeated around itself."""
    darkness = read_darkness(grey if contrast == "bright" else 1 - grey).wrapped(margin)
    segments = find_droplets(darkness.smooth, darkness.noise)
    if segments is None:
        raise InputError(f"no droplet found: check `contrast` ({contrast}) and the picture")
    return GreyDroplets(contrast, darkness, segments, film)


def find_contrast(grey: Array) -> str:
    """Whether droplets are bright or dark: those under which they are roundest."""
    step = max(1, round(max(grey.shape) / TRIED))
    small = scikit_image().transform.downscale_local_mean(grey, (step, step)) if step > 1 else grey
    bright, dark = (_roundness(values) for values in (small, 1 - small))
    return "bright" if bright >= dark else "dark"


def _roundness(grey: Array) -> float:
    darkness = remove_background(grey, noise_level(grey))
    return roundness(None if darkness is None else find_droplets(darkness.smooth, darkness.noise))


class Measurement:
    """Droplets on their way to a `Micrograph`; those of a periodic picture are repeated around it."""

    def __init__(self, grey: Array, droplets: DropletSource, margin: int = 0) -> None:
        """`grey`: (h, w) grey values; `droplets`: of the picture repeated around itself, `margin` pixels wide."""
        self.grey, self.droplets, self.margin = grey, droplets, margin
        self.window = tuple(slice(margin, margin + side) for side in grey.shape)
        low, high = np.full(2, margin), np.add(margin, grey.shape)
        self.seen = (droplets.size > 0) & ((droplets.centres >= low) & (droplets.centres < high)).all(axis=1)
        whole, self.unsure = droplets.whole()
        self.whole = whole & self.seen
        self.rim = self._rim()
        if not self.whole.any():
            raise InputError(
                f"all {droplets.segments.count} droplets are cut by the edge; check `contrast` "
                f"({droplets.contrast}) and the size of the picture"
            )

    def _rim(self) -> Mask:
        """(n,) droplets nearest to the edge of the picture if it is open: what else they touch is not seen."""
        rim = np.zeros(self.droplets.segments.count, dtype=bool)
        if self._open():
            gap = self.droplets.walls.inside <= 0
            y, x = ndimage.distance_transform_edt(gap, return_distances=False, return_indices=True)
            rim[edge_of(self.droplets.segments.cells[y, x])] = True
        return rim

    def _open(self) -> float:
        """Share of the edge of the picture that is ground, if that is most of it; else 0."""
        share = float((edge_of(self.droplets.darkness.smooth) > 0.5).mean())
        return share if not self.margin and share > self.droplets.open_edge else 0.0

    def _coordination(self, widest: float) -> tuple[Indices, Mask, float]:
        """(n,) contacts that bear force, (n,) rattlers, and z, with gaps up to `widest` as contacts."""
        pairs = self.droplets.walls.contacts(widest)
        inner = self.whole & ~self.rim
        rattlers, bearing = find_rattlers(pairs, inner)
        if self.droplets.labelled and (rattlers & inner).sum() > LOOSE * inner.sum():  # apart: z is that of no packing
            rattlers, bearing = np.ones_like(rattlers), np.zeros_like(bearing)
        contacts = np.bincount(pairs[bearing].ravel(), minlength=len(inner))
        held = inner & ~rattlers
        return contacts, rattlers, float(contacts[held].mean()) if held.any() else float("nan")

    def _shown(self) -> Mask:
        """Pixels over which rho is measured: the picture, or the cells in its middle if its edge is ground."""
        shown = np.zeros(self.droplets.outside.shape, dtype=bool)
        shown[self.window] = True
        outer, pairs = self.rim.copy(), self.droplets.walls.pairs
        outer[pairs[outer[pairs].any(axis=1)]] = True  # their neighbours too face the open ground
        inner = shown & ~outer[self.droplets.segments.cells]
        return inner if inner.any() else shown

    def _checks(self, areas: Array, rattlers: Mask, z: float) -> Checks:
        """What the quality rests on."""
        droplets, shown = self.droplets, self._shown()
        walls, radius, darkness = droplets.walls, droplets.segments.radius, droplets.darkness
        area, beyond = float(shown.sum()), walls.widest - walls.film
        counted = shown if droplets.labelled else shown & walls.void_pixels  # of labels films are ground
        least = 0.2 if walls.film > THICKEST_FILM * radius else 0.7  # of wide gaps half may be none
        low, high = (self._coordination(walls.film + factor * beyond)[2] for factor in (least, 1.4))
        inner = self.whole & ~self.rim
        return Checks(
            whole=self.whole,
            roundness=np.pi * droplets.segments.inner**2 / areas,
            rho=1 - float(darkness.values[counted].sum()) / area,
            rho_by_pixels=1 - float((darkness.smooth[counted] > 0.5).sum()) / area,
            z=(z, low, high),
            blind=0.5 * beyond / radius,
            loose=int((rattlers & inner).sum()),
            held=int(inner.sum()),
            unsure=self.unsure,
            open_edge=self._open(),
        )

    def _voids(self, scale: float) -> PictureVoids:
        """Voids with their centres in the window, in the unit of length."""
        droplets = self.droplets
        cells, radius = droplets.segments.cells, droplets.segments.radius
        found = find_voids(droplets.walls.void, cells, droplets.darkness.values, droplets.outside, radius)
        place = found.centroid - self.margin
        inside = ((place >= 0) & (place < self.grey.shape[::-1])).all(axis=1)
        return PictureVoids(found.sides[inside], found.area[inside] * scale**2, place[inside] * scale)

    def result(self, pixel: float | None) -> Micrograph:
        """Numbers of the droplets that are whole."""
        droplets, walls, margin = self.droplets, self.droplets.walls, self.margin
        cells, n = droplets.segments.cells, droplets.segments.count
        kept, cut = np.flatnonzero(self.whole), np.flatnonzero(~self.whole & self.seen)
        scale, areas = float(1.0 if pixel is None else pixel), droplets.areas()
        contacts, rattlers, z = self._coordination(walls.widest)
        checks = self._checks(areas, rattlers, z)
        names = np.full(n, -1)
        names[kept] = np.arange(1, len(kept) + 1)
        centres, touching = droplets.centres[:, ::-1] - margin, walls.pairs[walls.touching]
        found = Micrograph(
            labels=np.where(walls.inside > 0, names[cells], 0)[self.window],
            centres=centres[kept] * scale,
            areas=areas[kept] * scale**2,
            shape=np.array([shape_factor(droplets.outlines[k]) for k in kept]),
            cells=scale**2 * np.bincount(cells.ravel(), minlength=n)[kept].astype(np.float64),
            contacts=contacts[kept],
            neighbours=np.bincount(touching.ravel(), minlength=n)[kept],
            rattlers=rattlers[kept],
            rim=self.rim[kept],
            rho=checks.rho,
            voids=self._voids(scale),
            cut=len(cut),
            contrast=droplets.contrast,
            blur=droplets.blur,
            noise=droplets.darkness.noise,
            light=droplets.darkness.light,
            film=walls.film * scale,
            numbers={},
            reasons=(),
            label_notes=tuple(note.text for note in droplets.notes),
            pixel=pixel,
            picture=self.grey,
            outlines=tuple(droplets.outlines[k] - margin for k in kept),
            cut_outlines=tuple(droplets.outlines[k] - margin for k in cut),
            touching=centres[touching[self.whole[touching].any(axis=1)]],
        )
        return self._judged(found, checks)

    def _judged(self, found: Micrograph, checks: Checks) -> Micrograph:
        """The same with its numbers, and why each may be wrong."""
        droplets, row = self.droplets, found.measure()
        values = {"count": float(found.count), "area": float(found.areas.mean())}
        values |= {name: row[name] for name in ("rho", "z", "shape_rim")} | {"voids": float(len(found.voids.sides))}
        doubts = find_doubts(droplets, checks) + doubt_few(found.count, found.means)
        numbers = {
            name: Number(value, tuple(doubt.text for doubt in doubts if name in doubt.numbers))
            for name, value in values.items()
        }
        return replace(found, numbers=numbers, reasons=tuple(doubt.text for doubt in doubts))
