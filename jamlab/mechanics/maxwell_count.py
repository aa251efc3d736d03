"""The Maxwell-Calladine count: states of self-stress and zero modes of particles taken as rigid.

Every contact is one condition on the motions of the two that it joins, a row of the compatibility matrix, so that

    contacts - conditions that are independent = states of self-stress
    motions - 2 translations of the whole, if no particle is fixed - conditions that are independent = motions left free

(Calladine 1978, Int. J. Solids Struct. 14, 161). Disks have two motions each, since no contact holds them from turning:
at onset none is left free, one state of self-stress carries the load (two in few packings), and there are 2N' - 1
contacts. Droplets have three, and meet with vertices on edges: two droplets share one such contact, two where a flat
rests on a flat, now and then more. So pairs of droplets in contact obey no count of their own, nor do all states of
self-stress of a droplet packing carry load: a ring of droplets flat on flat has one of couples, which go round it and
add up to no force.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.geometry.contact_network import contacts, find_rattlers
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result


@dataclass(frozen=True)
class Counting:
    """Degrees of freedom that are counted."""

    most: int = 1000  # particles: singular values of a matrix of about (3 n, 3 n) take 10 s
    # singular value, with lengths in mean diameters, below which conditions hang on each other: droplets
    dependent: float = 2e-3


COUNTING = Counting()

# are dented a little at onset, which leaves up to 7e-4; independent ones of 328 packings, N = 16 to 128, have 4.5e-3 on


@dataclass(frozen=True)
class MaxwellCount(Result):
    """The Maxwell-Calladine count of the particles that bear load.

    Attributes:
        n_particles: number of particles that bear load, also droplets held by two opposite contacts on flat edges.
        pairs: number of pairs of particles in contact.
        contacts: contacts of disks; for droplets, of a vertex with an edge (two vertices that meet count once).
        self_stress_states: independent ways in which forces of these contacts, also tensile ones, balance by
            themselves.
        floppy_modes: number of floppy modes without the two translations of the packing.

    Example:
        >>> m = jamlab.maxwell_count(jamlab.jam(n=16))
        >>> m.contacts == 2 * m.n_particles - 2 - m.floppy_modes + m.self_stress_states  # droplets: 3, not 2
        True
    """

    n_particles: int
    pairs: int
    contacts: int
    self_stress_states: int
    floppy_modes: int


@checked
def maxwell_count(packing: Packing) -> MaxwellCount:
    """Count floppy modes and states of self-stress of particles taken as rigid (Maxwell-Calladine count).

    Args:
        packing: SP or DP at onset; far above onset droplets are not rigid.

    Raises:
        InputError: more than 1000 particles; outlines of two polygons cross.

    Example:
        >>> jamlab.maxwell_count(jamlab.jam(n=16))
        MaxwellCount(n_particles=15, pairs=29, contacts=29, self_stress_states=1, floppy_modes=0)
    """
    if packing.n > COUNTING.most:
        raise InputError(
            f"{packing.n} particles: maxwell_count supports at most {COUNTING.most}, since time grows as n cubed"
        )
    rows, held, pairs = held_conditions(packing)
    if not held:
        return MaxwellCount(0, 0, 0, 0, 0)
    singular = np.linalg.svd(rows, compute_uv=False)
    rank = int((singular > COUNTING.dependent).sum())
    whole = 2 if packing.frame.all_free else 0
    return MaxwellCount(held, pairs, len(rows), len(rows) - rank, rows.shape[1] - whole - rank)


def held_conditions(packing: Packing) -> tuple[Array, int, int]:
    """Compatibility matrix (contacts, motions) of the backbone; number of its particles; number of their pairs.
    States of self-stress are vectors of contact forces f with f @ rows = 0; a force that pushes is positive."""
    network, kind = contacts(packing), packing.kind
    free = packing.frame.free
    rattlers, bearing = find_rattlers(network.pairs, free, packing.law.least_bearing, kind.places(packing))
    bearing = bearing & free[network.pairs].any(axis=1)
    if not (free & ~rattlers).any():
        return np.zeros((0, 0)), 0, 0
    loose, rows = np.repeat(rattlers, kind.motions), kind.rigidity(packing)
    moving = np.repeat(free & ~rattlers, kind.motions)
    rows = rows[~rows[:, loose].any(axis=1)][:, moving]  # a rattler that touches holds nothing
    if not packing.frame.all_free:
        rows = rows[rows.any(axis=1)]  # of two that are fixed
    return rows, int((free & ~rattlers).sum()), int(bearing.sum())
