"""The static response of a packing to a load, K x = f, and what is wrong where it has none.

Rounding of the Hessian moves its eigenvalues by about one part in 1e16 of the largest. A mode within that of zero is
floppy: a load that does not push it has a response, the one that leaves the mode alone; a load that does push it has
none. A mode that is negative beyond rounding is an instability.
"""

import numpy as np
from scipy import sparse
from scipy.sparse import linalg

from jamlab.arrays import Array
from jamlab.errors import ConvergenceError
from jamlab.mechanics.factors import PositiveSolver, SymmetricFactors
from jamlab.packing.law_parameters import PairLaw

FLOPPY = PairLaw.floppy
# Part of the energy of the response that a floppy mode within rounding of zero may hide.
HIDDEN = 1e-6
_DENSE = 400  # coordinates up to which all eigenvalues at once are faster than a few by iteration
_NAMED = 6  # negative eigenvalues next to zero among which the lowest is looked for
_PATIENT, _BLURRED = 500, 1e-6  # restarts of the iteration at most; tolerance where six modes are not told apart
_STEPS = 30  # on stiff modes: each divides what is left by their stiffness over the floppy one, 1e4 at onset


class UnstableError(ConvergenceError):
    """A packing that gives way: some of its modes have no stiffness, or a negative one. `eigenvalue`: the lowest that
    was found, 0 if rounding hides it; `modes`: (k, n) displacements along up to six of them, the lowest first."""

    def __init__(self, message: str, eigenvalue: float, modes: Array) -> None:
        super().__init__(message)
        self.eigenvalue = eigenvalue
        self.modes = modes


def static_response(matrix: sparse.csc_array, load: Array, floppy: float = FLOPPY) -> Array:
    """Response (n, k) of a stable packing to k loads (n, k).

    Args:
        matrix: (n, n) Hessian with one site fixed, which removes the two translations.
        load: forces.
        floppy: see `PairLaw`.
    """
    solver = PositiveSolver()
    floppy *= float(matrix.diagonal().max())
    try:
        solver.factorise(matrix)
    except ConvergenceError:
        return _beside_floppy_modes(matrix, load, floppy)
    x = solver.solve(load)
    x += solver.solve(load - matrix @ x)
    if (np.einsum("nk,nk->k", x, load) >= floppy * np.einsum("nk,nk->k", x, x)).all():
        return x
    return _beside_floppy_modes(matrix, load, floppy)


def _beside_floppy_modes(matrix: sparse.csc_array, load: Array, floppy: float) -> Array:
    """The response beside floppy modes, by proximal steps: all add the same along these, and ever less else."""
    solver = PositiveSolver()
    try:
        solver.factorise(matrix + floppy * sparse.eye_array(matrix.shape[0], format="csc"))
    except ConvergenceError as error:
        raise _instability(matrix) from error
    x, left, last, count = np.zeros_like(load), load, np.inf, 0
    while count < _STEPS:
        step, count = solver.solve(left), count + 1
        x = x + step
        left = load - matrix @ x
        size = float(np.abs(left).max())
        if not size < 0.5 * last:
            break
        last = size
    hidden = np.einsum("nk,nk->k", left, step)
    x -= count * step
    if hidden.sum() > HIDDEN * np.einsum("nk,nk->", x, load):
        push = np.abs(left).max()
        raise UnstableError(
            "strain acts on a floppy mode (zero stiffness) of the packing with a force of "
            f"{push:.2g}: its moduli are undefined",
            0.0,
            step[:, [hidden.argmax()]].T,
        )
    return x


def _instability(matrix: sparse.csc_array) -> UnstableError:
    """The error for a matrix with negative eigenvalues, with those next to zero."""
    if matrix.shape[0] <= _DENSE:
        values, vectors = np.linalg.eigh(matrix.toarray())
        count = int((values < 0).sum())
    else:
        factors = SymmetricFactors(matrix)
        inverse = linalg.LinearOperator(matrix.shape, matvec=factors.solve, dtype=np.float64)
        count = factors.negative
        start = np.random.default_rng(0).standard_normal(matrix.shape[0])
        wanted = max(1, min(_NAMED, count))
        for some, blur in ((wanted, 0.0), (1, _BLURRED)):
            how = {"k": some, "tol": blur, "maxiter": _PATIENT}
            try:
                values, vectors = linalg.eigsh(matrix, sigma=0.0, which="SA", OPinv=inverse, v0=start, **how)
                break
            except linalg.ArpackNoConvergence as error:  # modes almost alike
                values, vectors = error.eigenvalues, error.eigenvectors
                if (values < 0).any():
                    break
        else:
            raise ConvergenceError(f"none of {count} negative modes of a Hessian was found in {_PATIENT} iterations")
    order = np.argsort(values)[: min(_NAMED, max(1, int((values < 0).sum())))]
    lowest = float(values[order[0]])
    return UnstableError(
        f"the packing is unstable: its Hessian has {count} negative mode(s), an eigenvalue is {lowest:.3g}",
        lowest,
        vectors[:, order].T,
    )
