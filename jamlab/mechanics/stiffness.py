"""Stiffness of a packing: forces, Hessian and its coupling to strain, assembled from the energy terms.

Positions move as x = (1 + E) X + u: a homogeneous displacement gradient E of box and particles plus displacements u at
fixed box. With prestress, second derivatives of the full potential energy are used.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from jamlab.arrays import Array, Indices
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.packing.area_change import compression
from jamlab.packing.derived import per_packing
from jamlab.packing.packing import Packing
from jamlab.packing.strain_map import shapes_of_curvature, shapes_of_stress
from jamlab.packing.terms import Terms

if TYPE_CHECKING:
    from scipy import sparse

MOST_ELEMENTS = 2**31 - 1  # of a sparse matrix: its factorisations count with 32 bits


def assemble(terms: Sequence[Terms], size: int) -> sparse.csc_array:
    """(2 size, 2 size) CSC sum of the Hessians of terms between `size` sites, with sorted indices; every pair of sites
    that shares a term has its 2 x 2 elements, zeros as well, so that terms between the same sites have one pattern."""
    from scipy import sparse

    rows, columns = [], []
    for term in terms:
        place = (2 * term.sites[:, :, None] + np.arange(2)).astype(np.int32)
        place = place.reshape(len(place), 2 * place.shape[1])
        rows.append(np.repeat(place, place.shape[1], axis=1).ravel())
        columns.append(np.tile(place, place.shape[1]).ravel())
    values = np.concatenate([term.hessian.ravel() for term in terms])
    check_elements(size, len(values))
    pairs = (np.concatenate(rows), np.concatenate(columns))
    return sparse.coo_array((values, pairs), shape=(2 * size, 2 * size)).tocsc()


def check_elements(size: int, elements: int) -> None:
    """Refuse a sparse matrix of `size` sites with too many elements."""
    if elements > MOST_ELEMENTS:
        raise InputError(f"a matrix of {size} sites has {elements} elements: at most {MOST_ELEMENTS}")


@per_packing
def energy_terms(packing: Packing, *, prestress: bool = True) -> list[Terms]:
    """Energy of a packing as a sum of small terms, each with its gradient and Hessian in closed form: between two
    disks; the two ends of an edge; a vertex and an edge; all vertices of one polygon. `prestress`: False leaves out the
    part of each Hessian that is proportional to the force in the contact (Baumgarten & Tighe eq 4 with f0 = 0): every
    contact is replaced by an unstressed spring. SP only."""
    return packing.frame.placed(packing.kind.terms(packing, prestress))


def solved_coordinates(packing: Packing) -> Indices:
    """(m,) coordinates 2 i, 2 i + 1 of sites that linear response solves for: those of free particles. Where all are
    free, the packing moves as a whole at no cost, and a site stays: the others move relative to it."""
    moving = free_coordinates(packing)
    return moving[2:] if packing.frame.all_free else moving


def free_coordinates(packing: Packing) -> Indices:
    """(m,) coordinates of free particles."""
    return np.flatnonzero(np.repeat(packing.frame.free_sites, 2))


@dataclass(frozen=True)
class Stiffness:
    """Second derivatives of the potential energy at fixed (u, E) = 0."""

    uu: sparse.csc_array  # (2 n_sites, 2 n_sites) sparse CSC, d2U/du du; coordinates 2 i, 2 i + 1 = u_x, u_y of site i
    ue: Array  # (2 n_sites, 2, 2), d2U/du dE[k, l], E[k, l] = d(displacement k)/d(position l)
    ee: Array  # (2, 2, 2, 2), d2U/dE dE


@per_packing
def forces(packing: Packing) -> Array:
    """(len(positions), 2) forces -dU/dx in numpy, 0 on fixed particles; the engine's own come from LAMMPS."""
    return packing.frame.hold(forces_of(energy_terms(packing), len(packing.positions)))


