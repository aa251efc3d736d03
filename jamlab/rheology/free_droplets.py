"""Rattling droplets under Stokes drag: the fluid deforms them, and their line tension gives back a part of G*.

A droplet that touches nothing has an equation of motion of its own, K + i omega B with the drag B = k tau_1/n_v of each
vertex. Its energy does not know the strain of the box once it has relaxed, so all of its part of G* are Maxwell
elements: eigenmodes v of K with stiffness kappa relax at kappa/B and have the strength (v . k)^2/(kappa A), where k is
the column of the shear strain. The three modes of rigid motion have neither stiffness nor strength.
"""

import numpy as np

from jamlab.mechanics.force_network import ForceNetwork
from jamlab.mechanics.stiffness import stiffness_of
from jamlab.packing.natural_units import stiffness_scale
from jamlab.packing.shear_direction import Direction, shear_direction
from jamlab.rheology.damping import Damping
from jamlab.rheology.relaxation_spectrum import RelaxationSpectrum

_RIGID = 1e-9  # stiffness over the largest one below which a mode is a rigid motion


def free_droplets(network: ForceNetwork, damping: Damping, direction: Direction) -> RelaxationSpectrum:
    """Maxwell elements of the droplets that a force network leaves out. Drag at contacts does not reach them, and disks
    do not deform: then there are none."""
    whole, none, shear = network.whole, np.zeros(0), shear_direction(network.whole, direction)
    rates, strengths = [none], [none]
    if not damping.at_contacts and whole.kind.shape_terms(whole):
        for m in np.unique(whole.particle[~network.held]):
            alone = whole.select(np.arange(whole.n) == m)
            matrices = stiffness_of(alone.kind.shape_terms(alone), len(alone.positions))
            kappa, vectors = np.linalg.eigh(matrices.uu.toarray())
            kept = kappa > _RIGID * kappa[-1]
            kappa, coupling = kappa[kept], vectors[:, kept].T @ shear.couplings(matrices.ue)
            rates.append(kappa * len(alone.positions) / (stiffness_scale(whole) * damping.tau))
            strengths.append(coupling**2 / (kappa * whole.area))
    every = np.concatenate(rates)
    return RelaxationSpectrum(0.0, 0.0, np.sort(every), np.concatenate(strengths)[np.argsort(every)])
