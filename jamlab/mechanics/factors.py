"""Factors of sparse symmetric matrices: positive definite ones by CHOLMOD, the supernodal Cholesky factors of cvxopt;
any, with their number of negative eigenvalues, by SuperLU.

Of CHOLMOD there is one library for everyone: another one rounds otherwise, and a search near jamming then ends at
another packing. Y. Chen, T. A. Davis, W. W. Hager and S. Rajamanickam, ACM Trans. Math. Softw. 35, 22 (2008).
"""

import os
import sys
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import linalg

from jamlab.arrays import Array
from jamlab.errors import ConvergenceError


@cache
def _load_cholmod() -> tuple[Any, Any, Any]:
    """CHOLMOD with the BLAS that it was built for, and cvxopt's dense and sparse matrices. liblammps offers the symbols
    of a plain BLAS to every library loaded after it. Bound to these, CHOLMOD factorises three times slower, and last
    digits would depend on what a process has loaded first."""
    flags = sys.getdlopenflags()
    sys.setdlopenflags(flags | getattr(os, "RTLD_DEEPBIND", 0))
    try:
        from cvxopt import cholmod, matrix, spmatrix
    finally:
        sys.setdlopenflags(flags)
    return cholmod, matrix, spmatrix


class PositiveSolver:
    """A solver that holds one factorisation of a lower triangle at a time; its symbolic analysis is used again."""

    def __init__(self) -> None:
        self._cholmod, self._dense, self._sparse = _load_cholmod()
        self._indptr = self._indices = np.zeros(0, dtype=np.int32)
        self._lower = np.zeros(0, dtype=np.bool_)
        self._matrix: Any = None
        self._factors: Any = None

    def factorise(self, matrix: sparse.csc_array) -> None:
        """Factorise a matrix (n, n); a pattern that is the same as before is not analysed again. `matrix`: both
        triangles."""
        _check_finite(matrix)
        if not matrix.has_sorted_indices:
            matrix = matrix.sorted_indices()
        known = np.array_equal(matrix.indptr, self._indptr) and np.array_equal(matrix.indices, self._indices)
        self._indptr, self._indices = matrix.indptr, matrix.indices
        if known:
            self._matrix.V = self._dense(matrix.data[self._lower])
        else:
            column = np.repeat(np.arange(matrix.shape[0], dtype=np.int64), np.diff(matrix.indptr))
            self._lower = matrix.indices >= column
            row = matrix.indices[self._lower].astype(np.int64)
            self._matrix = self._sparse(matrix.data[self._lower], row, column[self._lower], matrix.shape)
            self._factors = None
        if self._factors is None:
            self._factors = self._cholmod.symbolic(self._matrix)
        try:
            self._cholmod.numeric(self._matrix, self._factors)
        except ArithmeticError as error:
            self._factors = None  # used again, it would give other last digits from one process to the next
            raise ConvergenceError(f"a matrix is not positive definite from column {error.args[0]} on") from error

    def solve(self, right: Array) -> Array:
        """Solve for (n,) or (n, k) right-hand sides with the matrix factorised last."""
        solution = self._dense(right)
        self._cholmod.solve(self._factors, solution)
        return np.asarray(solution).reshape(right.shape)


def _check_finite(matrix: sparse.csc_array) -> None:
    if not np.isfinite(matrix.data).all():  # CHOLMOD takes them for numbers
        raise ConvergenceError("a matrix has elements that are not finite")


class SymmetricFactors:
    """L U factors of a symmetric matrix without pivoting, ordered for a symmetric pattern. Without pivoting U = D
    L^T, so by Sylvester's law the signs on the diagonal of U count the negative eigenvalues. COLAMD ordering with
    pivoting, scipy's default, is several times slower here and hides the signs. `matrix`: (n, n) sparse, symmetric;
    real or complex."""

    def __init__(self, matrix: sparse.csc_array) -> None:
        try:
            self._factors = linalg.splu(
                matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            )
        except RuntimeError as error:
            raise ConvergenceError(f"a matrix is singular, the packing has a floppy mode: {error}") from error

    @property
    def negative(self) -> int:
        """Number of negative eigenvalues of a real matrix."""
        return int(np.count_nonzero(self._factors.U.diagonal() < 0))

    def solve(self, right: NDArray[Any]) -> NDArray[Any]:
        """Solution for one right-hand side (n,) or several (n, k)."""
        solution: NDArray[Any] = self._factors.solve(right)
        return solution
