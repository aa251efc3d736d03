"""How far the means of a picture may be from those of many more droplets: standard errors and 95 % intervals.

A mean over the n droplets that a picture shows whole has the standard error s/sqrt(n), with their standard deviation s,
as if each had been drawn on its own. For rho, the area of droplets over that of their cells, it is that of a ratio,

    sqrt(n/(n - 1) sum_i (a_i - rho c_i)^2) / sum_i c_i.

Neighbours share contacts and gaps, which evens out what is beside each other: in windows of 30 and of 60 out of 2048
disks, jammed at 1e-3 k and 3e-2 k, means of z scatter by 0.7 to 0.8 of this standard error and rho by 1.0 of it, so
that intervals hold at least as often as they say. They know of scatter between droplets alone, not of what light, blur
and films do to all of them, which `jamlab figure micrograph-errors` draws.

Source: W. G. Cochran, Sampling Techniques, 3rd ed. (1977), sections 2.6 and 2.11.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from jamlab.statistics.confidence import CONFIDENCE

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Mean:
    """A mean over the droplets of a picture.

    Attributes:
        value: nan without droplets.
        error: standard error; nan for fewer than two droplets.
        count: of droplets.
    """

    value: float
    error: float
    count: int

    @property
    def half_width(self) -> float:
        """Half of the 95 % interval, by Student's t for few droplets."""
        return float(stdtrit(max(self.count - 1, 1), 0.5 + 0.5 * CONFIDENCE) * self.error)

    @property
    def interval(self) -> tuple[float, float]:
        """Ends of the 95 % interval."""
        return self.value - self.half_width, self.value + self.half_width

    def text(self, form: str) -> str:
        """Value ± standard error, to as many decimals or, in a format "g", two digits; "none" if there is no value."""
        if not np.isfinite(self.value):
            return "none"
        error = f" ± {self.error:{form if form.endswith('f') else '.2g'}}" if np.isfinite(self.error) else ""
        return f"{self.value:{form}}{error}"


def mean_of(values: Array) -> Mean:
    """Mean over droplets, (n,)."""
    n = len(values)
    value = float(np.mean(values)) if n else float("nan")
    return Mean(value, float(np.std(values, ddof=1) / np.sqrt(n)) if n > 1 else float("nan"), n)


def share_of(areas: Array, cells: Array, value: float) -> Mean:
    """Packing fraction, a ratio of two sums, with the scatter of droplets around their own ratio.

    Args:
        areas: (n,) of droplets.
        cells: (n,) of their cells.
        value: packing fraction of all that the picture shows.
    """
    n, whole = len(areas), float(cells.sum())
    rest = areas - areas.sum() / whole * cells
    return Mean(value, float(np.sqrt(n / (n - 1) * (rest**2).sum()) / whole) if n > 1 else float("nan"), n)
