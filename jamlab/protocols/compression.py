"""Sweeps: states at a list of packing fractions, up or down from a packing, each at an energy minimum."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from jamlab.arguments.choices import By
from jamlab.arrays import Array
from jamlab.checks import check_number, checked
from jamlab.engine.deck_defaults import defaults
from jamlab.engine.ranks import check_ranks
from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError, InputError, named
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.mechanics.elasticity import linear_response
from jamlab.mechanics.predicted_motion import follow
from jamlab.mechanics.stiffness import pressure, stress
from jamlab.packing.area_change import compression
from jamlab.packing.deformation import at_phi
from jamlab.packing.natural_units import in_natural_units
from jamlab.packing.packing import Packing
from jamlab.packing.recipe import made_by, recipe_of
from jamlab.processes.progress import Progress, told
from jamlab.protocols.box_relaxation import minimizer
from jamlab.protocols.dear_states import Costs, name_detours
from jamlab.protocols.makings import making_of
from jamlab.protocols.minimising import minimising_of
from jamlab.protocols.relaxation import Relaxed, usual_force_tolerance
from jamlab.protocols.saddles import leave_saddles, record, relax_off_saddles, stopped_beside


@dataclass(frozen=True)
class SweepSteps:
    """How a compression goes from state to state."""

    halvings: int = 4  # of a step that does not end in a minimum, at most
    secant_steps: int = 15  # at most, to a true packing fraction
    met: float = 0.01  # distance from a state's packing fraction over that to the state before
    met_last: float = 1e-6  # distance of the last state from its packing fraction
    least_slope: float = 0.1  # of rho against phi for a secant; below, the packing has jumped to another minimum
    shortest: float = 1e-7  # step in phi, when following a minimum
    loose: float = 1e3  # pressure over force tolerance below which a pressure is not worth predicting
    easy: float = 0.3  # part of the error allowed below which the next step may be twice as long


SWEEP = SweepSteps()

_SLOPE = "slope"  # entry of provenance: of the true against the nominal packing fraction, by which a sweep goes on


def fraction_by(packing: Packing, by: By) -> float:
    """The packing fraction of a packing: "rho", the true one, or "phi"."""
    return packing_fraction(packing) if by == "rho" else packing.phi


MOST_STATES = 1_000_000  # of a sweep: weeks of computing for any packing


@checked
def compress(
    packing: Packing,
    to: float,
    step: float = 1e-3,
    *,
    by: By = "rho",
    first_step: float | None = None,
    per_decade: int | None = None,
    pressure_tolerance: float | None = None,
    force_tolerance: float | None = None,
    ranks: int = 1,
    progress: Progress | None = None,
) -> Iterator[Packing]:
    """Compress or decompress a packing in steps, with an energy minimum after each.

    The ensemble of the packing, fixed box or shear-stabilized, is kept. Between walls the height of the box changes, at
    constant width; fixed particles move with the box and are not squeezed.

    Args:
        packing: initial packing, usually from `jam`.
        to: last packing fraction, reached to 1e-6.
        step: difference in packing fraction between two states, met to 1 %.
        by: "rho", the true packing fraction (`packing_fraction(p)`), or "phi", the nominal one.
        first_step: distance of the first state from the start. Steps then grow, with `per_decade` states per decade of
            distance, up to `step`. Default: all steps equal `step`.
        per_decade: see `first_step`; default `per_decade` of `sweep.parameters`.
        pressure_tolerance: follow the energy minimum in sub-steps so short that linear response predicts every pressure
            to this relative error. Default: one step per state, which may end in a different minimum. A small packing
            may unjam at an instability even when compressed.
        force_tolerance: largest residual force in natural units (`jamlab.packing.natural_units`), 1e-15 to 1e-3.
            Default: 1e-12 for disks, 1e-10 for droplets.
        ranks: SP: threads of FIRE on one machine; useful above 10 000 disks.
        progress: called after each state with (fraction done, text); True: print it.

    Yields:
        One Packing per state. A step that does not converge is repeated in up to 16 smaller steps. If it still does not
        converge, the state has `converged` False and the sweep ends; if rattlers block a sliding droplet, it has
        `on_rattlers`. A state that misses its packing fraction has `on_target` False. With `pressure_tolerance`,
        `provenance["pressure_error"]` is the largest relative error of a predicted pressure since the previous state.
        `provenance["minimizer_steps"]` counts the steps of minimizers, each with one force evaluation, or a few of
        "cg"; `provenance["detours"]` names what a state took beside one minimisation, such as slides along modes that
        give way.

    Raises:
        InputError: an argument is out of range.
        ConvergenceError: a state before the last one did not converge.

    Example:
        >>> onset = jamlab.jam(n=16, seed=1)
        >>> sweep = [onset, *jamlab.compress(onset, to=0.9, step=0.02)]
        >>> [round(jamlab.packing_fraction(p), 3) for p in sweep[-2:]], all(p.converged for p in sweep)
        ([0.881, 0.9], True)
    """
    how: dict[str, Any] = {"by": by, "first_step": first_step, "per_decade": per_decade, "ranks": ranks}
    how |= {"pressure_tolerance": pressure_tolerance, "force_tolerance": force_tolerance, "progress": progress}
    return go_on(packing, packing, 0, to, step, repeatable=False, **how)


def go_on(
    last: Packing,
    start: Packing,
    done: int,
    to: float,
    step: float,
    *,
    by: By = "rho",
    first_step: float | None = None,
    per_decade: int | None = None,
    pressure_tolerance: float | None = None,
    force_tolerance: float | None = None,
    ranks: int = 1,
    progress: Progress | None = None,
    repeatable: bool = True,
) -> Iterator[Packing]:
    """The states of a sweep that are left.

    Args:
        last: its last state.
        start: packing from which it started.
        done: number of states after the start. Other arguments as in `compress`.
        repeatable: put particles in order before each state, so that states are the same to the last bit wherever the
            sweep was stopped. Without it they depend on what LAMMPS did before, by rounding.
    """
    how: dict[str, Any] = {"by": by, "first_step": first_step, "per_decade": per_decade, "ranks": ranks}
    how |= {"pressure_tolerance": pressure_tolerance, "force_tolerance": force_tolerance, "repeatable": repeatable}
    states = _states(last, start, done, to, step, progress=progress, **how)
    return _with_recipes(states, start, done, {"to": to, "step": step, **how})


def _with_recipes(states: Iterator[Packing], start: Packing, done: int, how: dict[str, Any]) -> Iterator[Packing]:
    how |= {"repeatable": how["repeatable"] or None}
    recipe = recipe_of(start)
    for state, packing in enumerate(states, done + 1):
        number = -1 if packing.provenance["target"] == how["to"] else state
        yield made_by(packing, None if recipe is None else recipe.then("compress", **how, state=number))


@in_natural_units()
def _states(
    last: Packing,
    start: Packing,
    done: int,
    to: float,
    step: float,
    *,
    by: By,
    first_step: float | None,
    per_decade: int | None,
    pressure_tolerance: float | None,
    force_tolerance: float | None,
    ranks: int,
    progress: Progress | None,
    repeatable: bool,
) -> Iterator[Packing]:
    """`go_on` in natural units, without recipes."""
    if by == "rho":
        check_number("to", to, 1.0)
    if first_step is not None:
        check_number("first_step", first_step, step)
    if per_decade is not None and first_step is None:
        raise InputError(
            f"{named('per_decade', per_decade)}: it spaces the states after first_step; give first_step too"
        )
    check_ranks(ranks, start.kind)
    targets = grid(fraction_by(start, by), to, step, first_step, per_decade)
    force = usual_force_tolerance(start.model) if force_tolerance is None else force_tolerance
    if done >= len(targets):
        return iter(())
    if done and last.converged is False:
        raise ConvergenceError(f"the state at {by} = {fraction_by(last, by):.6g} is no minimum, the sweep ends there")
    return _sweep(last, start, targets, done, by, pressure_tolerance, force, ranks, progress, repeatable)


def grid(start: float, to: float, step: float, nearest: float | None = None, per_decade: int | None = None) -> Array:
    """Packing fractions of a sweep, without the start: log-spaced from `nearest` on, linear beyond, see `compress`."""
    way = abs(to - start)
    if way > MOST_STATES * step:
        raise InputError(
            f"{named('step', step, 'g')}: {way / step:.1g} states up to {to:g}; use {way / MOST_STATES:.1g} or more"
        )
    distances: Array = np.empty(0)
    if nearest is not None:
        growth = 10 ** (1 / (per_decade or int(defaults("sweep")["per_decade"])))
        count = 1 + int(np.ceil(np.log(step / ((growth - 1) * nearest)) / np.log(growth)))
        distances = np.asarray(nearest * growth ** np.arange(max(1, count)))
    last = distances[-1] if len(distances) else 0.0
    count = max(0, int(np.ceil((way - last) / step - 1e-9)))
    distances = np.concatenate([distances, last + step * np.arange(1, count + 1)])
    distances = distances[distances < way * (1 - 1e-9)]
    return np.asarray([*(start + np.sign(to - start) * distances), to])


def _sweep(
    packing: Packing,
    first: Packing,
    targets: Array,
    done: int,
    by: By,
    error: float | None,
    force: float,
    ranks: int,
    progress: Progress | None,
    repeatable: bool,
) -> Iterator[Packing]:
    making = making_of(packing.model)
    start, before = fraction_by(first, by), fraction_by(packing, by)
    with Session(packing, ranks=ranks) as session:
        slope, costs = packing.provenance.get(_SLOPE, 1.0) if done else 1.0, Costs()
        sweep = _Sweep(session, packing, by, error, force, slope)
        for target in targets[done:]:
            if repeatable:
                session.load(sweep.last, alike=True)
                session.last_descent = None
            began, steps, stride = time.perf_counter(), session.steps(), abs(target - before)
            tolerance = min(SWEEP.met * stride, SWEEP.met_last if target == targets[-1] else 1.0)
            found, off = sweep.go_to(target, tolerance)
            packing = session.packing()
            before = fraction_by(packing, by)
            taken, detours = session.steps() - steps, name_detours(session.detours)
            costs.add(taken, f"{by} = {before:.6g}: {detours or 'one minimisation'}")
            packing = record(
                session,
                packing,
                found,
                by=by,
                compression_version=making.compression_version,
                target=float(target),
                minimizer=making.descent.name(session),
                wall_time=time.perf_counter() - began,
                minimizer_steps=taken,
                detours=detours,
                **({} if error is None else {"pressure_error": off}),
                **{_SLOPE: sweep.slope},
            )._trusted(on_target=bool(abs(before - target) <= tolerance))
            sweep.last = packing
            if progress is not None:  # states far above onset take less time than those near it
                part = 1.0 if target == targets[-1] else min(0.999, abs((before - start) / (targets[-1] - start)))
                told(progress)(float(np.sqrt(part)), f"compress {before:.4f}")
            yield packing
            if not found.converged and target != targets[-1]:
                raise ConvergenceError(
                    f"the state at {by} = {before:.6g} is no minimum, the sweep ends there: {_why_none(found, stride)}"
                )


def _why_none(found: Relaxed, stride: float) -> str:
    force, tolerance = found.evaluation.max_force, found.tolerance
    if force > tolerance:
        return f"its largest force is {force:.2g}, not {tolerance:.2g}; take steps well below {stride:.2g}"
    return "its forces balance, but it is a saddle, and no minimum was found beside it; use another seed"


@dataclass
class _Sweep:
    """The way from one state of a sweep to the next, in the session that holds its packing."""

    session: Session
    last: Packing  # state
    by: By
    error: float | None  # of pressures that linear response predicts; None: each state in one step
    force: float
    slope: float = 1.0  # of the packing fraction against the nominal one

    def go_to(self, target: float, tolerance: float) -> tuple[Relaxed, float]:
        """Go to a packing fraction, which answers to the nominal one almost linearly: one or two secant steps. What the
        last minimisation reached, and the largest relative error of a pressure that was predicted."""
        value, step_error = fraction_by(self.last, self.by), 0.0
        known = self.last.phi, value  # of the last state at rest: a rough one tells little of the slope beside it
        for trial in range(SWEEP.secant_steps):
            phi = self.last.phi + (target - value) / self.slope
            if self.error is None:
                found = self._reach(phi, None if trial else target)
                rests = found.tolerance <= self.force
                if rests and found.converged and abs(self._reached() - target) <= tolerance:
                    found = self._settle(found)
            else:
                found, missed = self._follow(phi, self.error)
                step_error, rests = max(step_error, missed), True
            reached, state = self._reached(), self.session.packing()
            if rests and (abs(reached - target) <= tolerance or not found.converged):
                break
            if state.phi != known[0]:
                slope = (reached - known[1]) / (state.phi - known[0])
                self.slope = slope if slope > SWEEP.least_slope else self.slope
            self.last, value = state, reached
            known = (state.phi, value) if rests else known
        return found, step_error

    def _reached(self) -> float:
        return fraction_by(self.session.packing(), self.by)

    def _reach(self, phi: float, target: float | None) -> Relaxed:
        """Relax the last state at phi, maybe to a saddle; where that ends in no balance of forces, by steps.

        Args:
            phi: nominal packing fraction.
            target: packing fraction; where it is missed, which shows long before forces balance, the state is left
                at the larger `tolerance` of what is returned. None: relax to the end in any case.
        """
        self.session.load(at_phi(self.last, phi))
        relax_state, rough = minimizer(self.last.ensemble), minimising_of(self.last.model).rough
        if rough is not None and target is not None and self.by == "rho":
            found = relax_state(self.session, max(self.force, rough * self.session.evaluate().max_force))
            missed = abs(self._reached() - target) > SWEEP.met * abs(target - fraction_by(self.last, self.by))
            if missed and found.converged:
                return found
        found = relax_state(self.session, self.force)
        return found if found.converged else self._reach_by_steps(phi)

    def _settle(self, found: Relaxed) -> Relaxed:
        """The minimum beside a state that the session was relaxed to; where there is none, a state in which rattlers
        stop all that slides; if that fails too, what steps lead to, each of which may cost as much."""
        relax_state, packing = minimizer(self.last.ensemble), self.session.packing()
        again = partial(relax_state, self.session, self.force, near=True)
        left = leave_saddles(self.session, found, again)
        if not left.converged:
            left = stopped_beside(self.session, packing, found, again)
        return left if left.converged else self._reach_by_steps(packing.phi)

    def _reach_by_steps(self, phi: float) -> Relaxed:
        """Go to phi from the last state by 2 steps, then 4, and so on, until one way ends in a minimum, or the last in
        a state in which rattlers stop all that slides. Vertices run together, or outlines cross, where droplets are
        squeezed by too much at once."""
        for halving in range(1, SWEEP.halvings + 1):
            state, last_way = self.last, halving == SWEEP.halvings
            self.session.detours[f"way by {2**halving} steps"] += 1
            for following in np.linspace(state.phi, phi, 2**halving + 1)[1:]:
                self.session.load(at_phi(state, following))
                found = relax_off_saddles(self.session, self.force, stopped=last_way)
                if not found.converged:
                    break
                state = self.session.packing()
            if found.converged:
                break
        return found

    def _follow(self, phi: float, error: float) -> tuple[Relaxed, float]:
        """Go to phi by steps in which linear response predicts the pressure to a relative error; also returns that."""
        packing, largest, length = self.last, 0.0, abs(phi - self.last.phi)
        while True:
            length = min(length, abs(phi - packing.phi))
            following = packing.phi + np.sign(phi - packing.phi) * length
            predicted = _predict_pressure(packing, following)
            self.session.load(follow(packing, following))
            found = relax_off_saddles(self.session, self.force, near=True)
            met = found.evaluation.pressure
            missed = abs(met - predicted) / max(abs(met), abs(predicted), SWEEP.loose * self.force)
            if (missed > error or not found.converged) and length > SWEEP.shortest:
                length *= 0.5
                continue
            largest = max(largest, missed)
            packing = self.session.packing()
            if abs(packing.phi - phi) <= 1e-12:
                return found, largest
            length *= 2.0 if missed < SWEEP.easy * error else 1.0


def _predict_pressure(packing: Packing, phi: float) -> float:
    now = pressure(packing)
    try:
        modulus = compression(packing).modulus(linear_response(packing).relaxed, stress(packing))
    except ConvergenceError:  # not jammed: no response
        return now
    return float(now + modulus * np.log(phi / packing.phi))
