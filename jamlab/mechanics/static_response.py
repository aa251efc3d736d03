"""The static response of a packing to strain in one compiled call, where no floppy mode is near.

Positions move as x = (1 + E) X + u. The kernel adds up the energy's second derivatives K_uu, K_uE and K_EE from its
terms, and solves K_uu u = -K_uE E for each component of E by Cholesky factors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array, Mask
from jamlab.kernels.library import INTEGER, INTEGERS, REAL, REALS, kernel
from jamlab.mechanics.factors import SOFT
from jamlab.mechanics.force_network import force_network
from jamlab.mechanics.stiffness import energy_terms
from jamlab.packing.packing import Packing
from jamlab.packing.terms import Terms

_OUT = (REALS, REALS, REALS, REALS)
_respond = kernel("static_response", INTEGER, INTEGERS, INTEGER, INTEGERS, INTEGER, REAL, REAL, REALS, *_OUT)
_STAYS, _ABSENT = -1, -2  # as in static_response.cpp
_FIRM = 0


@dataclass(frozen=True)
class StrainResponse:
    """How sites answer the components of a strain."""

    forces: Array  # (n_sites, 2) -dU/du, 0 on absent sites
    affine: Array  # (2, 2, 2, 2) K_EE
    back: Array  # (2, 2, 2, 2) K_uE^T K_uu^-1 K_uE
    displacements: Array  # (n_sites, 2, 2, 2) u, 0 of sites that stay or are absent
    firm: bool  # whether K_uu is positive definite and no floppy mode may answer; else `back` and u mean nothing


def static_response_of(packing: Packing, prestress: bool) -> tuple[Array, Array, Array] | None:
    """K_EE, K_uE^T K_uu^-1 K_uE, and the displacements (n_sites, 2, 2, 2) of a packing without its rattlers; None where
    the Hessian is not positive definite or floppy modes may answer a strain."""
    network, frame = force_network(packing), packing.frame
    network.check_known()
    if frame.kept_shapes.any():  # fixed droplets, whose outlines strains bend
        return None
    row = _rows(network.held, frame.free_sites, frame.all_free)
    found = respond(energy_terms(packing, prestress=prestress), row, packing.law.floppy)
    network.check_balance(frame.hold(found.forces))
    return (found.affine, found.back, found.displacements) if found.firm else None


def _rows(held: Mask, free: Mask, all_free: bool) -> NDArray[np.int64]:
    """(n_sites,) row of each site in the matrix. Where all are free, the packing moves as a whole at no cost, and a
    site stays: the others move relative to it."""
    solved = held & free
    if all_free:
        solved[solved.argmax()] = False
    return np.where(solved, np.cumsum(solved) - 1, np.where(held, _STAYS, _ABSENT))


def respond(terms: Sequence[Terms], row: NDArray[np.int64], floppy: float) -> StrainResponse:
    """The response by some terms. `row`: (n_sites,) of each site in the matrix, -1: stays, -2: absent, with all terms
    that it is part of; `floppy`: see `PairLaw`."""
    names, size, count = ("sites", "local", "gradient", "hessian"), len(row), int(row.max(initial=-1)) + 1
    groups = [[np.ascontiguousarray(getattr(term, name)) for name in names] for term in terms]
    # of each group: count, sites of a term, and where its arrays lie in memory
    table = [[*group[0].shape, *(each.__array_interface__["data"][0] for each in group)] for group in groups]
    push = np.random.default_rng(0).standard_normal(2 * count)  # yields far along modes within rounding of zero
    forces, displacements = np.empty((size, 2)), np.empty((size, 2, 2, 2))
    affine, back = np.empty((2, 2, 2, 2)), np.empty((2, 2, 2, 2))
    found = _respond(
        len(groups), np.array(table, dtype=np.int64), size, row, count, floppy, SOFT.near, push,
        forces, affine, back, displacements,
    )  # fmt: skip
    return StrainResponse(forces, affine, back, displacements, found == _FIRM)
