"""Relax disks and their box together: at a pressure, without shear stress, or both.

FIRE takes the strains of the box for coordinates beside those of the disks, so that rearrangements of thousands of
disks cost only its cheap steps; Newton steps with the same strains in the border end the minimisation.
"""

from dataclasses import dataclass

import numpy as np

from jamlab.engine.box_border import SHEARS, Border
from jamlab.engine.session import Evaluation, Session
from jamlab.errors import ConvergenceError
from jamlab.geometry.contact_network import contacts
from jamlab.mechanics.elasticity import elastic_tensor
from jamlab.packing.packing import Packing
from jamlab.protocols.border_newton import descend_with_box, stress_noise
from jamlab.protocols.relaxation import Relaxed, quench


@dataclass(frozen=True)
class BoxRelaxationSettings:
    """Numbers of the method.

    Attributes:
        noise: largest force over pressure at which Newton steps take over; started at 1e-4 many fail.
        finer: its factor where they fail.
        rounds: at most.
        near: Newton steps from a guess of the minimum, before anything else.
        balanced: unbalanced stress at the end, over that of rounding or of 1e-12 of the pressure.
    """

    noise: float = 1e-6
    finer: float = 0.1
    rounds: int = 4
    near: int = 10
    balanced: float = 10.0


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
        pressure or to rounding, and that shear costs energy where the box may shear. Of a packing that has come loose
        it speaks of forces alone.
    """
    newton_steps, lowest = 0, 0.5 * tolerance
    for round_ in range(BOX_RELAXATION.rounds):
        if near and round_ == 0:
            newton_steps += descend_with_box(session, border, tolerance, steps=BOX_RELAXATION.near)
        else:
            noise = BOX_RELAXATION.noise * BOX_RELAXATION.finer ** (round_ - near)
            state = quench(session, noise, floor=max(least_pressure, lowest / noise), border=border)
            if state.pressure < least_pressure:
                return Relaxed(state, tolerance, state.max_force <= tolerance, newton_steps)
            newton_steps += descend_with_box(session, border, tolerance)
        state, packing = session.evaluate(), session.packing()
        if state.max_force > tolerance:
            continue
        if contacts(packing).rattlers.all():  # nothing is held, so there is no stress to relax
            return Relaxed(state, tolerance, True, newton_steps)
        if border.excess(state.stress) <= BOX_RELAXATION.balanced * stress_noise(packing, state.pressure):
            return Relaxed(state, tolerance, _is_minimum(packing, state, border), newton_steps)
    return Relaxed(session.evaluate(), tolerance, False, newton_steps)


def _is_minimum(packing: Packing, state: Evaluation, border: Border) -> bool:
    """Whether no shear of the box lowers the energy; few contacts that balance by symmetry alone are a saddle."""
    shears = [m for m in border.strains if not np.trace(m)]
    if not shears:
        return True
    try:
        relaxed = elastic_tensor(packing).relaxed
    except ConvergenceError:
        return False
    symmetric = 0.5 * (SHEARS + SHEARS.transpose(0, 2, 1))
    symmetric[1] *= 2  # both of them pure shears
    curvature = np.einsum("aij,ijkl,bkl->ab", symmetric, relaxed, symmetric) - 2 * state.pressure * np.eye(2)
    return bool(np.linalg.eigvalsh(curvature)[0] > 0)
