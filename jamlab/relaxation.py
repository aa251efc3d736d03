"""From any state to a minimum of the potential energy: first-order steps into the basin, Newton steps to the bottom.

SP: conjugate gradients in LAMMPS reach 1e-12 by themselves; FIRE and Newton help where they stall. DP: vertices slide
along flats almost freely, so first-order methods crawl: FIRE steps in LAMMPS lead into the basin, preconditioned L-BFGS
on LAMMPS forces follows, and Newton steps on the analytic Hessian end it.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from jamlab.engine import Evaluation, Session
from jamlab.errors import InputError
from jamlab.hessian import hessian
from jamlab.lbfgs import descend
from jamlab.packing import Packing
from jamlab.sparse_solver import SymmetricFactors

Array = NDArray[np.float64]

FORCE_TOLERANCE = {"sp": 1e-12, "dp": 1e-10}  # largest force at a minimum, in units of the packing

_FIRE_STEPS = 300
_LBFGS_STEPS = 2000
_LBFGS_FORCE = 1e-6  # here Newton takes over; a tenth of it in every further round
_LBFGS_SHIFT = 1e-2  # added to the Hessian's diagonal, eps/l^2
_NEWTON_STEPS = 40
_NEWTON_REACH = 0.05  # longest move of a site in one Newton step, mean particle size
_NEWTON_MEMORY = 6  # a step may not exceed the largest force of this many steps before


@dataclass(frozen=True)
class Relaxed:
    """A state after minimisation.

    Attributes:
        evaluation: LAMMPS energies, forces and stress there.
        converged: whether the largest force is below the tolerance.
        newton_steps: accepted Newton steps.
    """

    evaluation: Evaluation
    converged: bool
    newton_steps: int


def relax(session: Session, tolerance: float | None = None, *, rounds: int = 3) -> Relaxed:
    """Minimise the energy of the packing in a session, at fixed box.

    Args:
        session: is left in the minimum.
        tolerance: on the largest force; default `FORCE_TOLERANCE` of the model.
        rounds: how often to start again with first-order steps when Newton leaves its basin.

    Returns:
        The state reached; `converged` is False if no round met the tolerance.
    """
    if tolerance is None:
        tolerance = FORCE_TOLERANCE[session.model]
    newton_steps = 0
    for round_ in range(rounds):
        if session.model == "sp":
            state = _descend_disks(session, tolerance, round_)
        else:
            state = _descend_polygons(session, max(_LBFGS_FORCE * 0.1**round_, tolerance))
        if state.max_force > tolerance:
            newton_steps += _newton(session, tolerance)
            state = session.evaluate()
        if state.max_force <= tolerance:
            return Relaxed(state, True, newton_steps)
    return Relaxed(state, False, newton_steps)


def _descend_disks(session: Session, tolerance: float, round_: int) -> Evaluation:
    # LAMMPS compares components, jamlab compares norms
    style = "cg" if round_ % 2 == 0 else "fire"
    return session.minimize(0.5 * tolerance, style=style, steps=20000)


def _descend_polygons(session: Session, target: float) -> Evaluation:
    session.minimize(target, style="fire", steps=_FIRE_STEPS)
    packing = session.packing()

    def preconditioner(positions: Array) -> Callable[[Array], Array]:
        return _factorise(hessian(packing.with_state(positions=positions)), _LBFGS_SHIFT).solve

    try:
        positions, _ = descend(
            session.forces_at, packing.positions, preconditioner, tolerance=target, steps=_LBFGS_STEPS
        )
        session.set_positions(positions)
    except InputError:  # outlines crossed on the way: no Hessian there
        session.set_positions(packing.positions)
    return session.evaluate()


def _newton(session: Session, tolerance: float) -> int:
    """Damped Newton steps until the tolerance is met or no step helps; returns how many were taken.

    The shift that damps zero modes (sliding vertices, rattlers, translations) shrinks with the force, which keeps the
    convergence fast. Contacts that open or close make the force jump, so a step need only stay below the largest force
    of the last few: a search that insists on descent stalls at every such kink.
    """
    packing = session.packing()
    _, forces = session.forces_at(packing.positions)
    history = [float(np.linalg.norm(forces))]
    best, least = packing, history[0]
    damping = 1.0
    taken = 0
    for _ in range(_NEWTON_STEPS):
        if np.hypot(*forces.T).max() <= tolerance:
            break
        tried = _newton_step(session, packing, forces, damping * min(history[-1], 1e-3), max(history[-_NEWTON_MEMORY:]))
        if tried is None:
            damping *= 10.0
            if damping > 1e5:
                break
            continue
        packing, forces = tried
        history.append(float(np.linalg.norm(forces)))
        damping = max(0.3 * damping, 1e-3)
        taken += 1
        if history[-1] < least:
            best, least = packing, history[-1]
    session.set_positions(best.positions)
    return taken


def _newton_step(
    session: Session, packing: Packing, forces: Array, shift: float, limit: float
) -> tuple[Packing, Array] | None:
    """The packing after one step whose force stays below the limit, or None."""
    step = _factorise(hessian(packing), shift).solve(forces.ravel()).reshape(-1, 2)
    length = min(1.0, _NEWTON_REACH / float(np.hypot(*step.T).max()))
    for _ in range(4):
        positions = packing.positions + length * step
        _, trial = session.forces_at(positions)
        if np.linalg.norm(trial) < (1 - 1e-4) * limit:
            try:
                return packing.with_state(positions=positions), trial
            except InputError:  # outlines crossed
                pass
        length *= 0.3
    return None


def _factorise(matrix: sparse.csc_array, shift: float) -> SymmetricFactors:
    """Factors of matrix + shift, the shift raised until all eigenvalues are positive."""
    identity = sparse.eye_array(matrix.shape[0], format="csc")
    shift = max(shift, 1e-14)
    while True:
        try:
            factors = SymmetricFactors(matrix + shift * identity)
            if factors.negative == 0:
                return factors
        except np.linalg.LinAlgError:
            pass
        shift *= 3.0
