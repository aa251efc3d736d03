"""Minimise droplet shapes by limited-memory BFGS, preconditioned by a factorised Hessian.

Vertices are almost free to slide along a flat while contacts and areas are stiff, so plain L-BFGS takes thousands of
force evaluations. Started from the inverse of a Hessian of the same packing, made positive definite by a shift, it
takes about a hundred. Near onset droplets roll on a nearly flat energy, and contacts open and close at every step of
Newton's method; L-BFGS on a Hessian of a small shift passes there in hundreds of cheap steps. Near the minimum the
energy, which holds the whole perimeter, has no digits left for a line search: there the work of the force along the
step, (F0 + F1) . s/2, stands for the fall of the energy.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Forces = Callable[[Array], tuple[float, Array]]
Preconditioner = Callable[[Array], Callable[[Array], Array]]
Enough = Callable[[float], bool]


@dataclass(frozen=True)
class LbfgsSettings:
    """Numbers of the method.

    Halved or doubled, they change force evaluations and factorisations by less than 5 % and lose no state, except for
    `refresh` (62 % more or 30 % fewer factorisations), fewer `trials` (12 % more) and a `shift_decay` above 1, which
    doubles them: `tests/protocols/benchmark_solver_settings.py`.

    Attributes:
        steps: at most.
        pairs: steps remembered.
        refresh: steps that one factorisation serves.
        reach: longest move of a coordinate in one step, mean particle size; contacts beyond are not in the Hessian.
        trials: force evaluations in one line search.
        energy_digits: relative change of the energy below which it is rounding.
        sufficient: part of the energy foretold by the slope that a step must gain (Armijo), Nocedal & Wright 3.1.
        curved: least cosine between a step and the change of the force along it for the pair to be remembered.
        first_shift: added to the Hessian's diagonal at first: while contacts change, long steps miss.
        shift_decay: factor of the shift at every new factorisation.
        least_shift: with less, steps along soft modes are longer than the quadratic model holds.
    """

    steps: int = 5000
    pairs: int = 30
    refresh: int = 30
    reach: float = 0.05
    trials: int = 8
    energy_digits: float = 1e-13
    sufficient: float = 1e-4
    curved: float = 1e-10
    first_shift: float = 1e-2
    shift_decay: float = 0.7
    least_shift: float = 3e-4


LBFGS = LbfgsSettings()


def descend_by_lbfgs(
    forces_at: Forces,
    start: Array,
    preconditioner: Preconditioner,
    *,
    tolerance: float,
    steps: int,
    enough: Enough | None = None,
) -> tuple[Array, bool]:
    """Minimise an energy by its forces.

    Args:
        forces_at: positions (n, 2) -> energy, forces (n, 2).
        start: (n, 2).
        preconditioner: positions -> function that multiplies a (2 n,) force by an approximate inverse Hessian.
        tolerance: on the largest force.
        steps: at most.
        enough: largest force -> whether to stop; asked at each step.

    Returns:
        (n, 2) positions, and whether the tolerance was met.
    """
    shape = start.shape
    x = start.ravel()
    energy, force = _flat(forces_at, x, shape)
    pairs: deque[tuple[Array, Array, float]] = deque(maxlen=LBFGS.pairs)
    solve = preconditioner(start)
    age = 0
    for _ in range(steps):
        largest = float(np.hypot(*force.reshape(shape).T).max())
        if largest <= tolerance or (enough is not None and enough(largest)):
            return x.reshape(shape), largest <= tolerance
        if age == LBFGS.refresh:
            solve, age = preconditioner(x.reshape(shape)), 0
            pairs.clear()
        age += 1
        step = _two_loops(force, pairs, solve)
        if step @ force <= 0:
            pairs.clear()
            step = solve(force)
        found = _search_line(forces_at, x, shape, energy, force, step)
        if found is None:
            if age == 1:  # not even a fresh Hessian shows the way down
                break
            age = LBFGS.refresh
            continue
        moved, new_energy, new_force = found
        change, bend = moved - x, force - new_force
        curvature = float(change @ bend)
        if curvature > LBFGS.curved * np.linalg.norm(change) * np.linalg.norm(bend):
            pairs.append((change, bend, 1 / curvature))
        elif age > 1:
            age = LBFGS.refresh  # the model is wrong here: factorise anew
        x, energy, force = moved, new_energy, new_force
    return x.reshape(shape), False


def _flat(forces_at: Forces, x: Array, shape: tuple[int, ...]) -> tuple[float, Array]:
    energy, forces = forces_at(x.reshape(shape))
    return energy, forces.ravel()


def _two_loops(force: Array, pairs: deque[tuple[Array, Array, float]], solve: Callable[[Array], Array]) -> Array:
    """Inverse Hessian times force, Nocedal & Wright algorithm 7.4."""
    q = force.copy()
    weights = []
    for change, bend, inverse in reversed(pairs):
        weight = inverse * (change @ q)
        q -= weight * bend
        weights.append(weight)
    step = solve(q)
    for (change, bend, inverse), weight in zip(pairs, reversed(weights), strict=True):
        step += (weight - inverse * (bend @ step)) * change
    return step


def _search_line(
    forces_at: Forces, x: Array, shape: tuple[int, ...], energy: float, force: Array, step: Array
) -> tuple[Array, float, Array] | None:
    """Go along `step` until the energy falls enough; None if it does not."""
    slope = float(force @ step)
    length = min(1.0, LBFGS.reach / float(np.abs(step).max()))
    noise = LBFGS.energy_digits * abs(energy)
    for _ in range(LBFGS.trials):
        moved = x + length * step
        new_energy, new_force = _flat(forces_at, moved, shape)
        new_slope = float(new_force @ step)
        fall = energy - new_energy
        if abs(fall) <= noise:
            fall = 0.5 * length * (slope + new_slope)
        if fall > LBFGS.sufficient * length * slope:
            return moved, new_energy, new_force
        # secant on the force along the step
        length *= min(0.5, max(0.1, slope / (slope - new_slope))) if new_slope < slope else 0.5
    return None
