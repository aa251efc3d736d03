"""The linear map that takes vectors to neighbours to the next state with the least squares, and what it leaves.

With r the vectors of a particle to its neighbours before, and u how they change,

    G = (sum of u r^T) (sum of r r^T)^-1,    D2min = sum of |u - G r|^2.

Source: M. L. Falk & J. S. Langer, Phys. Rev. E 57, 7192 (1998), eqs 2.11 to 2.13.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array, Indices

LEAST = 3  # neighbours: two vectors determine a map without remainder


@dataclass(frozen=True)
class BestMaps:
    """One linear map a particle, nan where neighbours do not determine it."""

    change: Array  # (n, 2, 2) G, the map less 1
    left: Array  # (n,) sum of squares that the map leaves
    neighbors: Indices  # (n,)
    undefined: NDArray[np.str_]  # (n,) why there is no map, "" where there is one


def best_maps(n: int, i: Indices, r: Array, u: Array) -> BestMaps:
    """Fit the map of each of n particles.

    Args:
        n: number of particles.
        i: (m,) particle that each vector begins at; a pair is listed from both ends.
        r: (m, 2) vectors to neighbours before.
        u: (m, 2) their changes.
    """
    count = np.bincount(i, minlength=n)
    square, mixed = _sums(n, i, r, r), _sums(n, i, u, r)
    wide = np.linalg.eigvalsh(square)
    undefined = np.full(n, "", dtype="<U19")
    undefined[wide[:, 0] <= FLAT * wide[:, 1]] = "neighbors on a line"
    undefined[count < LEAST] = "too few neighbors"
    known = undefined == ""
    change = np.full((n, 2, 2), np.nan)
    change[known] = np.linalg.solve(square[known], np.swapaxes(mixed[known], 1, 2)).swapaxes(1, 2)
    rest = u - np.einsum("mab,mb->ma", change[i], r)
    left = np.bincount(i, np.einsum("ma,ma->m", rest, rest), n)
    return BestMaps(change, np.where(known, left, np.nan), count, undefined)


FLAT = 1e-9  # smaller over larger eigenvalue of sum of r r^T: neighbours on a line, but for rounding


def _sums(n: int, i: Indices, a: Array, b: Array) -> Array:
    """(n, 2, 2) sum of a b^T over the rows of each particle."""
    return np.stack([[np.bincount(i, a[:, k] * b[:, m], n) for m in (0, 1)] for k in (0, 1)]).transpose(2, 0, 1)