def forces_of(terms: Sequence[Terms], size: int) -> Array:
    """(size, 2) forces of some terms."""
    return -add_up(terms, [term.gradient for term in terms], size)


def add_up(terms: Sequence[Terms], values: Sequence[Array], size: int) -> Array:
    """(size, ...) sums over all terms of values (k, m, ...) at their sites, in the order of the terms."""
    sites, shape = np.concatenate([term.sites.ravel() for term in terms]), values[0].shape[2:]
    rows = np.concatenate([value.reshape(value.shape[0] * value.shape[1], math.prod(shape)) for value in values])
    total = np.stack([np.bincount(sites, column, size) for column in rows.T], axis=-1)
    return np.asarray(total.reshape(size, *shape), dtype=np.float64)


@checked
def hessian(packing: Packing, *, prestress: bool = True) -> sparse.csc_array:
    """Return the sparse Hessian of the potential energy at fixed box, (2 n_sites, 2 n_sites); 0 for fixed particles.

    Args:
        packing: SP: sites are disks. DP: sites are vertices; perimeter, area and contact terms all count.
        prestress: see `jamlab.mechanics.stiffness.energy_terms`.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> h = jamlab.hessian(p)
        >>> h.shape, bool(abs(h - h.T).max() < 1e-12)
        ((64, 64), True)
    """
    terms, size = energy_terms(packing, prestress=prestress), len(packing.positions)
    return assemble(packing.frame.between_free(terms), size)


def stiffness(packing: Packing, *, prestress: bool = True) -> Stiffness:
    """Assemble the Hessian of a packing and its couplings to a homogeneous strain, of its free particles."""
    terms, size = energy_terms(packing, prestress=prestress), len(packing.positions)
    ue, ee = _couplings(terms, size)
    if (shapes := packing.frame.kept_shapes).any():
        pull = assemble(terms, size) @ shapes.ravel()
        more = shapes_of_curvature(shapes, -forces_of(terms, size), ue, pull)
        ue, ee = ue + more[0], ee + more[1]
    return Stiffness(hessian(packing, prestress=prestress), packing.frame.hold(ue, 2), ee)


def stiffness_of(terms: Sequence[Terms], size: int) -> Stiffness:
    """The same of some terms between `size` sites."""
    return Stiffness(assemble(terms, size), *_couplings(terms, size))


def _couplings(terms: Sequence[Terms], size: int) -> tuple[Array, Array]:
    """`ue` and `ee` of `Stiffness`."""
    couplings = [np.einsum("kaibj,kbl->kaijl", term.hessian, term.local) for term in terms]
    ee = np.zeros((2, 2, 2, 2))
    for term, coupling in zip(terms, couplings, strict=True):
        ee += np.einsum("kal,kaijm->iljm", term.local, coupling)
    return add_up(terms, couplings, size).reshape(2 * size, 2, 2), ee


@per_packing
def stress(packing: Packing) -> Array:
    """(2, 2) stress -(1/A) dU/dE, positive in compression (Boromand et al. eq 6), every energy term counted; fixed
    particles are carried along by `Frame.carried`."""
    terms = energy_terms(packing)
    found = stress_of(terms, packing.area)
    if (shapes := packing.frame.kept_shapes).any():
        gradient = -forces_of(terms, len(packing.positions))
        found += 0.5 * shapes_of_stress(shapes, gradient) / packing.area * np.eye(2)
    return found


def stress_of(terms: Sequence[Terms], area: float) -> Array:
    """(2, 2) stress of some terms in a box of an area."""
    total = np.zeros((2, 2))
    for term in terms:
        total -= np.einsum("kai,kal->il", term.gradient, term.local)
    return total / area


def pressure(packing: Packing) -> float:
    """p = -dU/dA, positive in compression: (S_xx + S_yy)/2; between walls S_yy, the normal stress on them."""
    return compression(packing).pressure(stress(packing))
