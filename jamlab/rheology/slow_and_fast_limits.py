"""Response of a packing to infinitely slow and infinitely fast shear, and whether it is stable at all."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import linalg

from jamlab.errors import ConvergenceError
from jamlab.mechanics.positive_solver import positive_solver
from jamlab.mechanics.symmetric_factors import SymmetricFactors
from jamlab.rheology.equation_of_motion import EquationOfMotion
from jamlab.rheology.shifted_solver import ShiftedSolver

Array = NDArray[np.float64]

_LARGEST_RESIDUAL = 1e-6  # of a static solution; beyond it the network is floppy
_PROXIMAL_STEPS = 30
_FASTEST = 1e6  # shift of the fast limit over the rate at which dissipation outweighs elasticity
_NAMED = 6  # negative eigenvalues looked at for the message


@dataclass(frozen=True)
class Limits:
    """Response at unit strain when the strain is infinitely slow or fast.

    Attributes:
        slow: (m,) q of least energy; rotations dissipate least.
        fast: (m,) q of least dissipation, and among those of least energy.
        g0: G'(omega -> 0).
        eta_inf: lim G''/omega, omega -> infinity; 0 where drag leaves a way to flow without dissipation.
        eta0: lim G''/omega, omega -> 0.
    """

    slow: Array
    fast: Array
    g0: float
    eta_inf: float
    eta0: float


def limits(motion: EquationOfMotion) -> Limits:
    """Slow and fast limit of the response, and the moduli that follow from them.

    Raises:
        ConvergenceError: K has a negative eigenvalue, which is named, or another zero mode than translations.
    """
    slow = _slow(motion)
    fast = _fast(motion)
    strained_slow, strained_fast = np.append(slow, 1.0), np.append(fast, 1.0)
    dissipation = float(strained_fast @ (motion.b @ strained_fast))
    magnitude = float(np.abs(strained_fast) @ (abs(motion.b) @ np.abs(strained_fast)))
    if dissipation <= float(np.finfo(np.float64).eps) * magnitude:  # nothing is left but rounding
        dissipation = 0.0
    return Limits(
        slow=slow,
        fast=fast,
        g0=float(strained_slow @ (motion.k @ strained_slow)) / motion.area,
        eta_inf=dissipation / motion.area,
        eta0=float(strained_slow @ (motion.b @ strained_slow)) / motion.area,
    )


def held_stiffness(motion: EquationOfMotion) -> tuple[sparse.csc_array, int]:
    """K of the displacements with site 0 held, and the number of coordinates in front that are held only here."""
    held = 2 if motion.drifting else 0
    return motion.k_qq[held : motion.moving, held : motion.moving].tocsc(), held


def _slow(motion: EquationOfMotion) -> Array:
    matrix, held = held_stiffness(motion)
    solver = positive_solver()
    try:
        solver.factorise(matrix, check=True)
    except ConvergenceError as error:
        raise _unstable(matrix) from error
    right = -motion.k_qg[held : motion.moving]
    response = solver.solve(right)
    response += solver.solve(right - matrix @ response)
    scale = np.abs(right).max()
    residual = np.abs(right - matrix @ response).max()
    if not residual <= _LARGEST_RESIDUAL * scale:
        raise ConvergenceError(f"the packing has a floppy mode: its static response leaves {residual / scale:.2g}")
    q = np.zeros(motion.size)
    q[held : motion.moving] = response
    q = motion.without_drift(q)
    if motion.size > motion.moving:
        torque = (motion.b_qq @ q + motion.b_qg)[motion.moving :]
        solver.factorise(motion.b_qq[motion.moving :, motion.moving :].tocsc())
        q[motion.moving :] = -solver.solve(torque)
    return q


def _fast(motion: EquationOfMotion) -> Array:
    """Least dissipation, by proximal steps: B alone may be singular, K + s B is not.

    The first step is the exact response at s, so what B leaves free takes least energy; every further step keeps that
    and divides the imbalance of B by about 1 + s over the fastest rate.
    """
    moving = motion.moving
    shift = _FASTEST * motion.k_qq.diagonal()[:moving].max() / motion.b_qq.diagonal()[:moving].max()
    solver = ShiftedSolver(motion)
    solver.factorise(shift)
    q = -solver.solve(motion.k_qg + shift * motion.b_qg)
    last = np.inf
    for _ in range(_PROXIMAL_STEPS):
        step = solver.solve(shift * (motion.b_qq @ q + motion.b_qg))
        size = float(np.abs(step).max())
        if not size < 0.5 * last:  # rounding is reached
            break
        q = q - step
        last = size
    return q


def _unstable(matrix: sparse.csc_array) -> ConvergenceError:
    """What to say about a matrix that is not positive definite."""
    factors = SymmetricFactors(matrix)
    if not factors.negative:
        return ConvergenceError("the packing has a floppy mode: its Hessian is singular")
    return ConvergenceError(
        f"the packing is unstable: its Hessian has {factors.negative} negative mode(s), an eigenvalue is "
        f"{_negative_eigenvalue(matrix, factors):.3g}; it is not at a minimum of its energy"
    )


def _negative_eigenvalue(matrix: sparse.csc_array, factors: SymmetricFactors) -> float:
    """The lowest of the negative eigenvalues next to zero, by Lanczos iteration on the inverse."""
    size = matrix.shape[0]
    if size <= 4 * _NAMED:
        return float(np.linalg.eigvalsh(matrix.toarray())[0])
    inverse = linalg.LinearOperator((size, size), matvec=factors.solve, dtype=np.float64)
    wanted = min(_NAMED, factors.negative)
    found = linalg.eigsh(matrix, k=wanted, sigma=0.0, which="SA", OPinv=inverse, return_eigenvectors=False)
    return float(found.min())
