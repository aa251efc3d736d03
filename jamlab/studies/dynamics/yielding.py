"""Draw the yield stress of disks three ways side by side: steady flow, start-up and creep."""

from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from jamlab.errors import InputError
from jamlab.plotting.palette import BLACK, BLUE, GREEN, ORANGE, PINK, RED
from jamlab.statistics.bootstrap import Interval
from jamlab.studies.dynamics.flow_curves import HIGHEST, JAMMED, yield_law, yield_law_interval
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.flow_rows import (
    RATE,
    STRESS,
    balanced_disks,
    by_packing,
    mean_over_packings,
    nearest,
    steady_flows,
)
from jamlab.studies.panels import FIT, Drawing, drawing, label, scale

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
    scale(flow)
    scale(creep)
    found = _flows(out, flow, table, slow)
    found.append(Estimate("creep", _creeps(out, creep, loaded, table), _CREEP))
    for k, each in enumerate(found):
        low, high = each.found.low, each.found.high
        out.curve(
            ways, each.way, [k], 1e3 * each.found.value, 1e3 * low, 1e3 * high, band=False, ls="none", **each.look
        )
    ways.set_xticks(range(len(found)), [each.way.replace(" ", "\n") for each in found])
    ways.set_xlim(-0.5, len(found) - 0.5)
    ways.set_ylim(bottom=0)
    label(flow, RATE, STRESS, loc="upper left")
    label(creep, STRESS, r"rate of creep at the end $\dot\gamma\,\tau_1$")
    label(ways, "way", r"yield stress $\sigma_y$  [$10^{-3}$ k]", legend=False)
    ways.tick_params(axis="x", labelsize=8)
    text = "; ".join(
        f"{each.way} {1e4 * each.found.value:.1f} [{1e4 * each.found.low:.1f}, {1e4 * each.found.high:.1f}]"
        for each in found
    )
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


def _flows(out: Drawing, axes: Any, table: pd.DataFrame, slow: pd.DataFrame) -> list[Estimate]:
    rates, stress = by_packing(table, "rate", "stress")
    mean = mean_over_packings(stress)
    out.curve(axes, "steady flow", rates, mean.value, mean.low, mean.high, band=False, color=RED, marker="s", ls="none")
    law, interval = yield_law(rates, stress), yield_law_interval(rates, stress)
    line = np.geomspace(rates.min(), HIGHEST, 60)
    out.curve(axes, f"Herschel-Bulkley, $n$ = {law.exponent:.2f}", line, law(line), **FIT)
    _, peaks = by_packing(table, "rate", "peak_stress")
    top = mean_over_packings(np.where(np.isfinite(peaks), peaks, stress))
    out.curve(
        axes, "peak of start-up", rates, top.value, top.low, top.high, band=False, color=GREEN, marker="^", ls=":"
    )
    limit = mean_over_packings(slow[["stress"]].to_numpy(dtype=np.float64))
    ends = np.array([rates.min(), rates.max()])
    mean_slow, low, high = (np.full(2, v[0]) for v in (limit.value, limit.low, limit.high))
    out.curve(axes, "quasi-static mean", ends, mean_slow, low, high, color=BLUE, ls="--")
    peak = mean_over_packings(slow[["peak_stress"]].fillna({"peak_stress": slow["stress"]}).to_numpy(dtype=np.float64))
    return [
        Estimate("flow, law", interval[0], {"color": BLACK, "marker": "s"}),
        Estimate("flow, slowest", mean[0], {"color": RED, "marker": "s"}),
        Estimate("flow, quasi-static", limit[0], {"color": BLUE, "marker": "o"}),
        Estimate("start-up, slowest", top[0], {"color": GREEN, "marker": "^"}),
        Estimate("start-up, quasi-static", peak[0], {"color": ORANGE, "marker": "D"}),
    ]


def _creeps(out: Drawing, axes: Any, loaded: pd.DataFrame, table: pd.DataFrame) -> Interval:
    out.curve(axes, "creep", loaded["stress"] + loaded["residual"], loaded["final_rate"], ls="none", **_CREEP)
    rates, stress = by_packing(table, "rate", "stress")
    line = np.geomspace(MOVES, HIGHEST, 60)
    out.curve(axes, "steady flow, law of (a)", yield_law(rates, stress)(line), line, **FIT)
    axes.axhline(MOVES, color=BLACK, linewidth=0.8, linestyle=":")
    limits = [_threshold(rows) for _, rows in loaded.groupby("seed")]
    return mean_over_packings(np.array(limits)[:, None])[0]


def _threshold(rows: pd.DataFrame) -> float:
    """Stress, the residual one counted, between the largest that a packing bears and the next; nan if all flow."""
    total = (rows["stress"] + rows["residual"]).to_numpy(dtype=np.float64)
    order = np.argsort(total)
    total, flows = total[order], rows["final_rate"].to_numpy(dtype=np.float64)[order] > MOVES
    held = np.flatnonzero(~flows)
    if not len(held) or held[-1] + 1 == len(total):
        return np.nan
    return float(np.sqrt(total[held[-1]] * total[held[-1] + 1]))
