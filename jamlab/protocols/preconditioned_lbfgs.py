"""Limited-memory BFGS for droplet shapes, preconditioned by a factorised Hessian.

Vertices are almost free to slide along a flat while contacts and areas are stiff, so plain L-BFGS takes thousands of
force evaluations. Started from the inverse of a Hessian of the same packing, made positive definite by a shift, it
takes about a hundred. Near onset droplets roll on a nearly flat energy, and contacts open and close at every step of
Newton's method; L-BFGS on a Hessian of a small shift passes there in hundreds of cheap steps. Near the minimum the
energy, which holds the whole perimeter, has no digits left for a line search: there the work of the force along the
step, (F0 + F1) . s/2, stands for the fall of the energy.
"""

from collections import deque
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Forces = Callable[[Array], tuple[float, Array]]
Preconditioner = Callable[[Array], Callable[[Array], Array]]
Enough = Callable[[float], bool]

_PAIRS = 30
_REFRESH = 30  # steps that one factorisation serves
_REACH = 0.05  # longest move of a coordinate in one step, mean particle size
_TRIALS = 8  # force evaluations in one line search
_ENERGY_DIGITS = 1e-13  # relative change of energy below which it is rounding


def descend(
    forces_at: Forces,
    start: Array,
    preconditioner: Preconditioner,
    *,
    tolerance: float,
    steps: int,
    enough: Enough | None = None,
) -> tuple[Array, bool]:
    """Minimise an energy given its forces.

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
    pairs: deque[tuple[Array, Array, float]] = deque(maxlen=_PAIRS)
    solve = preconditioner(start)
    age = 0
    for _ in range(steps):
        largest = float(np.hypot(*force.reshape(shape).T).max())
        if largest <= tolerance or (enough is not None and enough(largest)):
            return x.reshape(shape), largest <= tolerance
        if age == _REFRESH:
            solve, age = preconditioner(x.reshape(shape)), 0
            pairs.clear()
        age += 1
        step = _two_loops(force, pairs, solve)
        if step @ force <= 0:
            pairs.clear()
            step = solve(force)
        found = _search(forces_at, x, shape, energy, force, step)
        if found is None:
            if age == 1:  # not even a fresh Hessian shows the way down
                break
            age = _REFRESH
            continue
        moved, new_energy, new_force = found
        change, bend = moved - x, force - new_force
        curvature = float(change @ bend)
        if curvature > 1e-10 * np.linalg.norm(change) * np.linalg.norm(bend):
            pairs.append((change, bend, 1 / curvature))
        elif age > 1:
            age = _REFRESH  # the model is wrong here: factorise anew
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


def _search(
    forces_at: Forces, x: Array, shape: tuple[int, ...], energy: float, force: Array, step: Array
) -> tuple[Array, float, Array] | None:
    """Go along `step` until the energy falls enough; None if it does not."""
    slope = float(force @ step)
    length = min(1.0, _REACH / float(np.abs(step).max()))
    noise = _ENERGY_DIGITS * abs(energy)
    for _ in range(_TRIALS):
        moved = x + length * step
        new_energy, new_force = _flat(forces_at, moved, shape)
        new_slope = float(new_force @ step)
        fall = energy - new_energy
        if abs(fall) <= noise:
            fall = 0.5 * length * (slope + new_slope)
        if fall > 1e-4 * length * slope:
            return moved, new_energy, new_force
        # secant on the force along the step
        length *= min(0.5, max(0.1, slope / (slope - new_slope))) if new_slope < slope else 0.5
    return None
