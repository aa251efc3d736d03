"""The drag of bubbles, Durian, Phys. Rev. Lett. 75, 4780 (1995): on the relative velocity of two that touch."""

from dataclasses import dataclass
from typing import ClassVar

from scipy import sparse

from jamlab.arguments.choices import Direction
from jamlab.packing.natural_units import stiffness_scale
from jamlab.packing.packing import Packing
from jamlab.rheology.drag_law import DragLaw, contact_velocities, parameter


@dataclass(frozen=True)
class BubbleDrag(DragLaw):
    """R = (k tau/2) sum |u_i' - u_j'|^2 over contacts, the same in every direction; rotations do not enter."""

    name: ClassVar[str] = "bubble"
    tau: float = parameter(1.0, "relaxation time of two bubbles", positive=True)

    def matrix(self, packing: Packing, whole: Packing, direction: Direction) -> sparse.csc_array:
        """Second derivatives of R by the velocities."""
        approach, slide, _ = contact_velocities(packing, direction, lever_arms="none")
        squares = approach.T @ approach + slide.T @ slide
        return sparse.csc_array(self.tau * stiffness_scale(whole) * squares)

    def lammps_variables(self) -> dict[str, float | str]:
        """The same in words of the plugin, for flow: no lever arms, and a coefficient that is even over contacts."""
        return {"tau": self.tau, "beta": 1.0, "lever_arms": "none", "even": 1.0}
