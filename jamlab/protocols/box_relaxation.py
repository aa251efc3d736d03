"""Relax disks and their box together: at a pressure, without shear stress, or both.

FIRE takes the strains of the box for coordinates beside those of the disks, so that rearrangements of thousands of
disks cost only its cheap steps; Newton steps with the same strains in the border end the minimisation.
"""

import numpy as np

from jamlab.arrays import Array
from jamlab.engine.box_border import COMPRESSION, PURE_SHEARS, BoxStrains
from jamlab.engine.session import Evaluation, Session
from jamlab.errors import ConvergenceError
from jamlab.geometry.contact_network import contacts
from jamlab.mechanics.elasticity import compression_modulus, elastic_tensor, follow
from jamlab.packing.deformation import deformed, shear_gradient
from jamlab.packing.natural_units import stiffness_scale
from jamlab.packing.packing import Packing
from jamlab.protocols.border_newton import descend_with_box, stress_noise
from jamlab.protocols.relaxation import Relaxed, load, quench, relax

_JAMMED = 1e-2  # largest force over pressure at which a packing at fixed box shows whether anything holds the box
_NOISE = 1e-6  # the same at which Newton steps take over; started at 1e-4 many fail
_FINER = 0.1  # its factor where they fail
FIRE_ONLY_DISKS = 10_000  # from here on FIRE alone meets a pressure: 40 Newton steps ended at 1e-10 with 32768 disks
_ROUNDS = 12  # of FIRE and Newton steps at most
_NEAR = 10  # Newton steps from a guess of the minimum, before anything else
_LEAVE = 1e-3  # shear of a box that rests on a saddle, as symmetric packings of few disks do
_BALANCED = 10.0  # unbalanced stress at the end, over that of rounding or of 1e-12 of the pressure
_AREAS = 40  # of a box at a pressure that are tried at most, behind all this
_WIDEST = 0.02  # change of the area in one step
_HELD = 1e-9  # error of a pressure over the load of the packing, at the end
_MET = 1e-7  # error of a pressure over the pressure that is good enough where FIRE has reached it by itself


def relax_disks_and_box(
    session: Session,
    border: BoxStrains,
    tolerance: float,
    *,
    near: bool = False,
    least_pressure: float = -np.inf,
) -> Relaxed:
    """Minimise the energy of disks, or their enthalpy, over their positions and strains of the box.

    Args:
        session: SP; is left in the minimum.
        border: strains that the box may take.
        tolerance: on the largest force.
        near: the state is a good guess of the minimum: try Newton steps before anything else.
        least_pressure: give up a packing whose pressure falls below this; it has unjammed.

    Returns:
        The state reached; `converged` also means that no strain of the box finds stress to relax, to 1e-11 of the
        pressure or to rounding, and that shear costs energy where the box may shear; from `FIRE_ONLY_DISKS` on, that a
        pressure alone is met to 1e-7. For an unjammed packing it refers to forces alone.
    """
    if near:
        descend_with_box(session, border, tolerance, _NEAR)
    state = session.evaluate()
    ended = near and _ends(session.packing(), state, border, tolerance)
    if ended and not (border.may_shear and _leave_saddle(session, state)):
        return _judge(session.packing(), state, border, tolerance)
    floor = max(least_pressure, tolerance / _JAMMED)
    state = quench(session, _JAMMED, floor=floor)
    if state.pressure < least_pressure or contacts(session.packing()).unjammed:
        return Relaxed(state, tolerance, state.max_force <= tolerance)
    for noise in _NOISE * _FINER ** np.arange(_ROUNDS):
        floor = max(least_pressure, tolerance / noise)
        state = quench(session, noise, floor=floor, border=border, lively=True)
        if state.pressure < least_pressure:
            return Relaxed(state, tolerance, state.max_force <= tolerance)
        borne = load(session.packing(), state)
        if state.max_force > noise * max(borne, floor):
            continue  # the packing flows on, slide by slide: still too far for Newton steps
        met = border.excess(state.stress) <= _MET * borne
        if not border.may_shear and met and state.max_force <= tolerance:
            return Relaxed(state, tolerance, True)
        if not border.may_shear and session.size >= FIRE_ONLY_DISKS:
            continue
        descend_with_box(session, border, tolerance)
        state = session.evaluate()
        ended = _ends(session.packing(), state, border, tolerance)
        if ended and not (border.may_shear and _leave_saddle(session, state)):
            break
    else:
        state = session.evaluate()
    return _judge(session.packing(), state, border, tolerance)


