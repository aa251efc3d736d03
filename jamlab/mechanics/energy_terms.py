"""Energy of a packing as a sum of small terms, each with its gradient and Hessian in closed form.

A term depends on a few positions only: two disks; the two ends of an edge; a vertex and an edge; all vertices of one
polygon. Every analysis that needs stiffness (elastic moduli, normal modes, G*(omega), Newton steps) is assembled from
this one list, for disks and droplets alike. It is evaluated in numpy, apart from the LAMMPS forces of the engine.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array, Indices, Mask
from jamlab.errors import InputError
from jamlab.geometry.contact_network import find_meetings
from jamlab.geometry.vertex_contacts import VertexContacts
from jamlab.packing.derived import per_packing
from jamlab.packing.force_laws import disk_law, reach, rim_law
from jamlab.packing.neighbors import Pairs
from jamlab.packing.packing import Packing

_IDENTITY = np.eye(2)
_TURN = np.array([[0.0, 1.0], [-1.0, 0.0]])  # x cross y = x . _TURN y


@dataclass(frozen=True)
class Terms:
    """Terms of one kind, k of them, each between m sites (indices into `Packing.positions`)."""

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


@per_packing
def energy_terms(packing: Packing, *, prestress: bool = True) -> list[Terms]:
    """Build all terms of the potential energy of a packing. `prestress`: False leaves out the part of each Hessian that
    is proportional to the force in the contact (Baumgarten & Tighe eq 4 with f0 = 0): every contact is replaced by an
    unstressed spring. SP only."""
    if packing.model == "dp" and not prestress:
        raise InputError(
            "prestress = False: deformable polygons are held by line tension, which is pre-stress; use prestress=True"
        )
    meetings = find_meetings(packing)
    if isinstance(meetings, Pairs):
        return [_build_springs(packing, meetings, prestress)]
    return [*_build_contacts(packing, meetings), *shape_terms(packing)]


def shape_terms(packing: Packing) -> list[Terms]:
    """Terms of the line tension and the area of droplets, which need no contact."""
    return [_build_tension(packing), *_build_areas(packing)]


def _build_springs(packing: Packing, touching: Pairs, prestress: bool) -> Terms:
    pairs, r = np.column_stack([touching.i, touching.j]), touching.r
    distance = np.hypot(*r.T)
    if not distance.all():
        i, j = pairs[distance.argmin()]
        raise InputError(f"disks {i} and {j} are in one place, where their contact has no direction: move one of them")
    energy, slope, stiffness = disk_law(packing)(reach(packing, pairs), distance)
    normal = r / distance[:, None]
    along = normal[:, :, None] * normal[:, None, :]
    block = stiffness[:, None, None] * along
    if prestress:
        block = block + (slope / distance)[:, None, None] * (_IDENTITY - along)
    return _build_pair_terms("spring", pairs, r, energy, slope[:, None] * normal, block)


def _build_tension(packing: Packing) -> Terms:
    """gamma sqrt(l^2 + eta^2) for every edge, Boromand et al. eq 7, first term."""
    gamma, eta = packing.params["gamma"], packing.params["eta"]
    edge = packing.edges
    length = np.sqrt(np.einsum("ij,ij->i", edge, edge) + eta**2)
    inverse = np.divide(gamma, length, out=np.zeros_like(length), where=length > 0)
    unit = edge * (np.divide(1.0, length, out=np.zeros_like(length), where=length > 0))[:, None]
    block = inverse[:, None, None] * (_IDENTITY - unit[:, :, None] * unit[:, None, :])
    pairs = np.column_stack([np.arange(len(edge)), packing.successor])
    return _build_pair_terms("tension", pairs, edge, gamma * length, gamma * unit, block)


def _build_pair_terms(name: str, pairs: Indices, r: Array, energy: Array, slope: Array, block: Array) -> Terms:
    """Terms that depend on r = x_j - x_i only; `slope` = dU/dr (k, 2), `block` = d2U/dr dr (k, 2, 2)."""
    sign = np.array([-1.0, 1.0])
    gradient = sign[None, :, None] * slope[:, None, :]
    hessian = np.einsum("a,b,kij->kaibj", sign, sign, block)
    local = np.stack([np.zeros_like(r), r], axis=1)
    return Terms(name, pairs, local, energy, gradient, hessian)


def _build_areas(packing: Packing) -> list[Terms]:
    """(ka/2)(a - a0)^2 for every polygon, Boromand et al. eq 7, second term; one group for each number of vertices."""
    offsets = packing.offsets
    assert offsets is not None
    ka, a0 = packing.params["ka"], packing.params["a0"]
    sizes = np.diff(offsets)
    groups = []
    for nv in np.unique(sizes):
        members = np.flatnonzero(sizes == nv)
        sites = offsets[members][:, None] + np.arange(nv)
        local = packing.positions[sites] - packing.positions[sites[:, :1]]
        after, before = np.roll(local, -1, axis=1), np.roll(local, 1, axis=1)
        excess = packing.polygon_areas[members] - a0[members]
        slope = 0.5 * (after - before) @ _TURN.T  # da/dx
        curvature = np.zeros((nv, 2, nv, 2))  # d2a/dx dx, the same for all
        ring = np.arange(nv)
        curvature[ring, :, (ring + 1) % nv, :] += 0.5 * _TURN
        curvature[ring, :, (ring - 1) % nv, :] -= 0.5 * _TURN
        hessian = ka * np.einsum("kai,kbj->kaibj", slope, slope)
        hessian += ka * excess[:, None, None, None, None] * curvature
        energy = 0.5 * ka * excess**2
        groups.append(Terms("area", sites, local, energy, ka * excess[:, None, None] * slope, hessian))
    return groups


def _build_contacts(packing: Packing, found: VertexContacts) -> list[Terms]:
    """`rim_law` for every meeting of a vertex with an edge at a distance d.

    At an end of the edge d is the distance of two points. In between, with unit normal n, unit tangent tau, edge length
    L and weights c = (1, -(1 - t), -t) on (vertex, tail, head): grad d = c n and, with w = (0, -1, 1),
    hess d = -(1/L)[w n (c tau)^T + c tau (w n)^T + (d/L) w n (w n)^T].
    """
    distance = found.distance
    kept = distance > 0
    distance, place, separation = distance[kept], found.place[kept], found.separation[kept]
    vertex, tail, shift = found.vertex[kept], found.tail[kept], found.shift[kept]
    energy, slope, stiffness = rim_law(packing, distance)
    normal = separation / distance[:, None]

    ends = (place == 0.0) | (place == 1.0)
    corner = np.where(place == 1.0, packing.successor[tail], tail)[ends]
    n = normal[ends]
    along = n[:, :, None] * n[:, None, :]
    block = stiffness[ends, None, None] * along + (slope[ends] / distance[ends])[:, None, None] * (_IDENTITY - along)
    points = _build_pair_terms(
        "contact", np.column_stack([corner, vertex[ends]]), separation[ends], energy[ends], slope[ends, None] * n, block
    )

    inner = ~ends
    n, t, d = normal[inner], place[inner], distance[inner]
    edge = packing.edges[tail[inner]]
    length = np.hypot(*edge.T)
    tangent = edge / length[:, None]
    c = np.column_stack([np.ones_like(t), t - 1.0, -t])
    w = np.broadcast_to([0.0, -1.0, 1.0], c.shape)
    cn = np.einsum("ka,ki->kai", c, n)
    ct = np.einsum("ka,ki->kai", c, tangent)
    wn = np.einsum("ka,ki->kai", w, n)
    mixed = np.einsum("kai,kbj->kaibj", wn, ct)
    bend = mixed + mixed.transpose(0, 3, 4, 1, 2)
    bend += (d / length)[:, None, None, None, None] * np.einsum("kai,kbj->kaibj", wn, wn)
    hessian = stiffness[inner, None, None, None, None] * np.einsum("kai,kbj->kaibj", cn, cn)
    hessian -= (slope[inner] / length)[:, None, None, None, None] * bend
    sites = np.column_stack([vertex[inner], tail[inner], packing.successor[tail[inner]]])
    x_vertex = packing.positions[vertex[inner]]
    x_tail = packing.positions[tail[inner]] + shift[inner]
    local = np.stack([np.zeros_like(x_vertex), x_tail - x_vertex, x_tail + edge - x_vertex], axis=1)
    edges = Terms("contact", sites, local, energy[inner], slope[inner, None, None] * cn, hessian)
    return [points, edges]
