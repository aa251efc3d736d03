"""How packings of soft disks are made."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from jamlab.arrays import Array
from jamlab.models.disks import DISKS
from jamlab.packing.packing import Packing
from jamlab.packing.recipe import Recipe
from jamlab.protocols.descent import DescentOfDisks
from jamlab.protocols.makings import Making
from jamlab.protocols.random_start import disk_params, disks_of, usual_units


class MakingOfDisks(Making):
    """See `Making`; without droplets, "direct" starts do not exist."""

    name = DISKS.name
    descent = DescentOfDisks()
    stiffening_version = 2  # 1 left forces beside the contact forces
    compression_version = 2  # leaves saddles

    def check_law(self, parameters: Mapping[str, Any]) -> None:
        disk_params(usual_units(parameters, "eps"), **parameters)

    def place(self, recipe: Recipe, phi: float, sizes: Array) -> Packing:
        return disks_of(recipe, phi, sizes, "eps")


MAKING = MakingOfDisks()  # as entry points name it
