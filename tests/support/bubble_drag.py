"""A law of drag as a package of somebody else would declare it: Durian's bubbles.

Phys. Rev. Lett. 75, 4780 (1995): where two disks touch, the drag c is on the relative velocity of their centres, the
same at every contact and in every direction. No rotation enters.
"""

from dataclasses import dataclass
from typing import ClassVar

from scipy import sparse

from jamlab.packing.natural_units import stiffness_scale
from jamlab.rheology.drag_law import DRAGS, DragLaw, contact_velocities, parameter


@dataclass(frozen=True)
class BubbleDrag(DragLaw):
    """R = (k tau/2) sum |du'|^2."""

    name: ClassVar[str] = "bubble"
    tau: float = parameter(1.0, "relaxation time of two disks", positive=True)

    def matrix(self, packing, whole, direction):
        approach, slide, _ = contact_velocities(packing, direction, lever_arms="none")
        drag = self.tau * stiffness_scale(whole)
        return sparse.csc_array(drag * (approach.T @ approach + slide.T @ slide))

    # lammps_variables is left out: nothing carries the law in flow


@dataclass(frozen=True)
class CarriedBubbleDrag(BubbleDrag):
    """The same, which says how the plugin has it."""

    name: ClassVar[str] = "carried_bubble"

    def lammps_variables(self):
        return {"tau": self.tau, "beta": 1.0, "lever_arms": "none", "even": 1.0}


DRAGS.register(CarriedBubbleDrag.name, CarriedBubbleDrag)
DRAGS.register(BubbleDrag.name, BubbleDrag)
