"""Packings that answer to a stress or a small strain must touch to begin with."""

from jamlab.errors import InputError
from jamlab.flow.overdamped_session import check_model
from jamlab.geometry.contact_network import contacts
from jamlab.packing.packing import Packing


def check_touching(packing: Packing) -> None:
    """Refuse droplets, and disks of which no two touch.

    Raises:
        InputError: naming packing fraction and remedy.
    """
    check_model(packing)
    if not contacts(packing).count:
        raise InputError(
            f"no disks touch at phi = {packing.phi:.4g}, so nothing holds or resists: give a jammed packing, or "
            "shear it at a rate"
        )
