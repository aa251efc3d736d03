"""Factorise symmetric sparse matrices and count their negative eigenvalues."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import linalg

from jamlab.errors import ConvergenceError


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
