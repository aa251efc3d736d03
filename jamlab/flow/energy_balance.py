"""Work that flow does on a packing is stored or lost; how far the three part tells how good the steps were.

Steps integrate positions, work and dissipation each on their own, so nothing makes them agree but small steps.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LIMIT = 0.02  # imbalance from which on a result is doubtful: that of the averages of a flow
LEAST_SHOWN = 1e-4
FINER = 0.1  # tolerance to try next, over the present one; steps go as its root, errors as steps squared


def energy_gap(work: Array, lost: Array, energy: Array) -> Array:
    """(m,) work less what is lost and stored, since the first row: 0 but for errors of the steps.

    Args:
        work: (m,) done since the start.
        lost: (m,) energy lost since the start.
        energy: (m,) elastic.
    """
    gap = work - lost - energy
    return np.asarray(gap - gap[0])


def energy_imbalance(gap: Array, work: Array, lost: Array) -> float:
    """Largest gap (m,) over the larger of work (m,) and loss (m,); 0 where nothing is done."""
    scale = max(float(np.abs(values - values[0]).max()) for values in (work, lost))
    return float(np.abs(gap).max()) / scale if scale > 0 else 0.0


def describe_balance(imbalance: float) -> str:
    """Say in words how well energy is balanced."""
    return f"energy balance to {_percent(imbalance)}"


def warn_of_imbalance(imbalance: float, remedy: str, where: Sequence[str] = ()) -> str:
    """Say that a result is doubtful and what to do; nothing if energy is balanced.

    Args:
        imbalance: largest one.
        remedy: what makes it smaller.
        where: names of the parts that are off, where there are several.
    """
    if not imbalance > LIMIT:
        return ""
    place = f" at {', '.join(where)}" if where else ""
    return f"ENERGY BALANCE OFF by {_percent(imbalance)}{place}, above {LIMIT:.0%}: {remedy}"


def finer_steps(tolerance: float) -> str:
    """The remedy of flow at a rate, in words."""
    return f"doubt the stresses; give tolerance = {FINER * tolerance:g}, or a lower rate"


def _percent(imbalance: float) -> str:
    return f"{100 * imbalance:.2g} %" if imbalance > LEAST_SHOWN else f"better than {100 * LEAST_SHOWN:g} %"
