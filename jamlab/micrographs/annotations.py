"""Scale bars, labels and frames: find what was drawn into a picture, so that it is not taken for droplets or ground.

Three signs, of which one is enough: pixels that are exactly alike where all others carry noise; bars, straight and
level, that differ from droplets and ground around them; strokes brighter than any droplet or darker than any ground.
Thin ones are filled in from beside them; what is thicker covers droplets as the edge of the picture does.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage
from scipy.interpolate import griddata

from jamlab.arrays import Array, Mask
from jamlab.micrographs.illumination import Darkness
from jamlab.micrographs.picture_files import distance_inside

LEAST_NOISE = 0.004  # of the range of the picture, one grey level of 8 bit: below, flat pixels are no sign
LEAST_FLAT = 24  # pixels alike, side by side
FLAT_SHARE = 0.25  # of the picture: where more is flat, droplets are overexposed or the picture is not noisy
BEYOND = 0.3  # of the contrast, above droplets or below the ground
NOISES = 5.0  # standard deviations of noise that strokes must stand out by
BAR_LENGTH, BAR_ASPECT = 0.06, 4.0  # least length of a bar, of the width of the picture; least length over height
LONGER = 1.3  # radii that a bar is longer than: voids are not
BAR_FILL = 0.9  # of its bounding box that a bar fills
BAR_EDGE = 0.75  # of the pixels around a bar that must differ from it
GROW = 2  # pixels around what is found: blur and the edges of letters
THIN = 0.3  # of the radius: half-thickness up to which droplets are seen through an annotation


@dataclass(frozen=True)
class Annotations:
    """What was drawn into a picture."""

    thin: Mask  # (h, w) pixels filled in from beside them
    thick: Mask  # (h, w) pixels that count as outside of the picture
    count: int  # of separate pieces

    def wrapped(self, margin: int) -> Annotations:
        """The same repeated periodically around itself, `margin` pixels wide."""
        return replace(self, thin=np.pad(self.thin, margin, mode="wrap"), thick=np.pad(self.thick, margin, mode="wrap"))


def find_flat(grey: Array, noise: float) -> Mask:
    """(h, w) pixels that are exactly as their neighbours in a picture with noise."""
    if noise < LEAST_NOISE:
        return np.zeros(grey.shape, dtype=bool)
    flat = ndimage.maximum_filter(grey, 3) == ndimage.minimum_filter(grey, 3)
    if not 0 < flat.mean() < FLAT_SHARE:
        return np.zeros(grey.shape, dtype=bool)
    flat = ndimage.binary_dilation(flat, np.ones((3, 3)))  # the middles of areas of 3 x 3
    label, _ = ndimage.label(flat)
    size = np.bincount(label.ravel())
    size[0] = 0
    return np.asarray(size[label] >= LEAST_FLAT)


def left_noise(darkness: Darkness) -> float:
    """Standard deviation of what denoising leaves: noise/(2 sqrt(pi) s) behind a Gaussian of width s."""
    return float(darkness.noise / max(2 * np.sqrt(np.pi) * darkness.filter, 1.0))


def find_drawn(darkness: Array, noise: float, radius: float) -> Mask:
    """(h, w) bars and strokes in a picture without its background. `darkness`: (h, w) denoised, 0 in droplets and 1
    on the ground; `noise`: standard deviation of what noise is left in it; `radius`: typical radius of droplets,
    pixels."""
    beyond = max(BEYOND, NOISES * noise)
    found = np.zeros(darkness.shape, dtype=bool)
    for mask, height in ((darkness < -beyond, np.inf), (darkness > 1 + beyond, np.inf), (darkness > 0.6, 0.5 * radius)):
        found |= _bars(mask, darkness, height, LONGER * radius)
    near = ndimage.binary_dilation(found, iterations=int(radius)) if found.any() else found
    return np.asarray(found | (near & ((darkness < -beyond) | (darkness > 1 + beyond))))


def _bars(mask: Mask, darkness: Array, highest: float, longest_void: float) -> Mask:
    """Level bars in a mask: long, filled, and unlike what is above and below them."""
    length = max(int(BAR_LENGTH * mask.shape[1]), int(longest_void), 12)
    label, _ = ndimage.label(_long_runs(mask, length))
    bars = np.zeros(mask.shape, dtype=bool)
    for number, box in enumerate(ndimage.find_objects(label), 1):
        rows, columns = (side.stop - side.start for side in box)
        piece = label[box] == number
        if columns < BAR_ASPECT * rows or rows < 2 or rows > highest or piece.mean() < BAR_FILL:
            continue
        around = tuple(slice(max(side.start - 4, 0), side.stop + 4) for side in box)
        ring = ~ndimage.binary_dilation(label[around] == number, iterations=2)
        level = np.median(darkness[box][piece])
        if (np.abs(darkness[around][ring] - level) > BEYOND).mean() > BAR_EDGE:
            bars[box] |= piece
    return bars


def _long_runs(mask: Mask, length: int) -> Mask:
    """What lies in runs of a row of at least that many pixels: an opening by a level line."""
    wide = np.pad(mask, ((0, 0), (length, length))).view(np.uint8)
    core = ndimage.minimum_filter1d(wide, length, axis=1)
    back = ndimage.maximum_filter1d(core, length, axis=1, origin=-1 if length % 2 == 0 else 0)
    return np.asarray(back[:, length:-length] > 0)


def sort_annotations(drawn: Mask, radius: float) -> Annotations:
    """Grow what was found by its blurred edges and part it by thickness."""
    empty = np.zeros(drawn.shape, dtype=bool)
    if not drawn.any():
        return Annotations(empty, empty, 0)
    grown = ndimage.binary_dilation(drawn, np.ones((3, 3)), iterations=GROW)
    label, count = ndimage.label(grown)
    thickness = ndimage.maximum(distance_inside(grown), label, np.arange(1, count + 1))
    thick = np.concatenate([[False], thickness > THIN * radius])[label]
    return Annotations(grown & ~thick, thick, count)


def fill_in(values: Array, holes: Mask) -> Array:
    """Interpolate (h, w) values across holes from the pixels around them."""
    if not holes.any():
        return values
    filled = values.copy()
    label, _ = ndimage.label(holes)
    for number, box in enumerate(ndimage.find_objects(label), 1):
        wide = tuple(slice(max(side.start - 2, 0), side.stop + 2) for side in box)
        hole = label[wide] == number
        ring = ndimage.binary_dilation(hole, np.ones((3, 3)), iterations=2) & ~holes[wide]
        if ring.sum() > 3:
            points, wanted = np.argwhere(ring), np.argwhere(hole)
            level = griddata(points, filled[wide][ring], wanted, "nearest")
            linear = griddata(points, filled[wide][ring], wanted, "linear")
            filled[wide][hole] = np.where(np.isfinite(linear), linear, level)
    return filled
