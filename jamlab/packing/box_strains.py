"""The strains that a box may take while its packing is relaxed.

During minimisation a box may take strains e_a under an outer pressure p. Box and sites then follow exp(sum of e_a M_a),
and the enthalpy H = U + p A changes by dH/de_a = A (p 1 - S) : M_a.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import finite_array
from jamlab.errors import InputError
from jamlab.packing.packing import Packing

# upper triangles: they leave the first lattice vector along x
COMPRESSION = np.eye(2)[None]
SHEARS = np.array([[[1.0, 0.0], [0.0, -1.0]], [[0.0, 1.0], [0.0, 0.0]]])
PURE_SHEARS = np.array([[[1.0, 0.0], [0.0, -1.0]], [[0.0, 1.0], [1.0, 0.0]]])  # without rotation


@dataclass(frozen=True)
class BoxStrains:
    """Strains that a box may take during minimisation, and the outer pressure.

    Attributes:
        strains: (m, 2, 2) upper triangular strain matrices M_a: COMPRESSION, SHEARS or both in one array.
        pressure: outer pressure; irrelevant if no strain changes the area.

    Example:
        >>> stretch = jamlab.BoxStrains(np.array([[[1.0, 0.0], [0.0, -1.0]]]))
        >>> stretch.pressure
        0.0
    """

    strains: Array
    pressure: float = 0.0

    def __post_init__(self) -> None:
        strains = finite_array("strains", self.strains, (None, 2, 2))
        if not len(strains) or strains[:, 1, 0].any():
            raise InputError(
                "strains must be upper triangular matrices, one or more: a box keeps its first edge along x"
            )
        object.__setattr__(self, "strains", strains)

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
        return packing.with_state(box=packing.box @ f.T, positions=packing.frame.carried(f) + displacement)
