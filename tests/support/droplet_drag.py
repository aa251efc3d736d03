"""Stress by contact drag between droplets in plain numpy: the slope of the dissipation function in any affine flow."""

import numpy as np

import jamlab
from jamlab.geometry.vertex_contacts import vertex_contacts
from jamlab.packing.force_laws import rim_law


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


def drag_stress(packing: jamlab.Packing, velocity: np.ndarray, rate: float, beta: float) -> np.ndarray:
    """(2, 2) tension, first index the force, from velocities (n_vertices, 2) beside an affine flow; tau_1 = 1."""
    rotation, edge, head = _outline_rotation(packing)
    found = vertex_contacts(packing)
    distance, t, apart = found.distance, found.place, found.separation
    normal = apart / distance[:, None]
    tangent = np.column_stack([-normal[:, 1], normal[:, 0]])

    def relative(u: np.ndarray, gradient: np.ndarray) -> tuple:
        """Approach and slip of every contact."""
        foot = (1 - t)[:, None] * u[found.tail] + t[:, None] * u[head[found.tail]]
        moved = u[found.vertex] - foot + apart @ gradient.T
        spin = rotation(u[head] - u + edge @ gradient.T)
        rolled = spin[found.vertex] + (1 - t) * spin[found.tail] + t * spin[head[found.tail]]
        return (moved * normal).sum(axis=1), (moved * tangent).sum(axis=1) - 0.5 * distance * rolled

    approach, slip = relative(velocity, np.array([[0.0, rate], [0.0, 0.0]]))
    weight, stress = rim_law(packing, distance)[2], np.zeros((2, 2))
    for a, b in np.ndindex(2, 2):
        unit = np.zeros((2, 2))
        unit[a, b] = 1.0
        along, across = relative(np.zeros_like(velocity), unit)
        stress[a, b] = np.sum(weight * (approach * along + beta * slip * across)) / packing.area
    return stress
