"""From any state to a minimum of the potential energy: first-order steps into the basin, Newton steps to the bottom.

SP: conjugate gradients in LAMMPS reach 1e-12 by themselves; FIRE and Newton help where they stall, and Newton ends the
minimisation of large packings. DP: vertices slide along flats almost freely, so first-order methods crawl. L-BFGS on
LAMMPS forces, preconditioned by the analytic Hessian, goes all the way; FIRE and Newton steps help where it stalls.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from jamlab.engine.session import Evaluation, Session
from jamlab.errors import ConvergenceError, InputError
from jamlab.geometry.vertex_contacts import vertex_contacts
from jamlab.mechanics.stiffness import hessian
from jamlab.mechanics.symmetric_factors import SymmetricFactors
from jamlab.protocols.preconditioned_lbfgs import descend

Array = NDArray[np.float64]

FORCE_TOLERANCE = {"sp": 1e-12, "dp": 1e-10}  # largest force at a minimum, in units of the packing

_MANY_DISKS = 1000  # from here on Newton steps end a minimisation sooner than conjugate gradients
_FIRE_ONLY_DISKS = 4000
_FIRE_ONLY_NOISE = 1e-7
_NEWTON_NOISE = 1e-5  # force over pressure at which they take over; started earlier they stall
_FIRST_NOISE = 1e-2
_STAGES = 12
_CG_STEPS = 20_000
_FIRE_STRETCH = 3000
_FIRE_STEPS = {"sp": 20_000, "dp": 300}
_LBFGS_STEPS = 5000
_SETTLE_STEPS = 1500
_LOOSE_FORCE = 2e-5  # DP: below, forces that are left cannot bring a packing to jam that has no contacts
_SHIFT = 1e-2  # added to the Hessian's diagonal in L-BFGS at first: while contacts change, long steps miss
_SHIFT_DECAY = 0.7  # at every new factorisation
_LEAST_SHIFT = 3e-4  # with less, steps along soft modes are longer than the quadratic model holds
_NEWTON_STEPS = 150
_NEAR_STEPS = 40  # beyond, first-order steps bring disks nearer for less
_NEWTON_REACH = 0.05  # longest move of a coordinate in one Newton step, mean particle size
_NEWTON_SHIFT = 1e-3  # added to the Hessian's diagonal at first
_NEWTON_LEAST_SHIFT = 1e-10  # keeps rattlers and translations from running away
_NEWTON_GIVES_UP = 1e6


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


def settle(session: Session, tolerance: float, *, loose: float = 0.0) -> Evaluation:
    """A bounded effort: enough to tell a jammed packing from a loose one, whose last digits cost most.

    Args:
        session: is left in the state reached.
        tolerance: on the largest force.
        loose: DP: give up a packing whose contact energy per vertex is below this when forces are nearly gone.
    """
    if session.model == "sp":
        return _descend_disks(session, tolerance, 0, 0.0)
    state = _descend_preconditioned(session, tolerance, _SETTLE_STEPS, loose * session.size)
    if state.max_force > tolerance and not _loose(session, state.max_force, loose * session.size):
        _newton(session, tolerance)
        state = session.evaluate()
    return state


def relax(
    session: Session,
    tolerance: float | None = None,
    *,
    rounds: int = 3,
    near: bool = False,
    least_pressure: float = 0.0,
) -> Relaxed:
    """Minimise the energy of the packing in a session, at fixed box.

    Args:
        session: is left in the minimum.
        tolerance: on the largest force; default `FORCE_TOLERANCE` of the model.
        rounds: how often to start again with first-order steps when Newton leaves its basin.
        near: SP: the state is a good guess of the minimum: try Newton steps before anything else.
        least_pressure: SP: give up a packing whose pressure falls below this on the way; the last digits of one that
            just loses its contacts cost most.

    Returns:
        The state reached; `converged` is False if no round met the tolerance.
    """
    if tolerance is None:
        tolerance = FORCE_TOLERANCE[session.model]
    newton_steps = 0
    if near and session.model == "sp":
        newton_steps = _newton(session, tolerance, _NEAR_STEPS)
        state = session.evaluate()
        if state.max_force <= tolerance:
            return Relaxed(state, True, newton_steps)
    for round_ in range(rounds):
        if session.model == "sp":
            state = _descend_disks(session, tolerance, round_, least_pressure)
            if state.pressure < least_pressure:
                return Relaxed(state, state.max_force <= tolerance, newton_steps)
        else:
            if round_:
                before = session.positions()
                session.minimize(tolerance, style="fire", steps=_FIRE_STEPS["dp"])
                _undo_if_folded(session, before)
            state = _descend_preconditioned(session, tolerance, _LBFGS_STEPS)
        if state.max_force > tolerance:
            newton_steps += _newton(session, tolerance)
            state = session.evaluate()
        if state.max_force <= tolerance:
            break
    return Relaxed(state, state.max_force <= tolerance and not _entangled(session), newton_steps)


def _entangled(session: Session) -> bool:
    """Whether polygons have come through each other's outline, where the contact energy pulls instead of pushing."""
    if session.model == "sp":
        return False
    try:
        vertex_contacts(session.packing())
    except InputError:
        return True
    return False


def _descend_disks(session: Session, tolerance: float, round_: int, least_pressure: float) -> Evaluation:
    lowest = 0.5 * tolerance  # LAMMPS compares components, jamlab compares norms
    if session.size >= _MANY_DISKS:
        return _descend_many_disks(session, _NEWTON_NOISE * 0.1**round_, lowest, least_pressure)
    style = "cg" if round_ % 2 == 0 else "fire"
    if not least_pressure:
        return session.minimize(lowest, style=style, steps=_CG_STEPS)
    state = session.evaluate()
    for noise in _FIRST_NOISE * 0.1 ** np.arange(_STAGES):
        target = max(noise * state.pressure, lowest)
        if state.max_force > target:
            state = session.minimize(target, style=style, steps=_CG_STEPS)
        if state.pressure < least_pressure or state.max_force <= lowest:
            break
    return state


