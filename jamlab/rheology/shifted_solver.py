"""Solve with K + s B for real shifts s, where it is positive definite: the work horse of the reduced model."""

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from jamlab.arrays import Array
from jamlab.errors import ConvergenceError
from jamlab.mechanics.positive_solver import PositiveSolver
from jamlab.rheology.equation_of_motion import EquationOfMotion


class ShiftedSolver:
    """Solver of (K + s B) q = f for one real s > 0 after the other. With rotations scaled by sqrt(s) the matrix is
    positive definite for every s: displacements see K + s B, rotations B, and between them sqrt(s) B; torques are
    divided by sqrt(s). Without torques that eliminates rotations exactly. `motion`: equation of motion."""

    def __init__(self, motion: EquationOfMotion) -> None:
        self._motion = motion
        self._solver = PositiveSolver()
        self._root = 0.0
        # values of K and of B on their common pattern, so that a shift costs one sum
        self._pattern = (abs(motion.k_qq) + abs(motion.b_qq)).tocsc()
        self._pattern.sort_indices()
        keys = _entry_keys(self._pattern)
        self._k, self._b = (_spread_values(m, keys) for m in (motion.k_qq, motion.b_qq))
        # 0, 1 or 2 rotations in an entry
        self._turning = np.add(keys % motion.size >= motion.moving, keys // motion.size >= motion.moving, dtype=np.int8)

    def factorise(self, shift: float) -> None:
        """Factorise K + s B for a shift s, 1/tau_1."""
        self._root = float(np.sqrt(shift))
        values = self._k + np.array([shift, self._root, 1.0])[self._turning] * self._b
        pattern = self._pattern
        matrix = sparse.csc_array((values, pattern.indices, pattern.indptr), shape=pattern.shape)
        try:
            self._solver.factorise(matrix)
        except ConvergenceError as error:
            raise ConvergenceError(
                f"K + s B has no digits left at s = {shift:.2g}: ask for less extreme frequencies or beta, or use "
                f"method='direct' ({error})"
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
