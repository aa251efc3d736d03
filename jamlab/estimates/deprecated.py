"""Names of version 0.2.0 that work for one release more, each with a warning that names what took its place."""

from collections.abc import Sequence
from typing import Any

import pandas as pd

from jamlab.checks import checked
from jamlab.estimates.estimate import EnsemblePlan, plan_mean
from jamlab.estimates.options import warn_renamed
from jamlab.flow.flow_cost import cost_of_flow, require_time
from jamlab.packing.packing import Packing
from jamlab.rheology.damping import Damping

__all__ = ["EnsemblePlan", "FlowPlan", "plan_estimate", "plan_flow"]


@checked
def plan_estimate(quantity: str, rho: float | None, error: float, *, model: str = "auto") -> EnsemblePlan:
    """Plan a mean, as `jamlab.estimate` with `dry_run=True`."""
    warn_renamed("plan_estimate", "use estimate(..., dry_run=True)")
    return plan_mean(quantity, rho, error, model=model)


class FlowPlan:
    """Expected cost of flow at some rates, (m,) each: what `plan_flow` gives."""

    def __init__(self, cost: pd.DataFrame) -> None:
        """Take what `cost_of_flow` gives."""
        self._cost = cost
        self.rates, self.seconds = cost["rate"].to_numpy(), cost["seconds"].to_numpy()
        self.strain = float(cost["strain"].iloc[0])
        self.seconds_per_strain = self.seconds / self.strain
        self.total = float(self.seconds.sum())

    def check(self, seconds: float) -> None:
        """Refuse rates that do not fit into the time given; raises InputError."""
        require_time(self._cost, seconds)


@checked
def plan_flow(
    packing: Packing, rates: Sequence[float], damping: Damping | None = None, *, strain: float = 1.0, **accuracy: Any
) -> FlowPlan:
    """Plan flow at some rates, as `jamlab.flow_curve` with `dry_run=True`."""
    warn_renamed("plan_flow", "use flow_curve(..., dry_run=True)")
    return FlowPlan(cost_of_flow(packing, rates, damping, strain=strain, **accuracy))
