"""Collapse y(x, s) onto y = s^q f((x - x_c)/s^w) around a critical point x_c, with ln f a polynomial."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from jamlab.arrays import Array
from jamlab.checks import finite_array
from jamlab.errors import InputError

ORDER = 4  # of the polynomial


@dataclass(frozen=True)
class CriticalCollapse:
    """What brings the data onto one curve."""

    critical: float  # x_c
    q: float  # y ~ s^q at x_c
    w: float  # the width of the critical region in x grows as s^w
    coefficients: Array = field(repr=False)  # (k,) of ln f, highest power first
    spread: float  # root mean square distance of ln y from the curve
    before: float  # the same of ln y from one curve in x alone

    @property
    def above(self) -> float:
        """Exponent y of the limit of small s above x_c, y ~ (x - x_c)^(q/w): of the yield stress."""
        return self.q / self.w

    @property
    def below(self) -> float:
        """Exponent beta below x_c, y/s ~ (x_c - x)^-beta if y ~ s there, beta = (1 - q)/w: of the viscosity."""
        return (1 - self.q) / self.w

    def function(self, z: ArrayLike) -> Array:
        """f, of the shape of z; inside the data only."""
        return np.asarray(np.exp(np.polyval(self.coefficients, np.asarray(z, dtype=np.float64))))


def collapse_through(
    x: ArrayLike,
    s: ArrayLike,
    y: ArrayLike,
    start: Sequence[float],
    *,
    critical: float | None = None,
    order: int = ORDER,
) -> CriticalCollapse:
    """Fit both exponents, and the critical point unless it is given, by least squares in ln y (m,), from a guess (x_c,
    q, w). A narrow range of s does not settle all three: data far above x_c scale with many of them."""
    points = [finite_array(name, value, (None,)) for name, value in (("x", x), ("s", s), ("y", y))]
    place, log_s, log_y = points[0], *(np.log(np.maximum(p, 1e-300)) for p in points[1:])
    if not len(place) == len(log_s) == len(log_y) > order + 4:
        raise InputError(f"{len(place)} points: {order + 5} or more are needed for {order + 4} unknowns")
    if min(points[1].min(), points[2].min()) <= 0:
        raise InputError("a collapse is measured in logarithms: s and y must be positive")
    width, middle = float(np.ptp(place)) or 1.0, float(np.median(log_s))

    def misfit(at: float, q: float, w: float) -> tuple[Array, Array]:
        """Distances (m,) of ln y from the polynomial that is best for these numbers, and its coefficients."""
        z = (place - at) * np.exp(-w * log_s)
        powers = np.vander(z / np.exp(-w * middle) / width, order + 1)
        found, *_ = np.linalg.lstsq(powers, log_y - q * log_s, rcond=None)
        return powers @ found - log_y + q * log_s, found / (np.exp(-w * middle) * width) ** np.arange(order, -1, -1)

    first, steps = np.array(start, dtype=np.float64), np.array([0.1 * width, 0.1, 0.1])
    if critical is not None:
        first[0] = critical
    fixed = 0 if critical is None else 1  # leading unknowns that stay

    def unknowns(move: Array) -> list[float]:
        return [*first[:fixed].tolist(), *(first[fixed:] + steps[fixed:] * move).tolist()]

    at, q, w = unknowns(least_squares(lambda move: misfit(*unknowns(move))[0], np.zeros(3 - fixed)).x)
    rest, coefficients = misfit(at, q, w)
    spread, before = (float(np.sqrt(np.mean(part**2))) for part in (rest, misfit(at, 0.0, 0.0)[0]))
    return CriticalCollapse(at, q, w, coefficients, spread, before)
