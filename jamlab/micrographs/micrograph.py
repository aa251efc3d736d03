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

from jamlab.arguments.choices import Channel, Contrast
from jamlab.arrays import Array, ArrayLike, Indices, Mask
from jamlab.checks import checked
from jamlab.errors import InputError, named, typed
from jamlab.geometry.contact_network import find_rattlers
from jamlab.micrographs.illumination import remove_background
from jamlab.micrographs.label_doubts import ODD, elongation
from jamlab.micrographs.labels import labelled_picture, looks_labelled, read_labels
from jamlab.micrographs.measured_droplets import Micrograph
from jamlab.micrographs.picture_files import NoDropletsError, read_grey, read_values, scikit_image
from jamlab.micrographs.picture_numbers import Number, find_voids, mean_of, share_of
from jamlab.micrographs.pixel_size import common_size
from jamlab.micrographs.quality import Checks, doubt_few, doubted_droplets, find_bounds, find_doubts, find_widths
from jamlab.micrographs.segmentation import edge_of, find_droplets, roundness
from jamlab.micrographs.walls import SeenDroplets, shape_factor

TRIED = 256  # pixels along a side on which bright and dark are tried


@checked
def micrograph(
    picture: str | Path | ArrayLike | None = None,
    pixel: float | None = None,
    film: float | None = None,
    contrast: Contrast = "auto",
    labels: str | Path | ArrayLike | Mask | None = None,
    channel: Channel = "grey",
) -> Micrograph:
    """Detect and measure droplets in a micrograph, with a reliability check.

    Uneven light, noise and blur are corrected; if they are too strong, `quality` is "doubtful" and `reasons` names the
    cause. Cut off scale bars first. Droplets with dark walls, such as bubbles in brightfield, need `labels`.

    Args:
        picture: image file, (h, w) grey values or (h, w, 3 or 4) colours; optional with `labels`.
        pixel: pixel size in the unit of length of the results; 1 for pixels. None: the size that a TIFF file states
            (OME, ImageJ, tags of resolution), else lengths in pixels.
        film: largest gap that counts as a contact, in pixels. None: estimated from the picture.
        contrast: "bright" (droplets on a dark background), "dark", or "auto" (the contrast with the roundest droplets).
        labels: droplets found by another program: (h, w) integers, 0 for the background, or a file of them. Only the
            size of the picture is then used. In a mask (True in droplets) each piece is a droplet; touching droplets
            are split at their necks. Specks are removed and holes filled; `label_notes` counts them.
        channel: "grey", "red", "green" or "blue", for pictures in colours.

    Raises:
        InputError: scikit-image or edt is missing, the file is not a picture, has several pages or pixels that are not
            square, the picture looks like labels, arguments are invalid, or no whole droplet is found.

    Example:
        >>> *_, dense = jamlab.compress(jamlab.jam(8, "dp"), to=0.93, step=0.03)
        >>> picture = np.tile(jamlab.synthetic_micrograph(dense, 256), (2, 2))  # four periods
        >>> m = jamlab.micrograph(picture, pixel=dense.box[0, 0] / 256)
        >>> abs(m.rho - jamlab.packing_fraction(dense)) < 0.02, len(m.table()) == m.count
        (True, True)
        >>> m.draw("overlay.png")
        >>> y, x = np.indices((60, 90))
        >>> two = 1 * (np.hypot(x - 24, y - 30) < 20) + 2 * (np.hypot(x - 65, y - 30) < 20)
        >>> again = jamlab.micrograph(labels=two)
        >>> again.count, again.contrast
        (2, 'labels')
    """
    _check_kind(picture is None, labels is None, contrast, channel)
    unit = ""
    if pixel is None:
        files = [Path(each) if isinstance(each, str | Path) else None for each in (picture, labels)]
        if stated := common_size(*files):
            pixel, unit = stated.width, stated.unit
    if isinstance(picture, str | Path):
        picture = read_values(Path(picture))
    grey = None if picture is None else read_grey(picture, channel)
    if labels is not None:
        named, notes = read_labels(labels, None if grey is None else grey.shape)
        droplets = SeenDroplets("labels", *labelled_picture(named), film, tuple(notes))
        return _measured((named > 0).astype(np.float64) if grey is None else grey, droplets, pixel, unit)
    assert grey is not None and picture is not None
    if contrast == "auto":
        contrast = _contrast_of(np.asarray(picture), grey)
    darkness = remove_background(grey if contrast == "bright" else 1 - grey)
    segments = None if darkness is None else find_droplets(darkness.smooth, darkness.noise)
    if darkness is None or segments is None:
        text = f"no droplet stands out from light and noise: check `contrast` ({contrast}) and the picture"
        raise NoDropletsError(text)
    return _measured(grey, SeenDroplets(contrast, darkness, segments, film), pixel, unit)


def _check_kind(no_picture: bool, no_labels: bool, contrast: Contrast, channel: Channel) -> None:
    """Refuse what says how to read a picture where there is none, or where it is not read."""
    if no_picture and no_labels:
        raise InputError("give a picture, or labels, or both")
    if no_picture and channel != "grey":
        raise InputError(
            f"{named('channel', channel)}: labels alone have no colours; leave it out, or give the picture too"
        )
    if not no_labels and contrast != "auto":
        raise InputError("`contrast` does not apply to labels: leave it out")


def _contrast_of(picture: Array, grey: Array) -> Contrast:
    """The contrast of a photograph; labels are refused."""
    if looks_labelled(picture):
        raise InputError(
            f"the picture looks like labels or a mask: give it as {typed('labels=', '--labels')}; if it is a "
            f"photograph, give {typed('contrast=', '--contrast')}"
        )
    return find_contrast(grey)


