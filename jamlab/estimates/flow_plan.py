"""Say before a flow is run how long it takes: a short trial at each rate gives the cost of a unit of strain."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import check_number, checked
from jamlab.errors import InputError
from jamlab.flow.overdamped_session import OverdampedSession, background_drag
from jamlab.flow.shear import TOLERANCE, check_rates
from jamlab.packing.packing import Packing
from jamlab.packing.short_repr import short_repr
from jamlab.rheology.damping import ContactDamping, Damping

TRIAL = 0.5  # s at each rate
_STEPS = 100  # of a trial between two looks at the clock
_LONGEST_TRIAL = 0.2  # strain
_FLOW_OVER_START = 2.0  # cost of a unit of strain in flow over that of start-up, which the trial sees


@dataclass(frozen=True)
class FlowPlan:
    """Expected cost, good to a factor of two.

    >>> jamlab.plan_flow(jamlab.pack(n=32, pressure=1e-2, seed=1), [0.3, 1.0], strain=0.1).rates
    array([0.3, 1. ])

    Attributes:
        rates: (m,) of shear, ascending.
        seconds_per_strain: (m,) of one core.
        strain: of each run.
    """

    rates: Array
    seconds_per_strain: Array
    strain: float

    __repr__ = short_repr

    @property
    def seconds(self) -> Array:
        """(m,) of each run."""
        return self.seconds_per_strain * self.strain

    @property
    def total(self) -> float:
        """Seconds of all runs, one after the other."""
        return float(self.seconds.sum())

    def check(self, seconds: float) -> None:
        """Refuse rates that do not fit into the time given.

        Raises:
            InputError: naming the slowest rate, what it takes, and what would fit.
        """
        if self.total <= seconds:
            return
        fits = self.rates[np.cumsum(self.seconds[::-1])[::-1] <= seconds]
        rest = f"rates from {fits[0]:g} on fit" if len(fits) else "no rate fits"
        shorter = self.strain * seconds / self.total
        raise InputError(
            f"rate = {self.rates[0]:g}: strain {self.strain:g} takes about {self.seconds[0]:.2g} s, and all rates "
            f"{self.total:.2g} s, of {seconds:g} s given: {rest}, or strain {shorter:.2g} at all of them"
        )


@checked
def plan_flow(
    packing: Packing,
    rates: Sequence[float],
    damping: Damping | None = None,
    *,
    strain: float = 1.0,
    tolerance: float = TOLERANCE,
    background: float | None = None,
) -> FlowPlan:
    """Measure for half a second at each rate what a unit of strain costs.

    >>> plan = jamlab.plan_flow(jamlab.pack(n=32, pressure=1e-2, seed=1), [0.3, 1.0], strain=0.1)
    >>> bool(plan.total > 0)
    True

    Args:
        packing, damping, tolerance, background: see `shear`.
        rates: of shear, 1/tau_1.
        strain: of each run.

    Raises:
        InputError: a value out of range.
        ConvergenceError: see `shear`.
    """
    law = damping or ContactDamping()
    background = background_drag(packing, law, background)
    values = check_rates(rates)[::-1]
    check_number("strain", strain, 1e4)
    costs = [_cost(packing, rate, law, tolerance, background) for rate in values]
    return FlowPlan(np.array(values), np.array(costs), strain)


def _cost(packing: Packing, rate: float, law: Damping, tolerance: float, background: float) -> float:
    """Seconds per unit of strain."""
    with OverdampedSession(packing, law, tolerance, background) as session:
        session.drive(f"rate {rate:.17g}", 1e3 / rate)
        begun = session.advance(_STEPS).strain  # the first steps are shorter than those that follow
        clock = time.process_time()
        while True:
            strain = session.advance(_STEPS).strain - begun
            seconds = time.process_time() - clock
            if seconds > TRIAL or strain > _LONGEST_TRIAL:
                return _FLOW_OVER_START * seconds / strain
