"""Force laws as a package of somebody else would write them, registered in this process."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jamlab.laws.laws import LAWS
from jamlab.laws.pair_law import PairLaw, PairStyle
from jamlab.laws.parameter import Parameter
from tests.support.wca_law import WcaLaw as Wca


@dataclass(frozen=True)
class Ramp(PairLaw):
    """U = weight eps (1 - r/s)^2 or ^3, by its form; with a parameter of each sort."""

    name: ClassVar[str] = "ramp"
    strengths: ClassVar = {"eps": PairLaw.strengths["eps"]}
    parameters: ClassVar = {
        "weight": Parameter(default=1.0, least=0.1, largest=10.0),
        "form": Parameter(default="square", choices=("square", "cube")),
    }

    weight: float = 1.0
    form: str = "square"

    @property
    def power(self):
        return {"square": 2, "cube": 3}[self.form]

    @property
    def pair_style(self):
        return PairStyle("lepton 1.0", (f"$(v_weight*v_eps:%.17g)*(1-r/$(v_s:%.17g))^{self.power}", "v_s"))

    def __call__(self, contact, distance):
        x, m, u = np.maximum(1 - distance / contact, 0.0), self.power, self.weight * self.energy_of(contact)
        return u * x**m, -m * u * x ** (m - 1) / contact, m * (m - 1) * u * x ** (m - 2) / contact**2


@dataclass(frozen=True)
class NoDeck(Wca):
    """A law that analysis alone knows."""

    name: ClassVar[str] = "nodeck"
    pair_style: ClassVar[PairStyle | None] = None


for law in (Ramp, NoDeck):
    LAWS.register(law.name, law)
