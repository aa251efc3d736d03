"""Dimers: two disks of one size on a stiff bond."""

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from jamlab.arrays import Array
from jamlab.laws.parameter import Parameter
from jamlab.models.round_sites import RoundSites
from jamlab.packing.packing import Packing


class Dimers(RoundSites):
    """A bond has the rest length aspect d, between disks of diameter d, and the stiffness `bond`."""

    name = "dimer"
    particles = "dimers"
    words = ("dimers",)
    sites = 2
    own: ClassVar[Mapping[str, Parameter]] = {
        "aspect": Parameter(default=0.5, least=0.01, largest=0.99),
        "bond": Parameter(energy=1, length=-2, default=50.0, made=(1.0, 1e3)),
    }
    bond_style = "harmonic"
    bond_coefficients = ("v_bond/2", "v_aspect*v_d")

    def shape(self, diameters: Array, params: Mapping[str, Any]) -> Array:
        """(n, 2, 2) positions of the two disks from the centre."""
        half = 0.5 * float(params["aspect"]) * diameters[:, None, None]
        return np.asarray(half * np.array([[-1.0, 0.0], [1.0, 0.0]]))

    def free_area(self, packing: Packing) -> float:
        """Two disks, less the lens that they share."""
        a = packing.params["aspect"]
        return float(np.sum(packing.disk_diameters**2) * (np.pi - np.arccos(a) + a * np.sqrt(1 - a * a)) / 2)

    def bond_energy(
        self,
        length: Array,
        diameters: Array,
        params: Mapping[str, Any],
    ) -> tuple[Array, Array, float]:
        """Energy, tension and stiffness of each bond."""
        stretch, stiffness = length - params["aspect"] * diameters, params["bond"]
        return 0.5 * stiffness * stretch**2, stiffness * stretch, stiffness


DIMERS = Dimers()
