"""The repulsion of disks by a power of their overlap: springs, the elastic spheres of Hertz, and stiffening ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from jamlab.arrays import Array
from jamlab.laws.pair_law import PairLaw
from jamlab.laws.parameter import Parameter


@dataclass(frozen=True)
class PowerLaw(PairLaw):
    """The repulsion of two disks whose centres are at a distance r below s = (d_i + d_j)/2.

    Strength eps, an energy: U = (eps/alpha)(1 - r/s)^alpha, Boromand et al. eq 5. Strength k, a stiffness: U = (k
    s^2/alpha)(1 - r/s)^alpha, Baumgarten & Tighe eq 3. alpha is 2 in both papers, 5/2 for the elastic spheres of Hertz.
    `lammps_inputs/parts/sp` says the same to LAMMPS. Beyond an exponent of 10 disks that barely touch have no stiffness
    left.
    """

    name: ClassVar[str] = "power"
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "exponent": Parameter(
            default=2.0, least=2.0, largest=10.0, meaning="power of the overlap in the energy; 2.5: Hertz"
        )
    }
    deck_part: ClassVar[bool] = True
    sizes_by_disk: ClassVar[bool] = True

    exponent: float = 2.0  # alpha

    @property
    def relative(self) -> bool:
        """Whether the strength is an energy, or a stiffness."""
        return self.units == "eps"

    @property
    def springs(self) -> bool:
        """Whether the force grows in proportion to the overlap."""
        return self.exponent == 2

    def __call__(self, contact: Array, distance: Array) -> tuple[Array, Array, Array]:
        """See `PairLaw`; `distance` is at most s."""
        stiffness = self.strength / contact**2 if self.relative else np.full(len(contact), self.strength)
        overlap, alpha = contact - distance, self.exponent
        if alpha != 2:
            overlap = np.maximum(overlap, 0.0)
            stiffness = stiffness * (overlap / contact) ** (alpha - 2)
        return stiffness * overlap**2 / alpha, -stiffness * overlap, (alpha - 1) * stiffness

    @property
    def plugin_words(self) -> str:  # type: ignore[override]
        return f"exponent {self.exponent:.17g} shell 0"

    def lammps_variables(self) -> dict[str, object]:
        """Variables that `lammps_inputs/parts/sp` needs to know the law."""
        found: dict[str, object] = {"units": self.units, self.units: self.strength, "exponent": self.exponent}
        return found | {"stickiness": 0.0, "shell": 0.0}

    @property
    def stiffness(self) -> float:
        return 1.0

    @property
    def power_of_contact(self) -> float:
        """p in E = K (s - r)^alpha with K ~ s^p for two disks that touch at s."""
        return -self.exponent if self.relative else 2.0 - self.exponent

    def kernel_arguments(self) -> tuple[float, int, float]:
        """Strength, relative and exponent, as `plugin/kernels/disk_fire.cpp` takes them."""
        return self.strength, int(self.relative), self.exponent

    # near onset -----------------------------------------------------------------------------------------------------

    def linear_in_phi(self, pressure: float) -> float:
        """Pressure over the strength, to the power that makes it grow as phi - phi_J above onset."""
        return float((pressure / self.strength) ** (1 / (self.exponent - 1)))

    def pressure_at(self, overlap: float) -> float:
        """Pressure whose `linear_in_phi` is the overlap."""
        return float(overlap ** (self.exponent - 1) * self.strength)

    def stiffness_at(self, pressure: float) -> float:
        """Typical stiffness of contacts over the strength at a pressure, lengths in the unit of length."""
        return float((self.exponent - 1) * self.linear_in_phi(max(pressure, 0.0)) ** (self.exponent - 2))

    def force_at(self, energy: float) -> float:
        """Typical contact force at a contact energy per disk, lengths in the unit of length."""
        return float(self.strength * (self.exponent * energy / self.strength) ** (1 - 1 / self.exponent))

    def beside_springs(self, energy: float) -> float:
        """Typical contact force over the force of springs of the same strength, at a contact energy per disk."""
        return self.force_at(energy) / replace(self, exponent=2.0).force_at(energy)

    def root_energy(self, energy: float) -> float:
        """Contact energy, to the power that makes it grow as phi - phi_J above onset."""
        return float(np.sqrt(energy)) if self.springs else energy ** (1 / self.exponent)
