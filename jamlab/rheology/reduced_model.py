"""Reduced model of the equation of motion, good at all frequencies: rational Krylov with real positive shifts.

G*(omega) is a transfer function of two symmetric semi-definite matrices. Projected on responses at a few real shifts s,
for which K + s B is positive definite, and on the slow and fast limits, the equation keeps its form with a handful of
coordinates; its modes are a relaxation spectrum of some tens of lines that has the G* of the whole one.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from jamlab.errors import ConvergenceError
from jamlab.rheology.equation_of_motion import EquationOfMotion
from jamlab.rheology.relaxation_spectrum import Modes, RelaxationSpectrum, modes, spectrum
from jamlab.rheology.rounding_error import larger_relative
from jamlab.rheology.shifted_solver import ShiftedSolver
from jamlab.rheology.slow_and_fast_limits import Limits

Array = NDArray[np.float64]

_STEPS = 5  # Krylov steps at a shift; with one the search may stop too early, with more it factorises less often
_TOLERANCE = 1e-9  # relative change of G' and of G'' that counts as quiet
_QUIET = 2  # quiet updates in a row that end the search
_MOST_SHIFTS = 60
_PER_DECADE = 6  # candidates for the next shift
_MARGIN = 30.0  # candidates reach this factor beyond the frequencies asked for
_SKETCH = 2048  # rows of the projection that residuals are judged by
_DEPENDENT = 1e-12  # part of a new vector outside the space that is still direction, not rounding


@dataclass(frozen=True)
class ReducedModel:
    """Outcome of the reduction.

    Attributes:
        spectrum: Maxwell elements.
        modes: generalised modes on `basis`.
        basis: (m, j) orthonormal.
        shifts: (k,) real shifts used.
        change: largest relative change of G' or G'' in the last update, over the frequencies asked for. Every shift
            is put where most is missing, so this bounds the error of the last but one model at all frequencies; at
            one frequency alone it would not, since far from the new shift nothing changes.
    """

    spectrum: RelaxationSpectrum
    modes: Modes
    basis: Array
    shifts: Array
    change: float


def reduce(motion: EquationOfMotion, ends: Limits, omega: Array) -> ReducedModel:
    """Reduced model for frequencies omega (f,).

    Args:
        motion: equation of motion.
        ends: its limits.
        omega: positive.

    Raises:
        ConvergenceError: G* still moves after `_MOST_SHIFTS` shifts.
    """
    space = _Space(motion, ends)
    start = _forces(motion, motion.b_qq @ ends.slow + motion.b_qg)
    candidates = _candidates(omega)
    solver = ShiftedSolver(motion)
    shifts: list[float] = []
    change = 0.0
    model, found = space.model()
    before = model.modulus(omega)
    quiet = 0
    while quiet < _QUIET and len(candidates):
        if len(shifts) == _MOST_SHIFTS:
            raise ConvergenceError(
                f"G*(omega) still changes by {change:.2g} after {len(shifts)} shifts: use method='direct'"
            )
        # real shifts do not make the residual vanish at i omega: never choose one twice
        shift = float(candidates[np.argmax(space.residual(candidates))])
        candidates = candidates[candidates != shift]
        solver.factorise(shift)
        vector = start
        chain = []
        for _ in range(_STEPS):
            vector = solver.solve(vector)
            chain.append(vector)
            vector = _forces(motion, motion.b_qq @ vector)
        if not space.add(np.column_stack(chain)):
            continue
        shifts.append(shift)
        model, found = space.model()
        after = model.modulus(omega)
        change = float(larger_relative(after - before, after).max())
        quiet = quiet + 1 if change <= _TOLERANCE else 0
        before = after
    return ReducedModel(model, found, space.basis, np.array(shifts), change)


def _forces(motion: EquationOfMotion, load: Array) -> Array:
    """The load without torques, which are balanced but for rounding."""
    load[motion.moving :] = 0.0
    return load


def _candidates(omega: Array) -> Array:
    low, high = omega.min() / _MARGIN, omega.max() * _MARGIN
    return np.geomspace(low, high, 1 + int(np.ceil(_PER_DECADE * np.log10(high / low))))


class _Space:
    """Orthonormal basis that grows, with K and B projected on it."""

    def __init__(self, motion: EquationOfMotion, ends: Limits) -> None:
        self._motion = motion
        self._ends = ends
        self._x = ends.fast - ends.slow
        # forces are looked at through a random projection that keeps lengths to some per cent
        rng = np.random.default_rng(0)
        signs = rng.choice([-1.0, 1.0], motion.moving)
        places = (rng.integers(_SKETCH, size=motion.moving), np.arange(motion.moving))
        self._sketch = sparse.coo_array((signs, places), shape=(_SKETCH, motion.moving)).tocsr()
        # K q_slow + k = 0: what slow response leaves at a shift s is s times the drag on it
        drag = (motion.b_qq @ ends.slow + motion.b_qg)[: motion.moving, None]
        self._forces = self._sketch @ drag
        self.basis = np.zeros((motion.size, 0))
        self._k = self._b = np.zeros((0, 0))
        self.add(self._x[:, None])

    def add(self, vectors: Array) -> int:
        """Widen the space by vectors (m, j), one after the other; returns how many do not lie inside."""
        old = self.basis.shape[1]
        self.basis = _orthonormal(self.basis, vectors)
        added = self.basis[:, old:]
        k_added, b_added = self._motion.k_qq @ added, self._motion.b_qq @ added
        self._k = _bordered(self._k, self.basis.T @ k_added)
        self._b = _bordered(self._b, self.basis.T @ b_added)
        forces = np.stack([k_added, b_added], axis=2)[: self._motion.moving].reshape(self._motion.moving, -1)
        self._forces = np.hstack([self._forces, self._sketch @ forces])
        return self.basis.shape[1] - old

    def model(self) -> tuple[RelaxationSpectrum, Modes]:
        """Spectrum and modes of the projected equation."""
        found = modes(self._k, self._b, self.basis.T @ self._x)
        return spectrum(found, self._ends, self._motion.area), found

    def residual(self, omega: Array) -> Array:
        """(f,) force left over by the projected response, squared, over stiffness and the smaller modulus.

        The response q_slow + w at s = i omega leaves s (B q_slow + b) + (K + s B) w. The error of G* goes with its
        square.
        """
        model, found = self.model()
        w = found.coefficients(omega)
        share = np.stack([w, 1j * omega * w], axis=1).reshape(-1, len(omega))
        share = np.vstack([1j * omega, share])
        square = np.sum(np.abs(self._forces @ share) ** 2, axis=0)
        modulus = model.modulus(omega)
        smaller = np.minimum(np.abs(modulus.real), modulus.imag)
        moving = self._motion.moving
        stiffness, drag = (m.diagonal()[:moving].mean() for m in (self._motion.k_qq, self._motion.b_qq))
        return np.asarray(square / ((stiffness + omega * drag) * smaller))


def _orthonormal(basis: Array, vectors: Array) -> Array:
    """Orthonormal basis (m, i) widened by those of the vectors (m, j) that do not lie inside."""
    size = basis.shape[1]
    wider = np.empty((len(basis), size + vectors.shape[1]), order="F")
    wider[:, :size] = basis
    for vector in vectors.T:
        old = wider[:, :size]
        length = float(np.linalg.norm(vector))
        rest = vector
        for _ in range(2):  # once leaves rounding
            rest = rest - old @ (old.T @ rest)
        left = float(np.linalg.norm(rest))
        if left > _DEPENDENT * length:
            new = rest / left
            new -= old @ (old.T @ new)
            wider[:, size] = new / np.linalg.norm(new)
            size += 1
    return wider[:, :size]


def _bordered(matrix: Array, columns: Array) -> Array:
    """Symmetric matrix (m, m) widened by j columns (m + j, j)."""
    old, size = len(matrix), len(columns)
    wider = np.empty((size, size))
    wider[:old, :old] = matrix
    wider[:, old:] = columns
    wider[old:, :old] = columns[:old].T
    return wider
