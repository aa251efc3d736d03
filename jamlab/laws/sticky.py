"""Springs that also pull: the attraction of sticky disks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.laws.pair_law import HIGHEST_OVERLAP, check_derivatives
from jamlab.laws.parameter import Parameter
from jamlab.laws.spring_law import SpringLaw

SLACK = 1e-11  # of the unit of force: ten times the tolerance of a minimum


@dataclass(frozen=True)
class StickyLaw(SpringLaw):
    """Springs that also pull, Koeze & Tighe, Phys. Rev. Lett. 121, 188002 (2018).

    Of the overlap x = s - r of two disks, and a shell of width a, the force is k x down to x = -a, and -k (x + 2 a)
    from there to x = -2 a, where it ends. U = (k/2)(x^2 - 2 a^2), then -(k/2)(x + 2 a)^2. Strength eps: k = eps/s^2.
    The parameter `stickiness` is a over the mean diameter. Of equal disks the integral of U over the plane is negative
    from 0.23 of the diameter on: the more of them lie upon each other, the lower is their energy (Ruelle, Statistical
    Mechanics, 1969, sec. 3.2). Packings of two sizes collapse from 0.25 of the mean diameter on.
    """

    name: ClassVar[str] = "sticky"
    deck_part: ClassVar[bool] = True
    sizes_by_disk: ClassVar[bool] = True
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "stickiness": Parameter(
            default=0.0,
            least=1e-9,
            largest=0.2,
            may_vanish=True,
            over_size=True,
            beyond="disks that attract collapse",
            meaning="width of the shell that attracts, over the mean diameter",
        )
    }
    floppy: ClassVar[float] = 1e-12  # networks have as many floppy modes as particles, and rounding grows with them
    least_contacts: ClassVar[int] = 2  # bonds hold a disk on both sides of their line
    least_bearing: ClassVar[int] = 2

    stickiness: float
    shell: float  # a

    @classmethod
    def of(cls, params: Mapping[str, Any], units: str, mean_size: float = 1.0) -> Self:
        """See `PairLaw`."""
        stickiness = float(params.get("stickiness", 0.0))
        if not stickiness:
            raise InputError("law 'sticky' needs a stickiness above 0: give it, or leave the law out")
        law = cls(units, float(params[units]), stickiness, stickiness * mean_size)
        check_derivatives(law, mean_size)
        return law

    def __str__(self) -> str:
        return f"sticky disks of stickiness {self.stickiness:g}"

    @property
    def pressures(self) -> tuple[float, float]:
        """See `PairLaw`. Highest at a stickiness of 0.1, 0.15, 0.2: 0.3, 0.2, 0.1, phi = 1.28, 1.22, 1.19 (n = 32); at
        0.3 with 0.15 and 0.2 disks lie upon each other, phi = 1.48 and 2.05."""
        highest = min(HIGHEST_OVERLAP, round(0.5 - 2.0 * self.stickiness, 12))
        return -HIGHEST_OVERLAP * self.strength, highest * self.strength

    @property
    def range(self) -> float:
        return 2 * self.shell

    @property
    def slack(self) -> float:
        mean = self.shell / self.stickiness
        return SLACK * self.strength * (1 / mean if self.units == "eps" else mean)

    def __call__(self, contact: Array, distance: Array) -> tuple[Array, Array, Array]:
        """See `PairLaw`."""
        k, overlap, a = self.drag_stiffness(contact, distance), contact - distance, self.shell
        inner, depth = overlap >= -a, overlap + 2 * a
        energy = 0.5 * k * np.where(inner, overlap**2 - 2 * a**2, -(depth**2))
        return energy, k * np.where(inner, -overlap, depth), np.where(inner, k, -k)

    def drag_stiffness(self, contact: Array, distance: Array) -> Array:
        """Stiffness of the spring, wherever the two disks act on each other."""
        return self.strength / contact**2 if self.units == "eps" else np.full(len(contact), self.strength)

    def lammps_variables(self) -> dict[str, object]:
        found: dict[str, object] = {"units": self.units, self.units: self.strength, "exponent": 2.0}
        return found | {"stickiness": self.stickiness, "shell": self.shell}

    @property
    def power_of_contact(self) -> float:
        return -2.0 if self.units == "eps" else 0.0
