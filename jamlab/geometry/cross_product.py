"""The cross product of plane vectors."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def cross(a: Array, b: Array) -> Array:
    """(m,) a_x b_y - a_y b_x of vectors (m, 2): positive if b lies counter-clockwise of a."""
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
