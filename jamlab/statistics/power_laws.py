"""Power laws near jamming: fits with fixed or free exponents, their window, finite-size extrapolation, data collapse.

Intervals of what is fitted here come from `jamlab.statistics.bootstrap`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares, minimize, minimize_scalar

from jamlab.errors import ConvergenceError, InputError

Array = NDArray[np.float64]
Curve = tuple[Array, Array]

_GRID = 60  # points at which curves are compared


@dataclass(frozen=True)
class PowerLaw:
    """y = sum of coefficients_k x^exponents_k.

    Attributes:
        coefficients, exponents: (terms,).
        low, high: first and last x fitted.
        points: number of points fitted.
        spread: root mean square of the residuals, relative or in standard errors.
        worst: the largest of them.
    """

    coefficients: Array
    exponents: Array
    low: float
    high: float
    points: int
    spread: float
    worst: float

    def __call__(self, x: ArrayLike) -> Array:
        """y at x, of the shape of x."""
        return np.asarray((np.asarray(x, dtype=np.float64)[..., None] ** self.exponents) @ self.coefficients)


def power_law(
    x: ArrayLike,
    y: ArrayLike,
    exponents: Sequence[float | None] = (None,),
    *,
    error: ArrayLike | None = None,
    low: float = 0.0,
    high: float = np.inf,
) -> PowerLaw:
    """Fit one power law or a sum of several, such as z - z_J = z_0 d^0.5 + z_1 d^1, Boromand et al. eqs 13-14.

    Without errors relative residuals (model - y)/y count alike, so that every decade does; one free power law alone is
    a straight line through ln y against ln x. With errors it is least squares in (model - y)/error. Points that are
    nan, or where x or the error (without errors: y) is not positive, take no part.

    Args:
        x, y: (m,).
        exponents: one for each term; None is fitted.
        error: (m,) standard errors of y.
        low, high: window in x.

    Raises:
        InputError: shapes that differ, no term, fewer usable points than unknowns.
        ConvergenceError: the free exponents were not found.
    """
    if not exponents:
        raise InputError("a power law needs an exponent: give (None,) for one free exponent")
    x, y = _row(x, y)
    unit = y if error is None else _row(x, error)[1]
    kept = (x >= low) & (x <= high) & (x > 0) & (unit > 0) & np.isfinite(x + y + unit)
    x, y, unit = x[kept], y[kept], unit[kept]
    free = [k for k, e in enumerate(exponents) if e is None]
    if len(x) < max(len(exponents) + len(free), 2):
        raise InputError(
            f"{len(x)} points between {low:g} and {high:g} for {len(exponents)} power law(s): widen the window"
        )
    powers = np.array([np.nan if e is None else e for e in exponents])
    up = y > 0
    slope = np.polyfit(np.log(x[up]), np.log(y[up]), 1) if up.sum() > 1 else np.array([1.0, 0.0])
    if free and len(powers) == 1 and error is None:
        powers, coefficients = slope[:1], np.exp(slope[1:])
    else:
        if free:
            powers = _free(x, y, unit, powers, free, float(slope[0]))
        coefficients = _linear(x, y, unit, powers)
    residual = ((x[:, None] ** powers) @ coefficients - y) / unit
    spread, worst = float(np.sqrt(np.mean(residual**2))), float(np.abs(residual).max())
    return PowerLaw(coefficients, powers, float(x.min()), float(x.max()), len(x), spread, worst)


def _linear(x: Array, y: Array, unit: Array, powers: Array) -> Array:
    return np.asarray(np.linalg.lstsq(x[:, None] ** powers / unit[:, None], y / unit, rcond=None)[0])


def _free(x: Array, y: Array, unit: Array, powers: Array, free: list[int], slope: float) -> Array:
    """Free exponents by variable projection: for each set of them the coefficients are linear."""

    def filled(values: Array) -> Array:
        out = powers.copy()
        out[free] = values
        return out

    def residual(values: Array) -> Array:
        trial = filled(values)
        return np.asarray(((x[:, None] ** trial) @ _linear(x, y, unit, trial) - y) / unit)

    start = slope + 0.4 * (np.arange(len(free)) - 0.5 * (len(free) - 1))
    start += 0.1 * np.any(np.isclose(powers[:, None], start), axis=0)  # two equal terms would be one
    found = least_squares(residual, start, x_scale=0.1)
    if not found.success:
        raise ConvergenceError(f"free exponents not found ({found.message}): narrow the window or fix one")
    return filled(found.x)


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
    """The fit over the widest run of points, in ln x, none of which lies further off the law than the tolerance.

    Args:
        x, y, exponents: see `power_law`.
        tolerance: largest relative residual.
        least: fewest points.
        low, high: where to look.

    Raises:
        InputError: see `power_law`; a tolerance that is not positive.
        ConvergenceError: no run of `least` points is that straight.
    """
    x, y = _points(x, y)
    if not tolerance > 0:
        raise InputError(f"tolerance = {tolerance}: must be positive")
    kept = (x >= low) & (x <= high) & (x > 0) & (y > 0)
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


@dataclass(frozen=True)
class FiniteSize:
    """y(N) = limit + amplitude N^-exponent."""

    limit: float
    amplitude: float
    exponent: float

    def __call__(self, n: ArrayLike) -> Array:
        """y at sizes n."""
        return np.asarray(self.limit + self.amplitude * np.asarray(n, dtype=np.float64) ** -self.exponent)


def finite_size(
    n: ArrayLike, y: ArrayLike, error: ArrayLike | None = None, *, exponent: float | None = None
) -> FiniteSize:
    """Extrapolate to the large-system limit.

    Args:
        n, y: (m,) sizes and values.
        error: (m,) standard errors; by default all alike.
        exponent: of the correction; by default the one between 0.1 and 4 that fits best.

    Raises:
        InputError: fewer sizes than unknowns, sizes or errors that are not positive.
    """
    n, y = _points(n, y)
    spread = np.asarray(np.ones_like(y) if error is None else error, dtype=np.float64)
    if len(np.unique(n)) < (3 if exponent is None else 2):
        raise InputError(f"{len(np.unique(n))} sizes: give three or more, or two and the exponent")
    if spread.shape != y.shape or not (np.all(n > 0) and np.all(spread > 0) and np.all(np.isfinite(spread))):
        raise InputError("sizes and errors must be positive, one error for each value")
    weight = 1 / spread

    def solve(e: float) -> tuple[Array, float]:
        columns = np.column_stack([np.ones_like(n), n**-e]) * weight[:, None]
        solution = np.linalg.lstsq(columns, y * weight, rcond=None)[0]
        return np.asarray(solution), float(np.sum((columns @ solution - y * weight) ** 2))

    if exponent is None:
        exponent = float(minimize_scalar(lambda e: solve(e)[1], bounds=(0.1, 4.0), method="bounded").x)
    limit, amplitude = solve(exponent)[0]
    return FiniteSize(float(limit), float(amplitude), exponent)


def collapse_spread(curves: Sequence[Curve]) -> float:
    """Root mean square distance, in ln y, of curves from their mean, where two of them or more overlap in x.

    0 is a perfect collapse; the spread of the curves as measured is what to compare with.

    Args:
        curves: (x, y), each (m,) ascending and positive.

    Raises:
        InputError: fewer than two curves; values that are not positive.
    """
    return _spread(_logarithms(curves))


def _logarithms(curves: Sequence[Curve]) -> list[Curve]:
    if len(curves) < 2:
        raise InputError(f"{len(curves)} curve(s): a collapse needs two or more")
    if not all(np.all(x > 0) and np.all(y > 0) for x, y in curves):
        raise InputError("a collapse is measured in logarithms: x and y must be positive")
    return [(np.log(x), np.log(y)) for x, y in curves]


def _spread(logs: list[Curve]) -> float:
    starts, ends = np.array([[x[0], x[-1]] for x, _ in logs]).T
    grid = np.linspace(np.sort(starts)[1], np.sort(ends)[-2], _GRID)
    inside = (grid >= starts[:, None]) & (grid <= ends[:, None])
    inside &= inside.sum(axis=0) >= 2
    count = inside.sum(axis=0)
    if not count.any():
        return float("inf")
    values = np.where(inside, [np.interp(grid, x, y) for x, y in logs], 0.0)
    mean = values.sum(axis=0) / np.maximum(count, 1)
    return float(np.sqrt(np.sum(np.where(inside, values - mean, 0.0) ** 2) / count.sum()))


@dataclass(frozen=True)
class ScalingCollapse:
    """x scale^a and y scale^b fall on one curve.

    Attributes:
        a, b: exponents.
        spread: of the rescaled curves, see `collapse_spread`.
        before: spread of the curves as they are.
    """

    a: float
    b: float
    spread: float
    before: float

    @property
    def quality(self) -> float:
        """1 - spread/before: 1 is perfect, 0 no gain."""
        return 1 - self.spread / self.before


def collapse_exponents(
    scale: ArrayLike,
    families: Sequence[Sequence[Curve]],
    *,
    a: float | None = None,
    b: float | None = None,
    start: tuple[float, float] = (0.0, 0.0),
) -> ScalingCollapse:
    """Exponents that bring curves of several sizes, or pressures, onto one, for each family of curves.

    Args:
        scale: (m,) positive, such as N or p.
        families: each m curves, such as G' and G'' of every pressure; all families share the exponents.
        a, b: fixed exponents; None is fitted.
        start: where the fit starts.

    Raises:
        InputError: numbers of curves that differ from the number of scales; see `collapse_spread`.
    """
    s = np.asarray(scale, dtype=np.float64)
    if not families or any(len(family) != len(s) for family in families) or not np.all(s > 0):
        raise InputError(f"{len(s)} scales need as many curves in each family, and must be positive")
    free = [k for k, e in enumerate((a, b)) if e is None]
    logs = [_logarithms(family) for family in families]
    moves = np.log(s)

    def spread(exponents: tuple[float, float]) -> float:
        p, q = exponents
        parts = [_spread([(x + p * m, y + q * m) for (x, y), m in zip(family, moves, strict=True)]) for family in logs]
        return float(np.sqrt(np.mean(np.square(parts))))

    def filled(values: Array) -> tuple[float, float]:
        out = [0.0 if a is None else a, 0.0 if b is None else b]
        for k, value in zip(free, values, strict=True):
            out[k] = float(value)
        return out[0], out[1]

    best = filled(np.array([start[k] for k in free]))
    if free:
        found = minimize(
            lambda v: spread(filled(v)) ** 2,
            [start[k] for k in free],
            method="Nelder-Mead",
            options={"xatol": 1e-4, "fatol": 1e-10},
        )
        best = filled(found.x)
    return ScalingCollapse(best[0], best[1], spread(best), spread((0.0, 0.0)))


def _row(x: ArrayLike, y: ArrayLike) -> Curve:
    a, b = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if a.ndim != 1 or a.shape != b.shape:
        raise InputError(f"x and y have shapes {a.shape} and {b.shape}: need two rows of the same length")
    return a, b


def _points(x: ArrayLike, y: ArrayLike) -> Curve:
    a, b = _row(x, y)
    kept = np.isfinite(a) & np.isfinite(b)
    return a[kept], b[kept]
