"""A force law as a package of somebody else would declare it: Weeks, Chandler and Andersen, J. Chem. Phys. 54, 5237.

The repulsive part of Lennard-Jones, cut where its force vanishes, which is where two disks touch. LAMMPS has it.
"""

from dataclasses import dataclass
from typing import ClassVar

from jamlab.laws.laws import LAWS
from jamlab.laws.pair_law import PairLaw, PairStyle


@dataclass(frozen=True)
class WcaLaw(PairLaw):
    """U = 4 eps [(sigma/r)^12 - (sigma/r)^6] + eps up to s = 2^(1/6) sigma."""

    name: ClassVar[str] = "wca_here"  # that of an installed package may be wca
    pair_style: ClassVar[PairStyle] = PairStyle("lj/cut 1.0", ("v_eps", "v_s/2^(1/6)", "v_s"), "shift yes")

    def __call__(self, contact, distance):
        eps, ratio = self.energy_of(contact), contact / distance
        energy = eps * (ratio**12 - 2 * ratio**6 + 1)
        slope = -12 * eps / distance * (ratio**12 - ratio**6)
        stiffness = 12 * eps / distance**2 * (13 * ratio**12 - 7 * ratio**6)
        return energy, slope, stiffness


LAWS.register(WcaLaw.name, WcaLaw)
