"""Force laws of contacts: energy, force and stiffness at a distance, of two disks and of the rims of two droplets.

Line tension and area elasticity of droplets are no contacts: their energies stand with their terms in `energy_terms`.
"""

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.packing.packing import Packing


def disk_law(packing: Packing, pairs: NDArray[np.int64], distance: Array) -> tuple[Array, Array, Array]:
    """Energy, force U' and stiffness U'' of pairs of disks at a distance r < s = (d_i + d_j)/2.

    Units "eps": U = (eps/2)(1 - r/s)^2, Boromand et al. eq 5. Units "k": U = (k/2)(s - r)^2, Baumgarten & Tighe eq 3.

    Args:
        packing: SP.
        pairs: (m, 2) disks.
        distance: (m,) r.

    Returns:
        Three (m,) arrays: U, dU/dr, d2U/dr2.
    """
    assert packing.diameters is not None
    s = 0.5 * packing.diameters[pairs].sum(axis=1)
    stiffness = packing.params["eps"] / s**2 if packing.units == "eps" else np.full(len(s), packing.params["k"])
    overlap = s - distance
    return 0.5 * stiffness * overlap**2, -stiffness * overlap, stiffness


def rim_law(packing: Packing, distance: Array) -> tuple[Array, Array, Array]:
    """Energy, force U' and stiffness U'' of a vertex at a distance d < delta from an edge.

    U = (eps/2)(1 - d/delta)^2, Boromand et al. eq 8.

    Args:
        packing: DP.
        distance: (m,) d.

    Returns:
        Three (m,) arrays: U, dU/dd, d2U/dd2.
    """
    eps, delta = packing.params["eps"], packing.params["delta"]
    overlap = 1.0 - distance / delta
    return 0.5 * eps * overlap**2, -eps * overlap / delta, np.full(len(distance), eps / delta**2)
