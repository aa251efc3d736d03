"""Rounding error of G*(omega): a bound from the rounding of the matrices.

A good solver answers exactly for matrices whose entries are off by a few units in the last place. To first order that
moves A G* = Q^T (K + i omega B) Q, Q = (q, 1), by Q^T dM Q, so |Q|^T |M| |Q| times the unit of rounding bounds the
error; real and imaginary parts are bounded apart, since one may be 1e12 times smaller.

The direct solver takes one complex symmetric sparse factorisation for each frequency, Baumgarten & Tighe eq 12.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array, Complex
from jamlab.mechanics.factors import ComplexFactors
from jamlab.mechanics.floppy_modes import least_along
from jamlab.rheology.equation_of_motion import TRACES, BorderedMatrix, EquationOfMotion

if TYPE_CHECKING:
    from scipy import sparse


@dataclass(frozen=True)
class MatrixRounding:
    """What rounding leaves."""

    # Factors without pivoting may lose digits, and a refinement brings the residual back to rounding. Disks and
    # droplets under contact damping are there without, at 1e-13; two are a guard for soft packings and for
    # Stokes drag.
    refinements: int = 2
    # Entries of K and B are sums of a few products each, so that they err by a few units in the last place;
    # with four, the estimate is never ten times too low against extended precision
    # (tests/rheology/test_complex_modulus.py).
    entries: float = 4.0 * float(np.finfo(np.float64).eps)
    dragless: float = 1e-14  # drag along a floppy mode, over the largest, that is rounding
    nothing: float = 1e-200  # below every modulus at a frequency that is allowed


OF_ROUNDING = MatrixRounding()


def solve_frequency(motion: EquationOfMotion, floppy: Array, omega: float) -> tuple[Complex, complex, complex]:
    """Solve for the response to unit strain at one frequency: (m,) q; G* = (M_gg + M_gq q)/A with M = K + i omega B,
    eq 12 after elimination of all but gamma (their eq 13 is printed upside down); and the error of G* that the
    equation's remaining residual r amounts to, q^T r / A. `floppy`: (m, k) floppy modes, see `Limits`; only drag
    resists motion along them, so at low frequencies rounding of K would decide on it. With masses M = K + i omega B -
    omega^2 m, and inertia resists as well."""
    matrix = _dynamic_stiffness(motion, motion.b_qq, omega)
    column = motion.k_qg + 1j * omega * motion.b_qg
    solved = _dynamic_stiffness(motion, motion.b_solved, omega)
    solver = _Driftless(motion, solved, omega) if motion.drifting else ComplexFactors(solved)

    def balanced(q: Complex) -> Complex:
        if motion.mass is not None or not floppy.size:
            return q
        balancing: Complex = q + least_drag(motion, floppy, motion.b_qq @ q + motion.b_qg)
        return balancing

    q = balanced(-solver.solve(column))
    for _ in range(OF_ROUNDING.refinements):
        q = balanced(q + solver.solve(-column - matrix @ q))
    residual = -column - matrix @ q
    corner = motion.k_gg + 1j * omega * motion.b_gg
    return q, complex(corner + column @ q) / motion.area, complex(q @ residual) / motion.area


def _dynamic_stiffness(motion: EquationOfMotion, drag: sparse.csc_array, omega: float) -> sparse.csc_array:
    """(m, m) K + i omega B - omega^2 m."""
    from scipy import sparse

    matrix = motion.k_qq + 1j * omega * drag
    if motion.mass is not None:
        matrix = matrix + sparse.diags_array(-(omega**2) * motion.mass, format="csc")
    return sparse.csc_array(matrix)


class _Driftless:
    """Solver of M q = f under drag or inertia on translations t, for forces f without resultant. M t = (i omega B -
    omega^2 m) t vanishes with omega, and rounding would start a drift. Write q = q_rel + t c with site 0 of q_rel at
    rest; no net force, t^T (M - K) q = 0, gives c, and q_rel obeys M less a matrix of rank two."""

    def __init__(self, motion: EquationOfMotion, matrix: sparse.csc_array, omega: float) -> None:
        self._axes = motion.translations
        drag = motion.b_qq @ self._axes
        if motion.mass is not None:  # over i omega; drag at contacts resists no translation but for rounding
            drag[np.abs(drag) <= TRACES.rounding * (abs(motion.b_qq) @ self._axes)] = 0.0
            drag = drag + 1j * omega * motion.mass[:, None] * self._axes
        self._drag, self._total = drag[2:], self._axes.T @ drag
        self._factors = ComplexFactors(matrix[2:, 2:].tocsc())
        self._dragged = self._factors.solve(1j * omega * self._drag)
        self._small = self._total - self._drag.T @ self._dragged

    def solve(self, force: Complex) -> Complex:
        """(m,) response to a force (m,)."""
        relative = self._factors.solve(force[2:])
        relative = relative + self._dragged @ np.linalg.solve(self._small, self._drag.T @ relative)
        drift = -np.linalg.solve(self._total, self._drag.T @ relative)
        q: Complex = (self._axes @ drift).astype(np.complex128)
        q[2:] += relative
        return q


def least_drag(motion: EquationOfMotion, floppy: Array, drag: NDArray[Any]) -> NDArray[Any]:
    """(m,) motion along floppy modes (m, k) that balances a drag (m,) on them."""
    dragged = floppy.T @ (motion.b_qq @ floppy)
    return least_along(floppy, dragged, floppy.T @ drag, OF_ROUNDING.dragless * float(motion.b_qq.diagonal().max()))


def dissipated_loss(motion: EquationOfMotion, q: Complex, omega: Array) -> Array:
    """(f,) G'' = omega Q^H B Q / A from responses q (m, f): the power that drag dissipates, a sum of squares."""
    strained = np.vstack([q, np.ones_like(omega)])
    power = [np.einsum("if,if->f", part, motion.b @ part) for part in (strained.real, strained.imag)]
    return np.asarray(omega * (power[0] + power[1]) / motion.area)


def variational_modulus(motion: EquationOfMotion, q: Complex, omega: Array) -> Complex:
    """(f,) G* = Q^T (K + i omega B) Q / A from responses q (m, f); errors of q enter squared."""
    strained = np.vstack([q, np.ones_like(omega)])
    return _quadratic_form(motion.k, motion.b, strained.real, strained.imag, omega, -1.0) / motion.area


def rounding_error(motion: EquationOfMotion, q: Complex, omega: Array) -> Complex:
    """(f,) bounds of rounding in G' and, as imaginary part, in G'', for responses q (m, f)."""
    strained = np.vstack([q, np.ones_like(omega)])
    slow, fast = np.abs(strained.real), np.abs(strained.imag)
    force = _quadratic_form(abs(motion.k), abs(motion.b), slow, fast, omega, 1.0)
    if motion.mass is not None:
        squares = motion.mass @ slow[:-1] ** 2 + motion.mass @ fast[:-1] ** 2
        force = force + omega**2 * (squares + 2j * (motion.mass @ (slow[:-1] * fast[:-1])))
    return np.asarray(OF_ROUNDING.entries * force / motion.area)


