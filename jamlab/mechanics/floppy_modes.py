"""Floppy modes of a stable packing: a basis of the displacements that cost no energy, and the minimum of a quadratic
form over them.

Response to strain is not unique along floppy modes. Whatever else acts on the packing decides: of infinitely slow shear
drag does, so that the response is the one that dissipates least.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.mechanics.factors import SOFT, PositiveSolver, SymmetricFactors

if TYPE_CHECKING:
    from scipy import sparse

PASSES = 3  # of inverse iteration: each divides what is not floppy by its stiffness over that of rounding, 1e3 or more


def floppy_modes(matrix: sparse.csc_array, floppy: float) -> Array:
    """(n, k) orthonormal basis of the floppy modes of a stable packing. `matrix`: (n, n) Hessian without negative
    eigenvalues; `floppy`: see `PairLaw`."""
    size, least = matrix.shape[0], floppy * float(matrix.diagonal().max())
    if size <= SOFT.dense:
        values, vectors = np.linalg.eigh(matrix.toarray())
        return np.asarray(vectors[:, values <= least])
    count = SymmetricFactors(matrix, -least).negative
    if not count:
        return np.zeros((size, 0))
    solver, modes = PositiveSolver(), np.random.default_rng(0).standard_normal((size, count))
    solver.factorise(matrix, least)
    for _ in range(PASSES):
        modes, _ = np.linalg.qr(solver.solve(modes))
    return modes


def least_along(modes: Array, form: Array, slope: NDArray[Any], least: float) -> NDArray[Any]:
    """(n,) or (n, j) sum of modes (n, k) that, added to a state, minimises a quadratic form. `form`: (k, k) second
    derivatives along the modes, never negative; `slope`: (k,) or (k, j) first ones at that state; `least`: second
    derivative that is rounding: along such directions nothing is added."""
    values, vectors = np.linalg.eigh(form)
    kept = values > least
    vectors = vectors[:, kept]
    share = vectors @ ((vectors.T @ slope).T / values[kept]).T
    moved: NDArray[Any] = -(modes @ share)
    return moved
