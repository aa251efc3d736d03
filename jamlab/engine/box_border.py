"""Strains that a box may take while its packing is relaxed, and the pressure outside: the border of the sites.

Box and sites follow exp(sum of e_a M_a); with it the enthalpy H = U + p A changes by dH/de_a = A (p 1 - S) : M_a.
"""

from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array
from jamlab.packing.packing import Packing

# upper triangles: they leave the first lattice vector along x
COMPRESSION = np.eye(2)[None]
SHEARS = np.array([[[1.0, 0.0], [0.0, -1.0]], [[0.0, 1.0], [0.0, 0.0]]])
PURE_SHEARS = np.array([[[1.0, 0.0], [0.0, -1.0]], [[0.0, 1.0], [1.0, 0.0]]])  # without rotation


@dataclass(frozen=True)
class BoxStrains:
    """Strains that a box may take during minimisation, and the outer pressure.

    Attributes:
        strains: (m, 2, 2) M_a, upper triangles: COMPRESSION, SHEARS or both in one array.
        pressure: outer pressure; irrelevant if no strain changes the area.

    Example:
        >>> stretch = jamlab.BoxStrains(np.array([[[1.0, 0.0], [0.0, -1.0]]]))
        >>> stretch.pressure
        0.0
    """

    strains: Array
    pressure: float = 0.0

    @property
    def may_shear(self) -> bool:
        """Whether a strain leaves the area."""
        return any(not np.trace(m) for m in self.strains)

    def gradient(self, stress: Array, area: float) -> Array:
        """(m,) dH/de_a at a stress (2, 2)."""
        return np.asarray(area * np.einsum("aij,ij->a", self.strains, self.pressure * np.eye(2) - stress))

    def excess(self, stress: Array) -> float:
        """Largest part of a stress (2, 2) along one of the strains that nothing balances."""
        lengths = np.sqrt(np.einsum("aij,aij->a", self.strains, self.strains))
        return float(np.abs(self.gradient(stress, 1.0) / lengths).max())

    def deformation(self, strain: Array) -> Array:
        """(2, 2) deformation gradient exp(sum of the strains), their amplitudes (m,)."""
        (a, b), (_, d) = np.einsum("a,aij->ij", strain, self.strains)
        half = 0.5 * (a - d)
        middle = np.exp(0.5 * (a + d)) * (np.sinh(half) / half if half else 1.0)
        return np.array([[np.exp(a), b * middle], [0.0, np.exp(d)]])

    def move(self, packing: Packing, displacement: Array, strain: Array) -> Packing:
        """The packing after strains of box and sites, amplitudes (m,), and displacements (n_sites, 2)."""
        f = self.deformation(strain)
        return packing.with_state(box=packing.box @ f.T, positions=packing.positions @ f.T + displacement)
