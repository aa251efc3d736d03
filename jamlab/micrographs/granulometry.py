"""Granulometry: how much of a picture openings by discs of growing radius leave, which gives the scale of its droplets.

The pattern spectrum is what disappears between one radius and the next. It needs no segmentation, since droplets that
merge still hold discs of their own size.

Sources: G. Matheron, Random Sets and Integral Geometry (1975); P. Maragos, IEEE Trans. PAMI 11, 701 (1989).
"""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array, Mask
from jamlab.micrographs.picture_files import distance_inside

RADII = 20  # discs, in equal ratios
LONGEST = 600  # pixels along a side on which openings are made
COARSEST = 14  # pixels that the largest disc keeps there
SMALLEST_SHARE = 0.08  # of the area of droplets that lies in smaller ones than `Granulometry.smallest`


@dataclass(frozen=True)
class Granulometry:
    """Scale of the foreground of a picture."""

    radius: float  # pixels: half of the foreground lies in larger discs; 0 without foreground
    smallest: float  # pixels: all but 8 % of the foreground lies in larger discs


def granulometry(mask: Mask) -> Granulometry:
    """Open a mask by discs, only by those between which the wanted shares lie. `mask`: (h, w), True in droplets."""
    step = max(1, int(np.ceil(max(mask.shape) / LONGEST)))
    depth = _depth(mask[::step, ::step])
    coarser = max(1, int(depth.max() / COARSEST))
    step *= coarser
    depth = depth if coarser == 1 else _depth(mask[::step, ::step])
    widest, total = float(depth.max()), int(np.count_nonzero(mask[::step, ::step]))
    if widest <= 0.5:
        return Granulometry(0.0, 0.0)
    radii, gone = np.geomspace(1.0, max(1.01 * widest, 1.1), RADII), {RADII: 1.0}

    def lost(k: int) -> float:
        if k not in gone:
            centres = depth >= radii[k]
            left = np.count_nonzero(distance_inside(~centres) < radii[k]) if centres.any() else 0
            gone[k] = 1 - min(left / total, 1.0)
        return gone[k]

    def radius_at(share: float) -> float:
        k = bisect_left(range(RADII), share, key=lost)
        if k == 0 or k == RADII:
            return float(radii[min(k, RADII - 1)])
        return float(np.interp(share, [lost(k - 1), lost(k)], radii[k - 1 : k + 1]))

    return Granulometry(step * radius_at(0.5), step * radius_at(SMALLEST_SHARE))


def _depth(mask: Mask) -> Array:
    """Distance from the ground; beyond the edge of the picture droplets go on."""
    return np.zeros(mask.shape) if mask.all() else distance_inside(mask)
