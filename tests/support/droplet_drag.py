"""Drag at the contacts between droplets in plain numpy: what it dissipates, and its stress in any affine flow."""

import numpy as np

import jamlab
from jamlab.geometry.vertex_contacts import vertex_contacts


def outline_rotation(packing: jamlab.Packing, opening: np.ndarray) -> np.ndarray:
    """Angular velocity of the outline at each vertex, from relative velocities (n, 2) of the ends of edges: the least
    squares fit of a rotation to its two edges."""
    edge, head = packing.polygons.edges, packing.polygons.successor
    around = np.einsum("ij,ij->i", edge, edge)
    turn = edge[:, 0] * opening[:, 1] - edge[:, 1] * opening[:, 0]
    return (turn + turn[np.argsort(head)]) / (around + around[np.argsort(head)])


def drag_rates(packing: jamlab.Packing, u: np.ndarray, gradient: np.ndarray, beta: float) -> np.ndarray:
    """(2m,) approach and slip of every contact, times the root of their drag with tau_1 = 1, from velocities (n, 2)
    beside an affine flow."""
    edge, head = packing.polygons.edges, packing.polygons.successor
    found = vertex_contacts(packing)
    distance, t, apart = found.distance, found.place, found.separation
    normal = apart / distance[:, None]
    tangent = np.column_stack([-normal[:, 1], normal[:, 0]])
    weight = np.sqrt(packing.law(np.full(len(distance), packing.params["delta"]), distance)[2])
    foot = (1 - t)[:, None] * u[found.tail] + t[:, None] * u[head[found.tail]]
    moved = u[found.vertex] - foot + apart @ gradient.T
    spin = outline_rotation(packing, u[head] - u + edge @ gradient.T)
    rolled = spin[found.vertex] + (1 - t) * spin[found.tail] + t * spin[head[found.tail]]
    slip = (moved * tangent).sum(axis=1) - 0.5 * distance * rolled
    return np.concatenate([weight * (moved * normal).sum(axis=1), weight * np.sqrt(beta) * slip])


def drag_stress(packing: jamlab.Packing, velocity: np.ndarray, rate: float, beta: float) -> np.ndarray:
    """(2, 2) tension, first index the force, from velocities (n, 2) beside shear at a rate; tau_1 = 1."""
    sheared = drag_rates(packing, velocity, np.array([[0.0, rate], [0.0, 0.0]]), beta)
    affine = [drag_rates(packing, 0 * velocity, g, beta) for g in np.eye(4).reshape(4, 2, 2)]
    return np.reshape(affine @ sheared, (2, 2)) / packing.area
