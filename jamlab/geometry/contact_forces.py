"""The force in every contact of two particles, and the gap between them: one number per row of `Contacts.pairs`."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jamlab.geometry.vertex_contacts import VertexContacts, name_pairs, unique_rows
from jamlab.packing.force_laws import disk_law, rim_law
from jamlab.packing.neighbors import Pairs
from jamlab.packing.packing import Packing
from jamlab.packing.short_repr import short_repr

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ContactForces:
    """Forces of contacts, rows as in `Contacts.pairs`.

    Attributes:
        on_j: (m, 2) force on particle j; that on i is the opposite. Droplets: the sum over all meetings of a vertex of
            one with an edge of the other.
        gap: (m,) distance of the surfaces, negative where they overlap. SP: r - (d_i + d_j)/2. DP: d - delta at the
            closest vertex.

    Example:
        >>> f = jamlab.contacts(jamlab.pack(n=32, pressure=1e-2, seed=1)).forces
        >>> bool((f.gap < 0).all()), np.allclose(f.size, -f.gap)  # k = 1: the force is the overlap
        (True, True)
    """

    on_j: Array
    gap: Array

    __repr__ = short_repr

    @property
    def size(self) -> Array:
        """(m,) magnitude of the force."""
        return np.asarray(np.hypot(*self.on_j.T))


def contact_forces(packing: Packing, meetings: Pairs | VertexContacts) -> ContactForces:
    """Find the force and the gap of every contact, by the force law of the packing; see `Contacts.forces`.

    Args:
        packing: SP or DP.
        meetings: its disks that touch, or its vertices and edges.
    """
    if isinstance(meetings, VertexContacts):
        return _between_droplets(packing, meetings)
    assert packing.diameters is not None
    pairs, distance = np.column_stack([meetings.i, meetings.j]), np.hypot(*meetings.r.T)
    push = -disk_law(packing, pairs, distance)[1]
    gap = distance - 0.5 * packing.diameters[pairs].sum(axis=1)
    return ContactForces(_per_length(push, distance)[:, None] * meetings.r, gap)


def _between_droplets(packing: Packing, meetings: VertexContacts) -> ContactForces:
    names, on_vertex_of_j = name_pairs(packing, meetings)
    pairs, row = unique_rows(names)
    distance = meetings.distance
    push = -rim_law(packing, distance)[1]
    force = np.where(on_vertex_of_j, 1.0, -1.0)[:, None] * _per_length(push, distance)[:, None] * meetings.separation
    on_j = np.zeros((len(pairs), 2))
    np.add.at(on_j, row, force)
    closest = np.full(len(pairs), np.inf)
    np.minimum.at(closest, row, distance)
    return ContactForces(on_j, closest - packing.params["delta"])


def _per_length(push: Array, distance: Array) -> Array:
    """Force over distance; disks in one place, or a vertex on an edge, have no direction to be pushed in."""
    return np.divide(push, distance, out=np.zeros_like(push), where=distance > 0)
