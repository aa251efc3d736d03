"""Contacts between disks: they touch where r < (d_i + d_j)/2."""

from jamlab.errors import InputError
from jamlab.packing.neighbors import Pairs, periodic_pairs
from jamlab.packing.packing import Packing


def touching_disks(packing: Packing) -> Pairs:
    """Find all pairs of disks closer than the sum of their radii.

    Args:
        packing: SP.

    Returns:
        Pairs i <= j, sorted by i, j and image. A disk that reaches several periodic images of another, or its own
        image, touches each of them.

    Raises:
        InputError: for a DP packing; `jamlab.geometry.vertex_contacts` finds the contacts of droplets.
    """
    if packing.diameters is None:
        raise InputError(f"only disks (model sp) touch by their diameters; this packing has model {packing.model}")
    return periodic_pairs(packing.positions, packing.box, 0.5 * packing.diameters)
