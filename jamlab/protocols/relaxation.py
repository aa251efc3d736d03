"""Relax a packing to a minimum of its potential energy: first-order steps into the basin, Newton steps to the bottom.

SP: few disks take conjugate gradients in LAMMPS, which reach 1e-12 by themselves, and FIRE and Newton help where they
stall; more disks take compiled FIRE, which costs half of that, and Newton ends it. DP: vertices slide along flats
almost freely, so first-order methods crawl. L-BFGS on LAMMPS forces, preconditioned by the analytic Hessian, goes all
the way; FIRE and Newton steps help where it stalls.
"""

from dataclasses import astuple, dataclass, replace
from typing import Any, Protocol

from jamlab.arrays import Array
from jamlab.checks import check_number
from jamlab.engine.deck_defaults import defaults
from jamlab.engine.disk_fire import fire_numbers
from jamlab.engine.evaluation import Evaluation
from jamlab.engine.session import Session
from jamlab.errors import EngineError, InputError
from jamlab.mechanics.force_network import force_scale
from jamlab.packing.box_strains import BoxStrains
from jamlab.packing.natural_units import mean_size
from jamlab.packing.packing import Packing
from jamlab.protocols.newton import DEFINITE, descend_by_newton
from jamlab.protocols.preconditioned_lbfgs import FAR, NEAR, LbfgsSettings, descend_by_lbfgs

QUENCH_PROTOCOL = 1  # version, see jamlab.campaign.tasks

LEAST_TOLERANCE = 1e-15  # forces of order 1 hold no smaller differences
# from here on FIRE descends almost to the end: local events keep the one step length of any other method short. An
# onset of 96 disks costs the same by either, of 256 and 512 two to three times less by FIRE; states of a sweep cost 1.5
# times more at 96, and 1.2 less at 256
MANY_DISKS = 200
_CG_STEPS = 20_000  # or of FIRE beside them, in one call at most
_SETTLE_STEPS = 1500  # of L-BFGS when it only matters whether droplets jam
_STAGES = 12  # of a quench at most
# Newton steps of disks at most, from a guess near the minimum; beyond, first-order steps bring disks nearer for less.
# Halved or doubled: 11 % more force evaluations, or 22 % more factorisations
_NEAR_STEPS = 40
MANY_DROPLETS = 512  # from here on gaps that a step will close are in the Hessian of onsets
_NEWTON_NOISE = 1e-7  # largest force over pressure at which Newton steps take over; started earlier they stall
_JUMP = 0.5  # a stage whose pressure falls by less than this factor was stopped by its steps, not by a new target
_CLOSE = 1.05  # with a free box, a stage that starts with its target times this or less aims lower by as much
_FIRE_STRETCH = 3000  # FIRE steps after which it starts anew
_FIRE_STEPS_DROPLETS = 300  # between two rounds: away from where the last one stalled
_SOFTEST = 1e-3  # contacts, over the strength of the law: FIRE steps do not grow where stiffening disks are softer
# of `jamlab/descend` in the tally of a session
_COUNTS = (
    *("factorisations", "Hessians of L-BFGS", "not positive definite"),
    *("searches that found no lower energy", "steps along which the force did not fall"),
)
LOOSE_FORCE = 2e-5  # of droplets: below, forces cannot bring a packing to jam that has no contacts


@dataclass(frozen=True)
class Relaxed:
    """A state after minimisation."""

    evaluation: Evaluation  # LAMMPS energies, forces and stress there
    tolerance: float  # asked for, on the largest force
    converged: bool  # whether the largest force is below the tolerance
    off_saddles: bool = False  # whether it is known to be no saddle, or to be held by what its Hessian leaves out
    on_rattlers: bool = False  # whether it is the latter


@dataclass(frozen=True)
class Effort:
    """How far a minimisation goes at most; the defaults lie on plateaus."""

    near: int = 400  # steps of L-BFGS beside a minimum of droplets
    far: int = 5000  # the same from elsewhere
    rounds: int = 3  # starts with first-order steps; another follows when Newton steps leave their basin
    box: int = 60  # steps of the box around droplets
    # droplets from which on gaps that a step will close are in the Hessian: with 1024, 5000 steps do not reach a
    # minimum without; a sweep of 256 takes .90 to .99 times the CPU, of 64 the same
    many: int = 256


USUAL = Effort()


def force_tolerance(model: str) -> float:
    """Largest force at a minimum by default, in natural units: `force` of `*.minimum.parameters`."""
    return float(defaults(f"{model}.minimum")["force"])


