"""Packings that answer to a stress or a small strain must touch to begin with."""

from jamlab.errors import InputError
from jamlab.geometry.contact_network import contacts
from jamlab.packing.packing import Packing


def check_touching(packing: Packing) -> None:
    """Refuse particles of which no two touch.

    Raises:
        InputError: naming packing fraction and remedy.
    """
    particles = "disks" if packing.model == "sp" else "droplets"
    if not contacts(packing).count:
        raise InputError(
            f"no {particles} touch at phi = {packing.phi:.4g}, so nothing holds or resists: give a jammed packing, or "
            "shear it at a rate"
        )
