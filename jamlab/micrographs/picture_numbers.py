"""Numbers of a picture: how far a mean is known over its droplets, and how far from the truth of this picture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from jamlab.arrays import Array
from jamlab.statistics.confidence import CONFIDENCE


@dataclass(frozen=True)
class Number:
    """A number of a picture, and whether it can be trusted.

    The interval is about this picture, not about more droplets, of which `Micrograph.means` speak: of rings by how
    likely each is a droplet (95 %), of bright and dark droplets the largest errors of good rendered pictures.
    """

    value: float
    half_width: float  # nan where nothing is known of it
    reasons: tuple[str, ...]  # why it may be wrong

    @property
    def interval(self) -> tuple[float, float]:
        """Ends of the interval."""
        return self.value - self.half_width, self.value + self.half_width

    @property
    def quality(self) -> str:
        """Whether it can be trusted: "good" or "doubtful"."""
        return "doubtful" if self.reasons else "good"


@dataclass(frozen=True)
class Mean:
    """A mean over the droplets of a picture, with how far it may be from that over many more.

    The mean over n droplets has the standard error s/sqrt(n), with their standard deviation s, as if each had been
    drawn on its own; for rho, the area of droplets over that of their cells, it is that of a ratio,
    sqrt(n/(n - 1) sum_i (a_i - rho c_i)^2) / sum_i c_i. Neighbours share contacts and gaps, which evens out what is
    beside each other: in windows of 30 and of 60 out of 2048 disks, jammed at 1e-3 k and 3e-2 k, means of z scatter by
    0.7 to 0.8 of this error and rho by 1.0 of it. What light, blur and films do to all droplets alike is not in it.

    Source: W. G. Cochran, Sampling Techniques, 3rd ed. (1977), sections 2.6 and 2.11.
    """

    value: float  # nan without droplets
    error: float  # standard error; nan for fewer than two droplets
    count: int  # of droplets

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
    """Packing fraction, a ratio of two sums, with the scatter of droplets around their own ratio. `areas`: (n,) of
    droplets; `cells`: (n,) of their cells; `value`: packing fraction of all that the picture shows."""
    n, whole = len(areas), float(cells.sum())
    rest = areas - areas.sum() / whole * cells
    return Mean(value, float(np.sqrt(n / (n - 1) * (rest**2).sum()) / whole) if n > 1 else float("nan"), n)
