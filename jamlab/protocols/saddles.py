"""Leave the saddles that packings end on, where small forces alone look like a minimum.

A droplet between two opposite flats slides along them at next to no cost, with a curvature of -1e-13 beside 300 at
onset; one that is balanced on a vertex tips over, with -1e-3 in dense packings. Forces hide either below any tolerance,
the Hessian shows it. Compressed disks stay on saddles by symmetry: of 8 to 16 disks 5 of about 80 states did.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from jamlab.arrays import Array
from jamlab.engine.session import Session
from jamlab.mechanics.elasticity import unstable_direction
from jamlab.packing.natural_units import mean_size
from jamlab.packing.packing import Packing
from jamlab.protocols.box_shear import minimizer
from jamlab.protocols.newton import descend_by_newton
from jamlab.protocols.relaxation import Relaxed
from jamlab.protocols.solver_settings import SOLVERS, SolverSettings


def relax_off_saddles(
    session: Session, tolerance: float | None = None, *, near: bool = False, settings: SolverSettings = SOLVERS
) -> Relaxed:
    """Relax the packing in a session in its ensemble, to a minimum and not to a saddle; arguments as in `relax`."""
    relax_state = minimizer(session.packing().ensemble)
    found = relax_state(session, tolerance, near=near, settings=settings)

    def again() -> Relaxed:
        return relax_state(session, tolerance, near=True, settings=settings)

    return leave_saddles(session, found, again, settings)


def leave_saddles(
    session: Session, found: Relaxed, relax_again: Callable[[], Relaxed], settings: SolverSettings
) -> Relaxed:
    """The minimum beside a state that a session was relaxed to, which does not count as converged where none is found.
    `relax_again`: of what lies near a minimum."""
    for _ in range(settings.saddles.slides):
        packing = session.packing()
        if not found.converged:
            return found
        if (unstable := unstable_direction(packing)) is None:
            return replace(found, off_saddles=True)
        session.set_positions(slid(session, packing, unstable[0], settings))
        descend_by_newton(session, min(settings.saddles.finest, found.tolerance), settings=settings.newton)
        found = relax_again()
    return replace(found, converged=False)


def rests_on_rattlers(session: Session, settings: SolverSettings) -> bool:
    """Whether the state that a session holds is pushed back either way along the mode that gives way.

    A droplet squeezed between two others slides until it touches a rattler, which stops it with hardly any force. The
    Hessian leaves rattlers out and sees a saddle for ever. The rattler is held fixed here.
    """
    packing = session.packing()
    if (unstable := unstable_direction(packing)) is None:
        return False
    unit = unstable[0] / np.linalg.norm(unstable[0])
    steps = settings.saddles.probe * mean_size(packing) * np.array([-1.0, 1.0])
    pushes = [-np.sign(step) * np.vdot(session.forces_at(packing.positions + step * unit)[1], unit) for step in steps]
    session.set_positions(packing.positions)
    return bool(min(pushes) > settings.saddles.pushed)


def slid(session: Session, packing: Packing, direction: Array, settings: SolverSettings) -> Array:
    """Positions downhill along a mode, where it goes uphill again: at the next contact, found by bisection."""
    numbers, start = settings.saddles, packing.positions
    least = numbers.held * session.evaluate().pressure * mean_size(packing)
    if np.vdot(session.forces_at(start)[1], direction) < 0:
        direction = -direction

    def uphill(length: float) -> float:
        forces = session.forces_at(start + length * direction)[1]
        return float(-np.vdot(forces, direction) / np.linalg.norm(direction) - least)

    reached, length = 0.0, numbers.slide
    for _ in range(numbers.doublings):
        if uphill(length) > 0:
            break
        reached, length = length, 2 * length
    if uphill(length) > 0:
        from scipy.optimize import bisect  # loaded by packings on a saddle alone

        length = bisect(uphill, reached, length, xtol=1e-9)
    return np.asarray(start + length * direction)
