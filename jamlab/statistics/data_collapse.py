"""Collapse data: rescale curves of several sizes or pressures until they fall on one, and say how well they do."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

from jamlab.arrays import Array, ArrayLike
from jamlab.errors import InputError

Curve = tuple[Array, Array]


def _take_logarithms(curves: Sequence[Curve]) -> list[Curve]:
    if len(curves) < 2:
        raise InputError(f"{len(curves)} curve(s): a collapse needs two or more")
    if not all(np.all(x > 0) and np.all(y > 0) for x, y in curves):
        raise InputError("a collapse is measured in logarithms: x and y must be positive")
    return [(np.log(x), np.log(y)) for x, y in curves]


def _spread_of_logarithms(logs: list[Curve]) -> float:
    """How far curves (x, y) of ascending x lie apart: root mean square distance from their mean, in y, where two or
    more overlap. 0 is a perfect collapse."""
    starts, ends = np.array([[x[0], x[-1]] for x, _ in logs]).T
    grid = np.linspace(np.sort(starts)[1], np.sort(ends)[-2], 60)  # points at which curves are compared
    inside = (grid >= starts[:, None]) & (grid <= ends[:, None])
    inside &= inside.sum(axis=0) >= 2
    count = inside.sum(axis=0)
    if not count.any():
        return float("inf")
    values = np.where(inside, [np.interp(grid, x, y) for x, y in logs], 0.0)
    mean = values.sum(axis=0) / np.maximum(count, 1)
    return float(np.sqrt(np.sum(np.where(inside, values - mean, 0.0) ** 2) / count.sum()))


class ScalingExponents(NamedTuple):
    """Exponents for which x scale^a and y scale^b of all curves fall on one. `spread` of the rescaled curves: root mean
    square distance from their mean in ln y; inf if no two overlap."""

    a: float
    b: float
    spread: float


def fit_scaling_exponents(
    scale: ArrayLike,
    families: Sequence[Sequence[Curve]],
    *,
    a: float | None = None,
    b: float | None = None,
    start: tuple[float, float] = (0.0, 0.0),
) -> ScalingExponents:
    """Fit the exponents of a scaling collapse of curves at every scale (m,), such as N or p, in each family, such as
    G' and G''; an exponent that is given is held. Curves must overlap at the start of the search."""
    s = np.asarray(scale, dtype=np.float64)
    if not families or any(len(family) != len(s) for family in families) or not np.all(s > 0):
        raise InputError(f"{len(s)} scales: each family needs one curve per scale, and scales must be positive")
    held = np.array([np.nan if e is None else e for e in (a, b)])
    free = np.isnan(held)
    logs = [_take_logarithms(family) for family in families]
    moves = np.log(s)

    def spread(exponents: tuple[float, float]) -> float:
        p, q = exponents
        parts = [
            _spread_of_logarithms([(x + p * m, y + q * m) for (x, y), m in zip(family, moves, strict=True)])
            for family in logs
        ]
        return float(np.sqrt(np.mean(np.square(parts))))

    def fill_in(values: Array) -> tuple[float, float]:
        out = held.copy()
        out[free] = values
        return float(out[0]), float(out[1])

    begin = np.array(start)[free]
    best = fill_in(begin)
    if free.any() and np.isinf(spread(best)):
        raise InputError(f"no two curves overlap at the start {best}: give another start, or curves of wider range")
    if free.tolist() == [False, True]:  # b moves curves upwards alone: the square of their spread is a parabola in it
        below, at, above = (spread((best[0], best[1] + step)) ** 2 for step in (-1, 0, 1))
        if (bend := below - 2 * at + above) > 0:
            best = best[0], best[1] + 0.5 * (below - above) / bend
    elif free.any():
        how = {"xatol": 1e-4, "fatol": 1e-10}
        best = fill_in(minimize(lambda v: spread(fill_in(v)) ** 2, begin, method="Nelder-Mead", options=how).x)
    return ScalingExponents(*best, spread(best))
