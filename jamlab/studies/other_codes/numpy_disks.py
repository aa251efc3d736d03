"""Evaluate soft disks in plain numpy, every pair: the independent reference."""

from collections.abc import Callable

import numpy as np

from jamlab.arrays import Array
from jamlab.packing.packing import Packing
from jamlab.studies.other_codes.peer import Point, mean_diameters


def all_pairs(packing: Packing) -> Callable[[Array], Point]:
    """Function of positions (n, 2): energy, forces and stress of Boromand et al. eqs 5 and 6 from all n^2 pairs."""
    species, table = mean_diameters(packing)
    s = table[species[:, None], species]
    sides, eps = np.diag(packing.box), float(packing.params["eps"])

    def evaluate(positions: Array) -> Point:
        r = positions[:, None] - positions
        r -= sides * np.round(r / sides)
        distance = np.hypot(r[..., 0], r[..., 1])
        np.fill_diagonal(distance, np.inf)
        overlap = np.maximum(1 - distance / s, 0.0)
        pulls = (eps * overlap / (s * distance))[..., None] * r
        stress = 0.5 * np.einsum("ijk,ijl->kl", pulls, r) / packing.area
        return Point(0.25 * eps * float((overlap**2).sum()), pulls.sum(axis=1), stress, 0.5 * float(np.trace(stress)))

    return evaluate
