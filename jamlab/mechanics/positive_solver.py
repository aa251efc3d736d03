"""Solve with a series of symmetric positive definite matrices of one pattern, by the fastest library at hand.

scipy always works. PARDISO, through `pip install jamlab[fast]`, factorises five to ten times faster and is taken where
it is installed, unless the environment variable JAMLAB_FACTORISATION says "scipy".
"""

import importlib.util
import os
import sys
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from jamlab.errors import ConvergenceError, InputError
from jamlab.mechanics.symmetric_factors import SymmetricFactors

Array = NDArray[np.float64]

VARIABLE = "JAMLAB_FACTORISATION"
BACKENDS = ("pardiso", "scipy")

_LIBRARY = "PYPARDISO_MKL_RT"  # environment variable in which pypardiso looks up where MKL is
_CHOLESKY = 2  # PARDISO's number for real symmetric positive definite
_ANALYSE_FACTORISE, _FACTORISE, _SOLVE = 12, 22, 33  # PARDISO's phases


class PositiveSolver(Protocol):
    """A solver that holds one factorisation at a time."""

    def factorise(self, matrix: sparse.csc_array, *, check: bool = False) -> None:
        """Factorise a matrix (n, n); a pattern that is the same as before is not analysed again.

        Args:
            matrix: both triangles.
            check: make sure that the matrix is positive definite, also where that costs extra.

        Raises:
            ConvergenceError: the matrix is not positive definite.
        """

    def solve(self, right: Array) -> Array:
        """Solve for (n,) or (n, k) right-hand sides with the matrix factorised last."""


def backend() -> str:
    """Name the library in use.

    Raises:
        InputError: the environment variable names an unknown library, or one that is not installed.
    """
    installed = importlib.util.find_spec("pypardiso") is not None
    wanted = os.environ.get(VARIABLE, "pardiso" if installed else "scipy")
    if wanted not in BACKENDS:
        raise InputError(f"{VARIABLE} = {wanted!r}: use one of {', '.join(BACKENDS)}")
    if wanted == "pardiso" and not installed:
        raise InputError(f"{VARIABLE} = 'pardiso', but pypardiso is not installed: pip install 'jamlab[fast]'")
    return wanted


def positive_solver() -> PositiveSolver:
    """Make a solver of the library that `backend` names."""
    return _Pardiso() if backend() == "pardiso" else _Superlu()


class _Superlu:
    """SuperLU, which scipy brings: factors without pivoting, whose ordering is used again."""

    def __init__(self) -> None:
        self._factors: SymmetricFactors | None = None

    def factorise(self, matrix: sparse.csc_array, *, check: bool = False) -> None:
        """See `PositiveSolver`."""
        same = self._factors is not None and self._factors.size == matrix.shape[0]
        self._factors = SymmetricFactors(matrix, analysis=self._factors if same else None)
        if check and self._factors.negative:
            raise ConvergenceError(f"a matrix has {self._factors.negative} negative eigenvalue(s)")

    def solve(self, right: Array) -> Array:
        """See `PositiveSolver`."""
        assert self._factors is not None
        return self._factors.solve(right)


class _Pardiso:
    """PARDISO: Cholesky factors of the upper triangle, whose symbolic analysis is used again."""

    def __init__(self) -> None:
        from pypardiso.pardiso_wrapper import PyPardisoError, PyPardisoSolver

        self._failure: type[Exception] = PyPardisoError
        # else every solver looks for the library anew, by subprocesses and a walk through all packages: up to seconds
        installed = sorted(Path(sys.prefix, "lib").glob("libmkl_rt.so*"))
        if installed:
            os.environ.setdefault(_LIBRARY, str(installed[-1]))
        self._solver: Any = PyPardisoSolver(mtype=_CHOLESKY)
        os.environ.setdefault(_LIBRARY, str(self._solver.libmkl._name))
        self._matrix: sparse.csr_array | None = None
        self._indptr = self._indices = np.zeros(0, dtype=np.int32)
        self._upper = np.zeros(0, dtype=bool)

    def factorise(self, matrix: sparse.csc_array, *, check: bool = False) -> None:
        """See `PositiveSolver`."""
        if not matrix.has_sorted_indices:
            matrix = matrix.sorted_indices()
        known = np.array_equal(matrix.indptr, self._indptr) and np.array_equal(matrix.indices, self._indices)
        if not known:
            self._indptr, self._indices = matrix.indptr, matrix.indices
            # columns of a symmetric matrix are its rows
            self._upper = matrix.indices >= np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))
        rows = np.add.reduceat(self._upper, matrix.indptr[:-1], dtype=np.int32)
        starts = np.concatenate([[0], np.cumsum(rows)])
        triangle = (matrix.data[self._upper], matrix.indices[self._upper], starts)
        self._matrix = sparse.csr_array(triangle, shape=matrix.shape)
        try:
            self._call(_FACTORISE if known else _ANALYSE_FACTORISE, np.zeros((matrix.shape[0], 1)))
        except self._failure as error:
            self._indptr = np.zeros(0, dtype=np.int32)
            raise ConvergenceError(f"a matrix is not positive definite: {error}") from error

    def solve(self, right: Array) -> Array:
        """See `PositiveSolver`."""
        solution = self._call(_SOLVE, np.asfortranarray(right.reshape(len(right), -1)))
        return solution.reshape(right.shape)

    def __del__(self) -> None:
        if getattr(self, "_solver", None) is not None and len(self._indptr):
            self._solver.free_memory(everything=True)

    def _call(self, phase: int, right: Array) -> Array:
        # the public methods analyse a matrix anew whenever its values change
        self._solver.set_phase(phase)
        return np.asarray(self._solver._call_pardiso(self._matrix, right))
