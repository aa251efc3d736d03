"""Find the widest run of points that one power law describes."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from jamlab.errors import ConvergenceError, InputError
from jamlab.statistics.power_laws import PowerLaw, power_law


def widest_window(
    x: ArrayLike,
    y: ArrayLike,
    exponents: Sequence[float | None] = (None,),
    *,
    tolerance: float = 0.05,
    least: int = 5,
    low: float = 0.0,
    high: float = np.inf,
) -> PowerLaw:
    """Fit the widest run of at least so many points, in ln x, whose relative residuals all lie within a tolerance."""
    x, y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    kept = (x >= low) & (x <= high) & (x > 0) & (y > 0)  # nan is in no window
    order = np.argsort(x[kept])
    x, y = x[kept][order], y[kept][order]
    if len(x) < least:
        raise InputError(f"{len(x)} points between {low:g} and {high:g}, needs {least}: widen the window")
    runs = [(i, j) for i in range(len(x)) for j in range(i + least - 1, len(x))]
    for i, j in sorted(runs, key=lambda run: x[run[0]] / x[run[1]]):
        fit = power_law(x[i : j + 1], y[i : j + 1], exponents)
        if fit.worst <= tolerance:
            return fit
    raise ConvergenceError(
        f"no {least} points in a row lie within {tolerance:g} of a power law: raise the tolerance or add packings"
    )