def _descend_many_disks(session: Session, noise: float, lowest: float, least_pressure: float) -> Evaluation:
    """FIRE while contacts open and close in many places at once; L-BFGS where the packing slides in a soft direction.

    L-BFGS and Newton steps have one length for the whole packing, which local events keep short in large ones: there
    FIRE goes on, almost to the end.
    """
    if session.size >= _FIRE_ONLY_DISKS:
        noise *= _FIRE_ONLY_NOISE / _NEWTON_NOISE
        return quench(session, noise, floor=max(least_pressure, lowest / noise))
    state = quench(session, noise, floor=max(least_pressure, lowest / noise), steps=_FIRE_STEPS["sp"])
    target = max(noise * state.pressure, lowest)
    if state.max_force <= target or state.pressure < least_pressure:
        return state
    return _descend_preconditioned(session, target, _LBFGS_STEPS)


def quench(session: Session, noise: float, *, floor: float, steps: int = 100_000) -> Evaluation:
    """FIRE steps down to forces of `noise` times the pressure: enough to know the pressure of disks.

    Args:
        session: SP; is left in the state reached.
        noise: largest force over pressure.
        floor: pressure below which a packing counts as loose, and need not be relaxed any further.
        steps: at most, in each of a few stages.
    """
    state = session.evaluate()
    for _ in range(_STAGES):  # the pressure, and with it the target, falls on the way
        target = noise * max(state.pressure, floor)
        if state.max_force <= target:
            break
        before = state.pressure
        state = session.minimize(target, style="fire", steps=steps, stretch=_FIRE_STRETCH)
        if state.max_force > target and state.pressure > 0.5 * before:
            break
    return state


def _descend_preconditioned(session: Session, target: float, steps: int, loose: float = 0.0) -> Evaluation:
    packing = session.packing()
    shift = _SHIFT / _SHIFT_DECAY

    def preconditioner(positions: Array) -> Callable[[Array], Array]:
        nonlocal shift
        shift = max(shift * _SHIFT_DECAY, _LEAST_SHIFT)
        return _factorise(hessian(packing.with_state(positions=positions)), shift)[0].solve

    try:
        positions, _ = descend(
            session.forces_at,
            packing.positions,
            preconditioner,
            tolerance=target,
            steps=steps,
            enough=lambda largest_force: _loose(session, largest_force, loose),
        )
        session.set_positions(positions)
        _undo_if_folded(session, packing.positions)
    except InputError:  # outlines crossed on the way: no Hessian there
        session.set_positions(packing.positions)
    return session.evaluate()


def _loose(session: Session, largest_force: float, contact_energy: float) -> bool:
    """Whether contacts are gone, and forces too small to press droplets together again that have just lost touch."""
    return largest_force < _LOOSE_FORCE and session.contact_energy() < contact_energy


def _undo_if_folded(session: Session, before: Array) -> None:
    """Go back to positions in which no polygon has folded over itself: from there no minimum is one of a packing."""
    if len(session.self_crossings()):
        session.set_positions(before)


def _newton(session: Session, tolerance: float, steps: int = _NEWTON_STEPS) -> int:
    """Levenberg-Marquardt steps on the analytic Hessian until the tolerance is met; returns how many were taken.

    A step is judged by the energy it gains. Energies have no digits left here, so the gain is the work of the force
    along the step, (F0 + F1) . s/2; the size of the force would not do, because a long step along a soft mode (a
    rolling droplet) raises the force on stiff ones. The shift shrinks when the quadratic model holds, which makes the
    end quadratic, and grows when contacts open or close.
    """
    packing = session.packing()
    _, forces = session.forces_at(packing.positions)
    shift = _NEWTON_SHIFT
    matrix: sparse.csc_array | None = None
    taken = 0
    for _ in range(steps):
        if np.hypot(*forces.T).max() <= tolerance or shift > _NEWTON_GIVES_UP:
            break
        if matrix is None:
            try:
                matrix = hessian(packing)
            except InputError:  # outlines of two polygons cross: no minimum that way
                break
        factors, shift = _factorise(matrix, shift)
        step = factors.solve(forces.ravel())
        step *= min(1.0, _NEWTON_REACH / float(np.abs(step).max()))
        predicted = forces.ravel() @ step - 0.5 * step @ (matrix @ step)
        positions = packing.positions + step.reshape(-1, 2)
        _, trial = session.forces_at(positions)
        gained = 0.5 * (forces + trial).ravel() @ step / predicted if predicted > 0 else -1.0
        if gained > 1e-3:
            try:
                packing = packing.with_state(positions=positions)
            except InputError:  # a polygon crosses itself
                gained = -1.0
            else:
                forces, matrix = trial, None
                taken += 1
        if gained > 0.75:
            shift = max(0.2 * shift, _NEWTON_LEAST_SHIFT)
        elif gained < 0.25:
            shift *= 5.0
    session.set_positions(packing.positions)
    return taken


def _factorise(matrix: sparse.csc_array, shift: float) -> tuple[SymmetricFactors, float]:
    """Factors of matrix + shift, the shift raised until all eigenvalues are positive, and that shift."""
    identity = sparse.eye_array(matrix.shape[0], format="csc")
    while True:
        try:
            factors = SymmetricFactors(matrix + shift * identity)
            if factors.negative == 0:
                return factors, shift
        except ConvergenceError:
            pass
        shift *= 4.0
