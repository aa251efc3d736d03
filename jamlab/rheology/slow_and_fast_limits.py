"""Response of a packing to infinitely slow and infinitely fast shear; refuses packings that are not stable."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from jamlab.arrays import Array
from jamlab.mechanics.positive_solver import PositiveSolver
from jamlab.mechanics.static_response import static_response
from jamlab.rheology.equation_of_motion import EquationOfMotion
from jamlab.rheology.rounding_error import ROUNDING
from jamlab.rheology.shifted_solver import ShiftedSolver


@dataclass(frozen=True)
class FastLimitSettings:
    """Numbers of the proximal steps to the fast limit."""

    # over the rate at which dissipation outweighs elasticity. A step divides the imbalance by about this number; the
    # elastic energy of what B leaves free must stay above the rounding of s B, 1e-16 times this.
    shift: float = 1e6
    most_steps: int = 30  # a guard; two to five reach rounding
    least_gain: float = 0.5  # a step must be shorter than this part of the last one, else it is rounding


SETTINGS = FastLimitSettings()


@dataclass(frozen=True)
class Limits:
    """Response at unit strain when the strain is infinitely slow or fast."""

    slow: Array  # (m,) q of least energy; rotations dissipate least
    fast: Array  # (m,) q of least dissipation, and among those of least energy
    g0: float  # G'(omega -> 0)
    eta_inf: float  # lim G''/omega, omega -> infinity; 0 where drag leaves a way to flow without dissipation
    eta_inf_error: float  # what rounding may change eta_inf by; a smaller one counts as 0
    eta0: float  # lim G''/omega, omega -> 0
    solver: ShiftedSolver  # of this equation of motion, which knows the pattern of its matrices


def find_limits(motion: EquationOfMotion) -> Limits:
    """Find the slow and the fast limit of the response, and the moduli that follow from them."""
    slow = _solve_slow(motion)
    solver = ShiftedSolver(motion)
    fast = _solve_fast(motion, solver)
    strained_slow, strained_fast = np.append(slow, 1.0), np.append(fast, 1.0)
    b = motion.b
    dissipation = float(strained_fast @ (b @ strained_fast))
    magnitude = float(np.abs(strained_fast) @ (abs(b) @ np.abs(strained_fast)))
    rounding = ROUNDING * magnitude
    if dissipation <= rounding:  # nothing else is left
        dissipation = 0.0
    return Limits(
        slow=slow,
        fast=fast,
        g0=float(strained_slow @ (motion.k @ strained_slow)) / motion.area,
        eta_inf=dissipation / motion.area,
        eta_inf_error=rounding / motion.area,
        eta0=float(strained_slow @ (b @ strained_slow)) / motion.area,
        solver=solver,
    )


def _fix_one_site(motion: EquationOfMotion) -> tuple[sparse.csc_array, int]:
    """K of the displacements with site 0 fixed, and the number of coordinates in front that are fixed only here."""
    held = 2 if motion.drifting else 0
    return motion.k_qq[held : motion.moving, held : motion.moving].tocsc(), held


def _solve_slow(motion: EquationOfMotion) -> Array:
    matrix, held = _fix_one_site(motion)
    q = np.zeros(motion.size)
    q[held : motion.moving] = static_response(matrix, -motion.k_qg[held : motion.moving, None])[:, 0]
    q = motion.without_drift(q)
    if motion.size > motion.moving:
        torque = (motion.b_qq @ q + motion.b_qg)[motion.moving :]
        solver = PositiveSolver()
        solver.factorise(motion.b_qq[motion.moving :, motion.moving :].tocsc())
        q[motion.moving :] = -solver.solve(torque)
    return q


def _solve_fast(motion: EquationOfMotion, solver: ShiftedSolver) -> Array:
    """Least dissipation, by proximal steps: B alone may be singular, K + s B is not. The first step is the exact
    response at s, so what B leaves free takes least energy; every further step keeps that and divides the imbalance of
    B by about 1 + s over the fastest rate."""
    moving = motion.moving
    shift = SETTINGS.shift * motion.k_qq.diagonal()[:moving].max() / motion.b_qq.diagonal()[:moving].max()
    solver.factorise(shift)
    q = -solver.solve(motion.k_qg + shift * motion.b_qg)
    last = np.inf
    for _ in range(SETTINGS.most_steps):
        step = solver.solve(shift * (motion.b_qq @ q + motion.b_qg))
        size = float(np.abs(step).max())
        if not size < SETTINGS.least_gain * last:
            break
        q = q - step
        last = size
    return q
