"""Mean spectra: G*(omega) of several packings together, with band and table."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.representation import short_repr
from jamlab.rheology.complex_modulus import ComplexModulus

Array = NDArray[np.float64]

COLUMNS = ("storage", "loss", "error")
LIMITS = ("g0", "eta0", "eta_inf")


@dataclass(frozen=True)
class Spectra:
    """G*(omega) of one or more packings at the same frequencies.

    Attributes:
        members: one spectrum per packing.
        units: "k" or "eps", of all packings.
        converged: whether each packing is at a minimum.
    """

    members: tuple[ComplexModulus, ...]
    units: str
    converged: tuple[bool, ...]

    __repr__ = short_repr

    @property
    def omega(self) -> Array:
        """(m,) angular frequencies, 1/tau_1."""
        return self.members[0].omega

    def all_of(self, name: str) -> Array:
        """(packings, m) values of "storage", "loss" or "error"."""
        return np.array([getattr(s, name) for s in self.members])

    def limit(self, name: str) -> float:
        """Mean of "g0", "eta0" or "eta_inf"."""
        return float(np.mean([getattr(s, name) for s in self.members]))

    def band(self, name: str) -> tuple[Array, Array, Array]:
        """Mean over packings, and mean minus and plus the standard error; the band of one packing has no width."""
        values = self.all_of(name)
        mean = values.mean(axis=0)
        spread = values.std(axis=0, ddof=1) / np.sqrt(len(values)) if len(values) > 1 else np.zeros_like(mean)
        return mean, mean - spread, mean + spread

    @property
    def method(self) -> str:
        """Solvers used."""
        return ", ".join(sorted({s.method for s in self.members}))

    @property
    def description(self) -> str:
        """The numbers of packings and of those that are not at a minimum, and the solver."""
        count = len(self.members)
        text = f"{count} packings" if count > 1 else "1 packing"
        bad = self.converged.count(False)
        return f"{text}, {self.method}" + (f", {bad} NOT CONVERGED" if bad else "")

    def rows(self) -> tuple[list[str], list[list[str]]]:
        """Column names and cells of a table."""
        names = ["ω τ1", "G'", "G''", "error"]
        columns = [self.omega, *(self.band(name)[0] for name in COLUMNS)]
        if len(self.members) > 1:
            names += ["± G'", "± G''"]
            columns += [high - mean for mean, _, high in map(self.band, ("storage", "loss"))]
        return names, [[f"{value:.4g}" for value in row] for row in zip(*columns, strict=True)]

    def summary(self) -> dict[str, Any]:
        """Plain numbers: limits and mean curves, of each packing too if there are several."""
        content: dict[str, Any] = {
            "converged": all(self.converged),
            "method": self.method,
            "omega": self.omega.tolist(),
        }
        content |= {name: self.limit(name) for name in LIMITS}
        content |= {name: self.band(name)[0].tolist() for name in COLUMNS}
        if len(self.members) > 1:
            content["packings"] = [
                {**{k: getattr(s, k) for k in LIMITS}, **{k: getattr(s, k).tolist() for k in COLUMNS}}
                for s in self.members
            ]
        return content
