"""Mean flow curves: steady flow of several packings of one kind, averaged rate by rate."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from jamlab.arrays import Array, Indices
from jamlab.checks import checked
from jamlab.errors import InputError, warn
from jamlab.flow.flow_curve import FlowCurve
from jamlab.mechanics.like_packings import check_distinct, group_by_kind
from jamlab.packing.result import Result
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line, positive
from jamlab.plotting.palette import COLOURS
from jamlab.statistics.confidence import bootstrap
from jamlab.statistics.herschel_bulkley import HerschelBulkley, herschel_bulkley
from jamlab.statistics.rows_of_one_kind import (
    Campaign,
    DataFrame,
    Select,
    check_packings_once,
    groups_of_numbers,
    rows_of_one_kind,
    stress_unit,
)

_MEANS = ("stress", "elastic_stress", "pressure", "normal_stress_difference", "z_all")  # attributes of `FlowCurve`
_IN_TABLE = {name: name for name in _MEANS} | {"pressure": "flow_pressure"}  # columns of the table "flow"
_ENDS = ("", "_stderr", "_low", "_high")
_NEEDED = (
    "task",
    "seed",
    "state",
    "rate",
    *(f"{name}{end}" for name in _IN_TABLE.values() for end in _ENDS[:2]),
    "converged",
)
_MEASURED = (  # may differ from packing to packing
    *(name for name in _NEEDED if name != "state"),  # of a task: one at each pressure or packing fraction
    *("rho", "pressure", "dissipation", "plastic_events", "peak_stress", "peak_strain", "ambiguous_contacts"),
)
RESAMPLES = 1000  # the ends of a 95 % interval to a tenth of its width


@dataclass(frozen=True, kw_only=True)
class MeanFlowCurve(Result):
    """Steady states at m rates, means over packings of one kind.

    Attributes:
        rate: (m,) shear rates, ascending, 1/tau_1.
        packings: (m,) number of packings whose flow is steady at each rate.
        stress: (m,) mean shear stress.
        stress_stderr: (m,) standard error, by the scatter of packings; of one packing the error of its own mean.
        stress_low, stress_high: (m,) ends of the 95 % interval over packings, by bootstrap; nan of one packing.
        elastic_stress, pressure, normal_stress_difference, z_all: (m,) means, each with `..._stderr`, `..._low` and
            `..._high`; as in `FlowCurve`.
        label: drag law, for the legend.
        unit: unit of stress, for labels.

    Example:
        >>> packings = [jamlab.pack(16, 1e-2, seed=seed) for seed in (1, 2)]
        >>> curves = [jamlab.flow_curve(p, [0.1, 0.3, 1.0], strain=1.0, discard=0.2) for p in packings]
        >>> mean = jamlab.mean_flow_curve(curves)
        >>> len(mean.rate), bool(np.all(mean.stress_stderr > 0))
        (3, True)
    """

    _rows = ("rate", "packings", *(f"{name}{end}" for name in _MEANS for end in _ENDS))

    rate: Array
    packings: Indices
    stress: Array
    stress_stderr: Array
    stress_low: Array
    stress_high: Array
    elastic_stress: Array
    elastic_stress_stderr: Array
    elastic_stress_low: Array
    elastic_stress_high: Array
    pressure: Array
    pressure_stderr: Array
    pressure_low: Array
    pressure_high: Array
    normal_stress_difference: Array
    normal_stress_difference_stderr: Array
    normal_stress_difference_low: Array
    normal_stress_difference_high: Array
    z_all: Array
    z_all_stderr: Array
    z_all_low: Array
    z_all_high: Array
    label: str = field(default="", repr=False)
    unit: str = field(default="", repr=False)

    def herschel_bulkley(self) -> HerschelBulkley:
        """Fit yield stress, consistency and exponent to three rates or more, well below 1/tau_1.

        A few packings agree by chance at some rates, and these would decide the fit: each rate has at least the mean
        relative error of all.

        Raises:
            InputError, ConvergenceError: fewer than three rates, or no fit is found.
        """
        common = np.sqrt(np.mean((self.stress_stderr / self.stress) ** 2)) * np.abs(self.stress)
        return herschel_bulkley(self.rate, self.stress, np.maximum(self.stress_stderr, common), self.unit)

    @drawn("Line2D; `label` names the curve in the legend")
    def plot(self, axes: Any, /, label: str = "", **style: Any) -> None:
        """Draw the mean stress over the rate with its standard errors, on logarithmic axes."""
        colour = COLOURS[len(axes.containers) % len(COLOURS)]
        look = merged_line({"color": colour, "marker": "o", "markersize": 5, "linewidth": 1.2}, style)
        stress, left_out = positive(self.stress)
        fewest, most = self.packings.min(), self.packings.max()
        count = f"{most} packings" if fewest == most else f"{fewest} to {most} packings"
        name = (label or ", ".join(filter(None, (self.label, count)))) + left_out
        axes.errorbar(self.rate, stress, self.stress_stderr, capsize=2.5, label=name, **look)
        axes.set_xscale("log")
        axes.set_yscale("log")
        label_axes(axes, r"rate of shear $\dot\gamma\,\tau_1$", in_unit(r"shear stress $\sigma$", self.unit))
        axes.legend(fontsize=LEGEND)


class _Point(NamedTuple):
    """Steady flow of one packing at one rate: means by name, with their errors."""

    rate: float
    means: dict[str, float]
    errors: dict[str, float]


@checked
def mean_flow_curve(
    curves: Campaign | DataFrame | Sequence[FlowCurve], *, select: Select | None = None
) -> MeanFlowCurve:
    """Average steady flow over packings of one kind, rate by rate.

    Flows that are not steady are left out, with a warning that counts them.

    Args:
        curves: of several packings, see `jamlab.flow_curve`; or a campaign, or its table "flow", of one sweep or
            several.
        select: of a campaign or a table with packings of several kinds: columns and their values in the rows that are
            wanted, such as {"target_pressure": 1e-2, "beta": 1.0}.

    Warns:
        JamlabWarning: flows are left out.

    Raises:
        InputError: packings or flows of several kinds, or no flow that is steady.

    Example:
        >>> packings = [jamlab.pack(16, 1e-2, seed=seed) for seed in (1, 2)]
        >>> curves = [jamlab.flow_curve(p, [0.1, 0.3, 1.0], strain=1.0, discard=0.2) for p in packings]
        >>> fit = jamlab.mean_flow_curve(curves).herschel_bulkley()
        >>> bool(fit.exponent > 0)
        True
    """
    if isinstance(curves, Campaign | DataFrame):
        points, missed, label, unit = _of_table(curves, select)
    elif select is not None:
        raise InputError("select: applies to a campaign, or its table; choose among curves by hand")
    else:
        points, missed, label, unit = _of_curves(curves)
    if missed:
        counts = ", ".join(f"{missed.count(rate)} at rate {rate:g}" for rate in sorted(set(missed)))
        told = f"left out of the mean: {len(missed)} of {len(missed) + len(points)} flows, which are not steady"
        warn(f"{told} ({counts}): give them more strain")
    if not points:
        raise InputError("no flow is steady: give a larger strain")
    places = groups_of_numbers([point.rate for point in points])
    rates, columns = np.unique(places), dict[str, list[float]]()
    for rate in rates:
        here = [point for point, place in zip(points, places, strict=True) if place == rate]
        for name in _MEANS:
            values = _mean([point.means[name] for point in here], [point.errors[name] for point in here])
            for end, value in zip(_ENDS, values, strict=True):
                columns.setdefault(f"{name}{end}", []).append(value)
    return MeanFlowCurve(
        rate=np.array([points[list(places).index(rate)].rate for rate in rates]),
        packings=np.array([int(np.sum(places == rate)) for rate in rates]),
        label=label,
        unit=unit,
        **{name: np.array(values) for name, values in columns.items()},
    )


def _mean(values: list[float], errors: list[float]) -> tuple[float, float, float, float]:
    """Mean over packings, its standard error, and the ends of its interval."""
    found = bootstrap([np.array(values)], lambda groups: groups[0].mean(), resamples=RESAMPLES)
    error = float(np.std(values, ddof=1)) / np.sqrt(len(values)) if len(values) > 1 else errors[0]
    return float(found.value), error, float(found.low), float(found.high)


def _of_curves(curves: Sequence[FlowCurve]) -> tuple[list[_Point], list[float], str, str]:
    """Points of flow curves; the rates that are not steady; names of their drag law and of the unit of stress."""
    if not curves:
        raise InputError("curves: give one or more")
    if len(kinds := group_by_kind([curve.frames[0] for curve in curves])) > 1:
        raise InputError(f"packings of {len(kinds)} kinds have no common mean: {'; '.join(kinds)}. Give those of one")
    for name in ("damping", "background_drag", "tolerance"):
        if len(found := dict.fromkeys(str(getattr(curve, name)) for curve in curves)) > 1:
            raise InputError(f"flows with {name} {' and '.join(found)} have no common mean: give those of one")
    for rate in dict.fromkeys(float(each) for curve in curves for each in curve.rate):
        check_distinct({k: curve.frames[0] for k, curve in enumerate(curves) if rate in curve.rate}, "curves")
    points, missed = list[_Point](), list[float]()
    for curve in curves:
        for k, steady in enumerate(curve.finished):
            if steady:
                means, errors = ({name: getattr(curve, f"{name}{end}")[k] for name in _MEANS} for end in _ENDS[:2])
                points.append(_Point(float(curve.rate[k]), means, errors))
            else:
                missed.append(float(curve.rate[k]))
    return points, missed, str(curves[0].damping), curves[0].unit


def _of_table(source: Any, select: Select | None) -> tuple[list[_Point], list[float], str, str]:
    """The same of a campaign, or of its table "flow"."""
    rows = source._rows_of("flow") if isinstance(source, Campaign) else source
    by_fraction = "phi" in rows and rows.groupby("state")["phi"].nunique().max() <= 1  # which then tells states apart
    frame = rows_of_one_kind(rows, "flow", select, _MEASURED if by_fraction else (*_MEASURED, "phi"), _NEEDED)
    steady = frame["converged"].astype(bool)
    check_packings_once(frame, "flows")
    if (again := frame.duplicated(["task", "rate"])).any():
        row = frame[again].iloc[0]
        raise InputError(f"task {row['task']} has rate {row['rate']:g} twice: leave out rows that are repeated")
    label = ", ".join(_words(frame.iloc[0])) if len(frame) else ""
    return [*_points(frame[steady])], frame.loc[~steady, "rate"].tolist(), label, stress_unit(frame)


def _points(frame: Any) -> Iterator[_Point]:
    for row in frame.to_dict("records"):
        means = {name: float(row[column]) for name, column in _IN_TABLE.items()}
        errors = {name: float(row[f"{column}_stderr"]) for name, column in _IN_TABLE.items()}
        yield _Point(float(row["rate"]), means, errors)


def _words(row: Any) -> Iterator[str]:
    """The drag law of a row, in words."""
    if "damping" in row:
        yield f"{row['damping']} damping"
    yield from (f"{name} = {row[name]:g}" for name in ("beta", "eta_f") if name in row and np.isfinite(row[name]))
