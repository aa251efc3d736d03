"""Draw steady flow of disks in time: flow curves around onset, pressure, and the law of Herschel and Bulkley."""

from collections.abc import Callable

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import ConvergenceError
from jamlab.plotting.palette import RED
from jamlab.statistics.bootstrap import Interval
from jamlab.statistics.herschel_bulkley import HerschelBulkley, herschel_bulkley
from jamlab.statistics.published_numbers import FLOW_AT_ONSET, JAMMING_IN_SHEAR
from jamlab.studies.claims import Claim, claim
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.ensembles import average, bootstrap
from jamlab.studies.flow_rows import (
    RATE,
    STRESS,
    balanced_disks,
    by_packing,
    mean_over_packings,
    nearest,
    steady_flows,
)
from jamlab.studies.panels import FIT, Drawing, drawing, label, scale, sequence

ONSET = 0.84  # packing fraction nearest to onset
JAMMED = 0.86  # of the fit with a yield stress
HIGHEST = 1e-2  # rate up to which laws are fitted: beyond, contacts themselves limit the flow


def flow_curves(tables: EnsembleTables) -> Drawing:
    """Flow curves of disks around onset, stress over pressure, and the law of Herschel and Bulkley."""
    table = steady_flows(tables.flow)
    out, (stress, friction, fit) = drawing("dynamics-flow-curves", 1, 3, 4.8, 3.9)
    for axes in (stress, friction, fit):
        scale(axes, "log", "linear" if axes is friction else "log")
    fractions = sorted(table["phi"].unique())
    for k, phi in enumerate(fractions):
        rows = table[table["phi"] == phi]
        rows = rows.assign(friction=rows["stress"] / rows["flow_pressure"])
        for axes, column in ((stress, "stress"), (friction, "friction")):
            rate, values = by_packing(rows, "rate", column)
            mean = mean_over_packings(values)
            look = sequence(k, len(fractions))
            out.curve(axes, f"$\\phi$ = {phi:.2f}", rate, mean.value, mean.low, mean.high, band=False, **look)
    rates = table.loc[table["phi"] == ONSET, "rate"]
    if len(rates):
        at_onset = table[(table["phi"] == ONSET) & (table["rate"] == rates.min())]["stress"].mean()
        out.slope(stress, FLOW_AT_ONSET.value, (rates.min(), HIGHEST), 0.6 * float(at_onset))
    said = _draw_fit(out, fit, table, balanced_disks(tables.flow))
    label(stress, RATE, STRESS, fontsize=7.5)
    label(friction, RATE, r"stress over pressure $\sigma/p$", legend=False)
    label(fit, RATE, r"$\sigma - \sigma_y$  [k]", loc="upper left")
    out.claims = [_exponent_at_onset(table)]
    out.caption = (
        f"Steady flow of {int(table['n'].iloc[0])} disks with balanced contact drag at a given rate, means over "
        f"{table['seed'].nunique()} packings with 95 % intervals. (a) Stress over rate; the lower the rate, the more "
        "curves part, to a yield stress above onset and a liquid below; dashed, the power law at onset. (b) Stress "
        f"over pressure. {said}"
    )
    return out


def yield_law(rates: Array, stress: Array) -> HerschelBulkley:
    """Law of Herschel and Bulkley through the means of stresses (packings, m), weighted by their relative errors.

    Rate 0 is quasi-static shear, whose mean counts as any other.
    """
    kept = (rates <= HIGHEST) & np.isfinite(stress).all(axis=0)
    rates = np.maximum(rates, _STANDS)
    mean = average(stress[:, kept])
    return herschel_bulkley(rates[kept], mean, 0.03 * mean)


def yield_law_interval(rates: Array, stress: Array) -> Interval:
    """Yield stress and exponent, with their intervals over packings; nan of too few rates."""

    def of(groups: list[Array]) -> Array:
        try:
            found = yield_law(rates, groups[0])
        except ConvergenceError:
            return np.full(2, np.nan)
        return np.array([found.yield_stress, found.exponent])

    return bootstrap([stress], of, resamples=100)


def _draw_fit(out: Drawing, axes: object, table: pd.DataFrame, everything: pd.DataFrame) -> str:
    phi = nearest(sorted(table["phi"].unique()), JAMMED)
    rates, stress = by_packing(table[table["phi"] == phi], "rate", "stress")
    if (rates <= HIGHEST).sum() < 3:
        return "(c) Too few rates for a law with a yield stress."
    law, found = yield_law(rates, stress), yield_law_interval(rates, stress)
    mean = mean_over_packings(stress)
    y = law.yield_stress
    bounds = (mean.low - y, mean.high - y)
    out.curve(
        axes, f"$\\phi$ = {phi:.2f}", rates, mean.value - y, *bounds, band=False, color=RED, marker="s", ls="none"
    )
    line = np.geomspace(rates.min(), HIGHEST, 50)
    out.curve(axes, f"$n$ = {law.exponent:.3f}", line, law(line) - y, **FIT)
    low, high = found.low[1], found.high[1]
    return (
        f"(c) The law of Herschel and Bulkley at packing fraction {phi:.2f}, fitted up to rate {HIGHEST:g}: exponent "
        f"{law.exponent:.3f} [{low:.3f}, {high:.3f}], yield stress {1e4 * y:.2f} "
        f"[{1e4 * found.low[0]:.2f}, {1e4 * found.high[0]:.2f}] 1e-4 k.{_said_with_rest(everything, table, phi)}"
    )


def _said_with_rest(everything: pd.DataFrame, table: pd.DataFrame, phi: float) -> str:
    """The same law with quasi-static shear as rate 0."""
    still = everything[(everything["rate"] == 0) & (everything["phi"] == phi)]
    if still.empty:
        return ""
    rates, stress = by_packing(pd.concat([still, table[table["phi"] == phi]]), "rate", "stress")
    found = yield_law_interval(rates, stress)
    return (
        f" With the mean of quasi-static shear as rate 0: exponent {found.value[1]:.3f} [{found.low[1]:.3f}, "
        f"{found.high[1]:.3f}], yield stress {1e4 * found.value[0]:.2f} [{1e4 * found.low[0]:.2f}, "
        f"{1e4 * found.high[0]:.2f}]."
    )


def _exponent_at_onset(table: pd.DataFrame) -> Claim:
    rows = table[(table["phi"] == ONSET) & (table["rate"] <= HIGHEST)]
    found = None
    if len(rows):
        rates, stress = by_packing(rows, "rate", "stress")
        if len(rates) > 1:
            found = bootstrap([stress], _slope(np.log(rates)))
    how = f"slope of ln stress over ln rate up to {HIGHEST:g} at packing fraction {ONSET}"
    quantity = "exponent of stress over rate near onset"
    cause = f"Olsson & Teitel 2011 put onset in shear at {JAMMING_IN_SHEAR.value}; at onset the collapse finds q"
    return claim("dynamics-flow-curves", quantity, found, FLOW_AT_ONSET, how=how, cause=cause, shown_by=_COLLAPSE)


_STANDS = 1e-15  # rate that adds nothing to a yield stress
_COLLAPSE = "jamlab figure dynamics-collapse"


def _slope(log_rate: Array) -> Callable[[list[Array]], float]:
    return lambda groups: float(np.polyfit(log_rate, np.log(average(groups[0])), 1)[0])
