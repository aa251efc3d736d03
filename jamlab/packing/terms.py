"""What a model hands to mechanics and rheology: small energy terms, and relative velocities at contacts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from jamlab.arrays import Array, Indices, Mask
from jamlab.kernels.library import INTEGER, INTEGERS, REAL, REALS, kernel

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


_OUT = (REALS, REALS, REALS)  # local, gradient, hessian
_central_terms = kernel("central_terms", INTEGER, REALS, REALS, REALS, REALS, REALS, *_OUT)
_tension_terms = kernel("tension_terms", INTEGER, REALS, REAL, REAL, REALS, *_OUT)
_edge_contact_terms = kernel("edge_contact_terms", INTEGER, REALS, REALS, REALS, REALS, REALS, *_OUT)
_area_terms = kernel("area_terms", INTEGER, INTEGER, REALS, INTEGERS, REAL, REALS, *_OUT)


def _room(count: int, sites: int) -> tuple[Array, Array, Array]:
    """Arrays for what the kernels give."""
    local, gradient = np.empty((2, count, sites, 2))
    return local, gradient, np.empty((count, sites, 2, sites, 2))


def central_terms(
    name: str, pairs: Indices, r: Array, normal: Array, energy: Array, slope: Array, along: Array, across: Array
) -> Terms:
    """Terms that depend on r = x_j - x_i (k, 2) only, by forces along a normal (k, 2): `slope` = dU/dr and stiffness
    `along` (k,) the normal, and `across` (k,) it."""
    local, gradient, hessian = _room(len(r), 2)
    given = [np.ascontiguousarray(each, dtype=np.float64) for each in (r, normal, slope, along, across)]
    _central_terms(len(r), *given, local, gradient, hessian)
    return Terms(name, pairs, local, energy, gradient, hessian)


def tension_terms(name: str, pairs: Indices, edge: Array, gamma: float, eta: float) -> Terms:
    """gamma sqrt(l^2 + eta^2) of edges (k, 2) of length l."""
    energy, (local, gradient, hessian) = np.empty(len(edge)), _room(len(edge), 2)
    _tension_terms(len(edge), edge, gamma, eta, energy, local, gradient, hessian)
    return Terms(name, pairs, local, energy, gradient, hessian)


def edge_contact_terms(
    name: str, sites: Indices, place: Array, r: Array, edge: Array, energy: Array, slope: Array, stiffness: Array
) -> Terms:
    """Terms that depend on the distance of a vertex from the inner part of an edge. `sites`: (k, 3) vertex, tail and
    head; `place`: (k,) t of the closest point, (1 - t) tail + t head; `r`: (k, 2) from there to the vertex; `edge`:
    (k, 2) from tail to head."""
    local, gradient, hessian = _room(len(r), 3)
    _edge_contact_terms(len(r), place, r, edge, slope, stiffness, local, gradient, hessian)
    return Terms(name, sites, local, energy, gradient, hessian)


def area_terms(name: str, positions: Array, first: Indices, count: int, ka: float, excess: Array) -> Terms:
    """(ka/2)(a - a0)^2 of polygons of `count` vertices each. `first`: (k,) of these; `excess`: (k,) a - a0."""
    local, gradient, hessian = _room(len(first), count)
    _area_terms(len(first), count, positions, first, ka, excess, local, gradient, hessian)
    return Terms(name, first[:, None] + np.arange(count), local, 0.5 * ka * excess**2, gradient, hessian)


@dataclass(frozen=True)
class ContactJacobian:
    """Contact Jacobian: relative velocity at m contacts as a linear function of all rates (compatibility matrix)."""

    normal: Array  # (m, 2) unit vectors
    flow: Array  # (m, 2) affine velocity difference at unit rate of a shear, by its generator
    stiffness: Array  # (m,)
    sites: Indices  # (m, j) that each contact joins
    weights: Array  # (m, j) of their velocities in the difference
    rolling: SparseRows  # (m, size) part of the tangential velocity that both surfaces take back by rotating
    levers: Array | None = None  # (m, 2) arms of two particles that turn

    @property
    def tangent(self) -> Array:
        """(m, 2) unit vectors, the normal turned counterclockwise."""
        return np.column_stack([-self.normal[:, 1], self.normal[:, 0]])


@dataclass(frozen=True)
class SparseRows:
    """(m, size) matrix with as many numbers in each row; its product with a vector needs no scipy."""

    values: Array  # (m, j)
    columns: Indices  # (m, j); one may stand twice, and its values add up
    size: int  # of what they are multiplied with
    inner: SparseRows | None = None  # whose rows the columns are

    def __matmul__(self, vector: Array) -> Array:
        found = vector if self.inner is None else self.inner @ vector
        return np.asarray(np.einsum("mj,mj->m", self.values, found[self.columns]))

    def matrix(self) -> sparse.csr_array:
        """The same as a matrix of scipy."""
        from scipy import sparse

        width = self.size if self.inner is None else len(self.inner.values)
        rows = np.repeat(np.arange(len(self.values), dtype=np.int32), self.values.shape[1])
        places = (rows, self.columns.ravel().astype(np.int32))  # else all that is made of it has indices twice as long
        own = sparse.coo_array((self.values.ravel(), places), shape=(len(self.values), width)).tocsr()
        return own if self.inner is None else own @ self.inner.matrix()
