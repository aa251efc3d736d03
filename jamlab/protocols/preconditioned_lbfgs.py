"""Minimise droplet shapes by limited-memory BFGS, preconditioned by a factorised Hessian.

Vertices are almost free to slide along a flat while contacts and areas are stiff, so plain L-BFGS takes thousands of
force evaluations. Started from the inverse of a Hessian of the same packing, made positive definite by a shift, it
takes about a hundred. Near onset droplets roll on a nearly flat energy, and contacts open and close at every step of
Newton's method; L-BFGS on a Hessian of a small shift passes there in hundreds of cheap steps. Near the minimum the
energy, which holds the whole perimeter, has no digits left for a line search: there the work of the force along the
step, (F0 + F1) . s/2, stands for the fall of the energy.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg.blas import dtrsv

from jamlab.arrays import Array

Forces = Callable[[Array], tuple[float, Array]]
Solve = Callable[[Array], Array]
Preconditioner = Callable[[Array, float], Solve]
Enough = Callable[[float], bool]


@dataclass(frozen=True)
class LbfgsSettings:
    """Numbers of the method.

    Halved or doubled, they lose no state and change force evaluations by 6 % and factorisations by 20 % at most, except
    for `refresh` (72 % more or 38 % fewer factorisations), `least_shift` doubled (38 % more of them), and `longer` = 1,
    with which steps cannot grow (4 times the evaluations): `tests/protocols/benchmark_solver_settings.py`.

    Attributes:
        steps: at most.
        refresh: steps that one factorisation serves; all of them are remembered.
        reach: longest move of a coordinate in one step, mean particle size; contacts beyond are not in the Hessian.
        longer: times the longest move of the step before that a step is tried with at most: full steps mostly miss
            while contacts open and close, and every miss costs an evaluation.
        trials: force evaluations in one line search.
        energy_digits: relative change of the energy below which it is rounding.
        sufficient: part of the energy foretold by the slope that a step must gain (Armijo), Nocedal & Wright 3.1.
        curved: least cosine between a step and the change of the force along it for the pair to be remembered.
        shift: added to the Hessian's diagonal over the largest force: far from balance long steps miss, and the Hessian
            has negative modes down to some ten times that.
        least_shift: with less, steps along soft modes are longer than the quadratic model holds.
    """

    steps: int = 5000
    refresh: int = 40
    reach: float = 0.05
    longer: float = 2.0
    trials: int = 8
    energy_digits: float = 1e-13
    sufficient: float = 1e-4
    curved: float = 1e-10
    shift: float = 2.0
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
        preconditioner: positions and a shift -> function that multiplies a (2 n,) force by an approximate inverse of
            the Hessian there, with at least that shift on its diagonal.
        tolerance: on the largest force.
        steps: at most.
        enough: largest force -> whether to stop; asked at each step.

    Returns:
        (n, 2) positions, and whether the tolerance was met.
    """
    shape = start.shape
    x = start.ravel()
    energy, force = _flat(forces_at, x, shape)
    age, longest = LBFGS.refresh, LBFGS.reach
    for _ in range(steps):
        largest = float(np.hypot(*force.reshape(shape).T).max())
        if largest <= tolerance or (enough is not None and enough(largest)):
            return x.reshape(shape), largest <= tolerance
        if age == LBFGS.refresh:
            shift = max(LBFGS.shift * largest, LBFGS.least_shift)
            pairs, age = _Pairs(x.size, preconditioner(x.reshape(shape), shift)), 0
        age += 1
        step = pairs.inverse_times(force)
        if step @ force <= 0:
            pairs.clear()
            step = pairs.inverse_times(force)
        found = _search_line(forces_at, x, shape, energy, force, step, longest)
        if found is None:
            if age == 1:  # not even a fresh Hessian shows the way down
                break
            age = LBFGS.refresh
            continue
        moved, new_energy, new_force = found
        change, bend = moved - x, force - new_force
        longest = min(LBFGS.reach, LBFGS.longer * float(np.abs(change).max()))
        curvature = float(change @ bend)
        if curvature > LBFGS.curved * np.linalg.norm(change) * np.linalg.norm(bend):
            pairs.add(change, bend)
        elif age > 1:
            age = LBFGS.refresh  # the model is wrong here: factorise anew
        x, energy, force = moved, new_energy, new_force
    return x.reshape(shape), False


def _flat(forces_at: Forces, x: Array, shape: tuple[int, ...]) -> tuple[float, Array]:
    energy, forces = forces_at(x.reshape(shape))
    return energy, forces.ravel()


class _Pairs:
    """Steps s and the changes y of the force along them, which correct an inverse Hessian.

    The two loops of Nocedal & Wright's algorithm 7.4 as products with whole matrices: with R the upper triangle of
    S^T Y and D its diagonal, R a = S^T F, r = H (F - Y a), R^T c = D a - Y^T r, and the step is r + S c.
    """

    def __init__(self, size: int, solve: Solve) -> None:
        self._solve, self._count = solve, 0
        self._s, self._y = np.empty((LBFGS.refresh, size)), np.empty((LBFGS.refresh, size))
        self._r = np.zeros((LBFGS.refresh, LBFGS.refresh), order="F")

    def clear(self) -> None:
        self._count = 0

    def add(self, change: Array, bend: Array) -> None:
        k = self._count
        self._s[k], self._y[k] = change, bend
        self._r[: k + 1, k] = self._s[: k + 1] @ bend
        self._count = k + 1

    def inverse_times(self, force: Array) -> Array:
        k = self._count
        if k == 0:
            return self._solve(force)
        s, y, r = self._s[:k], self._y[:k], self._r[:k, :k]
        a = dtrsv(r, s @ force)
        step = self._solve(force - a @ y)
        c = dtrsv(r, r.diagonal() * a - y @ step, trans=1)
        return np.asarray(step + c @ s)


def _search_line(
    forces_at: Forces,
    x: Array,
    shape: tuple[int, ...],
    energy: float,
    force: Array,
    step: Array,
    longest: float,
) -> tuple[Array, float, Array] | None:
    """Go along `step`, at most so far, until the energy falls enough; None if it does not."""
    slope = float(force @ step)
    length = min(1.0, longest / float(np.abs(step).max()))
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
