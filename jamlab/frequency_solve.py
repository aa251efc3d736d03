"""One complex symmetric sparse factorisation per frequency: the way of Baumgarten & Tighe eq 12."""

import numpy as np
from numpy.typing import NDArray

from jamlab.equation_of_motion import EquationOfMotion
from jamlab.sparse_solver import SymmetricFactors

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_REFINEMENTS = 2


def solve_frequency(motion: EquationOfMotion, omega: float) -> tuple[Complex, complex, complex]:
    """Response to unit strain at one frequency.

    Args:
        motion: equation of motion.
        omega: angular frequency, 1/tau_1.

    Returns:
        (m,) q; G* = (M_gg + M_gq q)/A with M = K + i omega B, eq 12 after elimination of all but gamma (their eq 13 is
        printed upside down); and the error of G* that the equation's remaining residual r amounts to, q^T r / A.
    """
    matrix = (motion.k_qq + 1j * omega * motion.b_qq).tocsc()
    column = motion.k_qg + 1j * omega * motion.b_qg
    factors = SymmetricFactors(matrix)
    # a drift that rounding starts feels no stiffness and, at low frequency, hardly any drag
    q = -motion.without_drift(factors.solve(column))
    residual = -column - matrix @ q
    for _ in range(_REFINEMENTS):
        q = q + motion.without_drift(factors.solve(residual))
        residual = -column - matrix @ q
    corner = float(motion.k[-1, -1]) + 1j * omega * float(motion.b[-1, -1])
    return q, complex(corner + column @ q) / motion.area, complex(q @ residual) / motion.area
