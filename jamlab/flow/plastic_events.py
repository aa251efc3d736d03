"""Plastic events of quasi-static shear: what each one changes."""

from __future__ import annotations

from dataclasses import dataclass

from jamlab.arrays import Array
from jamlab.packing.result import Result


@dataclass(frozen=True)
class PlasticEvents(Result):
    """Plastic events: m steps in which stress fell or energy was lost, and which a step back does not undo."""

    _rows = ("strain", "stress_drop", "released", "width")

    strain: Array  # (m,) at the end of the step
    stress_drop: Array  # (m,) stress before less that after; negative where it rose by more than it fell
    released: Array  # (m,) energy lost per area: the work by the trapezoidal rule less the rise of the energy
    width: Array  # (m,) strain of the step: the event lies that much before `strain` at most

    def __len__(self) -> int:
        return len(self.strain)
