"""Steady state of a flow: means over its rows beyond the start-up, with the errors of correlated values."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.packing.result import Result
from jamlab.statistics.confidence import AVERAGES, BlockAverage

AVERAGED = ("stress", "elastic_stress", "pressure", "normal_stress_difference", "z_all", "energy")


@dataclass(frozen=True, kw_only=True)
class SteadyState(Result):
    """Means over the steady part of a flow. Errors are standard errors of correlated rows, the largest of three
    estimates, see `jamlab.statistics.confidence.block_average`.

    Attributes:
        stress, stress_stderr: mean shear stress, in quasi-static shear the flow stress.
        elastic_stress, pressure, normal_stress_difference, z_all, energy: means, each with `..._stderr`; see `FlowRun`.
        mu, mu_stderr: macroscopic friction, mean stress over mean pressure; nan where the pressure is not positive.
        plastic_events: number of stress drops per unit of strain; 0 of several parts, whose drops are not told apart.
        stress_drop: mean size of these drops; nan without one.
        drift: change of the stress from the first to the second half of the average, in its standard errors.
        independent: number of independent rows that the stress is worth.
        discard, strain: strain of the start-up, which is left out, and strain of the average.
        unit: unit of stress, for labels.
    """

    stress: float
    stress_stderr: float
    elastic_stress: float
    elastic_stress_stderr: float
    pressure: float
    pressure_stderr: float
    mu: float
    mu_stderr: float
    normal_stress_difference: float
    normal_stress_difference_stderr: float
    z_all: float
    z_all_stderr: float
    energy: float
    energy_stderr: float
    plastic_events: float
    stress_drop: float
    drift: float
    independent: float
    discard: float
    strain: float
    unit: str = field(default="", repr=False)

    @property
    def steady(self) -> bool:
        """Whether the stress has one mean in both halves, as far as their errors tell."""
        return abs(self.drift) <= AVERAGES.drift

    def _columns(self) -> dict[str, Any]:
        """A row for each mean."""
        names = [*AVERAGED[:3], "mu", *AVERAGED[3:]]
        errors = [getattr(self, f"{name}_stderr") for name in names]
        return {"quantity": names, "mean": [getattr(self, name) for name in names], "stderr": errors}

    @classmethod
    def _of(
        cls, means: dict[str, BlockAverage], mu: BlockAverage, drops: Array, discard: float, strain: float, unit: str
    ) -> SteadyState:
        """From averages by name, and the sizes of the drops (k,) of the average."""
        return cls(
            **{name: mean.value for name, mean in means.items()},
            **{f"{name}_stderr": mean.error for name, mean in means.items()},
            mu=mu.value,
            mu_stderr=mu.error,
            plastic_events=len(drops) / strain,
            stress_drop=float(np.mean(drops)) if len(drops) else float("nan"),
            drift=means["stress"].drift,
            independent=means["stress"].independent,
            discard=discard,
            strain=strain,
            unit=unit,
        )
