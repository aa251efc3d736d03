"""What a model hands to mechanics and rheology: small energy terms, and relative velocities at contacts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array, Indices, Mask

if TYPE_CHECKING:
    from scipy import sparse  # slow to load, and needed by rheology alone


@dataclass(frozen=True)
class Terms:
    """Energy terms of one kind, k of them, each between m sites (indices into `Packing.positions`)."""

    name: str  # "spring" | "contact" | "tension" | "area"
    sites: Indices  # (k, m) int64
    local: Array  # (k, m, 2) positions of the sites in one common periodic image, relative to the first
    energy: Array  # (k,)
    gradient: Array  # (k, m, 2) dU/dx
    hessian: Array  # (k, m, 2, m, 2) d2U/dx dx

    def among(self, held: Mask) -> Terms:
        """The terms whose sites all remain, numbered as if there were no others. `held`: (n_sites,)."""
        kept, number = held[self.sites].all(axis=1), np.cumsum(held) - 1
        parts = (each[kept] for each in (self.local, self.energy, self.gradient, self.hessian))
        return Terms(self.name, number[self.sites[kept]], *parts)


def pair_terms(name: str, pairs: Indices, r: Array, energy: Array, slope: Array, block: Array) -> Terms:
    """Terms that depend on r = x_j - x_i only; `slope` = dU/dr (k, 2), `block` = d2U/dr dr (k, 2, 2)."""
    sign = np.array([-1.0, 1.0])
    gradient = sign[None, :, None] * slope[:, None, :]
    hessian = np.einsum("a,b,kij->kaibj", sign, sign, block)
    local = np.stack([np.zeros_like(r), r], axis=1)
    return Terms(name, pairs, local, energy, gradient, hessian)


def central_block(normal: Array, along: Array, across: Array) -> Array:
    """(k, 2, 2) d2U/dr dr of a central force: stiffness `along` (k,) the normal (k, 2), and `across` (k,) it."""
    projected = normal[:, :, None] * normal[:, None, :]
    return np.asarray(along[:, None, None] * projected + across[:, None, None] * (np.eye(2) - projected))


@dataclass(frozen=True)
class ContactJacobian:
    """Contact Jacobian: relative velocity at m contacts as a linear function of all rates (compatibility matrix)."""

    normal: Array  # (m, 2) unit vectors
    flow: Array  # (m, 2) affine velocity difference at unit rate of a shear, by its generator
    stiffness: Array  # (m,)
    sites: Indices  # (m, j) that each contact joins
    weights: Array  # (m, j) of their velocities in the difference
    # (m, size) sparse, the part of the tangential velocity that both surfaces take back by rotating
    rolling: sparse.csr_array
    levers: Array | None = None  # (m, 2) arms of two particles that turn


def spread(values: Array, columns: NDArray[np.int64], size: int) -> sparse.csr_array:
    """(m, size) sparse, with values (m, j) in the columns (m, j) of each row."""
    from scipy import sparse

    rows = np.repeat(np.arange(len(values), dtype=np.int32), values.shape[1])
    places = (rows, columns.ravel().astype(np.int32))  # else all that is made of it has indices twice as long
    return sparse.coo_array((values.ravel(), places), shape=(len(values), size)).tocsr()
