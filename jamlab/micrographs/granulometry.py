"""Granulometry: how much of a picture openings by discs of growing radius leave, which gives the scale of its droplets.

The pattern spectrum is what disappears between one radius and the next. It needs no segmentation, since droplets that
merge still hold discs of their own size.

Sources: G. Matheron, Random Sets and Integral Geometry (1975); P. Maragos, IEEE Trans. PAMI 11, 701 (1989).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from jamlab.arrays import Array, Mask

RADII = 20  # discs, in equal ratios
LONGEST = 600  # pixels along a side on which openings are made
COARSEST = 14  # pixels that the largest disc keeps there
SMALLEST_SHARE = 0.08  # of the area of droplets that lies in smaller ones than `Granulometry.smallest`


@dataclass(frozen=True)
class Granulometry:
    """Openings of a picture."""

    radii: Array  # (k,) pixels
    left: Array  # (k,) share of the foreground that an opening by each disc leaves, 1 to 0
    radius: float  # half of the foreground lies in larger discs; 0 without foreground
    smallest: float  # all but 8 % of the foreground lies in larger discs


def granulometry(mask: Mask) -> Granulometry:
    """Open a mask by discs. `mask`: (h, w), True in droplets."""
    step = max(1, int(np.ceil(max(mask.shape) / LONGEST)))
    depth = _depth(mask[::step, ::step])
    step *= max(1, int(depth.max() / COARSEST))
    small = mask[::step, ::step]
    depth = _depth(small)
    widest = float(depth.max())
    if not mask.any() or widest <= 0.5:
        return Granulometry(np.zeros(0), np.zeros(0), 0.0, 0.0)
    radii = np.geomspace(1.0, max(1.01 * widest, 1.1), RADII)
    total, left = small.sum(), []
    for radius in radii:
        centres = depth >= radius
        left.append((ndimage.distance_transform_edt(~centres) < radius).sum() / total if centres.any() else 0.0)
    share = np.minimum.accumulate(np.minimum(left, 1.0))
    places = np.interp([0.5, SMALLEST_SHARE], 1 - share, radii) * step
    return Granulometry(radii * step, share, float(places[0]), float(places[1]))


def _depth(mask: Mask) -> Array:
    """Distance from the ground; beyond the edge of the picture droplets go on."""
    if mask.all():
        return np.zeros(mask.shape)
    return np.asarray(ndimage.distance_transform_edt(mask))
