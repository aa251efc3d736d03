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
    """Area of the largest discs inside the segments over the area of the segments, for bright droplets; 0 without any."""
    darkness = remove_background(grey, np.ones(grey.shape, dtype=bool))
    segments = find_droplets(darkness.smooth, darkness.noise) if darkness is not None else None
    if segments is None:
        return 0.0
    return float(min(np.pi * np.sum(segments.inner**2) / max(segments.droplets.sum(), 1), 1.0))


def droplets_are_bright(grey: Array) -> bool:
    """Whether bright segments of a picture are rounder than dark ones."""
    step = max(1, round(max(grey.shape) / LARGEST))
    small = scikit_image().transform.downscale_local_mean(grey, (step, step)) if step > 1 else grey
    return roundness(small) >= roundness(1 - small)
