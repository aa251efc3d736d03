"""How packings of soft disks are made."""

from __future__ import annotations

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.models.disks import DISKS
from jamlab.packing.packing import Packing
from jamlab.packing.recipe import Recipe
from jamlab.protocols.descent import DescentOfDisks
from jamlab.protocols.makings import Making
from jamlab.protocols.random_start import disks_of, law_of_disks
from jamlab.protocols.size_distributions import diameters_of


class MakingOfDisks(Making):
    """See `Making`; without droplets, "direct" starts do not exist."""

    name = DISKS.name
    descent = DescentOfDisks()
    version = 2  # 1 rounded otherwise, by the factors of another library
    stiffening_version = 3  # 2 rounded otherwise, 1 left forces beside the contact forces
    compression_version = 4  # 3 rounded otherwise; asks what rattlers stop before it goes by steps, 2 leaves saddles

    def check(self, recipe: Recipe) -> None:
        self.check_start(recipe)
        diameters_of(recipe)
        law = law_of_disks(recipe, "eps")
        if law.range:
            raise InputError(f"{law}: what attracts has no onset at zero contact energy; use pack, or compress")

    def place(self, recipe: Recipe, phi: float, sizes: Array) -> Packing:
        return disks_of(recipe, phi, sizes, "eps")


MAKING = MakingOfDisks()  # as entry points name it
