"""Newton steps to a minimum: Levenberg-Marquardt on the analytic Hessian, forces from LAMMPS.

References: D. W. Marquardt, J. SIAM 11, 431 (1963); trust-region rules of Nocedal & Wright, Numerical Optimization,
algorithm 4.1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from jamlab.engine.evaluation import Evaluation
from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError, InputError
from jamlab.mechanics.factors import PositiveSolver
from jamlab.mechanics.stiffness import hessian
from jamlab.packing.deformation import at_positions

if TYPE_CHECKING:
    from scipy import sparse


@dataclass(frozen=True)
class Newton:
    """Newton steps within a trust region.

    Halved or doubled, these change force evaluations and factorisations by less than 5 % and lose no state, except for
    the first shift (a third more of both either way) and a larger `good` (18 and 43 % more).
    """

    steps: int = 150  # at most
    # longest move of a coordinate in one step, mean particle size; contacts beyond are not in the Hessian
    reach: float = 0.05
    first_shift: float = 1e-3  # added to the Hessian's diagonal at first
    least_shift: float = 1e-10  # keeps rattlers and translations, which have no stiffness, from running away
    last_shift: float = 1e6  # with more than this, steps are too short to get anywhere
    accepted: float = 1e-3  # part of the energy foretold that a step must gain
    # parts above which the shift shrinks and below which it grows, Nocedal & Wright
    good: float = 0.75
    poor: float = 0.25
    # factors of the shift; fast down, so that the end is quadratic
    shrink: float = 0.2
    grow: float = 5.0
    definite: float = 4.0  # factor of the shift until the shifted Hessian is positive definite


NEWTON = Newton()


def descend_by_newton(session: Session, tolerance: float, steps: int = NEWTON.steps) -> Evaluation:
    """Take Levenberg-Marquardt steps until the tolerance is met.

    A step is judged by the energy it gains. Energies have no digits left here, so the gain is the work of the force
    along the step, (F0 + F1) . s/2; the size of the force would not do, because a long step along a soft mode (a
    rolling droplet) raises the force on stiff ones. The shift shrinks when the quadratic model holds and grows when
    contacts open or close.

    Args:
        session: is left in the best state reached.
        tolerance: on the largest force.
        steps: at most.

    Returns:
        The state reached.
    """
    packing = session.packing()
    _, forces = session.forces_at(packing.positions)
    shift = NEWTON.first_shift
    matrix: sparse.csc_array | None = None
    solver = PositiveSolver(session.tally, "Newton steps")
    for _ in range(steps):
        if np.hypot(*forces.T).max() <= tolerance or shift > NEWTON.last_shift:
            break
        try:
            matrix = hessian(packing) if matrix is None else matrix
            shift = factorise(matrix, shift, solver)
        except (InputError, ConvergenceError):  # outlines of two polygons cross: no minimum that way
            break
        step = solver.solve(forces.ravel())
        step *= min(1.0, NEWTON.reach / float(np.abs(step).max()))
        predicted = forces.ravel() @ step - 0.5 * step @ (matrix @ step)
        positions = packing.positions + step.reshape(-1, 2)
        _, trial = session.forces_at(positions)
        gained = 0.5 * (forces + trial).ravel() @ step / predicted if predicted > 0 else -1.0
        if gained > NEWTON.accepted:
            try:
                packing = at_positions(packing, positions)
            except InputError:  # a polygon crosses itself
                gained = -1.0
            else:
                forces, matrix = trial, None
        if gained > NEWTON.good:
            shift = max(NEWTON.shrink * shift, NEWTON.least_shift)
        elif gained < NEWTON.poor:
            shift *= NEWTON.grow
    session.set_positions(packing.positions)
    return session.evaluate()


def factorise(matrix: sparse.csc_array, shift: float, solver: PositiveSolver) -> float:
    """Factorise matrix + shift, the shift raised until all eigenvalues are positive.

    Args:
        matrix: (n, n) symmetric.
        shift: least one.
        solver: holds the factors afterwards.

    Returns:
        The shift used.
    """
    highest = 1e6 * max(1.0, float(np.abs(matrix.diagonal()).max()))
    while shift < highest:
        try:
            solver.factorise(matrix, shift)
            return shift
        except ConvergenceError:
            shift *= NEWTON.definite
    raise ConvergenceError(f"the Hessian cannot be factorised with any shift up to {highest:.2g}: is it finite?")
