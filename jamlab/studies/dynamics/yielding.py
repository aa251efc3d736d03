"""Draw how disks yield: overshoot of start-up, and the yield stress of steady flow, start-up and creep side by side."""

from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from jamlab.errors import InputError
from jamlab.plotting.palette import BLACK, BLUE, GREEN, ORANGE, PINK, RED
from jamlab.statistics.bootstrap import Interval
from jamlab.studies.dynamics.flow_curves import (
    HIGHEST,
    JAMMED,
    RATE,
    STRESS,
    balanced_disks,
    draw_mean,
    mean_of_rows,
    steady_flows,
    yield_law,
    yield_law_interval,
)
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.ensembles import mean_over_packings, nearest, of_packings, scaled
from jamlab.studies.panels import FIT, Drawing, drawing, label, scale, sequence

LOOSE = 0.845  # packing fraction below which nothing holds a quenched packing before it flows
MOVES = 1e-5  # rate of creep below which a packing is taken to bear a stress
_CREEP: dict[str, Any] = {"color": PINK, "marker": "v"}


class Estimate(NamedTuple):
    """A yield stress by one way, with its look."""

    way: str
    found: Interval
    look: dict[str, Any]


def yield_stress(tables: EnsembleTables) -> Drawing:
    """Yield stress from steady flow, quasi-static shear, start-up and creep, side by side."""
    table = steady_flows(tables.flow)
    phi = nearest(sorted(table["phi"].unique()), JAMMED)
    table = table[table["phi"] == phi]
    slow = balanced_disks(tables.flow)
    slow = slow[(slow["phi"] == phi) & (slow["rate"] == 0)]
    loaded = balanced_disks(tables.creep)
    loaded = loaded[loaded["phi"] == phi]
    if slow.empty or loaded.empty:
        raise InputError(f"no quasi-static shear or no creep at packing fraction {phi}: run a campaign with both")
    out, (flow, creep, ways) = drawing("dynamics-yield", 1, 3, 4.8, 3.9)
    scale(flow, creep)
    found = _flows(out, flow, table, slow)
    found.append(Estimate("creep", _creeps(out, creep, loaded, table), _CREEP))
    for k, each in enumerate(found):
        out.keep(f"yield stress, {each.way}", each.found)
        out.curve(ways, each.way, [k], scaled(each.found, 1e3), band=False, ls="none", **each.look)
    ways.set_xticks(range(len(found)), [each.way.replace(" ", "\n") for each in found])
    ways.set_xlim(-0.5, len(found) - 0.5)
    ways.set_ylim(bottom=0)
    label(flow, RATE, STRESS, loc="upper left")
    label(creep, STRESS, r"rate of creep at the end $\dot\gamma\,\tau_1$")
    label(ways, "way", r"yield stress $\sigma_y$  [$10^{-3}$ k]", legend=False)
    ways.tick_params(axis="x", labelsize=8)
    text = "; ".join(f"{each.way} {_write_stress(each.found)}" for each in found)
    out.caption = (
        f"{int(table['n'].iloc[0])} disks at packing fraction {phi:.2f}, {slow['seed'].nunique()} packings, 95 % "
        "intervals. (a) Steady flow, the law of Herschel and Bulkley through it, the mean of quasi-static shear, to "
        "which it tends, and the peaks of start-up. (b) Packings at rest under a stress, with their residual stress: "
        f"mean rate over the last half of a time of {loaded['final_time'].max():g}, beside the law of (a). (c) Yield "
        f"stresses, in 1e-4 k: {text}. What keeps flow going needs less stress than what starts it from a quenched "
        f"packing. That of creep lies between the largest stress under which a packing ends slower than {MOVES:g}, and "
        "the next."
    )
    return out


def _write_stress(found: Interval) -> str:
    return f"{1e4 * found.value:.1f} [{1e4 * found.low:.1f}, {1e4 * found.high:.1f}]"


