"""Reduced model of the equation of motion for all frequencies: a rational Krylov space of real positive shifts.

G*(omega) is a transfer function of two symmetric semi-definite matrices. Projected on responses at a few real shifts s,
for which K + s B is positive definite, and on the slow and fast limits, the equation keeps its form with few
coordinates; its modes are a relaxation spectrum of some tens of lines that has the G* of the whole one.
"""

from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import ConvergenceError
from jamlab.rheology.equation_of_motion import EquationOfMotion
from jamlab.rheology.relaxation_spectrum import RelaxationModes, RelaxationSpectrum, build_spectrum, find_modes
from jamlab.rheology.rounding_error import larger_relative
from jamlab.rheology.slow_and_fast_limits import Limits


@dataclass(frozen=True)
class Search:
    """How shifts are chosen; they steer the cost, and what they miss shows in `ReducedModel.missing`."""

    # Krylov steps at a shift: with one the search may stop too early; a factorisation costs ten solves
    steps: int = 12
    # relative error of G' and G'' at which the search ends; rounding near onset is 1e-10 to 1e-8
    tolerance: float = 1e-9
    # updates in a row below it that end the search: one alone may be a shift that happened to add nothing
    quiet: int = 2
    # factor on what the next update may change, its residual times the most that any has changed for its own
    safety: float = 10.0
    most_shifts: int = 60  # two to six are used over ten decades
    per_decade: int = 6  # candidates for the next shift
    margin: float = 30.0  # candidates reach this factor beyond the frequencies: a Maxwell element is a decade wide
    # rows of the random projection by which residuals are compared; lengths err by sqrt(2/2048), 3 %
    sketch: int = 2048
    # part of a new vector outside the space that is a direction, not the rounding of 10 000 products
    dependent: float = 1e-12


SEARCH = Search()


@dataclass(frozen=True)
class ReducedModel:
    """Outcome of the reduction."""

    spectrum: RelaxationSpectrum  # Maxwell elements
    modes: RelaxationModes  # generalised modes on `basis`
    basis: Array  # (m, j) orthonormal
    missing: float  # estimated relative error of G' or G'', the larger, over all frequencies


def reduce(motion: EquationOfMotion, limits: Limits, omega: Array) -> ReducedModel:
    """Reduce an equation of motion to the few coordinates that its response needs at positive frequencies (f,)."""
    space = _Space(motion, limits)
    start = _without_torques(motion, motion.b_qq @ limits.slow + motion.b_qg)
    candidates = _place_candidates(omega)
    solver = limits.solver
    changes = list[float]()
    missing, gain = np.inf, 0.0
    model, found = space.model()
    before = model.modulus(omega)
    residual = space.residual(candidates, model, found)
    while missing > SEARCH.tolerance and len(candidates):
        if len(changes) == SEARCH.most_shifts:
            raise ConvergenceError(
                f"G*(omega) still changes by {changes[-1]:.2g} after {SEARCH.most_shifts} shifts: use method='direct'"
            )
        # real shifts do not make the residual vanish at i omega: never choose one twice
        worst = int(np.argmax(residual))
        shift, largest = float(candidates[worst]), float(residual[worst])
        candidates, residual = np.delete(candidates, worst), np.delete(residual, worst)
        solver.factorise(shift)
        vector = start
        chain = []
        for _ in range(SEARCH.steps):
            vector = solver.solve(vector)
            chain.append(vector)
            vector = _without_torques(motion, motion.b_qq @ vector)
        space.add(np.column_stack(chain))
        model, found = space.model()
        after = model.modulus(omega)
        changes.append(float(larger_relative(after - before, after).max()))
        before = after
        residual = space.residual(candidates, model, found)
        gain = max(gain, changes[-1] / largest if largest else 0.0)
        if len(changes) >= SEARCH.quiet:
            missing = max(changes[-SEARCH.quiet :])
        if len(changes) > SEARCH.quiet:
            missing = min(missing, SEARCH.safety * gain * float(residual.max(initial=0.0)))
    solver.forget()
    return ReducedModel(model, found, space.basis, missing)


def _without_torques(motion: EquationOfMotion, load: Array) -> Array:
    """A copy of the load (m,) whose torques, which are balanced but for rounding, are 0."""
    forces = load.copy()
    forces[motion.moving :] = 0.0
    return forces


