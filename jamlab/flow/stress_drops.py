"""Plastic events of a sheared packing: where its elastic stress falls while the strain grows."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class StressDrops(NamedTuple):
    """Falls of the stress, one after the other.

    Attributes:
        strain: (k,) at which each begins.
        size: (k,) by how much the stress falls, positive.
    """

    strain: Array
    size: Array


def stress_drops(strain: Array, stress: Array, least: float = 0.0) -> StressDrops:
    """Find the falls of a stress (m,) over strain (m,), each from a local maximum to the next minimum.

    Args:
        strain: (m,), growing.
        stress: (m,).
        least: smallest fall that counts.
    """
    falling = np.concatenate([[False], np.diff(stress) < 0, [False]])
    edges = np.flatnonzero(np.diff(falling.astype(int)))  # of the steps, where falling begins and where it ends
    begin, end = edges[::2], edges[1::2]
    size = stress[begin] - stress[end]
    kept = size > least
    return StressDrops(strain[begin[kept]], size[kept])