def relax_at_pressure(session: Session, pressure: float, tolerance: float) -> Relaxed:
    """Minimise the enthalpy U + p A over sites and the size of the box, whose shape stays.

    Disks first go by `relax_disks_and_box`. What is left, and all of droplets, goes by Newton steps in the area with
    the bulk modulus of linear response; the sites follow by it and are relaxed at each area.

    Args:
        session: near a minimum at best; is left in the state reached.
        pressure: outside.
        tolerance: on the largest force.

    Returns:
        The state reached; `converged` also means that the pressure is met to 1e-9 of its load.
    """
    if session.law.kernel_arguments() is not None and session.packing().fixed is None:
        relax_disks_and_box(session, BoxStrains(COMPRESSION, pressure), tolerance, near=True)
    found = relax(session, tolerance, near=True)
    before: tuple[float, float] | None = None
    for _ in range(_AREAS):
        state, packing = found.evaluation, session.packing()
        excess = state.pressure - pressure
        if abs(excess) <= _HELD * load(packing, state):
            return found
        try:
            modulus = compression_modulus(elastic_tensor(packing).relaxed, state.pressure)
        except ConvergenceError:  # droplets on corners, or loose: by the last two states
            modulus = 0.0 if before is None else (state.pressure - before[1]) / np.log(before[0] / packing.area)
        if not modulus > 0:
            modulus = stiffness_scale(packing)
        wider = np.clip(excess / modulus, -_WIDEST, _WIDEST)
        before = packing.area, state.pressure
        session.load(follow(packing, packing.phi * np.exp(-wider)))
        found = relax(session, tolerance, near=True)
    return Relaxed(found.evaluation, tolerance, False)


def _softest_shear(packing: Packing, pressure: float) -> tuple[float, Array] | None:
    """The lowest curvature of the energy in shears of the box, and its strain (2, 2); None where nothing is held."""
    try:
        relaxed = elastic_tensor(packing).relaxed
    except ConvergenceError:
        return None
    values, vectors = np.linalg.eigh(shear_curvature(relaxed, pressure))
    return float(values[0]), np.einsum("a,aij->ij", vectors[:, 0], PURE_SHEARS)


def _leave_saddle(session: Session, state: Evaluation) -> bool:
    """Shear the box a little where that lowers the energy, which a box without shear stress does not find by itself."""
    softest = _softest_shear(session.packing(), state.pressure)
    if softest is None or softest[0] > 0:
        return False
    session.load(deformed(session.packing(), shear_gradient(_LEAVE * softest[1]))[0])
    return True


def _ends(packing: Packing, state: Evaluation, border: BoxStrains, tolerance: float) -> bool:
    """Whether forces are balanced, and stress as well where anything is held."""
    balanced = border.excess(state.stress) <= _BALANCED * stress_noise(packing, state)
    return state.max_force <= tolerance and (balanced or contacts(packing).unjammed)


def _judge(packing: Packing, state: Evaluation, border: BoxStrains, tolerance: float) -> Relaxed:
    """Few contacts that balance by symmetry alone are a saddle, where a shear of the box lowers the energy."""
    minimum = _ends(packing, state, border, tolerance)
    if minimum and border.may_shear and not contacts(packing).unjammed:
        softest = _softest_shear(packing, state.pressure)
        minimum = softest is not None and softest[0] > 0
    return Relaxed(state, tolerance, minimum)


def shear_curvature(relaxed: Array, pressure: float) -> Array:
    """(2, 2) second derivatives of the energy per area in both pure shears of the box at constant area.

    Args:
        relaxed: (2, 2, 2, 2) elastic tensor, `ElasticTensor.relaxed`.
        pressure: exp(E) has E E/2 beyond E, which takes back work of the pressure.
    """
    return np.asarray(np.einsum("aij,ijkl,bkl->ab", PURE_SHEARS, relaxed, PURE_SHEARS) - 2 * pressure * np.eye(2))
