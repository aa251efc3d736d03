"""Direct solver: one complex symmetric sparse factorisation for each frequency, Baumgarten & Tighe eq 12."""

import numpy as np
from numpy.typing import NDArray

from jamlab.mechanics.symmetric_factors import SymmetricFactors
from jamlab.rheology.equation_of_motion import EquationOfMotion

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Factors without pivoting may lose digits, and a refinement brings the residual back to rounding. Disks and droplets
# under contact damping are there without, at 1e-13; two are a guard for soft packings and for Stokes drag.
_REFINEMENTS = 2


def solve_frequency(motion: EquationOfMotion, omega: float) -> tuple[Complex, complex, complex]:
    """Solve for the response to unit strain at one frequency.

    Args:
        motion: equation of motion.
        omega: angular frequency, 1/tau_1.

    Returns:
        (m,) q; G* = (M_gg + M_gq q)/A with M = K + i omega B, eq 12 after elimination of all but gamma (their eq 13 is
        printed upside down); and the error of G* that the equation's remaining residual r amounts to, q^T r / A.
    """
    matrix = (motion.k_qq + 1j * omega * motion.b_qq).tocsc()
    column = motion.k_qg + 1j * omega * motion.b_qg
    solver = _Driftless(motion, omega) if motion.drifting else SymmetricFactors(matrix)
    q = -solver.solve(column)
    residual = -column - matrix @ q
    for _ in range(_REFINEMENTS):
        q = q + solver.solve(residual)
        residual = -column - matrix @ q
    corner = float(motion.k[-1, -1]) + 1j * omega * float(motion.b[-1, -1])
    return q, complex(corner + column @ q) / motion.area, complex(q @ residual) / motion.area


class _Driftless:
    """Solver of M q = f under drag on translations t, for forces f without resultant.

    M t = i omega B t vanishes with omega, and rounding would start a drift. Write q = q_rel + t c with site 0 of q_rel
    at rest; no net drag, t^T B q = 0, gives c, and q_rel obeys M less a matrix of rank two.
    """

    def __init__(self, motion: EquationOfMotion, omega: float) -> None:
        self._axes = motion.translations
        drag = motion.b_qq @ self._axes
        self._drag, self._total = drag[2:], self._axes.T @ drag
        self._factors = SymmetricFactors((motion.k_qq + 1j * omega * motion.b_qq)[2:, 2:].tocsc())
        self._dragged = self._factors.solve(1j * omega * self._drag)
        self._small = self._total - self._drag.T @ self._dragged

    def solve(self, force: Complex) -> Complex:
        """(m,) response to a force (m,)."""
        relative = self._factors.solve(force[2:])
        relative = relative + self._dragged @ np.linalg.solve(self._small, self._drag.T @ relative)
        drift = -np.linalg.solve(self._total, self._drag.T @ relative)
        q: Complex = (self._axes @ drift).astype(np.complex128)
        q[2:] += relative
        return q
