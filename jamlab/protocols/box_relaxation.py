"""Relax disks and their box together: at a pressure, without shear stress, or both.

FIRE takes the strains of the box for coordinates beside those of the disks, so that rearrangements of thousands of
disks cost only its cheap steps; Newton steps with the same strains in the border end the minimisation.
"""

from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array
from jamlab.engine.box_border import PURE_SHEARS, Border
from jamlab.engine.disk_fire import fire_settings, lively_fire
from jamlab.engine.session import Evaluation, Session
from jamlab.errors import ConvergenceError
from jamlab.geometry.contact_network import contacts
from jamlab.mechanics.elasticity import elastic_tensor
from jamlab.packing.deformation import deformed, shear_gradient
from jamlab.packing.packing import Packing
from jamlab.protocols.border_newton import descend_with_box, stress_noise
from jamlab.protocols.relaxation import Relaxed, quench


@dataclass(frozen=True)
class BoxRelaxationSettings:
    """Numbers of the method.

    Attributes:
        jammed: largest force over pressure at which a packing at fixed box shows whether anything holds the box.
        noise: the same at which Newton steps take over; started at 1e-4 many fail.
        finer: its factor where they fail.
        rounds: at most; after one whose steps ran out, FIRE is livelier.
        fire_only_disks: from here on FIRE alone meets a pressure: 40 Newton steps ended at 1e-10 with 32768 disks.
        near: Newton steps from a guess of the minimum, before anything else.
        leave: shear of a box that rests on a saddle, as symmetric packings of few disks do.
        balanced: unbalanced stress at the end, over that of rounding or of 1e-12 of the pressure.
        met: error of a pressure over the pressure that is good enough where FIRE has reached it by itself.
    """

    jammed: float = 1e-2
    noise: float = 1e-6
    finer: float = 0.1
    rounds: int = 12
    fire_only_disks: int = 10_000
    near: int = 10
    leave: float = 1e-3
    balanced: float = 10.0
    met: float = 1e-7


BOX_RELAXATION = BoxRelaxationSettings()


def relax_disks_and_box(
    session: Session, border: Border, tolerance: float, *, near: bool = False, least_pressure: float = 0.0
) -> Relaxed:
    """Minimise the energy of disks, or their enthalpy, over their positions and strains of the box.

    Args:
        session: SP; is left in the minimum.
        border: strains that the box may take.
        tolerance: on the largest force.
        near: the state is a good guess of the minimum: try Newton steps before anything else.
        least_pressure: give up a packing whose pressure falls below this; it has come loose.

    Returns:
        The state reached; `converged` also means that no strain of the box finds stress to relax, to 1e-11 of the
        pressure or to rounding, and that shear costs energy where the box may shear; from `fire_only_disks` on, that a
        pressure alone is met to 1e-7. Of a packing that has come loose it speaks of forces alone.
    """
    newton_steps = descend_with_box(session, border, tolerance, steps=BOX_RELAXATION.near) if near else 0
    state = session.evaluate()
    may_shear = any(not np.trace(m) for m in border.strains)
    ended = near and _ends(session.packing(), state, border, tolerance)
    if ended and not (may_shear and _leave_saddle(session, state)):
        return _judge(session.packing(), state, border, tolerance, newton_steps)
    state = quench(session, BOX_RELAXATION.jammed, floor=max(least_pressure, tolerance / BOX_RELAXATION.jammed))
    if state.pressure < least_pressure or contacts(session.packing()).rattlers.all():
        return Relaxed(state, tolerance, state.max_force <= tolerance, newton_steps)
    fire = fire_settings()
    for noise in BOX_RELAXATION.noise * BOX_RELAXATION.finer ** np.arange(BOX_RELAXATION.rounds):
        floor = max(least_pressure, tolerance / noise)
        state = quench(session, noise, floor=floor, border=border, fire=fire)
        if state.pressure < least_pressure:
            return Relaxed(state, tolerance, state.max_force <= tolerance, newton_steps)
        if state.max_force > noise * max(state.pressure, floor):
            fire = lively_fire()  # the packing flows on, slide by slide
            continue  # still too far for Newton steps
        met = border.excess(state.stress) <= BOX_RELAXATION.met * state.pressure
        if not may_shear and met and state.max_force <= tolerance:
            return Relaxed(state, tolerance, True, newton_steps)
        if not may_shear and session.size >= BOX_RELAXATION.fire_only_disks:
            continue
        newton_steps += descend_with_box(session, border, tolerance)
        state = session.evaluate()
        ended = _ends(session.packing(), state, border, tolerance)
        if ended and not (may_shear and _leave_saddle(session, state)):
            break
    else:
        state = session.evaluate()
    return _judge(session.packing(), state, border, tolerance, newton_steps)


def _leave_saddle(session: Session, state: Evaluation) -> bool:
    """Shear the box a little where that lowers the energy, which a box without shear stress does not find by itself."""
    packing = session.packing()
    try:
        relaxed = elastic_tensor(packing).relaxed
    except ConvergenceError:  # not jammed
        return False
    values, vectors = np.linalg.eigh(shear_curvature(relaxed, state.pressure))
    if values[0] > 0:
        return False
    strain = BOX_RELAXATION.leave * np.einsum("a,aij->ij", vectors[:, 0], PURE_SHEARS)
    session.load(deformed(packing, shear_gradient(strain))[0])
    return True


def _ends(packing: Packing, state: Evaluation, border: Border, tolerance: float) -> bool:
    """Whether forces are balanced, and stress as well where anything is held."""
    excess = border.excess(state.stress)
    balanced = excess <= BOX_RELAXATION.balanced * stress_noise(packing, state.pressure)
    return state.max_force <= tolerance and (balanced or bool(contacts(packing).rattlers.all()))


def _judge(packing: Packing, state: Evaluation, border: Border, tolerance: float, newton_steps: int) -> Relaxed:
    minimum = _ends(packing, state, border, tolerance) and _is_minimum(packing, state, border)
    return Relaxed(state, tolerance, minimum, newton_steps)


def _is_minimum(packing: Packing, state: Evaluation, border: Border) -> bool:
    """Whether no shear of the box lowers the energy; few contacts that balance by symmetry alone are a saddle."""
    may_shear = any(not np.trace(m) for m in border.strains)
    if not may_shear or contacts(packing).rattlers.all():
        return True
    try:
        relaxed = elastic_tensor(packing).relaxed
    except ConvergenceError:
        return False
    return bool(np.linalg.eigvalsh(shear_curvature(relaxed, state.pressure))[0] > 0)


def shear_curvature(relaxed: Array, pressure: float) -> Array:
    """(2, 2) second derivatives of the energy per area in both pure shears of the box at constant area.

    Args:
        relaxed: (2, 2, 2, 2) elastic tensor, `ElasticTensor.relaxed`.
        pressure: exp(E) has E E/2 beyond E, which takes back work of the pressure.
    """
    return np.asarray(np.einsum("aij,ijkl,bkl->ab", PURE_SHEARS, relaxed, PURE_SHEARS) - 2 * pressure * np.eye(2))
