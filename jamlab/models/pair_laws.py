"""Force laws of contacts: energy, force and stiffness of a pair at a distance, and how far the law acts.

Line tension and area elasticity of droplets are no contacts: their energies stand with their terms in `droplets.py`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.packing.law_parameters import PairLaw, Parameter
from jamlab.packing.packing import Packing


@dataclass(frozen=True)
class PowerLaw(PairLaw):
    """The repulsion of two disks whose centres are at a distance r below s = (d_i + d_j)/2.

    Strength eps, an energy: U = (eps/alpha)(1 - r/s)^alpha, Boromand et al. eq 5. Strength k, a stiffness: U = (k
    s^2/alpha)(1 - r/s)^alpha, Baumgarten & Tighe eq 3. alpha is 2 in both papers, 5/2 for the elastic spheres of Hertz.
    `lammps_inputs/parts/sp` says the same to LAMMPS. Beyond an exponent of 10 disks that barely touch have no stiffness
    left.
    """

    parameters: ClassVar[Mapping[str, Parameter]] = {"exponent": Parameter(default=2.0, least=2.0, largest=10.0)}

    name: str  # "eps" or "k", the parameter that holds the strength
    strength: float
    exponent: float = 2.0  # alpha

    @classmethod
    def of(cls, params: Mapping[str, Any]) -> PowerLaw:
        """Read the law from `Packing.params` of disks."""
        name = "eps" if "eps" in params else "k"
        return cls(name, float(params[name]), float(params.get("exponent", cls.parameters["exponent"].default)))

    @property
    def relative(self) -> bool:
        """Whether the strength is an energy, or a stiffness."""
        return self.name == "eps"

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

    def lammps_variables(self) -> dict[str, object]:
        """Variables that `lammps_inputs/parts/sp` needs to know the law."""
        return {"law": self.name, self.name: self.strength, "exponent": self.exponent}

    @property
    def power_of_contact(self) -> float:
        """p in E = K (s - r)^alpha with K ~ s^p for two disks that touch at s."""
        return -self.exponent if self.relative else 2.0 - self.exponent

    def kernel_arguments(self) -> tuple[float, int, float]:
        """Strength, relative and exponent, as `plugin/kernels/disk_fire.cpp` takes them."""
        return self.strength, int(self.relative), self.exponent

    # scaling near onset, which only a power law has -----------------------------------------------------------------

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
        """Typical contact force over that of springs of the strength, at a contact energy per disk."""
        return self.force_at(energy) / replace(self, exponent=2.0).force_at(energy)

    def root_energy(self, energy: float) -> float:
        """Contact energy, to the power that makes it grow as phi - phi_J above onset."""
        return super().root_energy(energy) if self.springs else energy ** (1 / self.exponent)


@dataclass(frozen=True)
class RimLaw(PairLaw):
    """The repulsion of a vertex at a distance d < delta from an edge, U = (eps/2)(1 - d/delta)^2, Boromand et al. eq 8.
    Contact is at delta."""

    parameters: ClassVar[Mapping[str, Parameter]] = {"delta": Parameter(length=1)}

    eps: float
    delta: float

    def __call__(self, contact: Array, distance: Array) -> tuple[Array, Array, Array]:
        """See `PairLaw`."""
        overlap = 1.0 - distance / contact
        return (
            0.5 * self.eps * overlap**2,
            -self.eps * overlap / contact,
            np.full(len(distance), self.eps / self.delta**2),
        )


def power_law(packing: Packing) -> PowerLaw:
    """The law of disks, where a protocol needs its scaling near onset."""
    law = packing.law
    if not isinstance(law, PowerLaw):
        raise InputError(f"model {packing.model}: only disks that repel by a power law scale as this protocol needs it")
    return law
