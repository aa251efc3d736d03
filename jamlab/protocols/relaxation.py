"""Relax a packing to a minimum of its potential energy: first-order steps, then Newton steps.

The making of a model states the first-order steps, see `jamlab.protocols.descent`.
"""

from dataclasses import dataclass

from jamlab.arguments.table import argument
from jamlab.checks import check_number
from jamlab.engine.deck_defaults import defaults
from jamlab.engine.evaluation import Evaluation
from jamlab.engine.session import Session
from jamlab.errors import InputError, named
from jamlab.protocols.descent import USUAL, Effort, entangled
from jamlab.protocols.minimising import minimising_of
from jamlab.protocols.newton import descend_by_newton

QUENCH_PROTOCOL = 2  # version, see jamlab.campaign.tasks: 1 and 2 differ by rounding

LEAST_TOLERANCE = argument("force_tolerance").ends()[0]  # forces of order 1 hold no smaller differences


@dataclass(frozen=True)
class Relaxed:
    """A state after minimisation."""

    evaluation: Evaluation  # LAMMPS energies, forces and stress there
    tolerance: float  # asked for, on the largest force
    converged: bool  # whether the largest force is below the tolerance
    off_saddles: bool = False  # whether it is known to be no saddle, or to be held by what its Hessian leaves out
    on_rattlers: bool = False  # whether it is the latter


def usual_force_tolerance(model: str) -> float:
    """Largest force at a minimum by default, in natural units: `force_tolerance` of `*.minimum.parameters`."""
    return float(defaults(f"{model}.minimum")["force_tolerance"])


def check_tolerance(force_tolerance: float | None, highest: float) -> None:
    """Refuse a force tolerance that no minimisation can meet, or that leaves no digits of the result."""
    if force_tolerance is None:
        return
    check_number("force_tolerance", force_tolerance, highest)
    if force_tolerance < LEAST_TOLERANCE:
        raise InputError(
            f"{named('force_tolerance', force_tolerance, 'g')}: "
            f"rounding leaves larger forces, use {LEAST_TOLERANCE:g} or more"
        )


def settle(session: Session, tolerance: float, *, loose: float = 0.0) -> Evaluation:
    """A bounded effort: enough to tell a jammed packing from a loose one, whose last digits cost most.

    Args:
        session: is left in the state reached.
        tolerance: on the largest force.
        loose: DP: give up a packing whose contact energy per vertex is below this when forces are nearly gone.
    """
    return minimising_of(session.kind.name).descent.settle(session, tolerance, loose)


def relax_session(
    session: Session, tolerance: float | None = None, *, near: bool = False, effort: Effort = USUAL
) -> Relaxed:
    """Minimise the energy of the packing in a session, at fixed box.

    Args:
        session: is left in the minimum.
        tolerance: on the largest force; default `usual_force_tolerance` of the model.
        near: the state is a good guess of the minimum: try steps that converge fast there before anything else,
            Newton's, for droplets those of L-BFGS.
        effort: steps at most.

    Returns:
        The state reached; `converged` is False if no round met the tolerance.
    """
    if tolerance is None:
        tolerance = usual_force_tolerance(session.kind.name)
    descent = minimising_of(session.kind.name).descent
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
    return Relaxed(state, tolerance, state.max_force <= tolerance and not entangled(session))
