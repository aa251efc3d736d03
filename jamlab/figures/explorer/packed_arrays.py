"""Arrays as text inside a page: base64 of little-endian numbers, coordinates as whole numbers of 16 bits."""

import base64
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from jamlab.arrays import Array

STEPS = 2**16 - 1  # of a coordinate between the lowest and the highest of a state: 1e-4 of a box of 8 diameters


def encode(values: ArrayLike, kind: str) -> str:
    """Base64 of an array.

    Args:
        values: numbers that fit into the kind.
        kind: numpy's name of a little-endian type, such as "<f4".
    """
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")


@dataclass(frozen=True)
class Grid:
    """Lattice coordinates of one state as whole numbers from 0 to `STEPS`.

    Attributes:
        inverse: (2, 2) inverse of the box.
        low, high: (2,) lattice coordinates that 0 and `STEPS` stand for.
    """

    inverse: Array
    low: Array
    high: Array

    @classmethod
    def around(cls, box: Array, points: Array) -> "Grid":
        """The grid that holds points (m, 2)."""
        inverse = np.linalg.inv(box)
        lattice = points @ inverse
        low, high = lattice.min(axis=0), lattice.max(axis=0)
        return cls(np.asarray(inverse), low, np.where(high > low, high, low + 1.0))

    def encode(self, points: Array) -> str:
        """Base64 of the coordinates of points (m, 2), x and y in turn."""
        steps = np.round((points @ self.inverse - self.low) / (self.high - self.low) * STEPS)
        return encode(steps, "<u2")

    def limits(self) -> dict[str, Any]:
        """What turns the numbers back: lattice coordinate = low + number (high - low)/STEPS."""
        return {"low": self.low.tolist(), "high": self.high.tolist()}
