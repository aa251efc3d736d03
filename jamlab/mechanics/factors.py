"""Factors of sparse symmetric matrices, and the static response to a load by them.

Real matrices go by compiled factors L S L^T of dense panels, in an order of minimum degree: P. R. Amestoy, T. A. Davis
and I. S. Duff, SIAM J. Matrix Anal. Appl. 17, 886 (1996). S is 1 for positive definite ones, signs for others. Their
digits depend on no library and no processor. Complex matrices go by SuperLU.

Rounding of a Hessian moves its eigenvalues by about one part in 1e16 of the largest. A mode within that of zero is
floppy: a load that does not push it has a response, the one that leaves the mode alone; a load that does push it has
none. A mode that is negative beyond rounding is an instability.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from threading import Lock
from typing import TYPE_CHECKING, Any
from weakref import finalize

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array, Complex
from jamlab.errors import ConvergenceError
from jamlab.kernels.library import INDICES, INTEGER, REAL, REALS, kernel
from jamlab.laws.pair_law import PairLaw

if TYPE_CHECKING:
    from scipy import sparse

OTHER_ORDERS = 2  # of rows that are tried where a pivot vanishes

_MAKE = kernel("sparse_factors_make")
_FREE = kernel("sparse_factors_free", INTEGER)
_FACTORISE = kernel("sparse_factors_factorise", INTEGER, INTEGER, INDICES, INDICES, REALS, REAL, INTEGER)
_NEGATIVE = kernel("sparse_factors_negative", INTEGER)
_SOLVE = kernel("sparse_factors_solve", INTEGER, INTEGER, REALS)


class _CompiledFactors:
    """Factors L S L^T of a real matrix, and the order of elimination that the next matrix is taken in too, until its
    factors have 1.3 times the entries."""

    def __init__(self) -> None:
        self._handle = _MAKE()
        self._lock = Lock()  # compiled functions let other threads run
        self._size = 0  # of the matrix whose factors are here
        finalize(self, _FREE, self._handle)

    def factorise(self, matrix: sparse.csc_array, shift: float, indefinite: bool) -> int | None:
        """Factorise a matrix plus a shift of its diagonal; return the row without a pivot, None if all have one."""
        size, self._size = matrix.shape[0], 0
        numbers = np.ascontiguousarray(matrix.data, dtype=np.float64)
        if not (np.isfinite(numbers).all() and np.isfinite(shift)):
            raise ConvergenceError(f"a matrix has elements that are not finite, or the shift {shift:g} is not")
        first, rows = (np.ascontiguousarray(each, dtype=np.int32) for each in (matrix.indptr, matrix.indices))
        with self._lock:
            done = _FACTORISE(self._handle, size, first, rows, numbers, shift, int(indefinite))
        if done < size:
            return done
        self._size = size
        return None

    @property
    def negative(self) -> int:
        """Number of negative eigenvalues, after indefinite factors."""
        return _NEGATIVE(self._handle)

    def solve(self, right: NDArray[Any]) -> Array:
        """Solve for (n,) or (n, k) right-hand sides."""
        solution = np.array(right, dtype=np.float64, order="C")
        if len(solution) != self._size:
            raise ValueError(f"{len(solution)} numbers of a right-hand side for factors of {self._size} rows")
        with self._lock:
            _SOLVE(self._handle, solution.size // max(self._size, 1), solution)
        return solution


class PositiveSolver:
    """A solver that holds one factorisation at a time, and its order of elimination for the next. `tally`: counts its
    factorisations, and what they were for, `use`."""

    def __init__(self, tally: Counter[str] | None = None, use: str = "") -> None:
        self._tally, self._use = Counter() if tally is None else tally, use
        self._factors = _CompiledFactors()

    def factorise(self, matrix: sparse.csc_array, shift: float = 0.0) -> None:
        """Factorise a matrix (n, n), of both triangles, with a shift added to its diagonal."""
        row = self._factors.factorise(matrix, shift, indefinite=False)
        if row is not None:
            self._tally.update(("factorisations", "not positive definite"))
            raise ConvergenceError(f"a matrix is not positive definite: the pivot of row {row} is not positive")
        self._tally.update(("factorisations", self._use))

    def solve(self, right: Array) -> Array:
        """Solve for (n,) or (n, k) right-hand sides with the matrix factorised last."""
        return self._factors.solve(right)


class SymmetricFactors:
    """Factors L S L^T of a real symmetric matrix without pivoting: by Sylvester's law the signs S count the negative
    eigenvalues. A small pivot makes large factors. Where these would take half of the digits, the rows are taken in
    another order, whose pivots are other ones. `matrix`: (n, n) sparse, both triangles; `shift`: added to its
    diagonal."""

    def __init__(self, matrix: sparse.csc_array, shift: float = 0.0) -> None:
        self._factors, self._order = _CompiledFactors(), np.arange(matrix.shape[0])
        row = self._factors.factorise(matrix, shift, indefinite=True)
        for seed in range(OTHER_ORDERS):
            if row is None:
                break
            self._factors, self._order = _CompiledFactors(), np.random.default_rng(seed).permutation(matrix.shape[0])
            mixed = matrix.tocsr()[self._order][:, self._order].tocsc()
            row = self._factors.factorise(mixed, shift, indefinite=True)
        if row is not None:
            raise ConvergenceError(
                f"a matrix is singular, the packing has a floppy mode: in {1 + OTHER_ORDERS} orders of its rows a "
                f"pivot vanishes, here of row {self._order[row]}"
            )

    @property
    def negative(self) -> int:
        """Number of negative eigenvalues."""
        return self._factors.negative

    def solve(self, right: Array) -> Array:
        """Solution for one right-hand side (n,) or several (n, k)."""
        solution = np.empty(right.shape)
        solution[self._order] = self._factors.solve(right[self._order])
        return solution


class ComplexFactors:
    """L U factors of a complex symmetric matrix by SuperLU, without pivoting, ordered for a symmetric pattern; COLAMD
    ordering with pivoting, scipy's default, is several times slower here. `matrix`: (n, n) sparse."""

    def __init__(self, matrix: sparse.csc_array) -> None:
        from scipy.sparse import linalg

        try:
            self._factors = linalg.splu(
                matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            )
        except RuntimeError as error:
            raise ConvergenceError(f"a matrix is singular, the packing has a floppy mode: {error}") from error

    def solve(self, right: NDArray[Any]) -> Complex:
        """Solution for one right-hand side (n,) or several (n, k)."""
        solution: Complex = self._factors.solve(right)
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
    solver = PositiveSolver()
    try:
        solver.factorise(matrix, floppy)
    except ConvergenceError as error:
        raise instability(matrix, named) from error
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


def instability(matrix: sparse.csc_array, named: int) -> UnstableError:
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
