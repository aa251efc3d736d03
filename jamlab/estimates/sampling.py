"""Add packings to an ensemble until its mean is known well enough.

Stopping as soon as a few packings happen to lie close together would make intervals too narrow. So their scatter counts
together with that of the table, and the number planned from the table is made before the first look.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from jamlab.errors import ConvergenceError
from jamlab.estimates.ensemble_plan import EnsemblePlan, interval
from jamlab.statistics.confidence import room

Make = Callable[[int], Sequence[tuple[float, float]]]  # number of seeds -> value (nan: none) and seconds of each

_MOST_GROWTH = 2.0  # of the number of packings where the first ones do not do
_OVER_PLAN = 16  # times the packings planned: beyond, the table does not fit what is seen
_TRIED, _LEAST_SHARE = 20, 0.1  # seeds after which at least this share must have given a value


class Stop(StrEnum):
    """Why no more packings were made."""

    MET = "the interval is met"
    WAY = "the way is known no better: more packings would not help, another model would"
    SCATTER = "packings scatter more than the table says"
    PLANNED = "nothing was made"


@dataclass
class Sample:
    """Packings made so far."""

    plan: EnsemblePlan  # that they follow
    values: list[float] = field(default_factory=list)  # one for each seed that was tried; nan where it has none
    seconds: float = 0.0  # CPU time of all

    @property
    def good(self) -> list[float]:
        """Values of the packings that have one."""
        return [value for value in self.values if math.isfinite(value)]

    @property
    def error(self) -> float:
        """Half the width of the interval of the mean, with what the table does not know."""
        return math.hypot(self.half_width(), self.plan.bias_error)

    def extend(self, wanted: int, make: Make) -> None:
        """Make packings until so many have a value."""
        while (missing := wanted - len(self.good)) > 0:
            for value, seconds in make(missing):
                self.values.append(value)
                self.seconds += seconds
            tried, good = len(self.values), len(self.good)
            if tried >= _TRIED and good < _LEAST_SHARE * tried:
                raise ConvergenceError(
                    f"only {good} of {tried} packings have {self.plan.quantity} at rho = {self.plan.rho:g}: most jam "
                    "above it; take a higher one"
                )

    def half_width(self) -> float:
        """Of the interval by scatter: that of the packings together with that of the table, or the latter if larger.
        Packings that happen to lie close together are no better known than the table says."""
        count, known = len(self.good), self.plan.scatter
        freedom = known.freedom + count - 1
        own = float(np.var(self.good, ddof=1))
        variance = (known.freedom * known.deviation**2 + (count - 1) * own) / freedom
        return interval(max(math.sqrt(variance), known.deviation), freedom, count)


def sample(plan: EnsemblePlan, error: float, make: Make) -> tuple[Sample, Stop]:
    """Make packings until the error is reached, or until more would not help; and say which."""
    found, wanted, aim = Sample(plan), plan.packings, room(error, plan.bias_error)
    while True:
        found.extend(wanted, make)
        ratio = found.half_width() / aim
        if ratio <= 1:
            return found, Stop.MET if found.error <= error else Stop.WAY
        if wanted >= _OVER_PLAN * plan.packings:
            return found, Stop.SCATTER
        wanted = math.ceil(wanted * min(max(ratio**2, 1 + 1 / wanted), _MOST_GROWTH))
