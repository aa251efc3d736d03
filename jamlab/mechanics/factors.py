"""Factors of sparse symmetric matrices, and the static response to a load by them.

Positive definite matrices go by CHOLMOD, the supernodal Cholesky factors of cvxopt; any, with their number of negative
eigenvalues, by SuperLU. Of CHOLMOD there is one library for everyone: another one rounds otherwise, and a search near
jamming then ends at another packing. Y. Chen, T. A. Davis, W. W. Hager and S. Rajamanickam, ACM Trans. Math. Softw. 35,
22 (2008).

Rounding of a Hessian moves its eigenvalues by about one part in 1e16 of the largest. A mode within that of zero is
floppy: a load that does not push it has a response, the one that leaves the mode alone; a load that does push it has
none. A mode that is negative beyond rounding is an instability.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.errors import ConvergenceError
from jamlab.laws.pair_law import PairLaw
from jamlab.storage.blas import load_cholmod

if TYPE_CHECKING:
    from scipy import sparse


class PositiveSolver:
    """A solver that holds one factorisation of a lower triangle at a time; its symbolic analysis is used again.
    `tally`: counts its factorisations, and what they were for, `use`."""

    def __init__(self, tally: Counter[str] | None = None, use: str = "") -> None:
        self._tally, self._use = Counter() if tally is None else tally, use
        self._cholmod, self._dense, self._sparse = load_cholmod()
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
            self._tally.update(("factorisations", "not positive definite"))
            self._factors = None  # used again, it would give other last digits from one process to the next
            raise ConvergenceError(f"a matrix is not positive definite from column {error.args[0]} on") from error
        self._tally.update(("factorisations", self._use))

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
        from scipy.sparse import linalg

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


# static response ------------------------------------------------------------------------------------------------------

FLOPPY = PairLaw.floppy


@dataclass(frozen=True)
class SoftModes:
    """How modes that hardly resist are found."""

    hidden: float = 1e-6  # part of the energy of the response that a floppy mode within rounding of zero may hide
    dense: int = 400  # coordinates up to which all eigenvalues at once are faster than a few by iteration
    named: int = 6  # negative eigenvalues next to zero among which the lowest is looked for, at least
    # coordinates for each of them in large systems, whose droplets slide in proportion to their number
    per_named: int = 1200
    # restarts of the iteration at most; tolerance where modes are not told apart
    patient: int = 500
    blurred: float = 1e-6
    near: float = 100.0  # stiffness against a random push, over that of floppy modes, below which there may be some
    steps: int = 30  # on stiff modes: each divides what is left by their stiffness over the floppy one, 1e4 at onset


SOFT = SoftModes()


class UnstableError(ConvergenceError):
    """A packing that gives way: some of its modes have no stiffness, or a negative one. `eigenvalue`: the lowest that
    was found, 0 if rounding hides it; `modes`: (k, n) displacements along some of them, the lowest first; `count`: how
    many are negative, of which k may be fewer; 1 where rounding hides them."""

    def __init__(self, message: str, eigenvalue: float, modes: Array, count: int = 1) -> None:
        super().__init__(message)
        self.count = count
        self.eigenvalue = eigenvalue
        self.modes = modes


def static_response(matrix: sparse.csc_array, load: Array, floppy: float = FLOPPY, named: int = SOFT.named) -> Array:
    """Response (n, k) of a stable packing to k loads (n, k). `matrix`: (n, n) Hessian with one site fixed, which
    removes the two translations; `floppy`: see `PairLaw`; `named`: negative modes that an error names, at least."""
    return response_and_looseness(matrix, load, floppy, named)[0]


def response_and_looseness(
    matrix: sparse.csc_array, load: Array, floppy: float = FLOPPY, named: int = SOFT.named
) -> tuple[Array, bool]:
    """`static_response`, and whether floppy modes may leave it open."""
    solver = PositiveSolver()
    floppy *= float(matrix.diagonal().max())
    try:
        solver.factorise(matrix)
    except ConvergenceError:
        return _beside_floppy_modes(matrix, load, floppy, named), True
    x = solver.solve(load)
    x += solver.solve(load - matrix @ x)
    if (np.einsum("nk,nk->k", x, load) >= floppy * np.einsum("nk,nk->k", x, x)).all():
        push = np.random.default_rng(0).standard_normal(len(x))  # yields far along modes within rounding of zero
        return x, bool(np.linalg.norm(push) <= SOFT.near * floppy * np.linalg.norm(solver.solve(push)))
    return _beside_floppy_modes(matrix, load, floppy, named), True


def _beside_floppy_modes(matrix: sparse.csc_array, load: Array, floppy: float, named: int) -> Array:
    """The response beside floppy modes, by proximal steps: all add the same along these, and ever less else."""
    from scipy import sparse

    solver = PositiveSolver()
    try:
        solver.factorise(matrix + floppy * sparse.eye_array(matrix.shape[0], format="csc"))
    except ConvergenceError as error:
        raise _instability(matrix, named) from error
    x, left, last, count = np.zeros_like(load), load, np.inf, 0
    while count < SOFT.steps:
        step, count = solver.solve(left), count + 1
        x = x + step
        left = load - matrix @ x
        size = float(np.abs(left).max())
        if not size < 0.5 * last:
            break
        last = size
    hidden = np.einsum("nk,nk->k", left, step)
    x -= count * step
    if hidden.sum() > SOFT.hidden * np.einsum("nk,nk->", x, load):
        push = np.abs(left).max()
        raise UnstableError(
            "strain acts on a floppy mode (zero stiffness) of the packing with a force of "
            f"{push:.2g}: its moduli are undefined",
            0.0,
            step[:, [hidden.argmax()]].T,
        )
    return x


def _instability(matrix: sparse.csc_array, named: int) -> UnstableError:
    """The error for a matrix with negative eigenvalues, with those next to zero."""
    from scipy.sparse import linalg

    most = max(named, matrix.shape[0] // SOFT.per_named)
    if matrix.shape[0] <= SOFT.dense:
        values, vectors = np.linalg.eigh(matrix.toarray())
        count = int((values < 0).sum())
    else:
        factors = SymmetricFactors(matrix)
        inverse = linalg.LinearOperator(matrix.shape, matvec=factors.solve, dtype=np.float64)
        count = factors.negative
        start = np.random.default_rng(0).standard_normal(matrix.shape[0])
        wanted = max(1, min(most, count))
        for some, blur in ((wanted, 0.0), (1, SOFT.blurred)):
            how = {"k": some, "tol": blur, "maxiter": SOFT.patient}
            try:
                values, vectors = linalg.eigsh(matrix, sigma=0.0, which="SA", OPinv=inverse, v0=start, **how)
                break
            except linalg.ArpackNoConvergence as error:  # modes almost alike
                values, vectors = error.eigenvalues, error.eigenvectors
                if (values < 0).any():
                    break
        else:
            raise ConvergenceError(
                f"none of {count} negative modes of a Hessian was found in {SOFT.patient} iterations"
            )
    order = np.argsort(values)[: min(most, max(1, int((values < 0).sum())))]
    lowest = float(values[order[0]])
    return UnstableError(
        f"the packing is unstable: its Hessian has {count} negative mode(s), an eigenvalue is {lowest:.3g}",
        lowest,
        vectors[:, order].T,
        count,
    )
