"""Are droplets brighter or darker than the ground? Droplets are round, what lies between them is not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jamlab.micrographs.illumination import remove_background
from jamlab.micrographs.scikit_image import scikit_image
from jamlab.micrographs.segmentation import find_droplets

Array = NDArray[np.float64]

LARGEST = 256  # pixels along a side on which both are tried


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
    step = max(1, round(max(grey.shape) / LARGEST))
    small = scikit_image().transform.downscale_local_mean(grey, (step, step)) if step > 1 else grey
    return roundness(small) >= roundness(1 - small)
