"""Rounding error of G*(omega): a bound from the rounding of the matrices.

A good solver answers exactly for matrices whose entries are off by a few units in the last place. To first order that
moves A G* = Q^T (K + i omega B) Q, Q = (q, 1), by Q^T dM Q, so |Q|^T |M| |Q| times the unit of rounding bounds the
error; real and imaginary parts are bounded apart, since one may be 1e12 times smaller.
"""

import numpy as np
from numpy.typing import NDArray

from jamlab.rheology.equation_of_motion import EquationOfMotion

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Entries of K and B are sums of a few products each, so that they err by a few units in the last place; with four, the
# estimate is never ten times too low against extended precision (tests/rheology/test_complex_modulus.py).
ROUNDING = 4.0 * float(np.finfo(np.float64).eps)

_NOTHING = 1e-200  # below every modulus at a frequency that is allowed


def variational_modulus(motion: EquationOfMotion, q: Complex, omega: Array) -> Complex:
    """(f,) G* = Q^T (K + i omega B) Q / A from responses q (m, f); errors of q enter squared."""
    strained = np.vstack([q, np.ones_like(omega)])
    slow, fast = strained.real, strained.imag
    k_slow, k_fast, b_slow, b_fast = (m @ v for m in (motion.k, motion.b) for v in (slow, fast))

    def dot(a: Array, b: Array) -> Array:
        return np.asarray(np.einsum("if,if->f", a, b))

    storage = dot(slow, k_slow) - dot(fast, k_fast) - 2 * omega * dot(slow, b_fast)
    loss = 2 * dot(slow, k_fast) + omega * (dot(slow, b_slow) - dot(fast, b_fast))
    return np.asarray((storage + 1j * loss) / motion.area)


def rounding_error(motion: EquationOfMotion, q: Complex, omega: Array) -> Complex:
    """(f,) bounds of rounding in G' and, as imaginary part, in G'', for responses q (m, f)."""
    strained = np.vstack([q, np.ones_like(omega)])
    slow, fast = np.abs(strained.real), np.abs(strained.imag)
    k, b = abs(motion.k), abs(motion.b)

    def dot(a: Array, b: Array) -> Array:
        return np.asarray(np.einsum("if,if->f", a, b))

    k_fast, b_slow, b_fast = k @ fast, b @ slow, b @ fast
    storage = dot(slow, k @ slow) + dot(fast, k_fast) + 2 * omega * dot(slow, b_fast)
    loss = 2 * dot(slow, k_fast) + omega * (dot(slow, b_slow) + dot(fast, b_fast))
    return np.asarray(ROUNDING * (storage + 1j * loss) / motion.area)


def larger_relative(error: Complex, modulus: Complex) -> Array:
    """(f,) larger of the relative errors of G' and G''; enormous where one of them is 0."""
    return np.maximum(
        np.abs(error.real) / np.maximum(np.abs(modulus.real), _NOTHING),
        np.abs(error.imag) / np.maximum(np.abs(modulus.imag), _NOTHING),
    )
