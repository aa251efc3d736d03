"""Strains that boxes take, and what fixed droplets of constant area add to stress and elasticity.

The outline of a fixed droplet goes from x = c + s to F c + F s/sqrt(det F), see `jamlab.packing.frame`.
"""

from __future__ import annotations

import numpy as np

from jamlab.arrays import Array

SIMPLE_SHEAR = np.array([[0.0, 1.0], [0.0, 0.0]])  # along x, with its gradient along y
ALONG_Y = np.array([[0.0, 0.0], [0.0, 1.0]])


def shapes_of_stress(shapes: Array, gradient: Array) -> float:
    """Sum of dU/dx s over the fixed droplets: what their constant area leaves out of the virial, `gradient` (n_sites,
    2) being dU/dx of all sites and `shapes` s, see `Frame.kept_shapes`. It adds half of itself over the area of the box
    to both normal stresses."""
    return float(np.sum(gradient * shapes))


def shapes_of_curvature(shapes: Array, gradient: Array, couplings: Array, pull: Array) -> tuple[Array, Array]:
    """What the constant area of fixed droplets adds to K_uE and K_EE of sites that all follow the strain.

    To second order F s/sqrt(det F) is s + E s - (tr E/2) (s + E s) - (det E/2) s + (3/8) (tr E)^2 s.

    Args:
        shapes: (n_sites, 2) s.
        gradient: (n_sites, 2) dU/dx.
        couplings: (2 n_sites, 2, 2) K_uE of the affine map.
        pull: (2 n_sites,) K_uu s.

    Returns:
        (2 n_sites, 2, 2) and (2, 2, 2, 2) to be added.
    """
    one, turn = np.eye(2), np.array([[0.0, 1.0], [-1.0, 0.0]])
    moment, both = gradient.T @ shapes, np.multiply.outer(one, one)
    mixed = np.einsum("i,ikl->kl", shapes.ravel(), couplings) + moment
    trace = float(np.trace(moment))
    found = 0.25 * float(pull @ shapes.ravel()) * both + 0.75 * trace * both
    found -= 0.5 * (np.multiply.outer(one, mixed) + np.multiply.outer(mixed, one))
    found -= 0.5 * trace * np.einsum("km,ln->klmn", turn, turn)
    return -0.5 * np.multiply.outer(pull, one), found
