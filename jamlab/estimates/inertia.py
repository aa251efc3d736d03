"""What inertia would change: linear response of disks or droplets that have a mass, beside that without."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from jamlab.geometry.contact_network import contacts
from jamlab.packing.packing import Packing
from jamlab.rheology.damping import Damping
from jamlab.rheology.equation_of_motion import dynamical_matrices


def inertia_error(packing: Packing, damping: Damping, omega: float, mass: float) -> float:
    """Relative change of G*(omega) if the mean particle had a mass: |G*_m - G*|/|G*_m|.

    (K + i omega B - omega^2 M) q = -(k + i omega b) beside the affine flow, which is imposed. Disks are full and of one
    density; the mass of a droplet is shared by its vertices.

    Args:
        packing: SP or DP at a minimum.
        damping: linear drag.
        omega: angular frequency, 1/tau_1.
        mass: of the mean particle, k tau_1^2 (units "eps": eps tau_1^2 over the squared unit of length).
    """
    kept = packing.select(~contacts(packing).rattlers)
    k, b = dynamical_matrices(kept, damping)
    masses = mass * _masses(kept)
    light, heavy = (_modulus(k, b, omega, m) for m in (1e-9 * masses, masses))  # the least holds what drifts freely
    return float(abs(heavy - light) / abs(heavy))


def _modulus(k: sparse.csc_array, b: sparse.csc_array, omega: float, masses: np.ndarray) -> complex:
    dynamic = (k + 1j * omega * b).tocsc()
    inner = (dynamic[:-1][:, :-1] - sparse.diags_array(omega**2 * masses)).tocsc()
    column = dynamic[:-1][:, [-1]].toarray()[:, 0]
    return complex(dynamic[-1, -1] - column @ splu(inner).solve(column))


def _masses(packing: Packing) -> np.ndarray:
    """Inertia of every coordinate but the strain, over that of the mean particle."""
    if packing.diameters is None:
        share = 1.0 / np.bincount(packing.particle)[packing.particle]
        return np.repeat(share, 2)
    square = packing.diameters**2
    masses = square / square.mean()
    return np.concatenate([np.repeat(masses, 2), masses * square / 8.0])