def check_tolerance(tolerance: float | None, highest: float) -> None:
    """Refuse a force tolerance that no minimisation can meet, or that leaves no digits of the result."""
    if tolerance is None:
        return
    check_number("tolerance", tolerance, highest)
    if tolerance < LEAST_TOLERANCE:
        raise InputError(f"tolerance = {tolerance:g}: rounding leaves larger forces, use {LEAST_TOLERANCE:g} or more")


def settle(session: Session, tolerance: float, *, loose: float = 0.0) -> Evaluation:
    """A bounded effort: enough to tell a jammed packing from a loose one, whose last digits cost most.

    Args:
        session: is left in the state reached.
        tolerance: on the largest force.
        loose: DP: give up a packing whose contact energy per vertex is below this when forces are nearly gone.
    """
    return descent_of(session).settle(session, tolerance, loose)


def relax(session: Session, tolerance: float | None = None, *, near: bool = False, effort: Effort = USUAL) -> Relaxed:
    """Minimise the energy of the packing in a session, at fixed box.

    Args:
        session: is left in the minimum.
        tolerance: on the largest force; default `force_tolerance` of the model.
        near: the state is a good guess of the minimum: try steps that converge fast there before anything else,
            Newton's, for droplets those of L-BFGS.
        effort: steps at most.

    Returns:
        The state reached; `converged` is False if no round met the tolerance.
    """
    if tolerance is None:
        tolerance = force_tolerance(session.kind.name)
    descent = descent_of(session)
    if near:
        state = descent.end(session, tolerance, effort)
        if state.max_force <= tolerance:
            return Relaxed(state, tolerance, True)
    for round_ in range(effort.rounds):
        state = descent.descend(session, tolerance, round_, effort)
        if state.max_force > tolerance:
            state = descend_by_newton(session, tolerance)
        if state.max_force <= tolerance:
            break
    return Relaxed(state, tolerance, state.max_force <= tolerance and not _entangled(session))


def descend_by_fire(session: Session, tolerance: float) -> None:
    """FIRE over droplets; back to the start if one folded over itself or flew apart, where LAMMPS stops."""
    before = session.packing()
    try:
        session.minimize(tolerance, style="fire", steps=_FIRE_STEPS_DROPLETS)
    except EngineError:  # lost atoms, or an edge of many times its length: what is built anew has neither
        session.load(before, anew=True)
    undo_if_folded(session, before.positions)


def _entangled(session: Session) -> bool:
    """Whether polygons have come through each other's outline, where the contact energy pulls instead of pushing, or
    disks through a wall."""
    packing = session.packing()
    if not (packing.kind.has_outlines or packing.frame.has_walls):
        return False
    try:
        packing.kind.points(packing)
    except InputError:
        return True
    return False


class Descent(Protocol):
    """Steps of a kind of particles: first-order ones, which bring a packing near its minimum, and those to its end."""

    def name(self, session: Session) -> str: ...  # of the method
    def settle(self, session: Session, tolerance: float, loose: float) -> Evaluation: ...
    def descend(self, session: Session, tolerance: float, round_: int, effort: Effort) -> Evaluation: ...
    def end(self, session: Session, tolerance: float, effort: Effort) -> Evaluation: ...


class DescentOfDisks:
    """By "cg", or "fire" of many disks: CG crawls where barely touching disks are soft."""

    def name(self, session: Session) -> str:
        return "fire" if session.size >= MANY_DISKS or not session.law.springs else "cg"

    def settle(self, session: Session, tolerance: float, loose: float) -> Evaluation:
        return self.descend(session, tolerance, 0, USUAL)

    def descend(self, session: Session, tolerance: float, round_: int, effort: Effort) -> Evaluation:
        if round_ == 1:  # a curved valley, along which Newton and first-order steps crawl
            return descend_by_lbfgs(session, tolerance, effort.far)
        if self.name(session) == "fire":
            noise = _NEWTON_NOISE * 0.1**round_
            return quench(session, noise, floor=tolerance / noise)
        return session.minimize(tolerance, style="cg" if round_ % 2 == 0 else "fire", steps=_CG_STEPS)

    def end(self, session: Session, tolerance: float, effort: Effort) -> Evaluation:
        return descend_by_newton(session, tolerance, _NEAR_STEPS)