def _quadratic_form(
    k: BorderedMatrix, b: BorderedMatrix, slow: Array, fast: Array, omega: Array, sign: float
) -> Complex:
    """(f,) Q^T (K + i omega B) Q of Q = slow + i fast, by its real and imaginary parts; `sign` is that of i^2."""
    k_slow, k_fast, b_slow, b_fast = (m @ v for m in (k, b) for v in (slow, fast))

    def dot(left: Array, right: Array) -> Array:
        return np.asarray(np.einsum("if,if->f", left, right))

    storage = dot(slow, k_slow) + sign * dot(fast, k_fast) + sign * 2 * omega * dot(slow, b_fast)
    loss = 2 * dot(slow, k_fast) + omega * (dot(slow, b_slow) + sign * dot(fast, b_fast))
    return np.asarray(storage + 1j * loss)


def relative_parts(error: Complex, modulus: Complex) -> Complex:
    """(f,) relative error of G' and, imaginary, of G''; enormous where one of them is 0."""
    storage = np.abs(error.real) / np.maximum(np.abs(modulus.real), OF_ROUNDING.nothing)
    loss = np.abs(error.imag) / np.maximum(np.abs(modulus.imag), OF_ROUNDING.nothing)
    return np.asarray(storage + 1j * loss)


def larger_relative(error: Complex, modulus: Complex) -> Array:
    """(f,) larger of the relative errors of G' and G''."""
    parts = relative_parts(error, modulus)
    return np.asarray(np.maximum(parts.real, parts.imag))
