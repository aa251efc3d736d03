"""The force law of Weeks, Chandler and Andersen, J. Chem. Phys. 54, 5237 (1971): Lennard-Jones without attraction."""

from dataclasses import dataclass
from typing import ClassVar

from jamlab.arrays import Array
from jamlab.laws.pair_law import PairLaw, PairStyle


@dataclass(frozen=True)
class Wca(PairLaw):
    """U = eps [(s/r)^6 - 1]^2 where two disks overlap, r < s; strength k: eps = k s^2."""

    name: ClassVar[str] = "wca"
    pair_style: ClassVar[PairStyle] = PairStyle(
        style="lj/cut 1.0",
        coefficients=("v_eps", "v_s/2^(1/6)", "v_s"),
        modify="shift yes",
    )

    def __call__(self, contact: Array, distance: Array) -> tuple[Array, Array, Array]:
        """Energy, its slope and its curvature at each distance."""
        x, eps = (contact / distance) ** 6, self.energy_of(contact)
        slope = -12 * eps * (x**2 - x) / distance
        curvature = 12 * eps * (13 * x**2 - 7 * x) / distance**2
        return eps * (x - 1) ** 2, slope, curvature