class DescentOfDroplets:
    """By preconditioned L-BFGS, "lbfgs"."""

    def name(self, session: Session) -> str:
        return "lbfgs"

    def settle(self, session: Session, tolerance: float, loose: float) -> Evaluation:
        least = loose * session.size
        state = descend_droplets(session, tolerance, FAR, _SETTLE_STEPS, loose=least)
        if state.max_force > tolerance and not _loose(session, state.max_force, least):
            state = descend_by_newton(session, tolerance)
        return state

    def descend(self, session: Session, tolerance: float, round_: int, effort: Effort) -> Evaluation:
        if round_:
            descend_by_fire(session, tolerance)
        return descend_droplets(session, tolerance, FAR, effort.far, many=effort.many)

    def end(self, session: Session, tolerance: float, effort: Effort) -> Evaluation:
        return descend_droplets(session, tolerance, NEAR, effort.near)


_DESCENTS: dict[str, Descent] = {"disks": DescentOfDisks(), "droplets": DescentOfDroplets()}  # by `Model.particles`


def descent_of(session: Session) -> Descent:
    """First-order steps of the particles in a session."""
    return _DESCENTS[session.kind.particles]


def load(held: Packing | Session, state: Evaluation) -> float:
    """Mean contact force over the mean size, which forces that are left are small or large beside. Where contacts only
    push, the pressure stands for it, which a state tells by itself; where they pull as well, it may vanish."""
    if not held.law.range:
        return state.pressure
    packing = held.packing() if isinstance(held, Session) else held
    return force_scale(packing) / mean_size(packing)


def quench(
    session: Session,
    noise: float,
    *,
    floor: float,
    steps: int = 100_000,
    box_strains: BoxStrains | None = None,
    lively: bool = False,
) -> Evaluation:
    """FIRE steps down to forces of `noise` times the pressure: enough to know the pressure of disks.

    Args:
        session: SP; is left in the state reached.
        noise: largest force over pressure.
        floor: pressure below which a packing counts as loose, and need not be relaxed any further.
        steps: at most, in each of a few stages.
        box_strains: strains that the box may take, down to the same noise in their stress; by default none.
        lively: see `fire_numbers`.
    """
    state = session.evaluate()
    for _ in range(_STAGES):  # the pressure, and with it the target, falls on the way
        before = load(session, state)
        target = noise * max(before, floor)
        left = max(state.max_force, 0.0 if box_strains is None else box_strains.excess(state.stress))
        if left <= target:
            break
        if box_strains is not None and left <= _CLOSE * target:  # a stage that ended there sums in another order
            target /= _CLOSE
        # in the time of contacts that are soft, as those of disks are that stiffen with their overlap
        slower = max(1.0, max(session.law.stiffness_at(state.pressure), _SOFTEST) ** -0.5)
        how: dict[str, Any] = {"style": "fire", "steps": steps, "stretch": _FIRE_STRETCH}
        try:
            state = session.minimize(
                target, **how, box_strains=box_strains, fire=fire_numbers(lively=lively, slower=slower)
            )
        except InputError:  # the kernel does not take the law, or so small a box: LAMMPS does, at a box that keeps
            state = session.minimize(target, **how)
        if state.max_force > target and load(session, state) > _JUMP * before:
            break
    return state


def descend_droplets(
    session: Session,
    target: float,
    numbers: LbfgsSettings,
    steps: int,
    *,
    loose: float = 0.0,
    many: int = MANY_DROPLETS,
) -> Evaluation:
    """L-BFGS on a shifted Hessian, `jamlab/descend`, down to a largest force of `target`, or until less contact energy
    is left than `loose`; back to the start if outlines crossed on the way."""
    start, first_shift = session.positions(), numbers.least_shift
    if session.last_descent is not None and numbers.shift:
        first_shift = session.last_descent.shift
    if session.packing().n < many:
        numbers = replace(numbers, closing=0.0)
    found = session.descend([target, steps, LOOSE_FORCE, loose, *astuple(numbers), first_shift, DEFINITE])
    counts = (found.factors, found.factors - found.refused, found.refused, found.stuck, found.bent)
    session.tally.update(dict(zip(_COUNTS, map(int, counts), strict=True)))
    if found.crossed or _entangled(session):
        session.set_positions(start)
    return session.evaluate()


def _loose(session: Session, largest_force: float, contact_energy: float) -> bool:
    """Whether contacts are gone, and forces too small to press droplets together again that have just lost touch."""
    return largest_force < LOOSE_FORCE and session.contact_energy() < contact_energy


def undo_if_folded(session: Session, before: Array) -> None:
    """Go back to positions in which no polygon has folded over itself: from there no minimum is one of a packing."""
    if len(session.self_crossings()):
        session.set_positions(before)
