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
    def of(cls, params: Mapping[str, Any], mean_diameter: float = 1.0) -> PowerLaw | StickyLaw:
        """Read the law from `Packing.params` of disks."""
        name = "eps" if "eps" in params else "k"
        exponent = float(params.get("exponent", cls.parameters["exponent"].default))
        stickiness = float(params.get("stickiness", 0.0))
        if not stickiness:
            return cls(name, float(params[name]), exponent)
        if exponent != 2:
            raise InputError(f"stickiness = {stickiness:g} with exponent = {exponent:g}: sticky disks need 2")
        return StickyLaw(name, float(params[name]), stickiness, stickiness * mean_diameter)

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
        found: dict[str, object] = {"law": self.name, self.name: self.strength, "exponent": self.exponent}
        return found | {"stickiness": 0.0, "shell": 0.0}

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
        """Typical contact force over the force of springs of the same strength, at a contact energy per disk."""
        return self.force_at(energy) / replace(self, exponent=2.0).force_at(energy)

    def root_energy(self, energy: float) -> float:
        """Contact energy, to the power that makes it grow as phi - phi_J above onset."""
        return super().root_energy(energy) if self.springs else energy ** (1 / self.exponent)


SLACK = 1e-11  # of the unit of force: ten times the tolerance of a minimum


@dataclass(frozen=True)
class StickyLaw(PairLaw):
    """Springs that also pull, Koeze & Tighe, Phys. Rev. Lett. 121, 188002 (2018).

    Of the overlap x = s - r of two disks, and a shell of width a, the force is k x down to x = -a, and -k (x + 2 a)
    from there to x = -2 a, where it ends. U = (k/2)(x^2 - 2 a^2), then -(k/2)(x + 2 a)^2. Strength eps: k = eps/s^2.
    The parameter `stickiness` is a over the mean diameter. Of equal disks the integral of U over the plane is negative
    from 0.23 of the diameter on: the more of them lie upon each other, the lower is their energy (Ruelle, Statistical
    Mechanics, 1969, sec. 3.2). Packings of two sizes collapse from 0.25 of the mean diameter on.
    """

    parameters: ClassVar[Mapping[str, Parameter]] = {
        "stickiness": Parameter(
            default=0.0, least=1e-9, largest=0.2, may_vanish=True, over_size=True, beyond="disks that attract collapse"
        )
    }
    floppy: ClassVar[float] = 1e-12  # networks have as many floppy modes as particles, and rounding grows with them
    least_contacts: ClassVar[int] = 2  # bonds hold a disk on both sides of their line
    least_bearing: ClassVar[int] = 2

    name: str  # "eps" or "k", the parameter that holds the strength
    strength: float
    stickiness: float
    shell: float  # a

    @property
    def range(self) -> float:
        return 2 * self.shell

    @property
    def slack(self) -> float:
        mean = self.shell / self.stickiness
        return SLACK * self.strength * (1 / mean if self.name == "eps" else mean)

    def __call__(self, contact: Array, distance: Array) -> tuple[Array, Array, Array]:
        """See `PairLaw`."""
        k, overlap, a = self.drag_stiffness(contact, distance), contact - distance, self.shell
        inner, depth = overlap >= -a, overlap + 2 * a
        energy = 0.5 * k * np.where(inner, overlap**2 - 2 * a**2, -(depth**2))
        return energy, k * np.where(inner, -overlap, depth), np.where(inner, k, -k)

    def drag_stiffness(self, contact: Array, distance: Array) -> Array:
        """That of the spring, wherever the two disks act on each other."""
        return self.strength / contact**2 if self.name == "eps" else np.full(len(contact), self.strength)

    def lammps_variables(self) -> dict[str, object]:
        found: dict[str, object] = {"law": self.name, self.name: self.strength, "exponent": 2.0}
        return found | {"stickiness": self.stickiness, "shell": self.shell}

    @property
    def power_of_contact(self) -> float:
        return -2.0 if self.name == "eps" else 0.0


@dataclass(frozen=True)
class RimLaw(PairLaw):
    """The repulsion of a vertex at a distance d < delta from an edge, U = (eps/2)(1 - d/delta)^2, Boromand et al. eq 8.
    Contact is at delta."""

    parameters: ClassVar[Mapping[str, Parameter]] = {"delta": Parameter(length=1)}
    least_bearing: ClassVar[int] = 2  # the flats of a droplet hold it between two opposite ones

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
        what = f"stickiness = {law.stickiness:g}" if isinstance(law, StickyLaw) else f"model {packing.model}"
        remedy = "compress(packing, to) with a lower rho or phi"
        if packing.model == "sp":
            remedy = f"pack(n, pressure=...), pack(n, phi=...), or {remedy}"
        raise InputError(f"{what}: this protocol needs disks with a repulsive power law; use {remedy}")
    return law
