"""Rattling droplets under Stokes drag: the fluid deforms them, and their line tension gives back a part of G*.

A droplet that touches nothing has an equation of motion of its own, K + i omega B with the drag B of its vertices, of
Stokes drag k tau_1/n_v of each. Its energy does not know the strain of the box once it has relaxed, so all of its part
of G* are Maxwell elements: modes K v = kappa B v relax at kappa and have the strength (v . k)^2/(kappa A v . B v),
where k is the column of the shear strain. The three modes of rigid motion have neither stiffness nor strength.

With masses M, its part is y . (Z - K) Z^-1 k / A with Z = K + i omega B - omega^2 M and K y = k.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from jamlab.arguments.choices import Direction
from jamlab.arrays import Array, Complex
from jamlab.errors import InputError
from jamlab.mechanics.force_network import ForceNetwork
from jamlab.mechanics.masses import mass_matrix_diagonal
from jamlab.mechanics.stiffness import stiffness_of
from jamlab.packing.shear_direction import shear_direction
from jamlab.rheology.drag_law import DragLaw
from jamlab.rheology.relaxation_spectrum import RelaxationSpectrum

_RIGID = 1e-9  # stiffness over the largest one below which a mode is a rigid motion


class _FreeDroplet(NamedTuple):
    """A droplet without contacts, and its matrices."""

    number: int  # in the whole packing
    stiffness: Array  # (m, m) K
    drag: Array  # (m, m) B
    column: Array  # (m,) k


def _each_dragged(network: ForceNetwork, damping: DragLaw, direction: Direction) -> Iterator[_FreeDroplet]:
    """The droplets that a force network leaves out and on which drag acts. Drag at contacts does not reach them, and
    disks do not deform: then there are none."""
    whole, shear = network.whole, shear_direction(network.whole, direction)
    for m in np.unique(whole.particle[~network.held]) if whole.kind.shape_terms(whole) else []:
        alone = whole.select(np.arange(whole.n) == m)
        sites = len(alone.positions)
        drag = damping.matrix(alone, whole, direction)[: 2 * sites, : 2 * sites].toarray()
        if drag.any():
            matrices = stiffness_of(alone.kind.shape_terms(alone), sites)
            yield _FreeDroplet(int(m), matrices.uu.toarray(), drag, shear.couplings(matrices.ue))


def free_droplets(network: ForceNetwork, damping: DragLaw, direction: Direction) -> RelaxationSpectrum:
    """Maxwell elements of the free droplets."""
    none = np.zeros(0)
    rates, strengths = [none], [none]
    for each in _each_dragged(network, damping, direction):
        sites, mean = len(each.column) // 2, float(each.drag.diagonal().mean())
        try:
            back = np.linalg.inv(np.linalg.cholesky(each.drag / mean))
        except np.linalg.LinAlgError as error:
            raise InputError(
                f"{damping} resists some motions of a free droplet and not others, so that those relax at once; use "
                "jamlab.remove_rattlers(packing)"
            ) from error
        kappa, vectors = np.linalg.eigh(back @ each.stiffness @ back.T)
        kept = kappa > _RIGID * kappa[-1]
        kappa, coupling = kappa[kept], (back.T @ vectors[:, kept]).T @ each.column
        rates.append(kappa * sites / (mean * sites))  # by the drag on all of it, which is that of a disk
        strengths.append(coupling**2 / (kappa * network.whole.area))
    every = np.concatenate(rates)
    return RelaxationSpectrum(0.0, 0.0, np.sort(every), np.concatenate(strengths)[np.argsort(every)])


def free_droplets_with_inertia(
    network: ForceNetwork, damping: DragLaw, direction: Direction, masses: Array, omega: Array
) -> Complex:
    """(f,) part of G* of the free droplets at frequencies (f,). `masses`: (n,) of all particles."""
    whole, modulus = network.whole, np.zeros(len(omega), dtype=np.complex128)
    for each in _each_dragged(network, damping, direction):
        alone = whole.select(np.arange(whole.n) == each.number)
        mass = mass_matrix_diagonal(alone, masses[[each.number]])[: len(each.column)]
        kappa, vectors = np.linalg.eigh(each.stiffness)
        kept = kappa > _RIGID * kappa[-1]
        slow = vectors[:, kept] @ ((vectors[:, kept].T @ each.column) / kappa[kept])
        for index, w in enumerate(omega):
            beside = 1j * w * each.drag - w**2 * np.diag(mass)
            modulus[index] += slow @ (beside @ np.linalg.solve(each.stiffness + beside, each.column))
    return modulus / whole.area
