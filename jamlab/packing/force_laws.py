"""Force laws of contacts: energy, force and stiffness at a distance, of two disks and of the rims of two droplets.

Line tension and area elasticity of droplets are no contacts: their energies stand with their terms in `energy_terms`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from jamlab.arrays import Array, Indices
from jamlab.packing.law_parameters import FORCE_LAW, OPTIONAL
from jamlab.packing.natural_units import mean_size
from jamlab.packing.packing import Packing


@dataclass(frozen=True)
class DiskLaw:
    """The repulsion of two disks whose centres are at a distance r below s = (d_i + d_j)/2.

    Law "eps": U = (eps/alpha)(1 - r/s)^alpha, Boromand et al. eq 5. Law "k": U = (k s^2/alpha)(1 - r/s)^alpha,
    Baumgarten & Tighe eq 3. alpha is 2 in both papers, 5/2 for the elastic spheres of Hertz. Whatever depends on how
    disks repel asks this object; `lammps_inputs/parts/sp` says the same to LAMMPS.
    """

    name: str  # "eps" or "k", the parameter that holds the strength
    strength: float  # eps, an energy, or k, a stiffness
    exponent: float = 2.0  # alpha

    @property
    def relative(self) -> bool:
        """Whether the strength is an energy, as in law "eps", or a stiffness."""
        return self.name == "eps"

    @property
    def springs(self) -> bool:
        """Whether the force grows in proportion to the overlap."""
        return self.exponent == 2

    def __call__(self, reach: Array, distance: Array) -> tuple[Array, Array, Array]:
        """Energy, force U' and stiffness U'' of pairs that touch. `reach`: (m,) s; `distance`: (m,) r, at most s.
        Returns three (m,) arrays: U, dU/dr, d2U/dr2."""
        stiffness = self.strength / reach**2 if self.relative else np.full(len(reach), self.strength)
        overlap, alpha = reach - distance, self.exponent
        if alpha != 2:
            overlap = np.maximum(overlap, 0.0)
            stiffness = stiffness * (overlap / reach) ** (alpha - 2)
        return stiffness * overlap**2 / alpha, -stiffness * overlap, (alpha - 1) * stiffness

    def typical_stiffness(self, size: float) -> float:
        """Stiffness of contacts of disks of a mean diameter: the strength over the square of it."""
        return self.strength / size**2

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

    def root_energy(self, energy: float) -> float:
        """Contact energy, to the power that makes it grow as phi - phi_J above onset."""
        return float(np.sqrt(energy) if self.exponent == 2 else energy ** (1 / self.exponent))

    def lammps_variables(self) -> dict[str, object]:
        """Variables that `lammps_inputs/parts/sp` needs to know the law."""
        return {"law": self.name, self.name: self.strength, "exponent": self.exponent}

    @property
    def power_of_reach(self) -> float:
        """p in E = K (s - r)^alpha with K ~ s^p for two disks that touch at s."""
        return -self.exponent if self.name == "eps" else 2.0 - self.exponent

    def kernel_arguments(self) -> tuple[float, int, float]:
        """Strength, relative and exponent, as `plugin/kernels/disk_fire.cpp` takes them."""
        return self.strength, int(self.relative), self.exponent

    @classmethod
    def of(cls, params: Mapping[str, Any]) -> "DiskLaw":
        """Read a law from `Packing.params` of disks."""
        name = "eps" if "eps" in params else "k"
        return cls(name, float(params[name]), float(params.get("exponent", OPTIONAL["sp"]["exponent"][0])))


def disk_law(packing: Packing) -> DiskLaw:
    """Read the repulsion of the disks of a packing from its parameters."""
    return DiskLaw.of(packing.params)


def reach(packing: Packing, pairs: Indices) -> Array:
    """(m,) distance s = (d_i + d_j)/2 at which the disks of each pair (m, 2) begin to touch."""
    assert packing.diameters is not None
    return np.asarray(0.5 * packing.diameters[pairs].sum(axis=1))


def has_springs(packing: Packing) -> bool:
    """Whether contact forces grow in proportion to overlaps, as those of droplets and of harmonic disks do."""
    return packing.model == "dp" or disk_law(packing).springs


def lammps_variables(packing: Packing) -> dict[str, object]:
    """Variables that a part of the decks needs to know the force law of a packing."""
    if packing.model == "sp":
        return disk_law(packing).lammps_variables()
    return {"law": "eps"} | {name: packing.params[name] for name in FORCE_LAW["dp", "eps"] if name != "a0"}


def drag_stiffness(packing: Packing) -> float:
    """Stiffness in drag coefficients: k, or eps over the square of the mean size of particles."""
    return float(packing.params["k"] if packing.units == "k" else packing.params["eps"] / mean_size(packing) ** 2)


def root_energy(packing: Packing, energy: float) -> float:
    """Contact energy, to the power that makes it grow as phi - phi_J above onset: sqrt(U) of springs."""
    return disk_law(packing).root_energy(energy) if packing.model == "sp" else float(np.sqrt(energy))


def rim_law(packing: Packing, distance: Array) -> tuple[Array, Array, Array]:
    """Energy, force U' and stiffness U'' of a vertex at a distance d < delta from an edge. U = (eps/2)(1 - d/delta)^2,
    Boromand et al. eq 8. `distance`: (m,) d. Returns three (m,) arrays: U, dU/dd, d2U/dd2."""
    eps, delta = packing.params["eps"], packing.params["delta"]
    overlap = 1.0 - distance / delta
    return 0.5 * eps * overlap**2, -eps * overlap / delta, np.full(len(distance), eps / delta**2)
