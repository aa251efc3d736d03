"""How the area of a packing changes: isotropically, or between walls along y alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array
from jamlab.packing.packing import Packing


@dataclass(frozen=True, eq=False)
class AreaChange:
    """The change of area of a packing: a strain e = log of the area maps r to exp(e M) r, tr M = 1."""

    generator: Array  # (2, 2) M, diagonal

    def gradient(self, areas: float) -> Array:
        """(2, 2) deformation gradient that multiplies the area by `areas`."""
        return np.diag(np.sqrt(areas) ** (2 * np.diag(self.generator)))

    def pressure(self, stress: Array) -> float:
        """p = -dU/dA of a stress (2, 2)."""
        return float(np.sum(stress * self.generator))

    def modulus(self, curvature: Array, stress: Array) -> float:
        """B = -A dp/dA from d2(U/A) in the displacement gradient, (2, 2, 2, 2), and the stress (2, 2): the area of
        exp(e M) is quadratic in the displacement gradient, which brings in the stress."""
        m = self.generator
        beside = self.pressure(stress) - float(np.sum(stress * (m @ m)))
        return float(np.einsum("ij,ijkl,kl->", m, curvature, m)) + beside


ISOTROPIC = AreaChange(0.5 * np.eye(2))


def compression(packing: Packing) -> AreaChange:
    """How the area of a packing changes, with the pressure and the bulk modulus that belong to it: isotropic, and
    between walls along y alone, since walls keep their shape."""
    return AreaChange(packing.frame.squeeze)
