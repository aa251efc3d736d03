"""Rims that also pull: droplets that adhere."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.laws.parameter import Parameter
from jamlab.laws.rim import RimLaw

SYMMETRIC = 2.0  # range over adhesion where none is given: the pull falls as steeply as it grows


@dataclass(frozen=True)
class AdhesiveLaw(RimLaw):
    """Rims that attract each other beyond contact, with the energy that two vertices have in
    `dpm::vertexAttractiveForces2D` of github.com/jacktreado/dpm, the code of Treado et al., J. R. Soc. Interface 19,
    20220602 (2022).

    Of a vertex at the distance d from an edge, with l1 = `adhesion` and l2 = `adhesion_range`, both over delta, the
    energy is U = (eps/2)[(1 - d/delta)^2 - l1 l2] up to d = (1 + l1) delta, where the pull is largest, eps l1/delta;
    and U = -(eps/2) (l1/(l2 - l1)) (1 + l2 - d/delta)^2 from there to (1 + l2) delta, where it ends. Each meeting of
    two rims in contact has the energy -(eps/2) l1 l2. l2 = 2 l1 is the force of sticky disks.

    The energy belongs to vertices, however long their edges: vertices slide into the contact and gather there. Edges
    that shrink to nothing need an `eta` above 0, or elastic edges. In the forms in which a vertex meets every edge
    nearby, outlines collapse: two droplets of 24 vertices had 420 meetings.
    """

    name: ClassVar[str] = "adhesive"
    parameters: ClassVar[Mapping[str, Parameter]] = {
        **RimLaw.parameters,
        "adhesion": Parameter(
            default=0.0,
            least=1e-9,
            largest=1.0,
            may_vanish=True,
            meaning="largest pull between rims of droplets, over eps/delta",
        ),
        "adhesion_range": Parameter(
            default=0.0,
            least=1e-9,
            largest=10.0,
            may_vanish=True,
            meaning="gap up to which rims pull, over delta; 0: twice the adhesion",
        ),
    }
    deck_part: ClassVar[bool] = True
    least_contacts: ClassVar[int] = 2  # bonds hold a droplet on both sides of their line

    adhesion: float
    adhesion_range: float

    @classmethod
    def of(cls, params: Mapping[str, Any], units: str, mean_size: float = 1.0) -> Self:
        """See `PairLaw`."""
        pull, gap = (float(params.get(name, 0.0)) for name in ("adhesion", "adhesion_range"))
        if not pull:
            raise InputError("law 'adhesive' needs an adhesion above 0: give it, or leave the law out")
        if (form := params.get("contact", "outline")) != "outline":
            raise InputError(
                f"contact = {form!r} with adhesion = {pull:g}: each vertex would be pulled by all edges near it, and "
                "outlines collapse; use contact = 'outline'"
            )
        if gap and gap <= pull:
            raise InputError(
                f"adhesion_range = {gap:g} with adhesion = {pull:g}: the pull grows up to a gap of the adhesion; give "
                f"a longer range, or leave it out for {SYMMETRIC * pull:g}"
            )
        return super().of({**params, "adhesion_range": gap or SYMMETRIC * pull}, units, mean_size)

    def __str__(self) -> str:
        return f"droplets of adhesion {self.adhesion:g}"

    @property
    def range(self) -> float:
        return self.adhesion_range * self.delta

    @property
    def _falls(self) -> float:
        """Stiffness over eps where the pull falls, with the sign turned, times delta^2."""
        return self.adhesion / (self.adhesion_range - self.adhesion)

    def __call__(self, contact: Array, distance: Array) -> tuple[Array, Array, Array]:
        """See `PairLaw`."""
        overlap, l1, l2 = 1.0 - distance / contact, self.adhesion, self.adhesion_range
        inner, depth, falls = overlap >= -l1, overlap + l2, self._falls
        energy = np.where(inner, overlap**2 - l1 * l2, -falls * depth**2)
        slope = np.where(inner, -overlap, falls * depth)
        stiffness = np.where(inner, 1.0, -falls)
        return (
            0.5 * self.strength * energy,
            self.strength * slope / contact,
            self.strength * stiffness / contact**2,
        )

    def drag_stiffness(self, contact: Array, distance: Array) -> Array:
        """Stiffness of overlapping rims, wherever two act on each other."""
        return np.full(len(distance), self.strength / self.delta**2)
