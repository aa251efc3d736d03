"""The lowest modes of what a packing minimises: its energy at a fixed box, its enthalpy where the pressure is held.

At a held pressure the change of the area is one coordinate more. With a strain e = log(area), r -> exp(e M) r and
s = e sqrt(area), the second derivatives of H = U + p A are those of U in the sites, K_uE : M / sqrt(A) between sites
and s, and (M : K_EE : M - A S : M M + p A)/A in s. A fold of the enthalpy is where the lowest eigenvalue vanishes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from jamlab.arrays import Array, Indices
from jamlab.errors import ConvergenceError
from jamlab.mechanics.factors import SymmetricFactors
from jamlab.mechanics.force_network import force_network
from jamlab.mechanics.stiffness import free_coordinates, stiffness, stress
from jamlab.packing.area_change import compression
from jamlab.packing.packing import Packing

if TYPE_CHECKING:
    from scipy import sparse

DENSE = 800  # coordinates up to which LAPACK finds all modes: 0.1 s
ZERO = 1e-9  # eigenvalue over the largest element that counts as zero, see `jamlab.mechanics.vibrations.ITERATION`


def lowest_of_enthalpy(packing: Packing, count: int, pressure: float | None = None) -> tuple[Array, Array]:
    """The modes with the smallest eigenvalues, without zero modes, rattlers and fixed particles.

    Args:
        packing: at a minimum.
        count: number of modes at most.
        pressure: that is held; None: the box is fixed.

    Returns:
        Eigenvalues (k,), ascending, and vectors (k, 2 n_sites), of length 1; at a held pressure (k, 2 n_sites + 1),
        the last entry s.
    """
    matrix, places, size = _second_derivatives(packing, pressure)
    zero = ZERO * float(np.abs(matrix).max())
    if matrix.shape[0] <= DENSE:
        values, vectors = np.linalg.eigh(matrix.toarray())
    else:
        values, vectors = _by_iteration(matrix, count + packing.frame.translations, zero)
    lowest = np.flatnonzero(np.abs(values) > zero)[:count]
    found = np.zeros((len(lowest), size))
    found[:, places] = vectors[:, lowest].T
    return values[lowest], found


def _second_derivatives(packing: Packing, pressure: float | None) -> tuple[sparse.csc_array, Indices, int]:
    """The matrix, the place of each of its rows among all coordinates, and their number."""
    from scipy import sparse

    k, size = stiffness(packing), 2 * len(packing.positions)
    held = np.repeat(force_network(packing).held, 2)
    places = free_coordinates(packing)
    places = places[held[places]]
    uu = k.uu[places][:, places].tocsc()
    if pressure is None:
        return uu, places, size
    m, area = compression(packing).generator, packing.area
    border = np.einsum("nij,ij->n", k.ue.reshape(size, 2, 2), m)[places, None] / np.sqrt(area)
    corner = np.einsum("ij,ijkl,kl->", m, k.ee, m) / area - np.sum(stress(packing) * (m @ m)) + pressure
    blocks = [[uu, sparse.csc_array(border)], [sparse.csc_array(border.T), sparse.csc_array([[corner]])]]
    return sparse.block_array(blocks).tocsc(), np.append(places, size), size + 1


def _by_iteration(matrix: sparse.csc_array, count: int, zero: float) -> tuple[Array, Array]:
    """The modes nearest to a shift just below zero."""
    from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

    shift = 10 * zero
    factors = SymmetricFactors(matrix, shift)
    inverse = LinearOperator(matrix.shape, matvec=factors.solve, dtype=float)
    start = np.random.default_rng(0).standard_normal(matrix.shape[0])
    try:
        values, vectors = eigsh(matrix, k=min(count, matrix.shape[0] - 1), sigma=-shift, OPinv=inverse, v0=start)
    except ArpackNoConvergence as error:
        raise ConvergenceError(f"the {count} lowest modes were not found: {error}") from error
    order = np.argsort(values, kind="stable")
    return values[order], vectors[:, order]
