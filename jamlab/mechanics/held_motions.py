"""Rigidity analysis by the Maxwell-Calladine count: states of self-stress and zero modes of particles taken as rigid.

Every contact is one condition on the motions of the two that it joins, a row of the compatibility matrix, so that

    contacts - conditions that are independent = states of self-stress
    motions - 2 translations of the whole - conditions that are independent = motions left free

(Calladine 1978, Int. J. Solids Struct. 14, 161). Disks have two motions each, since no contact holds them from turning:
at onset none is left free, one state of self-stress carries the load, and there are 2N' - 1 contacts. Droplets have
three, and meet with vertices on edges: two droplets share one such contact, two where a flat rests on a flat, now and
then more. So pairs of droplets in contact obey no count of their own, nor do all states of self-stress of a droplet
packing carry load: a ring of droplets flat on flat has one of couples, which go round it and add up to no force.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.geometry.contact_network import LEAST_CONTACTS, contacts, find_rattlers
from jamlab.geometry.vertex_contacts import name_pairs, vertex_contacts
from jamlab.packing.neighbors import Pairs
from jamlab.packing.outlines import cross
from jamlab.packing.packing import Packing

MOST = 1000  # particles: singular values of a matrix of about (3 n, 3 n) take 10 s
DEPENDENT = 2e-3  # singular value, with lengths in mean diameters, below which conditions hang on each other: droplets
# are dented a little at onset, which leaves up to 7e-4; independent ones of 328 packings, N = 16 to 128, have 4.5e-3 on
_LEAST_DROPLET = 2  # contacts of a droplet that may bear load: its flats hold it between two opposite ones
_SAME = 1e-7  # directions and levers of one contact, seen from both sides, in mean diameters


@dataclass(frozen=True)
class HeldMotions:
    """The Maxwell-Calladine count of the particles that bear load.

    Attributes:
        particles: that bear load; a droplet between two opposite contacts does, on its flats.
        pairs: of particles in contact.
        contacts: of disks; of droplets, those of a vertex with an edge, two vertices that meet counting once.
        self_stresses: independent ways in which forces of these contacts balance by themselves, pulling ones included.
        free: motions that no contact holds, but for the two translations of the whole.

    Example:
        >>> m = jamlab.held_motions(jamlab.jam("sp", 16, 1))
        >>> m.contacts == 2 * m.particles - 2 - m.free + m.self_stresses  # with 3 for 2: droplets
        True
    """

    particles: int
    pairs: int
    contacts: int
    self_stresses: int
    free: int


@checked
def held_motions(packing: Packing) -> HeldMotions:
    """Rigidity analysis: contacts, states of self-stress and zero modes of particles taken as rigid.

    Args:
        packing: SP or DP, at onset: far above it droplets are not rigid.

    Raises:
        InputError: more than 1000 particles; outlines of two polygons cross.

    Example:
        >>> jamlab.held_motions(jamlab.jam("sp", 16, 1))
        HeldMotions(particles=15, pairs=29, contacts=29, self_stresses=1, free=0)
    """
    if packing.n > MOST:
        raise InputError(f"held_motions of {packing.n} particles: at most {MOST}, since time grows as the cube")
    rows, held, pairs = held_conditions(packing)
    if not held:
        return HeldMotions(0, 0, 0, 0, 0)
    singular = np.linalg.svd(rows, compute_uv=False)
    rank = int((singular > DEPENDENT).sum())
    return HeldMotions(held, pairs, len(rows), len(rows) - rank, rows.shape[1] - 2 - rank)


def held_conditions(packing: Packing) -> tuple[Array, int, int]:
    """Compatibility matrix (contacts, motions) of the particles that bear load; their number; that of their pairs.
    States of self-stress are vectors of contact forces f with f @ rows = 0; a force that pushes is positive."""
    network = contacts(packing)
    meetings, every = network.meetings, np.ones(packing.n, dtype=bool)
    disks = isinstance(meetings, Pairs)
    rattlers, bearing = find_rattlers(network.pairs, every, LEAST_CONTACTS if disks else _LEAST_DROPLET)
    loose = np.repeat(rattlers, 2 if disks else 3)
    if rattlers.all():
        return np.zeros((0, 0)), 0, 0
    rows = _disk_conditions(packing, meetings) if isinstance(meetings, Pairs) else conditions(packing)
    rows = rows[~rows[:, loose].any(axis=1)][:, ~loose]  # a rattler that touches holds nothing
    return rows, int((~rattlers).sum()), int(bearing.sum())


def _disk_conditions(packing: Packing, meetings: Pairs) -> Array:
    """(contacts, 2 n) change of every gap with the positions of disks."""
    rows = np.zeros((len(meetings.i), packing.n, 2))
    normal = meetings.r / np.linalg.norm(meetings.r, axis=1)[:, None]
    each = np.arange(len(rows))
    np.add.at(rows, (each, meetings.j), normal)
    np.add.at(rows, (each, meetings.i), -normal)
    return rows.reshape(len(rows), -1)


def conditions(packing: Packing) -> Array:
    """(contacts, 3 n) change of every gap with positions and angles of droplets, in mean diameters."""
    size = float(np.mean(np.sqrt(packing.params["a0"])))
    meetings, (names, pair, swapped) = vertex_contacts(packing), name_pairs(packing)
    sign = np.where(swapped, 1.0, -1.0)[:, None]  # the normal points from the first of a pair to the second
    normal = sign * meetings.separation / meetings.distance[:, None]
    vertex, centre = packing.positions[meetings.vertex], packing.centroids
    of_vertex, of_edge = packing.particle[meetings.vertex], packing.particle[meetings.tail]
    on_vertex = cross(vertex - centre[of_vertex], normal) / size
    on_edge = cross(vertex - meetings.separation - meetings.shift - centre[of_edge], normal) / size
    lever_i, lever_j = np.where(swapped, (on_edge, on_vertex), (on_vertex, on_edge))
    marks = np.round(np.column_stack([normal, lever_i]) / _SAME).astype(np.int64)
    first = np.unique(np.column_stack([pair, marks]), axis=0, return_index=True)[1]
    i, j = names[pair[first], :2].T
    rows = np.zeros((len(first), packing.n, 3))
    each = np.arange(len(first))
    np.add.at(rows, (each, j), np.column_stack([normal[first], lever_j[first]]))
    np.add.at(rows, (each, i), -np.column_stack([normal[first], lever_i[first]]))
    return rows.reshape(len(first), -1)