def _place_candidates(omega: Array) -> Array:
    low, high = omega.min() / SEARCH.margin, omega.max() * SEARCH.margin
    return np.geomspace(low, high, 1 + int(np.ceil(SEARCH.per_decade * np.log10(high / low))))


class _Space:
    """Orthonormal basis that grows, with K and B projected on it."""

    def __init__(self, motion: EquationOfMotion, limits: Limits) -> None:
        from scipy import sparse

        self._motion = motion
        self._limits = limits
        self._x = limits.fast - limits.slow
        # a random projection keeps the lengths of forces to some per cent and is much shorter than they are
        rng = np.random.default_rng(0)
        signs = rng.choice([-1.0, 1.0], motion.moving)
        places = (rng.integers(SEARCH.sketch, size=motion.moving), np.arange(motion.moving))
        self._sketch = sparse.coo_array((signs, places), shape=(SEARCH.sketch, motion.moving)).tocsr()
        # K q_slow + k = 0: what slow response leaves at a shift s is s times the drag on it
        drag = (motion.b_qq @ limits.slow + motion.b_qg)[: motion.moving, None]
        self._forces = self._sketch @ drag
        # room for all; the system gives memory to what is written
        self._columns = np.empty((motion.size, 1 + SEARCH.steps * SEARCH.most_shifts), order="F")
        self._size = 0
        self._k = self._b = np.zeros((0, 0))
        self.add(self._x[:, None])

    def add(self, vectors: Array) -> None:
        """Widen the space by those of vectors (m, j), one after the other, that do not lie inside it."""
        before = self._size
        old = self.basis
        lengths = np.linalg.norm(vectors, axis=0)
        for _ in range(2):  # "twice is enough": one pass of Gram-Schmidt leaves rounding
            vectors = vectors - old @ (old.T @ vectors)
        for vector, length in zip(np.asfortranarray(vectors).T, lengths, strict=True):
            new = self._columns[:, before : self._size]
            rest = vector - new @ (new.T @ vector)
            left = float(np.linalg.norm(rest))
            if left > SEARCH.dependent * length:
                rest = rest / left
                for basis in (old, new):
                    rest -= basis @ (basis.T @ rest)
                self._columns[:, self._size] = rest / np.linalg.norm(rest)
                self._size += 1
        added = self.basis[:, before:]
        k_added, b_added = self._motion.k_qq.T @ added, self._motion.b_qq.T @ added  # symmetric
        self._k = _border(self._k, self.basis.T @ k_added)
        self._b = _border(self._b, self.basis.T @ b_added)
        forces = np.stack([k_added, b_added], axis=2)[: self._motion.moving].reshape(self._motion.moving, -1)
        self._forces = np.hstack([self._forces, self._sketch @ forces])

    @property
    def basis(self) -> Array:
        """(m, j) orthonormal so far."""
        return self._columns[:, : self._size]

    def model(self) -> tuple[RelaxationSpectrum, RelaxationModes]:
        """Solve the projected equation: its spectrum and modes."""
        found = find_modes(self._k, self._b, self.basis.T @ self._x)
        return build_spectrum(found, self._limits, self._motion.area), found

    def residual(self, omega: Array, model: RelaxationSpectrum, found: RelaxationModes) -> Array:
        """(f,) force left over by the response of the `model`, squared, over stiffness and the smaller modulus. The
        response q_slow + w at s = i omega leaves s (B q_slow + b) + (K + s B) w. The error of G* goes with its
        square."""
        w = found.coefficients(omega)
        share = np.stack([w, 1j * omega * w], axis=1).reshape(2 * len(w), len(omega))
        share = np.vstack([1j * omega, share])
        square = np.sum(np.abs(self._forces @ share) ** 2, axis=0)
        modulus = model.modulus(omega)
        smaller = np.minimum(np.abs(modulus.real), modulus.imag)
        moving = self._motion.moving
        stiffness, drag = (m.diagonal()[:moving].mean() for m in (self._motion.k_qq, self._motion.b_qq))
        return np.asarray(square / ((stiffness + omega * drag) * smaller))


def _border(matrix: Array, columns: Array) -> Array:
    """Widen a symmetric matrix (m, m) by j columns (m + j, j)."""
    old, size = len(matrix), len(columns)
    wider = np.empty((size, size))
    wider[:old, :old] = matrix
    wider[:, old:] = columns
    wider[old:, :old] = columns[:old].T
    return wider
