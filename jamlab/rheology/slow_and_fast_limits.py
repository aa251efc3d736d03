"""Response of a packing to infinitely slow and infinitely fast shear; refuses packings that are not stable."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.errors import ConvergenceError
from jamlab.mechanics.factors import PositiveSolver, response_and_looseness
from jamlab.mechanics.floppy_modes import floppy_modes
from jamlab.rheology.equation_of_motion import BorderedMatrix, EquationOfMotion
from jamlab.rheology.rounding_error import OF_ROUNDING, least_drag

if TYPE_CHECKING:
    from scipy import sparse


class ShiftedSolver:
    """Solver of (K + s B) q = f for one real s > 0 after the other. With rotations scaled by sqrt(s) the matrix is
    positive definite for every s: displacements see K + s B, rotations B, and between them sqrt(s) B; torques are
    divided by sqrt(s). Without torques that eliminates rotations exactly. `motion`: equation of motion."""

    def __init__(self, motion: EquationOfMotion) -> None:
        self._motion = motion
        self._solver = PositiveSolver()
        self._root = 0.0
        # values of K and of B on their common pattern, so that a shift costs one sum
        k, b = motion.k_solved, motion.b_solved
        self._pattern = (abs(k) + abs(b)).tocsc()
        self._pattern.sort_indices()
        keys = _entry_keys(self._pattern)
        self._k, self._b = (_spread_values(m, keys) for m in (k, b))
        # 0, 1 or 2 rotations in an entry
        self._turning = np.add(keys % motion.size >= motion.moving, keys // motion.size >= motion.moving, dtype=np.int8)

    def factorise(self, shift: float, otherwise: str = ", or method='direct'") -> None:
        """Factorise K + s B for a shift s, 1/tau_1. `otherwise`: remedy of one that fails, besides frequency and
        beta."""
        from scipy import sparse

        self._root = float(np.sqrt(shift))
        values = self._k + np.array([shift, self._root, 1.0])[self._turning] * self._b
        pattern = self._pattern
        matrix = sparse.csc_array((values, pattern.indices, pattern.indptr), shape=pattern.shape)
        try:
            self._solver.factorise(matrix)
        except ConvergenceError as error:
            raise ConvergenceError(
                f"K + s B loses all digits to rounding at s = {shift:.2g}: use less extreme frequencies or "
                f"beta{otherwise} ({error})"
            ) from error

    def forget(self) -> None:
        """Free the memory of the factors."""
        self._solver = PositiveSolver()

    def solve(self, load: Array) -> Array:
        """Solve for the response (m,) to forces and torques (m,), less drift."""
        moving = self._motion.moving
        q = self._solver.solve(np.concatenate([load[:moving], load[moving:] / self._root]))
        q[moving:] /= self._root
        return self._motion.without_drift(q)


def _entry_keys(matrix: sparse.csc_array) -> NDArray[np.int64]:
    """column * size + row of every entry."""
    size = matrix.shape[0]
    columns = np.repeat(np.arange(size, dtype=np.int64), np.diff(matrix.indptr))
    return np.asarray(columns * size + matrix.indices)


def _spread_values(matrix: sparse.csc_array, keys: NDArray[np.int64]) -> Array:
    """Values of a matrix at the entries of a wider pattern."""
    values = np.zeros(len(keys))
    values[np.searchsorted(keys, _entry_keys(matrix))] = matrix.data
    return values


@dataclass(frozen=True)
class Steps:
    """How a limit of G* is approached."""

    # Of proximal steps to the fast limit, over the rate at which dissipation outweighs elasticity. A step
    # divides the imbalance by about this number; the elastic energy of what B leaves free must stay above the
    # rounding of s B, 1e-16 times this.
    shift: float = 1e6
    most_steps: int = 30  # a guard; two to five reach rounding
    least_gain: float = 0.5  # a step must be shorter than this part of the last one, else it is rounding


STEPS = Steps()


@dataclass(frozen=True)
class Limits:
    """Response at unit strain when the strain is infinitely slow or fast."""

    slow: Array  # (m,) q of least energy, and among those of least dissipation
    fast: Array  # (m,) q of least dissipation, and among those of least energy
    g0: float  # G'(omega -> 0)
    eta_inf: float  # lim G''/omega, omega -> infinity; 0 where drag leaves a way to flow without dissipation
    eta_inf_bound: float  # what rounding may change eta_inf by; a smaller one counts as 0
    eta0: float  # lim G''/omega, omega -> 0
    floppy: Array  # (m, k) displacements without energy, with the rotations that dissipate least
    solver: ShiftedSolver  # of this equation of motion, which knows the pattern of its matrices

    @property
    def nothing_resists(self) -> bool:
        """Whether slow shear costs neither energy nor drag: G* is 0 at all frequencies."""
        return not (self.g0 or self.eta0)


def find_limits(motion: EquationOfMotion, *, inertia: bool = False) -> Limits:
    """Find the slow and the fast limit of the response, and the moduli that follow from them. `inertia`: the fast
    response is the affine motion, whatever the drag."""
    slow, floppy = _solve_slow(motion)
    solver = ShiftedSolver(motion)
    fast = np.zeros(motion.size) if inertia else _solve_fast(motion, solver)
    strained_slow, strained_fast = np.append(slow, 1.0), np.append(fast, 1.0)
    b = motion.b
    fast_drag, rounding = _form(b, strained_fast)
    slow_drag, _ = _form(b, strained_slow)
    energy, _ = _form(motion.k, strained_slow)  # 0 of a slab that slips along flat walls
    return Limits(
        slow=slow,
        fast=fast,
        g0=energy / motion.area,
        eta_inf=fast_drag / motion.area,
        eta_inf_bound=rounding / motion.area,
        eta0=slow_drag / motion.area,
        floppy=floppy,
        solver=solver,
    )


def _form(matrix: BorderedMatrix, q: Array) -> tuple[float, float]:
    """q^T M q, 0 where nothing but rounding is left, and what rounding may change it by."""
    found, rounding = float(q @ (matrix @ q)), OF_ROUNDING.entries * float(np.abs(q) @ (abs(matrix) @ np.abs(q)))
    return (found if abs(found) > rounding else 0.0), rounding


def _fix_one_site(motion: EquationOfMotion) -> tuple[sparse.csc_array, int]:
    """K of the displacements with site 0 fixed, and the number of coordinates in front that are fixed only here."""
    held = 2 if motion.drifting else 0
    return motion.k_qq[held : motion.moving, held : motion.moving].tocsc(), held


def _solve_slow(motion: EquationOfMotion) -> tuple[Array, Array]:
    """(m,) `Limits.slow` and (m, k) `Limits.floppy`."""
    matrix, held = _fix_one_site(motion)
    load = -motion.k_qg[held : motion.moving, None]
    response, loose = response_and_looseness(matrix, load, motion.floppy)
    floppy = floppy_modes(matrix, motion.floppy) if loose else np.zeros((len(response), 0))
    q = np.zeros((motion.size, 1 + floppy.shape[1]))
    q[held : motion.moving] = np.column_stack([response, floppy])
    q = motion.without_drift(q)
    if motion.size > motion.moving:
        torque = (motion.b_qq @ q)[motion.moving :]
        torque[:, 0] += motion.b_qg[motion.moving :]
        solver = PositiveSolver()
        solver.factorise(motion.b_qq[motion.moving :, motion.moving :].tocsc())
        q[motion.moving :] = -solver.solve(torque)
    slow, floppy = q[:, 0], q[:, 1:]
    return slow + least_drag(motion, floppy, motion.b_qq @ slow + motion.b_qg), floppy


def _solve_fast(motion: EquationOfMotion, solver: ShiftedSolver) -> Array:
    """Least dissipation, by proximal steps: B alone may be singular, K + s B is not. The first step is the exact
    response at s, so what B leaves free takes least energy; every further step keeps that and divides the imbalance of
    B by about 1 + s over the fastest rate."""
    moving = motion.moving
    shift = STEPS.shift * motion.k_qq.diagonal()[:moving].max() / motion.b_qq.diagonal()[:moving].max()
    solver.factorise(shift, otherwise="")  # every method needs this limit
    q = -solver.solve(motion.k_qg + shift * motion.b_qg)
    last = np.inf
    for _ in range(STEPS.most_steps):
        step = solver.solve(shift * (motion.b_qq @ q + motion.b_qg))
        size = float(np.abs(step).max())
        if not size < STEPS.least_gain * last:
            break
        q = q - step
        last = size
    return q
