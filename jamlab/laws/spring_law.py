"""Laws whose force grows in proportion to the overlap."""

from __future__ import annotations

import numpy as np

from jamlab.laws.pair_law import PairLaw


class SpringLaw(PairLaw):
    """A law of springs: contacts are as stiff near onset as far above it."""

    @property
    def springs(self) -> bool:
        """Whether the force grows in proportion to the overlap."""
        return True

    @property
    def stiffness(self) -> float:
        """Stiffness of a contact over the strength."""
        return 1.0

    def stiffness_at(self, pressure: float) -> float:
        """Typical stiffness of contacts at a pressure, over `stiffness` times the strength."""
        return 1.0

    def beside_springs(self, energy: float) -> float:
        """Typical contact force over the force of springs."""
        return 1.0

    def root_energy(self, energy: float) -> float:
        """Contact energy, to the power that makes it grow as phi - phi_J above onset."""
        return float(np.sqrt(energy))
