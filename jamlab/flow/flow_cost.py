"""Say before a flow is run how long it takes: a short trial at each rate gives the cost of a unit of strain."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from jamlab.checks import check_number, checked
from jamlab.errors import InputError
from jamlab.flow.overdamped_session import OverdampedSession, background_drag
from jamlab.flow.shear import TOLERANCE, check_rates
from jamlab.packing.packing import Packing
from jamlab.rheology.damping import ContactDamping, Damping

if TYPE_CHECKING:
    import pandas as pd

TRIAL = 0.5  # s at each rate
_STEPS = 100  # of a trial between two looks at the clock
_LONGEST_TRIAL = 0.2  # strain
_FLOW_OVER_START = 2.0  # cost of a unit of strain in flow over that of start-up, which the trial sees


@checked
def flow_cost(
    packing: Packing,
    rates: Sequence[float],
    damping: Damping | None = None,
    *,
    strain: float = 1.0,
    tolerance: float = TOLERANCE,
    background: float | None = None,
) -> pd.DataFrame:
    """Measure for half a second at each rate what shear to a strain costs, to a factor of two.

    >>> cost = jamlab.flow_cost(jamlab.pack(n=32, pressure=1e-2, seed=1), rates=[0.1, 1.0], strain=5.0)
    >>> list(cost.columns), bool(cost["seconds"][0] > 0)
    (['rate', 'strain', 'seconds'], True)

    Args:
        packing: SP or DP.
        rates: of shear, 1/tau_1.
        damping: see `shear`.
        strain: of each run; of `flow_curve` that is `strain` and `discard`.
        tolerance: see `shear`.
        background: see `shear`.

    Returns:
        pandas DataFrame, a row for each rate, ascending: `rate`, `strain` and `seconds` of one core.

    Raises:
        InputError: a value out of range.
        ConvergenceError: see `shear`.
    """
    import pandas as pd

    law = damping or ContactDamping()
    background = background_drag(packing, law, background)
    values = check_rates(rates)[::-1]
    check_number("strain", strain, 1e4)
    seconds = [strain * _cost(packing, rate, law, tolerance, background) for rate in values]
    return pd.DataFrame({"rate": values, "strain": strain, "seconds": seconds})


def require_time(cost: pd.DataFrame, given: float) -> None:
    """Refuse rates of `flow_cost` that do not fit into the seconds given."""
    rates, seconds, strain = (cost[name].to_numpy() for name in ("rate", "seconds", "strain"))
    total = float(seconds.sum())
    if total <= given:
        return
    fits = rates[np.cumsum(seconds[::-1])[::-1] <= given]
    rest = f"give rates from {fits[0]:g} on" if len(fits) else "give a smaller strain"
    raise InputError(
        f"rate = {rates[0]:g}: strain {strain[0]:g} takes about {seconds[0]:.2g} s, and all rates "
        f"{total:.2g} s, of {given:g} s given: {rest}, or strain {strain[0] * given / total:.2g} at all of them"
    )


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