def _flows(out: Drawing, axes: Any, table: pd.DataFrame, slow: pd.DataFrame) -> list[Estimate]:
    rates, stress = of_packings(table, "rate", "stress")
    mean = mean_over_packings([stress])[0]
    out.curve(axes, "steady flow", rates, mean, band=False, color=RED, marker="s", ls="none")
    law, interval = yield_law(rates, stress), yield_law_interval(rates, stress)
    line = np.geomspace(rates.min(), HIGHEST, 60)
    out.curve(axes, f"Herschel-Bulkley, $n$ = {law.exponent:.2f}", line, law(line), **FIT)
    _, peaks = of_packings(table, "rate", "peak_stress")
    top = mean_over_packings([np.where(np.isfinite(peaks), peaks, stress)])[0]
    out.curve(axes, "peak of start-up", rates, top, band=False, color=GREEN, marker="^", ls=":")
    of_slow = (slow["stress"], slow["peak_stress"].fillna(slow["stress"]))
    limit, peak = (mean_over_packings([column.to_numpy(dtype=np.float64)])[0] for column in of_slow)
    ends = np.array([rates.min(), rates.max()])
    out.curve(axes, "quasi-static mean", ends, scaled(limit, np.ones(2)), color=BLUE, ls="--")
    return [
        Estimate("flow, law", interval[0], {"color": BLACK, "marker": "s"}),
        Estimate("flow, slowest", mean[0], {"color": RED, "marker": "s"}),
        Estimate("flow, quasi-static", limit, {"color": BLUE, "marker": "o"}),
        Estimate("start-up, slowest", top[0], {"color": GREEN, "marker": "^"}),
        Estimate("start-up, quasi-static", peak, {"color": ORANGE, "marker": "D"}),
    ]


def _creeps(out: Drawing, axes: Any, loaded: pd.DataFrame, table: pd.DataFrame) -> Interval:
    out.curve(axes, "creep", loaded["stress"] + loaded["residual"], loaded["final_rate"], ls="none", **_CREEP)
    rates, stress = of_packings(table, "rate", "stress")
    line = np.geomspace(MOVES, HIGHEST, 60)
    out.curve(axes, "steady flow, law of (a)", yield_law(rates, stress)(line), line, **FIT)
    axes.axhline(MOVES, color=BLACK, linewidth=0.8, linestyle=":")
    limits = [_threshold(rows) for _, rows in loaded.groupby("seed")]
    return mean_over_packings([np.array(limits)])[0]


def _threshold(rows: pd.DataFrame) -> float:
    """Find the stress between the largest that a packing bears and the next, residual one counted; nan if all flow."""
    total = (rows["stress"] + rows["residual"]).to_numpy(dtype=np.float64)
    order = np.argsort(total)
    total, flows = total[order], rows["final_rate"].to_numpy(dtype=np.float64)[order] > MOVES
    held = np.flatnonzero(~flows)
    if not len(held) or held[-1] + 1 == len(total):
        return np.nan
    return float(np.sqrt(total[held[-1]] * total[held[-1] + 1]))


def overshoot(tables: EnsembleTables) -> Drawing:
    """Overshoot of start-up from quenched packings: height, excess over steady flow, and strain."""
    table = steady_flows(tables.flow)
    table = table[table["phi"] > LOOSE]
    out, (height, excess, strain) = drawing("dynamics-overshoot", 1, 3, 4.6, 3.9)
    for axes in (height, excess, strain):
        scale(axes, y="log" if axes is height else "linear")
    fractions = sorted(table["phi"].unique())
    for k, phi in enumerate(fractions):
        rows = table[table["phi"] == phi]
        rows = rows.assign(excess=(rows["peak_stress"] / rows["stress"]).fillna(1.0))  # 1 without a peak
        look = sequence(k, len(fractions))
        for axes, column in ((height, "peak_stress"), (excess, "excess"), (strain, "peak_strain")):
            draw_mean(out, axes, f"$\\phi$ = {phi:.2f}", rows, "rate", column, **look)
        rate, steady = mean_of_rows(rows, "rate", "stress")
        out.curve(height, f"steady, $\\phi$ = {phi:.2f}", rate, steady.value, label=None, color=look["color"], ls=":")
    label(height, RATE, r"peak stress, dotted steady stress $\sigma$  [k]", loc="upper left")
    label(excess, RATE, "peak over steady stress", legend=False)
    label(strain, RATE, "strain at the peak", legend=False)
    out.caption = (
        f"Start-up of {int(table['n'].iloc[0])} quenched disks, means over {table['seed'].nunique()} packings with "
        "95 % intervals. The peak is the largest stress up to strain 1, which stress of so few disks reaches by chance "
        "too: where steady flow fluctuates most, at low rates near onset, most of the excess is of that kind."
    )
    return out
