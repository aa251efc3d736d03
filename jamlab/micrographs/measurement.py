"""From droplets to numbers: which are whole, their contacts, areas and voids, packing fraction and quality."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import ndimage

from jamlab.arrays import Array, Indices, Mask
from jamlab.errors import InputError
from jamlab.geometry.contact_network import find_rattlers
from jamlab.micrographs.droplet_sources import DropletSource
from jamlab.micrographs.measured_droplets import Micrograph
from jamlab.micrographs.picture_numbers import Number, PictureVoids, find_voids, size_distribution
from jamlab.micrographs.quality import LOOSE, Checks, doubt_few, doubt_known, find_doubts
from jamlab.micrographs.segmentation import edge_of
from jamlab.micrographs.walls import THICKEST_FILM, shape_factor


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
                f"no whole droplet among {droplets.segments.count}: check `contrast` ({droplets.contrast}) and its size"
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
        shown = np.zeros(self.droplets.thick.shape, dtype=bool)
        shown[self.window] = True
        shown &= ~self.droplets.thick
        outer, pairs = self.rim.copy(), self.droplets.walls.pairs
        outer[pairs[outer[pairs].any(axis=1)]] = True  # their neighbours too face the open ground
        inner = shown & ~outer[self.droplets.segments.cells]
        return inner if inner.any() else shown

    def _checks(self, areas: Array, rattlers: Mask, z: float) -> Checks:
        """What the quality rests on."""
        droplets, shown = self.droplets, self._shown()
        walls, segments, darkness = droplets.walls, droplets.segments, droplets.darkness
        void, area, beyond = shown & walls.void_pixels, float(shown.sum()), walls.widest - walls.film
        thick = walls.film > THICKEST_FILM * segments.radius
        apart = droplets.labelled and thick  # no films, but ground
        counted = shown if droplets.contrast == "labels" or apart else void
        least = 0.2 if thick else 0.7  # of wide gaps half may be none
        low, high = (self._coordination(walls.film + factor * beyond)[2] for factor in (least, 1.4))
        return Checks(
            whole=self.whole,
            roundness=droplets.roundness(areas),
            closed=droplets.closed(),
            radii=np.sqrt(areas / np.pi),
            rho=1 - float(darkness.values[counted].sum()) / area,
            rho_by_pixels=1 - float((darkness.smooth[counted] > 0.5).sum()) / area,
            z=(z, low, high),
            blind=0.5 * beyond / segments.radius,
            loose=int((rattlers & self.whole & ~self.rim).sum()),
            held=int((self.whole & ~self.rim).sum()),
            unsure=self.unsure,
            open_edge=self._open(),
            unstable=droplets.unstable(self.whole),
            widest=droplets.widest(self.window),
        )

    def _voids(self, scale: float) -> PictureVoids:
        """Voids with their centres in the window, in the unit of length."""
        droplets, segments = self.droplets, self.droplets.segments
        darkness = droplets.darkness.values
        found = find_voids(droplets.walls.void, segments.cells, darkness, droplets.outside, segments.radius)
        place = found.centroid - self.margin
        inside = ((place >= 0) & (place < self.grey.shape[::-1])).all(axis=1)
        return PictureVoids(found.sides[inside], found.area[inside] * scale**2, place[inside] * scale)

    def _beside(self, number: int, names: Indices) -> Indices:
        """(k,) droplet that each point of an outline touches, from 0; cut ones after the whole ones; -1 for none."""
        cells, beside = self.droplets.segments.cells, self.droplets.walls.beside
        x, y = np.rint(self.droplets.outlines[number]).astype(np.int64).T
        inside = np.clip(y, 0, len(cells) - 1), np.clip(x, 0, cells.shape[1] - 1)
        other = np.where(cells[inside] == number, beside[inside], cells[inside])
        other = np.where(beside[inside] < 0, -1, other)
        return np.where(other < 0, -1, np.where(names[other] > 0, names[other] - 1, int(names.max()) + other))

    def result(self, pixel: float | None) -> Micrograph:
        """Numbers of the droplets that are whole."""
        droplets, walls, margin = self.droplets, self.droplets.walls, self.margin
        cells, n = droplets.segments.cells, droplets.segments.count
        kept, cut = np.flatnonzero(self.whole), np.flatnonzero(~self.whole & self.seen)
        scale = float(1.0 if pixel is None else pixel)
        areas, (interiors, light) = droplets.areas(), droplets.interiors(self.window)
        contacts, rattlers, z = self._coordination(walls.widest)
        checks = self._checks(areas, rattlers, z)
        names = np.full(n, -1)
        names[kept] = np.arange(1, len(kept) + 1)
        centres = droplets.centres[:, ::-1] - margin
        touching = walls.pairs[walls.touching]
        found = Micrograph(
            labels=np.where(walls.inside > 0, names[cells], 0)[self.window],
            centres=centres[kept] * scale,
            areas=areas[kept] * scale**2,
            interiors=interiors[kept] * scale**2,
            shape=np.array([shape_factor(droplets.outlines[k]) for k in kept]),
            cells=scale**2 * np.bincount(cells.ravel(), minlength=n)[kept].astype(np.float64),
            contacts=contacts[kept],
            neighbours=np.bincount(touching.ravel(), minlength=n)[kept],
            rattlers=rattlers[kept],
            rim=self.rim[kept],
            rho=checks.rho,
            interior_fraction=light,
            voids=self._voids(scale),
            sizes=size_distribution(areas[kept] * scale**2),
            cut=len(cut),
            contrast=droplets.contrast,
            blur=droplets.blur,
            noise=droplets.darkness.noise,
            light=droplets.darkness.light,
            film=walls.film * scale,
            fringe=(walls.widest - walls.film) * scale,
            z_range=(min(checks.z), max(checks.z)) if np.isfinite(checks.z).all() else (np.nan, np.nan),
            numbers={},
            reasons=(),
            label_notes=tuple(note.text for note in droplets.notes),
            pixel=pixel,
            picture=self.grey,
            beside=tuple(self._beside(int(k), names) for k in kept),
            outlines=tuple(droplets.outlines[k] - margin for k in kept),
            cut_outlines=tuple(droplets.outlines[k] - margin for k in cut),
            touching=centres[touching[self.whole[touching].any(axis=1)]],
        )
        return self._judged(found, checks, scale)

    def _judged(self, found: Micrograph, checks: Checks, scale: float) -> Micrograph:
        """The same with its numbers, how far each is known, and why it may be wrong. `scale`: of lengths."""
        droplets = self.droplets
        areas = (found.interiors[found.measurable] if found.contrast == "ring" else found.areas) / scale**2
        values = {"count": float(len(areas)), "area": float(areas.mean()) if len(areas) else float("nan")}
        values |= {name: found.measure()[name] for name in ("rho", "z", "shape_rim")}
        values |= {"interior_fraction": found.interior_fraction, "voids": float(len(found.voids.sides))}
        errors = droplets.errors(values, self.whole, areas, self.grey.size)
        values["area"] *= scale**2
        errors["area"] *= scale**2
        doubts = find_doubts(droplets, checks)
        doubts += doubt_few(found.count, found.means)
        doubts += doubt_known(values, errors) if droplets.labelled else []
        numbers = {
            name: Number(
                value, errors.get(name, np.nan), tuple(doubt.text for doubt in doubts if name in doubt.numbers)
            )
            for name, value in values.items()
        }
        return replace(found, numbers=numbers, reasons=tuple(doubt.text for doubt in doubts))
