"""Leave the saddles that packings end on, where small forces alone look like a minimum.

A droplet between two opposite flats slides along them at next to no cost, with a curvature of -1e-13 beside 300 at
onset; one that is balanced on a vertex tips over, with -1e-3 in dense packings. Forces hide either below any tolerance,
the Hessian shows it. Compressed disks stay on saddles by symmetry: of 8 to 16 disks 5 of about 80 states did.
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.engine.session import Session
from jamlab.mechanics.predicted_motion import unstable_directions
from jamlab.packing.natural_units import mean_size
from jamlab.packing.packing import Packing
from jamlab.protocols.box_relaxation import Ensemble, minimizer
from jamlab.protocols.descent import load
from jamlab.protocols.relaxation import Relaxed


@dataclass(frozen=True)
class Slides:
    """Slides along modes that give way."""

    few_factors: int = 3  # of one state; more, and the log says why
    most: int = 40  # along unstable modes at most, until none is left: one droplet in ten slides on its flats
    # longest slide, and the first try, mean particle size
    longest: float = 0.1
    nearest: float = 1e-6
    bisections: int = 40  # to the contact that stops it, which then overlaps by rounding
    # force uphill at which a slide ends, over pressure times particle size, and over the tolerance
    held: float = 1e-3
    pressed: float = 0.1
    # cosine of two modes that are one, and how often it may come back
    alike: float = 0.9
    returns: int = 1
    # move either way, mean particle size, that rattlers push back, and the least force that is not rounding:
    # 1.4e-12 to 7e-10 were seen, where a curvature of -1e-11 alone leaves 1e-15
    probe: float = 1e-4
    pushed: float = 5e-13


SLIDES = Slides()

_log = logging.getLogger(__name__)


def relax_off_saddles(
    session: Session,
    tolerance: float | None = None,
    *,
    near: bool = False,
    stopped: bool = True,
    ensemble: Ensemble | None = None,
) -> Relaxed:
    """Relax the packing in a session, to a minimum and not to a saddle; arguments as in `relax_session`. `stopped`:
    accept a state in which rattlers block all sliding droplets, if no other is found. `ensemble`: default from the
    packing."""
    relax_state = ensemble or minimizer(session.packing().ensemble)
    found = relax_state(session, tolerance, near=near)

    def again() -> Relaxed:
        return relax_state(session, tolerance, near=True)

    packing = session.packing()
    left = leave_saddles(session, found, again)
    return stopped_beside(session, packing, found, again) if stopped and not left.converged else left


def stopped_beside(session: Session, packing: Packing, found: Relaxed, relax_again: Callable[[], Relaxed]) -> Relaxed:
    """The state beside a saddle in which rattlers stop all that slides. A stop pushes back, so that another slide along
    the mode leads to its other end: the first end is asked first. A rattler that gives way sets droplets free that had
    been stopped: in the end they slide until rattlers stop all of them."""
    for returns in (0, SLIDES.returns, SLIDES.most):
        session.load(packing)
        left = leave_saddles(session, found, relax_again, returns=returns, stopped=True)
        if left.converged:
            break
    return left


def leave_saddles(
    session: Session,
    found: Relaxed,
    relax_again: Callable[[], Relaxed],
    *,
    returns: int = SLIDES.returns,
    stopped: bool = False,
) -> Relaxed:
    """The minimum beside a state that a session was relaxed to, which does not count as converged where none is found.
    `relax_again`: of what lies near a minimum; `stopped`: a state that `rests_on_rattlers` counts in the end;
    `returns`: of a mode until it is given up; with `SLIDES.most` none is, and such a state counts once it is met."""
    tried = np.zeros((0, session.packing().positions.size))
    for _ in range(SLIDES.most):
        packing = session.packing()
        if not found.converged:
            return found
        if (unstable := unstable_directions(packing)) is None:
            return replace(found, off_saddles=True)
        modes = unstable[0].reshape(len(unstable[0]), -1)
        modes = modes / np.linalg.norm(modes, axis=1, keepdims=True)
        fresh = (np.abs(modes @ tried.T) > SLIDES.alike).sum(axis=1) <= returns
        if not fresh.any() or (returns == SLIDES.most and rests_on_rattlers(session)):
            break  # what stops them is taken out of the Hessian, rattlers
        tried = np.vstack([tried, modes[fresh]])
        for direction in unstable[0][fresh]:
            session.detours["slides along modes that give way"] += 1
            session.set_positions(slid(session, session.packing(), direction, found.tolerance))
        state = session.evaluate()
        found = replace(found, evaluation=state) if state.max_force <= found.tolerance else relax_again()
    held = stopped and found.converged and rests_on_rattlers(session)
    return replace(found, converged=held, off_saddles=held, on_rattlers=held)


def record(session: Session, packing: Packing, found: Relaxed, **entries: Any) -> Packing:
    """Mark a packing as the minimum found, unless its Hessian has a negative eigenvalue: balanced forces alone may be
    those of a saddle.

    Args:
        session: in which it was found; the log tells of its factorisations, if they were many.
        packing: the state that the minimisation ended in.
        found: what it reached.
        entries: further entries of the provenance.

    Returns:
        The packing with `max_force`, `converged`, `force_tolerance` and `on_rattlers` set.
    """
    converged = found.converged
    if converged and not found.off_saddles:
        unstable = unstable_directions(packing)
        converged = unstable is None or unstable[1] >= 0
    ended = packing.with_state(
        max_force=found.evaluation.max_force,
        converged=converged,
        force_tolerance=found.tolerance,
        on_rattlers=found.on_rattlers,
        provenance=entries,
    )
    total = session.tally.pop("factorisations", 0)
    if total > SLIDES.few_factors:
        reasons = (f"{count} {reason}" for reason, count in session.tally.items() if count)
        _log.debug("%d factorisations: %s: %r", total, ", ".join(reasons), ended)
    session.tally.clear()
    session.detours.clear()
    return ended


def rests_on_rattlers(session: Session) -> bool:
    """Whether the state that a session holds is stopped along every mode that gives way, all of which are known.

    A droplet squeezed between two others slides until it touches a rattler, or until a vertex passes the end of a flat.
    Either stops it with hardly any force, and the Hessian, which leaves rattlers out and knows no distance, sees a
    saddle for ever. The rattler is held fixed here. The way back is uphill, by less than rounding on a level flat.
    """
    packing = session.packing()
    if (unstable := unstable_directions(packing)) is not None and unstable[2] > len(unstable[0]):
        unstable = unstable_directions(packing, unstable[2])
    if unstable is None or unstable[2] > len(unstable[0]):
        return False  # or modes that give way are not known
    probe, pushes = SLIDES.probe * mean_size(packing), []
    for direction in unstable[0]:
        unit = direction / np.linalg.norm(direction)
        moved = [session.forces_at(packing.positions + step * unit)[1] for step in (-probe, probe)]
        pushes.append([np.vdot(moved[0], unit), -np.vdot(moved[1], unit)])
    session.set_positions(packing.positions)
    return bool(np.max(pushes, axis=1).min() > SLIDES.pushed and np.min(pushes) > -SLIDES.pushed)


def slid(session: Session, packing: Packing, direction: Array, tolerance: float) -> Array:
    """Positions downhill along a mode, where it goes uphill again: at the next contact, which is left to push back with
    a part of the tolerance on forces, so that it counts. Droplets turn and shift as they do in the mode."""
    least = min(SLIDES.held * load(packing, session.evaluate()) * mean_size(packing), SLIDES.pressed * tolerance)
    if np.vdot(session.forces_at(packing.positions)[1], direction) < 0:
        direction = -direction
    path = _path(packing, direction)

    def uphill(length: float) -> float:
        positions, along = path(length)
        return float(-np.vdot(session.forces_at(positions)[1], along) / np.linalg.norm(along) - least)

    reached, length = 0.0, SLIDES.nearest
    while uphill(length) <= 0 and length < SLIDES.longest:
        reached, length = length, 2 * length
    for _ in range(SLIDES.bisections):  # SciPy's takes half a second to load
        middle = 0.5 * (reached + length)
        reached, length = (reached, middle) if uphill(middle) > 0 else (middle, length)
    return path(length)[0]


def _path(packing: Packing, mode: Array) -> Callable[[float], tuple[Array, Array]]:
    """Positions, and their derivatives, along a mode, in which each particle shifts, turns and changes its shape."""
    particle = packing.particle
    counts = np.bincount(particle)

    def centred(sites: Array) -> tuple[Array, Array]:
        z = sites @ [1, 1j]
        mean = ((np.bincount(particle, z.real) + 1j * np.bincount(particle, z.imag)) / counts)[particle]
        return mean, z - mean

    (centre, arm), (shift, change) = centred(packing.positions), centred(mode)
    inertia = np.bincount(particle, np.abs(arm) ** 2)
    turn = np.bincount(particle, (arm.conj() * change).imag) / np.where(inertia > 0, inertia, 1.0)
    spin = 1j * turn[particle]
    change = change - spin * arm

    def at(length: float) -> tuple[Array, Array]:
        turned = np.exp(spin * length)
        shape = arm + length * change
        return _plane(centre + length * shift + shape * turned), _plane(shift + (spin * shape + change) * turned)

    return at


def _plane(z: Array) -> Array:
    return np.column_stack([z.real, z.imag])