def find_contrast(grey: Array) -> Contrast:
    """Whether droplets are bright or dark: those under which they are roundest."""
    step = max(1, round(max(grey.shape) / TRIED))
    small = scikit_image().transform.downscale_local_mean(grey, (step, step)) if step > 1 else grey
    bright, dark = (_roundness(values) for values in (small, 1 - small))
    return "bright" if bright >= dark else "dark"


def _roundness(grey: Array) -> float:
    darkness = remove_background(grey)
    return roundness(None if darkness is None else find_droplets(darkness.smooth, darkness.noise))


def _coordination(droplets: SeenDroplets, widest: float) -> tuple[Indices, Mask, Number]:
    """(n,) contacts that bear force, (n,) rattlers, and z, with gaps up to `widest` as contacts."""
    whole, pairs = droplets.whole, droplets.walls.pairs[droplets.walls.gap <= widest]
    rattlers, bearing = find_rattlers(pairs, whole)
    contacts = np.bincount(pairs[bearing].ravel(), minlength=len(whole))
    return contacts, rattlers, mean_of(contacts[whole & ~rattlers].astype(np.float64))


def _checks(droplets: SeenDroplets, rattlers: Mask, z: float) -> Checks:
    """What the quality rests on."""
    walls, darkness, radius = droplets.walls, droplets.darkness, droplets.segments.radius
    void = np.ones_like(walls.void_pixels) if droplets.labelled else walls.void_pixels  # of labels films are ground
    beyond = walls.widest - walls.film
    rough, long = (ODD.rough, elongation(droplets)) if droplets.labelled else (0.0, 1.0)
    low, high = (_coordination(droplets, walls.film + factor * beyond)[2].value for factor in (0.7, 1.4))
    return Checks(
        roundness=long * np.pi * (droplets.segments.inner + rough) ** 2 / droplets.areas,
        rho=1 - float(darkness.values[void].sum()) / void.size,
        rho_by_pixels=1 - float((darkness.smooth[void] > 0.5).sum()) / void.size,
        z=(z, low, high),
        blind=0.5 * beyond / radius,
        loose=int((rattlers & droplets.whole).sum()),
        open_edge=float((edge_of(darkness.smooth) > 0.5).mean()),
    )


def _measured(grey: Array, droplets: SeenDroplets, pixel: float | None, unit: str) -> Micrograph:
    """Numbers of the droplets that are whole, each with why it may be wrong."""
    walls, darkness, cells, n = droplets.walls, droplets.darkness, droplets.segments.cells, droplets.segments.count
    whole = droplets.whole
    if not whole.any():
        check = "the labels" if droplets.labelled else f"`contrast` ({droplets.contrast})"
        raise NoDropletsError(f"all {n} droplets are cut by the edge: check {check} and the size of the picture")
    kept, cut, scale = np.flatnonzero(whole), np.flatnonzero(~whole & (droplets.size > 0)), float(pixel or 1.0)
    owned = np.bincount(cells.ravel(), minlength=n)[kept].astype(np.float64) * scale**2
    areas = droplets.areas[kept] * scale**2
    shape = np.array([shape_factor(droplets.outlines[k]) for k in kept])
    contacts, rattlers, z = _coordination(droplets, walls.widest)
    checks = _checks(droplets, rattlers, z.value)
    voids = find_voids(walls.void, cells, darkness.values, droplets.segments.radius, scale)
    numbers = {"count": Number(float(len(kept))), "area": mean_of(areas), "rho": share_of(areas, owned, checks.rho)}
    numbers |= {"z": z, "shape_factor_rim": mean_of(shape), "voids": Number(float(len(voids.sides)))}
    bounds = find_bounds(droplets, checks)
    bounds["area"] *= scale**2
    numbers = {name: replace(number, bound=bounds[name]) for name, number in numbers.items()}
    doubts, widths = find_doubts(droplets, checks), find_widths(droplets, numbers, scale)
    doubts += doubt_few(numbers, droplets.labelled) + [(text, those) for empty, text, those in widths if empty]
    names = np.full(n, -1)
    names[kept] = np.arange(1, len(kept) + 1)
    centres, touching = droplets.centres[:, ::-1], walls.pairs[walls.touching]
    return Micrograph(
        labels=np.where(walls.inside > 0, names[cells], 0),
        centres=centres[kept] * scale,
        areas=areas,
        shape_factor=shape,
        cells=owned,
        contacts=contacts[kept],
        neighbours=np.bincount(touching.ravel(), minlength=n)[kept],
        rattlers=rattlers[kept],
        doubtful=doubted_droplets(droplets, checks)[kept],
        voids=voids,
        cut=len(cut),
        contrast=droplets.contrast,
        blur=droplets.blur,
        noise=darkness.noise,
        light=darkness.light,
        film=walls.film * scale,
        numbers={
            name: replace(number, reasons=tuple(why for why, those in doubts if name in those))
            for name, number in numbers.items()
        },
        reasons=tuple(text for text, _ in doubts),
        label_notes=tuple([note.text for note in droplets.notes] + [text for empty, text, _ in widths if not empty]),
        pixel=pixel,
        unit=unit if pixel is not None else "pixels",
        picture=grey,
        outlines=tuple(droplets.outlines[k] for k in kept),
        cut_outlines=tuple(droplets.outlines[k] for k in cut),
        touching=centres[touching[whole[touching].any(axis=1)]],
    )
