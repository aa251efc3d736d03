"""Extrapolate to the limit of large systems."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar

from jamlab.arrays import Array
from jamlab.errors import InputError

_CORRECTIONS = (0.1, 4.0)  # range searched for the exponent of a finite-size correction; published ones: 0.7 to 2
_EDGE = 1e-3  # of its range, within which such an exponent counts as at its end


@dataclass(frozen=True)
class FiniteSize:
    """y(N) = limit + amplitude N^-exponent."""

    # limit, amplitude, exponent: of the law
    limit: float
    amplitude: float
    exponent: float

    @property
    def at_end(self) -> bool:
        """Whether the exponent lies at an end of the range that is searched: the best one may lie beyond."""
        return not _CORRECTIONS[0] * (1 + _EDGE) < self.exponent < _CORRECTIONS[1] * (1 - _EDGE)

    def __call__(self, n: ArrayLike) -> Array:
        """y at sizes n."""
        return np.asarray(self.limit + self.amplitude * np.asarray(n, dtype=np.float64) ** -self.exponent)


def finite_size(
    sizes: ArrayLike, values: ArrayLike, error: ArrayLike | None = None, *, exponent: float | None = None
) -> FiniteSize:
    """Extrapolate y(N) = limit + amplitude N^-exponent to the limit of large systems; by default with the exponent
    between 0.1 and 4 that fits best. What is not finite is left out."""
    n, y = np.asarray(sizes, dtype=np.float64), np.asarray(values, dtype=np.float64)
    spread = np.ones_like(y) if error is None else np.asarray(error, dtype=np.float64)
    kept = np.isfinite(n) & np.isfinite(y)
    n, y, spread = n[kept], y[kept], spread[kept]
    if len(np.unique(n)) < (3 if exponent is None else 2):
        raise InputError(f"{len(np.unique(n))} sizes: give three or more, or two and the exponent")
    if not (np.all(n > 0) and np.all(spread > 0) and np.all(np.isfinite(spread))):
        raise InputError("sizes and errors must be positive, one error for each value")
    weight = 1 / spread

    def solve(e: float) -> tuple[Array, float]:
        columns = np.column_stack([np.ones_like(n), n**-e]) * weight[:, None]
        solution = np.linalg.lstsq(columns, y * weight, rcond=None)[0]
        return np.asarray(solution), float(np.sum((columns @ solution - y * weight) ** 2))

    if exponent is None:
        exponent = float(minimize_scalar(lambda e: solve(e)[1], bounds=_CORRECTIONS, method="bounded").x)
    limit, amplitude = solve(exponent)[0]
    return FiniteSize(float(limit), float(amplitude), exponent)
