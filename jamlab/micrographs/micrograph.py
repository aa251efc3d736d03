"""Micrographs of droplets: measure in a picture what is measured in a simulated packing.

In order: read the picture, divide it by its background, fill in scale bars and labels, find droplets by granulometry
and watershed, measure the gaps along the walls of their cells, and judge whether the numbers can be trusted. The edge
of the picture is an edge: droplets that it cuts are marked and not counted, but they hold and touch others.

The packing fraction is one minus the darkness of all voids over the area that the picture shows. That share needs no
whole droplets, so that large droplets, which the edge cuts more often, weigh as much as they should (Horvitz-Thompson
with the same probability for every point). Films belong to the droplets beside them.

Sources: F. M. Schaller et al., Philos. Mag. 93, 3993 (2013), for cells; K. Desmond & E. R. Weeks, Soft Matter 11, 4662
(2015), for contacts of quasi-two-dimensional emulsions.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.micrographs.annotations import Annotations, fill_in, find_drawn, find_flat, left_noise, sort_annotations
from jamlab.micrographs.illumination import Darkness, noise_level, remove_background
from jamlab.micrographs.measured_droplets import Micrograph
from jamlab.micrographs.measurement import Measurement
from jamlab.micrographs.picture_files import read_grey, scikit_image
from jamlab.micrographs.segmentation import find_droplets

LARGEST = 1e100  # size of a pixel, so that areas are finite
MARGIN = 0.3  # of the picture, repeated around a periodic one: more than half of the largest droplet and its cell


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

    Args:
        picture: image file, or (h, w) grey values, or (h, w, 3 or 4) colours.
        pixel: size of a pixel in the unit of length wanted; None measures lengths in pixels.
        film: widest gap, in pixels, between droplets in contact; None takes it from the gaps of the picture.
        bright: droplets are brighter than the ground, True or False; None finds out.
        periodic: the picture is one period of a periodic one, as rendered from a simulation.

    Raises:
        InputError: without scikit-image; if the file is no picture, values are not finite, arguments are not positive,
            nothing stands out from noise, or no whole droplet is found.

    Example:
        >>> *_, dense = jamlab.compress(jamlab.jam(model="dp", n=8, seed=1), to=0.93, step=0.03)
        >>> picture = jamlab.synthetic_micrograph(dense, 256)
        >>> m = jamlab.micrograph(picture, pixel=dense.box[0, 0] / 256, periodic=True)
        >>> abs(m.rho - jamlab.packing_fraction(dense)) < 0.02, len(m.table()) == m.count
        (True, True)
        >>> m.draw("overlay.png")
    """
    for name, value in (("pixel", pixel), ("film", film)):
        if value is not None and not 1 / LARGEST <= value <= LARGEST:  # beyond, areas are 0 or infinite
            raise InputError(f"{name} is {value}: must be a positive number, {1 / LARGEST:g} to {LARGEST:g}")
    grey = read_grey(picture)
    is_bright = droplets_are_bright(grey) if bright is None else bool(bright)
    darkness, drawn = _without_background(grey if is_bright else 1 - grey)
    margin = int(np.ceil(MARGIN * min(grey.shape))) if periodic else 0
    return Measurement(grey, is_bright, darkness, drawn, film, margin).result(pixel)


def _without_background(grey: Array) -> tuple[Darkness, Annotations]:
    """Darkness of a picture of bright droplets, and what was drawn into it, already filled in."""
    noise = noise_level(grey)
    flat = find_flat(grey, noise)
    grown = sort_annotations(flat, 0.0).thick
    darkness = remove_background(fill_in(grey, grown), ~grown)
    if darkness is None:
        raise InputError("no droplets stand out from light and noise: check the picture")
    drawn = flat | find_drawn(darkness.smooth, left_noise(darkness), darkness.radius)
    found = sort_annotations(drawn, darkness.radius)
    if found.count:
        hidden = found.thin | found.thick
        again = remove_background(fill_in(grey, hidden), ~hidden)
        if again is None:
            raise InputError("no droplets stand out from light and noise beside bars and labels: cut them off")
        darkness = again.covered(found.thick)
    return darkness, found


TRIED = 256  # pixels along a side on which both are tried


def roundness(grey: Array) -> float:
    """Area of the largest discs inside bright segments off the edge over the area of the segments; 0 without any."""
    darkness = remove_background(grey, np.ones(grey.shape, dtype=bool))
    segments = find_droplets(darkness.smooth, darkness.noise) if darkness is not None else None
    if segments is None:
        return 0.0
    cells = segments.cells
    area = np.bincount(cells[segments.droplets], minlength=segments.count).astype(np.float64)
    area[np.unique(np.concatenate([cells[0], cells[-1], cells[:, 0], cells[:, -1]]))] = 0.0  # cut, or around all others
    discs = np.minimum(np.pi * segments.inner**2, area)
    return float(discs.sum() / max(area.sum(), 1.0))


def droplets_are_bright(grey: Array) -> bool:
    """Whether bright segments of a picture are rounder than dark ones."""
    step = max(1, round(max(grey.shape) / TRIED))
    small = scikit_image().transform.downscale_local_mean(grey, (step, step)) if step > 1 else grey
    return roundness(small) >= roundness(1 - small)
