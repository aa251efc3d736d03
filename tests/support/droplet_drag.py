"""Stress by contact drag between droplets in plain numpy: the slope of the dissipation function in any affine flow."""

import numpy as np

import jamlab
from jamlab.geometry.vertex_contacts import vertex_contacts


def _outline_rotation(packing: jamlab.Packing) -> tuple:
    """Function of relative velocities (m, 2) of the ends of edges: angular velocity of the outline at each vertex."""
    edge, head = packing.edges, packing.successor
    square = np.einsum("ij,ij->i", edge, edge)
    around = square.copy()
    np.add.at(around, head, square)

    def rotation(opening: np.ndarray) -> np.ndarray:
        turn = edge[:, 0] * opening[:, 1] - edge[:, 1] * opening[:, 0]
        total = turn.copy()
        np.add.at(total, head, turn)
        return total / around

    return rotation, edge, head


def drag_rows(packing: jamlab.Packing, beta: float) -> tuple:
    """Approach and slip of every contact, times the root of their drag (tau_1 = 1), by velocities (2m, 2 n_vertices)
    and by the gradient of an affine flow (2m, 4): drag forces are -rows^T rows u."""
    rotation, edge, head = _outline_rotation(packing)
    found = vertex_contacts(packing)
    distance, t, apart = found.distance, found.place, found.separation
    normal = apart / distance[:, None]
    tangent = np.column_stack([-normal[:, 1], normal[:, 0]])
    weight = np.sqrt(packing.law(np.full(len(distance), packing.params["delta"]), distance)[2])

    def relative(u: np.ndarray, gradient: np.ndarray) -> np.ndarray:
        foot = (1 - t)[:, None] * u[found.tail] + t[:, None] * u[head[found.tail]]
        moved = u[found.vertex] - foot + apart @ gradient.T
        spin = rotation(u[head] - u + edge @ gradient.T)
        rolled = spin[found.vertex] + (1 - t) * spin[found.tail] + t * spin[head[found.tail]]
        slip = (moved * tangent).sum(axis=1) - 0.5 * distance * rolled
        return np.concatenate([weight * (moved * normal).sum(axis=1), weight * np.sqrt(beta) * slip])

    still, none = np.zeros_like(packing.positions), np.zeros((2, 2))
    units = np.eye(still.size).reshape(-1, *still.shape)
    return (np.column_stack([relative(u, none) for u in units]),
            np.column_stack([relative(still, g) for g in np.eye(4).reshape(4, 2, 2)]))  # fmt: skip


def drag_stress(packing: jamlab.Packing, velocity: np.ndarray, rate: float, beta: float) -> np.ndarray:
    """(2, 2) tension, first index the force, from velocities (n_vertices, 2) beside an affine flow; tau_1 = 1."""
    rows, affine = drag_rows(packing, beta)
    return (affine.T @ (rows @ velocity.ravel() + rate * affine[:, 1])).reshape(2, 2) / packing.area
