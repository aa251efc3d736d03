"""Scale bars, labels and frames: find what was drawn into a picture, so that it is not taken for droplets or ground.

Three signs, of which one is enough: pixels that are exactly alike where all others carry noise; bars, straight and
level, that differ from droplets and ground around them; strokes brighter than any droplet or darker than any ground.
Thin ones are filled in from beside them; what is thicker covers droplets as the edge of the picture does.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from jamlab.arrays import Array, Mask
from jamlab.micrographs.illumination import Darkness
from jamlab.micrographs.picture_files import distance_inside, scikit_image

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
    label, _ = ndimage.label(ndimage.grey_opening(mask.astype(np.uint8), (1, length), mode="constant"))
    bars = np.zeros(mask.shape, dtype=bool)
    for piece in scikit_image().measure.regionprops(label):
        rows, columns = piece.image.shape
        if columns < BAR_ASPECT * rows or rows < 2 or rows > highest or piece.extent < BAR_FILL:
            continue
        around = tuple(slice(max(side.start - 4, 0), side.stop + 4) for side in piece.slice)
        ring = ~ndimage.binary_dilation(label[around] == piece.label, iterations=2)
        level = np.median(darkness[piece.slice][piece.image])
        if (np.abs(darkness[around][ring] - level) > BEYOND).mean() > BAR_EDGE:
            bars[piece.slice] |= piece.image
    return bars


def sort_annotations(drawn: Mask, radius: float) -> tuple[Mask, Mask]:
    """Grow what was found by its blurred edges and part it by thickness. Returns (h, w) pixels that are thin, through
    which droplets are seen, and (h, w) those that are thick and count as outside of the picture."""
    if not drawn.any():
        return drawn, drawn
    grown = ndimage.binary_dilation(drawn, np.ones((3, 3)), iterations=GROW)
    label, count = ndimage.label(grown)
    thickness = ndimage.maximum(distance_inside(grown), label, np.arange(1, count + 1))
    thick = np.concatenate([[False], thickness > THIN * radius])[label]
    return grown & ~thick, thick


def fill_in(values: Array, holes: Mask) -> Array:
    """Give pixels in holes of a picture the values of the nearest ones beside them. `values`, `holes`: (h, w)."""
    if not holes.any():
        return values
    nearest = ndimage.distance_transform_edt(holes, return_distances=False, return_indices=True)
    return np.asarray(values[tuple(nearest)])
