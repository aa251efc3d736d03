"""First-order steps that bring a packing near its minimum, and those to its end: what every descent says.

Disks, and whatever LAMMPS minimises well: few sites take conjugate gradients in LAMMPS, which reach 1e-12 by
themselves, and FIRE and Newton steps help where they stall; more disks take compiled FIRE, which costs half of that,
and Newton steps end it.
"""

from dataclasses import dataclass
from typing import Any, Protocol

from jamlab.engine.disk_fire import fire_numbers
from jamlab.engine.evaluation import Evaluation
from jamlab.engine.session import Session
from jamlab.errors import InputError
from jamlab.mechanics.force_network import force_scale
from jamlab.packing.box_strains import BoxStrains
from jamlab.packing.natural_units import mean_size
from jamlab.packing.packing import Packing
from jamlab.protocols.newton import descend_by_newton
from jamlab.protocols.preconditioned_lbfgs import descend_by_lbfgs


@dataclass(frozen=True)
class Quench:
    """First-order steps of disks, and where Newton steps take over."""

    # from here on FIRE descends almost to the end: local events keep the one step length of any other method
    # short. An onset of 96 disks costs the same by either, of 256 and 512 two to three times less by FIRE;
    # states of a sweep cost 1.5 times more at 96, and 1.2 less at 256
    many_disks: int = 200
    cg_steps: int = 20_000  # or of FIRE beside them, in one call at most
    stages: int = 12  # of a quench at most
    # Newton steps of disks at most, from a guess near the minimum; beyond, first-order steps bring disks nearer
    # for less. Halved or doubled: 11 % more force evaluations, or 22 % more factorisations
    near_steps: int = 40
    # largest force over pressure at which Newton steps take over; started earlier they stall
    newton_noise: float = 1e-7
    # a stage whose pressure falls by less than this factor was stopped by its steps, not by a new target
    jump: float = 0.5
    close: float = 1.05  # with a free box, a stage that starts with its target times this or less aims lower by as much
    fire_stretch: int = 3000  # FIRE steps after which it starts anew
    # contacts, over the strength of the law: FIRE steps do not grow where stiffening disks are softer
    softest: float = 1e-3


QUENCH = Quench()


@dataclass(frozen=True)
class Effort:
    """How far a minimisation goes at most; the defaults lie on plateaus."""

    near: int = 400  # steps of L-BFGS beside a minimum of droplets
    far: int = 5000  # the same from elsewhere
    rounds: int = 3  # starts with first-order steps; another follows when Newton steps leave their minimum
    box: int = 60  # steps of the box around droplets
    # droplets from which on gaps that a step will close are in the Hessian: with 1024, 5000 steps do not reach a
    # minimum without. A sweep of 256 takes .90 to .99 times the CPU; of 64 the states up to rho = 0.855 take .73 times
    # that of descents (7 starts), denser ones the same
    many: int = 1


USUAL = Effort()


class Descent(Protocol):
    """Steps of a kind of particles: first-order ones, which bring a packing near its minimum, and those to its end."""

    def name(self, session: Session) -> str: ...  # of the method
    def settle(self, session: Session, tolerance: float, loose: float) -> Evaluation: ...
    def descend(self, session: Session, tolerance: float, round_: int, effort: Effort) -> Evaluation: ...
    def end(self, session: Session, tolerance: float, effort: Effort) -> Evaluation: ...


class DescentOfDisks:
    """By "cg", or "fire" of many disks: CG converges slowly where weak contacts are soft."""

    def name(self, session: Session) -> str:
        return "fire" if session.size >= QUENCH.many_disks or not session.law.springs else "cg"

    def settle(self, session: Session, tolerance: float, loose: float) -> Evaluation:
        return self.descend(session, tolerance, 0, USUAL)

    def descend(self, session: Session, tolerance: float, round_: int, effort: Effort) -> Evaluation:
        if round_ == 1:  # a curved valley, in which Newton and first-order steps converge slowly
            return descend_by_lbfgs(session, tolerance, effort.far)
        if self.name(session) == "fire":
            noise = QUENCH.newton_noise * 0.1**round_
            return quench(session, noise, floor=tolerance / noise)
        return session.minimize(tolerance, minimizer="cg" if round_ % 2 == 0 else "fire", steps=QUENCH.cg_steps)

    def end(self, session: Session, tolerance: float, effort: Effort) -> Evaluation:
        return descend_by_newton(session, tolerance, QUENCH.near_steps)


class DescentOfBonds(DescentOfDisks):
    """By L-BFGS with a factorised Hessian, which stiff bonds do not slow down; steps of FIRE would be too long."""

    def name(self, session: Session) -> str:
        return "lbfgs"

    def descend(self, session: Session, tolerance: float, round_: int, effort: Effort) -> Evaluation:
        if round_ % 2 == 0:
            return descend_by_lbfgs(session, tolerance, effort.far)
        return session.minimize(tolerance, minimizer="cg", steps=QUENCH.cg_steps)


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
    for _ in range(QUENCH.stages):  # the pressure, and with it the target, falls on the way
        before = load(session, state)
        target = noise * max(before, floor)
        left = max(state.max_force, 0.0 if box_strains is None else box_strains.excess(state.stress))
        if left <= target:
            break
        if box_strains is not None and left <= QUENCH.close * target:  # a stage that ended there sums in another order
            target /= QUENCH.close
        # in the time of contacts that are soft, as those of disks are that stiffen with their overlap
        slower = max(1.0, max(session.law.stiffness_at(state.pressure), QUENCH.softest) ** -0.5)
        how: dict[str, Any] = {"minimizer": "fire", "steps": steps, "stretch": QUENCH.fire_stretch}
        try:
            state = session.minimize(
                target, **how, box_strains=box_strains, fire=fire_numbers(lively=lively, slower=slower)
            )
        except InputError:  # the kernel does not take the law, or so small a box: LAMMPS does, at a box that keeps
            state = session.minimize(target, **how)
        if state.max_force > target and load(session, state) > QUENCH.jump * before:
            break
    return state


def entangled(session: Session) -> bool:
    """Whether polygons have come through each other's outline, where the contact energy pulls instead of pushing, or
    through their own, or disks through a wall."""
    try:
        packing = session.packing()
        if packing.kind.has_outlines or packing.frame.has_walls:
            packing.kind.check_apart(packing)
    except InputError:
        return True
    return False
