"""Minimise an energy by limited-memory BFGS, preconditioned by a factorised Hessian: disks along curved valleys.

Droplets, rigid or not, take the same method in compiled code, `plugin/kernels/lbfgs_descent.h`. Near the minimum the
energy has no digits left for a line search: there the work of the force along the step, (F0 + F1) . s/2, stands for the
fall of the energy.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array
from jamlab.engine.evaluation import Evaluation
from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError, InputError
from jamlab.mechanics.factors import PositiveSolver
from jamlab.mechanics.stiffness import hessian
from jamlab.packing.packing import Packing
from jamlab.protocols.newton import NEWTON, factorise


@dataclass(frozen=True)
class LbfgsSettings:
    """Numbers of preconditioned L-BFGS, in the order of `jamlab/descend`.

    Measured on 40 states of 64 droplets up to rho = 0.99: `refresh` from 15 to 40 changes the CPU time by 10 % at most;
    with `refresh` = 40, `least_shift` from 1e-4 to 1e-3 and `shift` from 1 to 4 change the steps by 6 % at most.
    """

    refresh: int = 20  # steps that one factorisation serves; all of them are remembered
    reach: float = NEWTON.reach
    # times the longest move of the step before that a step is tried with at most: full steps mostly miss while contacts
    # open and close, and every miss costs an evaluation
    longer: float = 2.0
    # times the longest move of the last step: gaps that count as contacts in the Hessian of many droplets
    closing: float = 0.3
    trials: int = 8  # force evaluations in one line search
    energy_digits: float = 1e-13  # relative change of the energy below which it is rounding
    # part of the energy foretold by the slope that a step must gain (Armijo), Nocedal & Wright 3.1
    sufficient: float = 1e-4
    # least cosine between a step and the change of the force along it for the pair to be remembered
    curved: float = 1e-10
    # added to the Hessian's diagonal over the largest force: far from balance long steps miss, and the Hessian has
    # negative modes down to some ten times that
    shift: float = 2.0
    least_shift: float = 3e-4  # with less, steps along soft modes are longer than the quadratic model holds


_Pair = tuple[Array, Array]  # a step, and the change of the force along it
FAR = LbfgsSettings()
# beside a minimum the quadratic model holds: a small shift, and factors that follow contacts as these open and close
NEAR = LbfgsSettings(refresh=10, trials=16, shift=0.0, least_shift=1e-6)


def descend_by_lbfgs(session: Session, tolerance: float, steps: int) -> Evaluation:
    """Minimise the energy of disks at a fixed box down to a largest force, by so many steps at most."""
    packing, solver = session.packing(), PositiveSolver(session.tally, "Hessians of L-BFGS")

    def forces_at(x: Array) -> tuple[float, Array]:
        energy, forces = session.forces_at(x.reshape(-1, 2))
        return energy, forces.ravel()

    x = packing.positions.ravel()
    energy, force = forces_at(x)
    age, longest = FAR.refresh, FAR.reach
    pairs: list[_Pair] = []
    for _ in range(steps):
        largest = float(np.sqrt((force[::2] ** 2 + force[1::2] ** 2).max()))
        if largest <= tolerance:
            break
        if age == FAR.refresh:
            if not _factorise_at(packing, x, largest, solver):
                x = packing.positions.ravel()
                break
            pairs, age = [], 0
        age += 1
        step, pairs = _direction(force, pairs, solver.solve)
        found = _search_line(forces_at, x, energy, force, step, longest)
        if found is None:
            if age == 1:  # even a fresh Hessian gives no direction of descent
                break
            age = FAR.refresh
            continue
        moved, energy, new_force = found
        change, bend = moved - x, force - new_force
        longest = min(FAR.reach, FAR.longer * float(np.abs(change).max()))
        if change @ bend > FAR.curved * np.sqrt((change @ change) * (bend @ bend)):
            pairs.append((change, bend))
        elif age > 1:
            age = FAR.refresh  # the model is wrong here: factorise anew
        x, force = moved, new_force
    session.set_positions(x.reshape(-1, 2))
    return session.evaluate()


def _factorise_at(packing: Packing, x: Array, largest: float, solver: PositiveSolver) -> bool:
    """Factorise the Hessian at a state; False where two disks lie in one place and there is none."""
    try:
        matrix = hessian(packing.with_state(positions=x.reshape(-1, 2)))
        factorise(matrix, max(FAR.shift * largest, FAR.least_shift), solver)
    except (InputError, ConvergenceError):
        return False
    return True


def _direction(force: Array, pairs: list[_Pair], solve: Callable[[Array], Array]) -> tuple[Array, list[_Pair]]:
    """A direction of descent, and the pairs that it comes from: none where these lead uphill."""
    step = _inverse_times(force, pairs, solve)
    return (solve(force), []) if step @ force <= 0 else (step, pairs)


def _inverse_times(force: Array, pairs: list[_Pair], solve: Callable[[Array], Array]) -> Array:
    """Nocedal & Wright, algorithm 7.4: pairs of steps and the changes of the force along them correct an inverse."""
    rest, along = force.copy(), []
    for change, bend in reversed(pairs):
        along.append((change @ rest) / (change @ bend))
        rest -= along[-1] * bend
    step = solve(rest)
    for (change, bend), a in zip(pairs, reversed(along), strict=True):
        step = step + (a - (bend @ step) / (change @ bend)) * change
    return step


def _search_line(
    forces_at: Callable[[Array], tuple[float, Array]],
    x: Array,
    energy: float,
    force: Array,
    step: Array,
    longest: float,
) -> tuple[Array, float, Array] | None:
    """Go along `step`, at most so far, until the energy falls enough; None if it does not."""
    slope = float(force @ step)
    length = min(1.0, longest / float(np.abs(step).max()))
    noise = FAR.energy_digits * abs(energy)
    for _ in range(FAR.trials):
        moved = x + length * step
        new_energy, new_force = forces_at(moved)
        new_slope = float(new_force @ step)
        fall = energy - new_energy
        if abs(fall) <= noise:
            fall = 0.5 * length * (slope + new_slope)
        if fall > FAR.sufficient * length * slope:
            return moved, new_energy, new_force
        # secant on the force along the step
        length *= min(0.5, max(0.1, slope / (slope - new_slope))) if new_slope < slope else 0.5
    return None
