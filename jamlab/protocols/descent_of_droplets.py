"""First-order steps of droplets: vertices slide along flats almost freely, so first-order methods are slow.

L-BFGS on LAMMPS forces, preconditioned by the analytic Hessian, goes all the way; FIRE and Newton steps help where it
stalls.
"""

from dataclasses import astuple, dataclass, replace

from jamlab.arrays import Array
from jamlab.engine.evaluation import Evaluation
from jamlab.engine.session import Session
from jamlab.errors import EngineError
from jamlab.protocols.descent import Effort, entangled
from jamlab.protocols.newton import NEWTON, descend_by_newton
from jamlab.protocols.preconditioned_lbfgs import FAR, NEAR, LbfgsSettings


@dataclass(frozen=True)
class DropletSteps:
    """First-order steps of droplets."""

    settle: int = 1500  # of L-BFGS when it only matters whether droplets jam
    many: int = 512  # from here on gaps that a step will close are in the Hessian of onsets
    fire: int = 300  # between two rounds: away from where the last one stalled


DROPLET_STEPS = DropletSteps()

# of `jamlab/descend` in the tally of a session
_COUNTS = (
    *("factorisations", "Hessians of L-BFGS", "not positive definite"),
    *("searches that found no lower energy", "steps along which the force did not fall"),
)
LOOSE_FORCE = 2e-5  # below, forces cannot bring a packing to jam that has no contacts


class DescentOfDroplets:
    """By preconditioned L-BFGS, "lbfgs"."""

    def name(self, session: Session) -> str:
        return "lbfgs"

    def settle(self, session: Session, tolerance: float, loose: float) -> Evaluation:
        least = loose * session.size
        state = descend_droplets(session, tolerance, FAR, DROPLET_STEPS.settle, loose=least)
        if state.max_force > tolerance and not _loose(session, state.max_force, least):
            state = descend_by_newton(session, tolerance)
        return state

    def descend(self, session: Session, tolerance: float, round_: int, effort: Effort) -> Evaluation:
        if round_:
            descend_by_fire(session, tolerance)
        return descend_droplets(session, tolerance, FAR, effort.far, many=effort.many)

    def end(self, session: Session, tolerance: float, effort: Effort) -> Evaluation:
        return descend_droplets(session, tolerance, NEAR, effort.near)


def descend_by_fire(session: Session, tolerance: float) -> None:
    """FIRE over droplets; back to the start if one folded over itself or flew apart, where LAMMPS stops."""
    before = session.packing()
    try:
        session.minimize(tolerance, minimizer="fire", steps=DROPLET_STEPS.fire)
    except EngineError:  # lost atoms, or an edge of many times its length: what is built anew has neither
        session.load(before, anew=True)
    undo_if_folded(session, before.positions)


def descend_droplets(
    session: Session,
    target: float,
    numbers: LbfgsSettings,
    steps: int,
    *,
    loose: float = 0.0,
    many: int = DROPLET_STEPS.many,
) -> Evaluation:
    """L-BFGS on a shifted Hessian, `jamlab/descend`, down to a largest force of `target`, or until less contact energy
    is left than `loose`; back to the start if outlines crossed on the way."""
    start, first_shift = session.positions(), numbers.least_shift
    if session.last_descent is not None and numbers.shift:
        first_shift = session.last_descent.shift
    if session.n < many:
        numbers = replace(numbers, closing=0.0)
    found = session.descend([target, steps, LOOSE_FORCE, loose, *astuple(numbers), first_shift, NEWTON.definite])
    counts = (found.factors, found.factors - found.refused, found.refused, found.stuck, found.bent)
    session.tally.update(dict(zip(_COUNTS, map(int, counts), strict=True)))
    if found.crossed or entangled(session):
        session.set_positions(start)
    return session.evaluate()


def _loose(session: Session, largest_force: float, contact_energy: float) -> bool:
    """Whether contacts are gone, and forces too small to press droplets together again that have just lost touch."""
    return largest_force < LOOSE_FORCE and abs(session.contact_energy()) < contact_energy


def undo_if_folded(session: Session, before: Array) -> None:
    """Go back to positions in which no polygon has folded over itself: from there no minimum is one of a packing."""
    if len(session.self_crossings()):
        session.set_positions(before)
