"""Micrographs of droplets: measure in a picture what is measured in a simulated packing.

In order: read the picture, find out whether droplets are bright, dark or rings, divide it by its background, fill in
scale bars, find droplets, measure the gaps along the walls of their cells, and judge whether the numbers can be
trusted. Labels of another program replace all but the last two. The edge of the picture is an edge: droplets that it
cuts are marked and not counted, but they hold and touch others.

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

from jamlab.arrays import Array, Mask
from jamlab.checks import check_choice, checked
from jamlab.errors import InputError
from jamlab.micrographs.annotations import fill_in, find_drawn, find_flat, left_noise, sort_annotations
from jamlab.micrographs.droplet_sources import DropletSource, GreyDroplets, LabelledDroplets, RingDroplets
from jamlab.micrographs.illumination import Darkness, noise_level, remove_background
from jamlab.micrographs.labels import ROUGH, label_segments, labelled, looks_labelled, read_labels
from jamlab.micrographs.measured_droplets import Micrograph
from jamlab.micrographs.measurement import Measurement
from jamlab.micrographs.picture_files import CHANNELS, read_grey, read_values, scikit_image
from jamlab.micrographs.ring_segmentation import find_rings
from jamlab.micrographs.segmentation import find_droplets, roundness

CONTRASTS = ("auto", "dark", "bright", "ring")
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
    """Find and measure the droplets of a picture, and say whether the numbers can be trusted.

    Handles uneven light, noise, blur, scale bars and labels. How large the errors are, by each of these, is drawn by
    `python -m studies draw micrograph-errors`; beyond what can be handled `quality` is "doubtful", with `reasons`.

    Args:
        picture: image file, or (h, w) grey values, or (h, w, 3 or 4) colours; with `labels` it may be left out.
        pixel: size of a pixel in the unit of length wanted; None measures lengths in pixels.
        film: widest gap, in pixels, between droplets in contact; None takes it from the gaps of the picture.
        periodic: the picture is one period of a periodic one, as rendered from a simulation.
        contrast: droplets are "bright" on dark ground, "dark" on bright ground, or "ring": dark walls with light on
            both sides, as bubbles and oil in brightfield. "auto" finds out: the one under which droplets are roundest.
        labels: (h, w) whole numbers, 0 the ground, or a file of them: droplets as another program found them. Nothing
            of the picture but its size is then used. Of a mask, True in droplets, the pieces are droplets, parted at
            their necks where several touch. Specks are set aside, holes are filled and pieces of one droplet are
            joined; `label_notes` tell how many, and intervals are as much wider.
        channel: of a picture in colours: "grey", "red", "green" or "blue".

    Raises:
        InputError: without scikit-image or edt; if a file is no picture, a picture looks like labels, values are not
            finite, arguments are not positive or contradict each other, nothing stands out from noise, or no whole
            droplet is found.

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
    check_choice("contrast", contrast, CONTRASTS)
    check_choice("channel", channel, CHANNELS)
    if picture is None and labels is None:
        raise InputError("give a picture, or labels, or both")
    if isinstance(picture, str | Path):
        picture = read_values(Path(picture))
    grey = None if picture is None else read_grey(picture, channel)
    if labels is not None:
        if periodic or contrast != CONTRASTS[0]:
            raise InputError("with labels there is nothing to find: leave out `periodic` and `contrast`")
        found = read_labels(labels, None if grey is None else grey.shape)
        return Measurement(found.coverage if grey is None else grey, LabelledDroplets(found, film)).result(pixel)
    assert grey is not None and picture is not None
    if contrast == "auto":
        if looks_labelled(np.asarray(picture)):
            raise InputError(
                "the picture has the levels of labels or of a mask: give it as labels=, or --labels in the shell; of a "
                "photograph say the contrast"
            )
        contrast = find_contrast(grey)
    margin = int(np.ceil(MARGIN * min(grey.shape))) if periodic else 0
    find = _find_rings if contrast == "ring" else _find_by_grey
    return Measurement(grey, find(grey, contrast, margin, film), margin).result(pixel)


def _find_rings(grey: Array, contrast: str, margin: int, film: float | None) -> DropletSource:
    """Droplets with dark walls, as labels, of a picture repeated around itself."""
    rings = find_rings(np.pad(grey, margin, mode="wrap"))
    if rings is None or not rings.labels.any():
        raise InputError(f"no droplet with a dark wall around it: check `contrast` ({contrast}) and the picture")
    return RingDroplets(labelled(rings.labels, rings.finer, rings.light), film, rings)


def _find_by_grey(grey: Array, contrast: str, margin: int, film: float | None) -> DropletSource:
    """Bright or dark droplets of a picture repeated around itself."""
    darkness, thick, annotated = _without_background(grey if contrast == "bright" else 1 - grey)
    wide = darkness.wrapped(margin)
    segments = find_droplets(wide.smooth, darkness.noise)
    if segments is None:
        raise InputError(f"no droplet found: check `contrast` ({contrast}) and the picture")
    return GreyDroplets(contrast, wide, segments, film, np.pad(thick, margin, mode="wrap"), annotated)


def _without_background(grey: Array) -> tuple[Darkness, Mask, float]:
    """Darkness of a picture of bright droplets, with what was drawn into it filled in; (h, w) pixels that count as
    outside for it, and the share of the picture that was drawn over."""
    noise = noise_level(grey)
    flat = find_flat(grey, noise)
    _, grown = sort_annotations(flat, 0.0)
    darkness = remove_background(fill_in(grey, grown), ~grown, noise)
    if darkness is None:
        raise InputError("no droplets stand out from light and noise: check the picture")
    drawn = flat | find_drawn(darkness.smooth, left_noise(darkness), darkness.radius)
    thin, thick = sort_annotations(drawn, darkness.radius)
    hidden = thin | thick
    if hidden.any():
        again = remove_background(fill_in(grey, hidden), ~hidden, noise)
        if again is None:
            raise InputError("no droplets stand out from light and noise beside bars and labels: cut them off")
        darkness = again.covered(thick)
    return darkness, thick, float(hidden.mean())


TRIED = 256  # pixels along a side on which bright and dark are tried
TRIED_RINGS = 512  # pixels along a side of the middle of the picture, in which walls are looked for
LEAST_COVER = 0.2  # of the middle of the picture that rings must fill


def find_contrast(grey: Array) -> str:
    """Whether droplets are bright, dark or rings: those under which they are roundest."""
    step = max(1, round(max(grey.shape) / TRIED))
    small = scikit_image().transform.downscale_local_mean(grey, (step, step)) if step > 1 else grey
    bright, dark = _roundness_of_bright(small), _roundness_of_bright(1 - small)
    rings = _roundness_of_rings(grey)
    if rings > max(bright, dark):
        return "ring"
    return "bright" if bright >= dark else "dark"


def _roundness_of_bright(grey: Array) -> float:
    darkness = remove_background(grey, np.ones(grey.shape, dtype=bool), noise_level(grey))
    return roundness(None if darkness is None else find_droplets(darkness.smooth, darkness.noise))


def _roundness_of_rings(grey: Array) -> float:
    middle = tuple(slice(max(0, (size - TRIED_RINGS) // 2), (size + TRIED_RINGS) // 2) for size in grey.shape)
    rings = find_rings(grey[middle])
    if rings is None or (rings.labels > 0).mean() < LEAST_COVER:
        return 0.0
    segments = label_segments(labelled(rings.labels))
    return roundness(replace(segments, inner=segments.inner + ROUGH))
