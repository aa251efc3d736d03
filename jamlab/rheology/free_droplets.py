"""Rattling droplets under Stokes drag: the fluid deforms them, and their line tension gives back a part of G*.

A droplet that touches nothing has an equation of motion of its own, K + i omega B with the drag B of its vertices, of
Stokes drag k tau_1/n_v of each. Its energy does not know the strain of the box once it has relaxed, so all of its part
of G* are Maxwell elements: modes K v = kappa B v relax at kappa and have the strength (v . k)^2/(kappa A v . B v),
where k is the column of the shear strain. The three modes of rigid motion have neither stiffness nor strength.
"""

import numpy as np

from jamlab.arguments.choices import Direction
from jamlab.errors import InputError
from jamlab.mechanics.force_network import ForceNetwork
from jamlab.mechanics.stiffness import stiffness_of
from jamlab.packing.shear_direction import shear_direction
from jamlab.rheology.drag_law import DragLaw
from jamlab.rheology.relaxation_spectrum import RelaxationSpectrum

_RIGID = 1e-9  # stiffness over the largest one below which a mode is a rigid motion


def free_droplets(network: ForceNetwork, damping: DragLaw, direction: Direction) -> RelaxationSpectrum:
    """Maxwell elements of the droplets that a force network leaves out. Drag at contacts does not reach them, and disks
    do not deform: then there are none."""
    whole, none, shear = network.whole, np.zeros(0), shear_direction(network.whole, direction)
    rates, strengths = [none], [none]
    for m in np.unique(whole.particle[~network.held]) if whole.kind.shape_terms(whole) else []:
        alone = whole.select(np.arange(whole.n) == m)
        sites = len(alone.positions)
        drag = damping.matrix(alone, whole, direction)[: 2 * sites, : 2 * sites].toarray()
        if not drag.any():
            continue
        matrices, mean = stiffness_of(alone.kind.shape_terms(alone), sites), float(drag.diagonal().mean())
        try:
            back = np.linalg.inv(np.linalg.cholesky(drag / mean))
        except np.linalg.LinAlgError as error:
            raise InputError(
                f"{damping} resists some motions of a free droplet and not others, so that those relax at once; use "
                "jamlab.remove_rattlers(packing)"
            ) from error
        kappa, vectors = np.linalg.eigh(back @ matrices.uu.toarray() @ back.T)
        kept = kappa > _RIGID * kappa[-1]
        kappa, coupling = kappa[kept], (back.T @ vectors[:, kept]).T @ shear.couplings(matrices.ue)
        rates.append(kappa * sites / (mean * sites))  # by the drag on all of it, which is that of a disk
        strengths.append(coupling**2 / (kappa * whole.area))
    every = np.concatenate(rates)
    return RelaxationSpectrum(0.0, 0.0, np.sort(every), np.concatenate(strengths)[np.argsort(every)])
