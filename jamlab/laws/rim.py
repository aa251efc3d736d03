"""The repulsion of the rims of droplets."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from jamlab.arrays import Array
from jamlab.laws.pair_law import Surfaces, check_derivatives
from jamlab.laws.parameter import WIDEST, Parameter
from jamlab.laws.spring_law import SpringLaw

CONTACT_FORMS = ("outline", "segment", "segment/smooth")  # data files hold their places: append only
WIDEST_RIM = 10.0  # in l, the size of a droplet


@dataclass(frozen=True)
class RimLaw(SpringLaw):
    """The repulsion of a vertex at a distance d < delta from an edge, U = (eps/2)(1 - d/delta)^2, Boromand et al. eq 8.
    Contact is at delta. Other laws of rims derive from this one, and have its parameters."""

    name: ClassVar[str] = "rim"
    between: ClassVar[Surfaces] = "rims"
    strengths: ClassVar[Mapping[str, Parameter]] = {
        "eps": Parameter(energy=1, made=(1 / WIDEST, WIDEST), meaning="energy of contacts")
    }
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "delta": Parameter(length=1, made=(1e-12, WIDEST_RIM), meaning="width of the rims")
    }
    deck_part: ClassVar[bool] = True
    least_bearing: ClassVar[int] = 2  # the flats of a droplet hold it between two opposite ones

    delta: float

    def __init_subclass__(cls, **options: Any) -> None:
        """Another energy of the rims is not the one of the decks, unless its class says so."""
        super().__init_subclass__(**options)
        if "deck_part" not in vars(cls):
            cls.deck_part = False

    @classmethod
    def of(cls, params: Mapping[str, Any], units: str, mean_size: float = 1.0) -> Self:
        """See `PairLaw`; rims meet at delta, whatever the mean size."""
        own = {name: float(params.get(name, each.default)) for name, each in cls.parameters.items()}
        law = cls(units, float(params[units]), **own)
        check_derivatives(law, law.delta)
        return law

    def __call__(self, contact: Array, distance: Array) -> tuple[Array, Array, Array]:
        """See `PairLaw`."""
        overlap = 1.0 - distance / contact
        return (
            0.5 * self.strength * overlap**2,
            -self.strength * overlap / contact,
            np.full(len(distance), self.strength / self.delta**2),
        )

    def drag_stiffness(self, contact: Array, distance: Array) -> Array:
        """Stiffness of the spring."""
        return self(contact, distance)[2]
