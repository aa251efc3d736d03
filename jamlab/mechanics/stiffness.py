"""Stiffness of a packing: forces, Hessian and its coupling to strain, assembled from the energy terms.

Positions move as x = (1 + E) X + u: a homogeneous displacement gradient E of box and particles plus displacements u at
fixed box. With prestress the second derivatives are those of the full potential energy.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from jamlab.checks import checked
from jamlab.mechanics.energy_terms import Terms, energy_terms
from jamlab.mechanics.sparse_assembly import assemble
from jamlab.packing.packing import Packing

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Stiffness:
    """Second derivatives of the potential energy at fixed (u, E) = 0.

    Attributes:
        uu: (2 n_sites, 2 n_sites) sparse CSC, d2U/du du; coordinates 2 i, 2 i + 1 = u_x, u_y of site i.
        ue: (2 n_sites, 2, 2), d2U/du dE[k, l], E[k, l] = d(displacement k)/d(position l).
        ee: (2, 2, 2, 2), d2U/dE dE.
    """

    uu: sparse.csc_array
    ue: Array
    ee: Array


def forces(packing: Packing, terms: Sequence[Terms] | None = None) -> Array:
    """(len(positions), 2) forces -dU/dx in numpy; the engine's own come from LAMMPS.

    Args:
        packing: SP or DP.
        terms: its `energy_terms`, if they are known already.
    """
    total = np.zeros_like(packing.positions)
    for term in energy_terms(packing) if terms is None else terms:
        np.subtract.at(total, term.sites, term.gradient)
    return total


@checked
def hessian(packing: Packing, *, prestress: bool = True) -> sparse.csc_array:
    """(2 n_sites, 2 n_sites) sparse Hessian of the potential energy at fixed box.

    Args:
        packing: SP: sites are disks. DP: sites are vertices; perimeter, area and contact terms all count.
        prestress: see `jamlab.mechanics.energy_terms.energy_terms`.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> h = jamlab.hessian(p)
        >>> h.shape, bool(abs(h - h.T).max() < 1e-12)
        ((64, 64), True)
    """
    return _assemble(energy_terms(packing, prestress=prestress), len(packing.positions))


def stiffness(packing: Packing, terms: Sequence[Terms]) -> Stiffness:
    """Assemble the Hessian and its couplings to a homogeneous strain from the `energy_terms` of a packing."""
    size = len(packing.positions)
    ue = np.zeros((size, 2, 2, 2))
    ee = np.zeros((2, 2, 2, 2))
    for term in terms:
        coupling = np.einsum("kaibj,kbl->kaijl", term.hessian, term.local)
        np.add.at(ue, term.sites, coupling)
        ee += np.einsum("kal,kaijm->iljm", term.local, coupling)
    return Stiffness(_assemble(terms, size), ue.reshape(2 * size, 2, 2), ee)


def stress(packing: Packing, terms: Sequence[Terms] | None = None) -> Array:
    """(2, 2) stress -(1/A) dU/dE, positive in compression (Boromand et al. eq 6), every energy term counted.

    Args:
        packing: SP or DP.
        terms: its `energy_terms`, if they are known already.
    """
    total = np.zeros((2, 2))
    for term in energy_terms(packing) if terms is None else terms:
        total -= np.einsum("kai,kal->il", term.gradient, term.local)
    return total / packing.area


def _assemble(terms: Sequence[Terms], size: int) -> sparse.csc_array:
    return assemble([term.sites for term in terms], [term.hessian for term in terms], size)
