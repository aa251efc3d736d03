"""Mean of a series in time, with its error from blocks: neighbouring values are correlated.

Blocks longer than the correlation are independent, so the spread of their means gives the error of the whole mean
(Flyvbjerg & Petersen, J. Chem. Phys. 91, 461, 1989). The length of blocks is doubled as long as eight remain; the
largest of the errors found is taken, since shorter blocks underestimate it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.errors import InputError

FEWEST_BLOCKS = 8
LARGEST_DRIFT = 3.0  # in standard errors: by chance in one series of 400


@dataclass(frozen=True)
class BlockAverage:
    """Mean of a series: its `value`, its standard `error`, and the `drift`, mean of the second half less that of the
    first, over its standard error."""

    value: float
    error: float
    drift: float

    @property
    def steady(self) -> bool:
        """Whether both halves have the same mean, as far as their errors tell."""
        return abs(self.drift) <= LARGEST_DRIFT


@checked
def block_average(values: ArrayLike) -> BlockAverage:
    """Average a series (m,) of at least sixteen values at equal distances."""
    series = np.asarray(values, dtype=np.float64)
    if series.ndim != 1 or len(series) < 2 * FEWEST_BLOCKS or not np.isfinite(series).all():
        raise InputError(f"a series of shape {series.shape}: give one row of at least {2 * FEWEST_BLOCKS} numbers")
    middle, places = len(series) // 2, np.arange(len(series))
    change = float(series[middle:].mean() - series[:middle].mean())
    trend = np.polyval(np.polyfit(places, series, 1), places)  # which would pass for noise of long blocks
    rounding = np.finfo(np.float64).eps * float(np.abs(series).max())
    noise = max(2 * _block_error(series - trend), rounding)
    return BlockAverage(float(series.mean()), _block_error(series), change / noise if change else 0.0)


def _block_error(series: Array) -> float:
    errors, length = [], 1
    while len(series) >= FEWEST_BLOCKS * length:
        count = len(series) // length
        means = series[len(series) - count * length :].reshape(count, length).mean(axis=1)
        errors.append(float(means.std(ddof=1) / np.sqrt(count)))
        length *= 2
    return max(errors)
