"""Change the box and carry the particles along: isotropic compression and simple shear."""

import numpy as np

from jamlab.errors import InputError
from jamlab.packing import Packing


def at_phi(packing: Packing, phi: float) -> Packing:
    """The packing scaled to nominal packing fraction phi.

    Centres move with the box; disks keep their diameters and polygons their shapes, so that droplets are pushed
    together, not squeezed.

    Raises:
        InputError: if phi is not between 0 and 2.
    """
    if not 0 < phi <= 2:
        raise InputError(f"phi = {phi}: a packing fraction must lie between 0 and 2")
    factor = float(np.sqrt(packing.phi / phi))
    centres = packing.centroids
    moved = packing.positions + ((factor - 1) * centres)[packing.particle]
    return packing.with_state(box=factor * packing.box, positions=moved)


def sheared(packing: Packing, strain: float) -> Packing:
    """The packing after the affine simple shear x -> x + strain * y of box and every position."""
    shear = np.array([[1.0, 0.0], [strain, 1.0]])
    return packing.with_state(box=packing.box @ shear, positions=packing.positions @ shear)
