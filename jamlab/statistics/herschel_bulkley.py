"""The law of Herschel and Bulkley for flow curves: a yield stress and a power law."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from jamlab.arrays import Array, ArrayLike
from jamlab.checks import checked, finite_array
from jamlab.errors import ConvergenceError, InputError
from jamlab.packing.result import Result
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line


@dataclass(frozen=True)
class Exponents:
    """Exponents that are tried."""

    steepest: float = 2.0  # exponent
    edge: float = 1e-3  # of its range, within which it counts as at its end


EXPONENTS = Exponents()


@dataclass(frozen=True)
class HerschelBulkley(Result):
    """sigma = yield_stress + consistency rate^exponent.

    Attributes:
        yield_stress, consistency, exponent: of the law.
        yield_stress_stderr, consistency_stderr, exponent_stderr: standard errors; where the points scatter by more than
            their errors, as much larger.
        misfit: root of chi squared per degree of freedom: 1 if the points scatter as their errors say; nan of three.
        rate, stress, stress_stderr: (m,) what was fitted.
        unit: unit of stress, for labels.
    """

    _rows = ("rate", "stress", "stress_stderr")

    yield_stress: float
    consistency: float
    exponent: float
    yield_stress_stderr: float
    consistency_stderr: float
    exponent_stderr: float
    misfit: float
    rate: Array = field(repr=False)
    stress: Array = field(repr=False)
    stress_stderr: Array = field(repr=False)
    unit: str = field(default="", repr=False)

    def _columns(self) -> dict[str, Any]:
        """The points, and the law at their rates."""
        return super()._columns() | {"law": self(self.rate)}

    def __call__(self, rates: ArrayLike) -> Array:
        """Stress at rates, of their shape."""
        return _law(np.asarray(rates, dtype=np.float64), self.yield_stress, self.consistency, self.exponent)

    def __str__(self) -> str:
        yields = f"σ_y = {self.yield_stress:.3g} ± {self.yield_stress_stderr:.1g}"
        flows = f"K = {self.consistency:.3g} ± {self.consistency_stderr:.1g}"
        seen = "" if self.resolved else "; yield stress NOT RESOLVED (below two standard errors)"
        return f"{yields}, {flows}, n = {self.exponent:.3f} ± {self.exponent_stderr:.3f}{seen}"

    @property
    def resolved(self) -> bool:
        """Whether the yield stress is above two standard errors: use more particles, longer strains or lower rates."""
        return self.yield_stress > 2 * self.yield_stress_stderr

    @drawn("Line2D that draws the law")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the points with their errors and the law through them, on logarithmic axes."""
        from jamlab.plotting.palette import BLUE, RED

        rates = np.geomspace(self.rate.min(), self.rate.max(), 200)
        law, points = self(rates), f"{len(self.rate)} points"
        label = rf"$\sigma_y$ = {self.yield_stress:.3g}, $n$ = {self.exponent:.3f}"
        axes.set_xscale("log")
        if min(law.min(), self.stress.min()) > 0 and law.max() > 3 * law.min():
            axes.set_yscale("log")
        axes.errorbar(self.rate, self.stress, self.stress_stderr, fmt="o", color=BLUE, ms=5, capsize=2.5, label=points)
        axes.plot(rates, law, **merged_line({"color": RED, "linewidth": 1.6, "label": label}, style))
        axes.legend(fontsize=LEGEND)
        label_axes(axes, r"rate of shear $\dot\gamma\,\tau_1$", in_unit(r"shear stress $\sigma$", self.unit))


@checked
def herschel_bulkley(rates: ArrayLike, stress: ArrayLike, stress_stderr: ArrayLike, unit: str = "") -> HerschelBulkley:
    """Fit the law to a flow curve of three points or more by least squares in (law - stress)/error; the yield stress
    may be negative. One below its error means that none is seen. Errors must not follow the scatter of the stresses:
    of 12 points that scatter by 20 % of the law, errors of 20 % of each stress lower the yield stress by 7 %, and of 10
    % by 0.1 %, since points that came out low weigh most."""
    from scipy.optimize import curve_fit

    names = ("rates", "stress", "stress_stderr")
    x, y, error = (finite_array(n, v, (None,)) for n, v in zip(names, (rates, stress, stress_stderr), strict=True))
    if not len(x) == len(y) == len(error) or len(np.unique(x)) < 3:
        raise InputError(
            f"{len(x)} rates, {len(y)} stresses, {len(error)} errors: give three or more different rates, and as many "
            "stresses and errors"
        )
    if min(x.min(), error.min()) <= 0:
        raise InputError("rates and errors of the stress must be positive")
    if not np.ptp(y) > 0:
        raise InputError(f"stress is {y[0]:.6g} at every rate: such a curve has no exponent")
    low = 0.5 * y.min() if y.min() > 0 else y.min()
    start = (low, (y.max() - low) / x.max() ** 0.5, 0.5)
    bounds = ([-np.inf, 0.0, 0.0], [np.inf, np.inf, EXPONENTS.steepest])
    try:
        best, covariance = curve_fit(
            _law, x, y, start, error, absolute_sigma=True, bounds=bounds, x_scale=(np.abs(y).max(), start[1], 0.5)
        )
    except RuntimeError as failure:
        raise ConvergenceError(f"no Herschel-Bulkley law fits these {len(x)} points: {_REMEDY}") from failure
    if not EXPONENTS.edge < best[2] < EXPONENTS.steepest - EXPONENTS.edge:
        raise ConvergenceError(f"the fitted exponent is {best[2]:.3g}, the limit of its range: {_REMEDY}")
    if best[1] * np.ptp(x ** best[2]) < error.min():
        raise ConvergenceError(f"stress is {y.mean():.6g} at every rate, within its errors: {_REMEDY}")
    freedom = len(x) - 3
    misfit = float(np.sqrt(np.sum(((_law(x, *best) - y) / error) ** 2) / freedom)) if freedom else np.nan
    errors = np.sqrt(np.diag(covariance)) * max(1.0, misfit if freedom else 1.0)
    (yields, consistency, exponent), (a, b, c) = best.tolist(), errors.tolist()
    return HerschelBulkley(yields, consistency, exponent, a, b, c, misfit, x, y, error, unit)


_REMEDY = "give more rates, longer strain or more particles"


def _law(rate: Array, yield_stress: float, consistency: float, exponent: float) -> Array:
    return np.asarray(yield_stress + consistency * rate**exponent)
