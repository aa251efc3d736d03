"""Relax disks and their box together: at a pressure, without shear stress, or both.

FIRE takes the strains of the box for coordinates beside those of the disks, so that rearrangements of thousands of
disks cost only its cheap steps; Newton steps with the same strains in the border end the minimisation.
"""

import numpy as np

from jamlab.arrays import Array
from jamlab.engine.box_border import PURE_SHEARS, Border
from jamlab.engine.disk_fire import lively_fire
from jamlab.engine.session import Evaluation, Session
from jamlab.errors import ConvergenceError
from jamlab.geometry.contact_network import contacts
from jamlab.mechanics.elasticity import elastic_tensor
from jamlab.packing.deformation import deformed, shear_gradient
from jamlab.packing.packing import Packing
from jamlab.protocols.border_newton import descend_with_box, stress_noise
from jamlab.protocols.relaxation import Relaxed, load, quench
from jamlab.protocols.solver_settings import SOLVERS, SolverSettings


def relax_disks_and_box(
    session: Session,
    border: Border,
    tolerance: float,
    *,
    near: bool = False,
    least_pressure: float = -np.inf,
    settings: SolverSettings = SOLVERS,
) -> Relaxed:
    """Minimise the energy of disks, or their enthalpy, over their positions and strains of the box.

    Args:
        session: SP; is left in the minimum.
        border: strains that the box may take.
        tolerance: on the largest force.
        near: the state is a good guess of the minimum: try Newton steps before anything else.
        least_pressure: give up a packing whose pressure falls below this; it has unjammed.
        settings: numbers of the solvers.

    Returns:
        The state reached; `converged` also means that no strain of the box finds stress to relax, to 1e-11 of the
        pressure or to rounding, and that shear costs energy where the box may shear; from `fire_only_disks` on, that a
        pressure alone is met to 1e-7. For an unjammed packing it refers to forces alone.
    """
    numbers = settings.box_relaxation
    if near:
        descend_with_box(session, border, tolerance, steps=numbers.near, settings=settings)
    state = session.evaluate()
    may_shear = any(not np.trace(m) for m in border.strains)
    ended = near and _ends(session.packing(), state, border, tolerance, settings)
    if ended and not (may_shear and _leave_saddle(session, state, numbers.leave)):
        return _judge(session.packing(), state, border, tolerance, settings)
    floor = max(least_pressure, tolerance / numbers.jammed)
    state = quench(session, numbers.jammed, floor=floor, settings=settings.relaxation)
    if state.pressure < least_pressure or contacts(session.packing()).loose:
        return Relaxed(state, tolerance, state.max_force <= tolerance)
    for noise in numbers.noise * numbers.finer ** np.arange(numbers.rounds):
        floor = max(least_pressure, tolerance / noise)
        state = quench(session, noise, floor=floor, border=border, fire=lively_fire(), settings=settings.relaxation)
        if state.pressure < least_pressure:
            return Relaxed(state, tolerance, state.max_force <= tolerance)
        borne = load(session.packing(), state)
        if state.max_force > noise * max(borne, floor):
            continue  # the packing flows on, slide by slide: still too far for Newton steps
        met = border.excess(state.stress) <= numbers.met * borne
        if not may_shear and met and state.max_force <= tolerance:
            return Relaxed(state, tolerance, True)
        if not may_shear and session.size >= numbers.fire_only_disks:
            continue
        descend_with_box(session, border, tolerance, settings=settings)
        state = session.evaluate()
        ended = _ends(session.packing(), state, border, tolerance, settings)
        if ended and not (may_shear and _leave_saddle(session, state, numbers.leave)):
            break
    else:
        state = session.evaluate()
    return _judge(session.packing(), state, border, tolerance, settings)


def _leave_saddle(session: Session, state: Evaluation, leave: float) -> bool:
    """Shear the box a little where that lowers the energy, which a box without shear stress does not find by itself."""
    packing = session.packing()
    try:
        relaxed = elastic_tensor(packing).relaxed
    except ConvergenceError:  # not jammed
        return False
    values, vectors = np.linalg.eigh(shear_curvature(relaxed, state.pressure))
    if values[0] > 0:
        return False
    strain = leave * np.einsum("a,aij->ij", vectors[:, 0], PURE_SHEARS)
    session.load(deformed(packing, shear_gradient(strain))[0])
    return True


def _ends(packing: Packing, state: Evaluation, border: Border, tolerance: float, settings: SolverSettings) -> bool:
    """Whether forces are balanced, and stress as well where anything is held."""
    excess = border.excess(state.stress)
    noise = stress_noise(packing, state, settings.border)
    balanced = excess <= settings.box_relaxation.balanced * noise
    return state.max_force <= tolerance and (balanced or contacts(packing).loose)


def _judge(packing: Packing, state: Evaluation, border: Border, tolerance: float, settings: SolverSettings) -> Relaxed:
    minimum = _ends(packing, state, border, tolerance, settings) and _is_minimum(packing, state, border)
    return Relaxed(state, tolerance, minimum)


def _is_minimum(packing: Packing, state: Evaluation, border: Border) -> bool:
    """Whether no shear of the box lowers the energy; few contacts that balance by symmetry alone are a saddle."""
    may_shear = any(not np.trace(m) for m in border.strains)
    if not may_shear or contacts(packing).loose:
        return True
    try:
        relaxed = elastic_tensor(packing).relaxed
    except ConvergenceError:
        return False
    return bool(np.linalg.eigvalsh(shear_curvature(relaxed, state.pressure))[0] > 0)


def shear_curvature(relaxed: Array, pressure: float) -> Array:
    """(2, 2) second derivatives of the energy per area in both pure shears of the box at constant area. `relaxed`: (2,
    2, 2, 2) elastic tensor, `ElasticTensor.relaxed`; `pressure`: exp(E) has E E/2 beyond E, which takes back work of
    the pressure."""
    return np.asarray(np.einsum("aij,ijkl,bkl->ab", PURE_SHEARS, relaxed, PURE_SHEARS) - 2 * pressure * np.eye(2))
