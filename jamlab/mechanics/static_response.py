"""The static response of a packing to strain in one compiled call, where no floppy mode is near.

Positions move as x = (1 + E) X + u. The kernel adds up the energy's second derivatives K_uu, K_uE and K_EE from its
terms, and solves K_uu u = -K_uE E for each component of E by Cholesky factors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array, Mask
from jamlab.kernels.library import INDICES, INTEGER, INTEGERS, REAL, REALS, kernel
from jamlab.mechanics.factors import SOFT
from jamlab.mechanics.stiffness import check_elements
from jamlab.packing.terms import Terms

if TYPE_CHECKING:
    from scipy import sparse  # slow to load, and needed beside floppy modes alone

_TERMS = (INTEGER, INTEGERS, INTEGER, INTEGERS, INTEGER)  # groups of them, and rows of sites
_respond = kernel("static_response", *_TERMS, REAL, REAL, REALS, REALS, REALS, REALS, REALS)
_strain_stiffness = kernel("strain_stiffness", *_TERMS, REALS, REALS, INDICES, INDICES, REALS)
_STAYS, _ABSENT = -1, -2  # as in static_response.cpp
_FIRM, _UNSTABLE = 0, 2


@dataclass(frozen=True)
class StrainResponse:
    """How sites answer the components of a strain."""

    forces: Array  # (n_sites, 2) -dU/du, 0 on absent sites
    affine: Array  # (2, 2, 2, 2) K_EE
    back: Array  # (2, 2, 2, 2) K_uE^T K_uu^-1 K_uE
    displacements: Array  # (n_sites, 2, 2, 2) u, 0 of sites that stay or are absent
    firm: bool  # whether K_uu is positive definite and no floppy mode may answer; else `back` and u mean nothing
    unstable: bool  # whether K_uu has eigenvalues that are negative beyond rounding


@dataclass(frozen=True)
class StrainStiffness:
    """Second derivatives of the energy that the response follows from, of sites that strains move."""

    uu: sparse.csc_array  # (n, n) coordinates 2 i, 2 i + 1 of row i
    ue: Array  # (n, 4)
    ee: Array  # (2, 2, 2, 2)


def rows_of(held: Mask, free: Mask, all_free: bool) -> NDArray[np.int64]:
    """(n_sites,) row of each site in the matrix. Where all are free, the packing moves as a whole at no cost, and a
    site stays: the others move relative to it."""
    solved = held & free
    if all_free:
        solved[solved.argmax()] = False
    return np.where(solved, np.cumsum(solved) - 1, np.where(held, _STAYS, _ABSENT))


def respond(terms: Sequence[Terms], row: NDArray[np.int64], floppy: float) -> StrainResponse:
    """The response by some terms. `row`: (n_sites,) of each site in the matrix, -1: stays, -2: absent, with all terms
    that it is part of; `floppy`: see `PairLaw`."""
    groups, size, count = _Groups(terms), len(row), _count(row)
    forces, displacements = np.empty((size, 2)), np.empty((size, 2, 2, 2))
    affine, back = np.empty((2, 2, 2, 2)), np.empty((2, 2, 2, 2))
    found = _respond(
        *groups.table, size, row, count, floppy, SOFT.near, _push(count), forces, affine, back, displacements
    )
    return StrainResponse(forces, affine, back, displacements, found == _FIRM, found == _UNSTABLE)


def _push(count: int) -> Array:
    """A random push, which yields far along modes within rounding of zero."""
    return np.random.default_rng(0).standard_normal(2 * count)


def strain_stiffness(terms: Sequence[Terms], row: NDArray[np.int64]) -> StrainStiffness:
    """What `respond` solves with."""
    from scipy import sparse

    groups, size, count = _Groups(terms), len(row), _count(row)
    room = sum(4 * term.sites.size * term.sites.shape[1] for term in terms)
    check_elements(count, room)
    couplings, ee, numbers = np.empty((2 * count, 4)), np.empty((2, 2, 2, 2)), np.empty(room)
    first, indices = np.empty(2 * count + 1, dtype=np.int32), np.empty(room, dtype=np.int32)
    found = _strain_stiffness(*groups.table, size, row, count, couplings, ee, first, indices, numbers)
    matrix = sparse.csc_array((numbers[:found], indices[:found], first), shape=(2 * count, 2 * count))
    return StrainStiffness(matrix, couplings, ee)


class _Groups:
    """What the kernels know of groups of terms; their arrays live as long."""

    def __init__(self, terms: Sequence[Terms]) -> None:
        names = ("sites", "local", "gradient", "hessian")
        self._arrays = [[np.ascontiguousarray(getattr(term, name)) for name in names] for term in terms]

    @property
    def table(self) -> tuple[int, NDArray[np.int64]]:
        """Number of groups, and of each (k, 6) its count, the sites of a term, and where its arrays lie in memory."""
        rows = [[*group[0].shape, *(each.__array_interface__["data"][0] for each in group)] for group in self._arrays]
        return len(rows), np.array(rows, dtype=np.int64)


def _count(row: NDArray[np.int64]) -> int:
    return int(row.max(initial=-1)) + 1
