"""Draw steady flow in time: flow curves of disks around onset, and of droplets beside disks."""

from itertools import product
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.plotting.palette import MODEL_STYLE, RED
from jamlab.statistics.bootstrap import Interval
from jamlab.statistics.published_numbers import FLOW_AT_ONSET, JAMMING_IN_SHEAR
from jamlab.studies.dynamics.steady_flows import (
    HIGHEST,
    JAMMED,
    ONSET,
    RATE,
    STRESS,
    balanced_disks,
    draw_mean,
    steady_flows,
    yield_law,
    yield_law_interval,
)
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.ensembles import average, bootstrap, mean_over_packings, nearest, of_packings
from jamlab.studies.panels import FIT, Drawing, drawing, label, model_style, scale, sequence


def flow_curves(tables: EnsembleTables) -> Drawing:
    """Flow curves of disks around onset, stress over pressure, and the law of Herschel and Bulkley."""
    table = steady_flows(tables.flow)
    out, (stress, friction, fit) = drawing("dynamics-flow-curves", 1, 3, 4.8, 3.9)
    for axes in (stress, friction, fit):
        scale(axes, y="linear" if axes is friction else "log")
    fractions = sorted(table["phi"].unique())
    for k, phi in enumerate(fractions):
        rows = table[table["phi"] == phi]
        rows = rows.assign(friction=rows["stress"] / rows["flow_pressure"])
        for axes, column in ((stress, "stress"), (friction, "friction")):
            draw_mean(out, axes, f"$\\phi$ = {phi:.2f}", rows, "rate", column, **sequence(k, len(fractions)))
    rates = table.loc[table["phi"] == ONSET, "rate"]
    if len(rates):
        at_onset = table[(table["phi"] == ONSET) & (table["rate"] == rates.min())]["stress"].mean()
        out.slope(stress, FLOW_AT_ONSET.value, (rates.min(), HIGHEST), 0.6 * float(at_onset))
    phi = nearest(fractions, JAMMED)
    _draw_fit(out, fit, table, balanced_disks(tables.flow), phi)
    label(stress, RATE, STRESS, fontsize=7.5)
    label(friction, RATE, r"stress over pressure $\sigma/p$", legend=False)
    label(fit, RATE, r"$\sigma - \sigma_y$  [k]", loc="upper left")
    _claim_exponent_at_onset(out, table)
    out.caption = (
        f"Steady flow of {int(table['n'].iloc[0])} disks with balanced contact drag at a given rate, means over "
        f"{table['seed'].nunique()} packings with 95 % intervals. (a) Stress over rate; the lower the rate, the more "
        "curves part, to a yield stress above onset and a liquid below; dashed, the power law at onset. (b) Stress "
        f"over pressure. {_write_fit(out, phi)}"
    )
    return out


def _draw_fit(out: Drawing, axes: Any, table: pd.DataFrame, everything: pd.DataFrame, phi: float) -> None:
    """Draw the law with a yield stress through the curve above onset, and keep it with and without rate 0."""
    moving = table[table["phi"] == phi]
    rates, stress = of_packings(moving, "rate", "stress")
    if (rates <= HIGHEST).sum() < 3:
        return
    law = yield_law(rates, stress)
    _keep_law(out, "", yield_law_interval(rates, stress))
    y, mean = law.yield_stress, mean_over_packings([stress])[0]
    above = Interval(mean.value - y, mean.low - y, mean.high - y)
    out.curve(axes, f"$\\phi$ = {phi:.2f}", rates, above, band=False, color=RED, marker="s", ls="none")
    line = np.geomspace(rates.min(), HIGHEST, 50)
    out.curve(axes, f"$n$ = {law.exponent:.3f}", line, law(line) - y, **FIT)
    still = everything[(everything["rate"] == 0) & (everything["phi"] == phi)]
    if len(still):
        _keep_law(out, REST, yield_law_interval(*of_packings(pd.concat([still, moving]), "rate", "stress")))


REST = " with quasi-static shear"


def _keep_law(out: Drawing, of: str, found: Interval) -> None:
    out.keep(f"yield stress{of}", found[0])
    out.keep(f"exponent of Herschel and Bulkley{of}", found[1])


def _write_law(out: Drawing, of: str) -> str:
    exponent, stress = (out.values[name + of] for name in ("exponent of Herschel and Bulkley", "yield stress"))
    return (
        f"exponent {exponent.value:.3f} [{exponent.low:.3f}, {exponent.high:.3f}], yield stress "
        f"{1e4 * stress.value:.2f} [{1e4 * stress.low:.2f}, {1e4 * stress.high:.2f}]"
    )


def _write_fit(out: Drawing, phi: float) -> str:
    if "yield stress" not in out.values:
        return "(c) Too few rates for a law with a yield stress."
    rest = ""
    if f"yield stress{REST}" in out.values:
        rest = f" With the mean of quasi-static shear as rate 0: {_write_law(out, REST)}."
    return (
        f"(c) The law of Herschel and Bulkley at packing fraction {phi:.2f}, fitted up to rate {HIGHEST:g}: "
        f"{_write_law(out, '')} 1e-4 k.{rest}"
    )


def _claim_exponent_at_onset(out: Drawing, table: pd.DataFrame) -> None:
    """Claim the exponent of the stress over the rate at the packing fraction nearest to onset."""
    rows = table[(table["phi"] == ONSET) & (table["rate"] <= HIGHEST)]
    found = None
    if rows["rate"].nunique() > 1:
        rates, stress = of_packings(rows, "rate", "stress")

        def slope(groups: list[Array]) -> float:
            return float(np.polyfit(np.log(rates), np.log(average(groups[0])), 1)[0])

        found = bootstrap([stress], slope)
    words = {
        "how": f"slope of ln stress over ln rate up to {HIGHEST:g} at packing fraction {ONSET}",
        "cause": f"Olsson & Teitel 2011 put onset in shear at {JAMMING_IN_SHEAR.value}; at onset the collapse finds q",
        "shown_by": "jamlab figure dynamics-collapse",
    }
    out.claim("exponent of stress over rate near onset", found, FLOW_AT_ONSET, **words)


def droplets_beside_disks(tables: EnsembleTables) -> Drawing:
    """Flow curves of droplets and disks at the same packing fraction, and their pressure."""
    table = tables.flow[tables.flow["law"] == "stokes"]
    table = table.assign(rho=table["rho"].round(3))
    fractions = sorted(table.loc[table["model"] == "dp", "rho"].unique())
    if not fractions:
        raise InputError("the table flow has no droplets under Stokes drag: run a campaign with some")
    out, axes = drawing("dynamics-droplets", 1, len(fractions) + 1, 4.6, 3.9)
    for part, rho in zip(axes, fractions, strict=False):
        scale(part)
        for model in MODEL_STYLE:
            rows, look = table[(table["rho"] == rho) & (table["model"] == model)], model_style(model, linestyle="-")
            draw_mean(out, part, MODEL_STYLE[model]["label"], rows, "rate", "stress", **look)
        text = rf"shear stress $\sigma$ at $\rho$ = {rho:.2f}  [ε/l²]"
        label(part, RATE, text, legend=False)
    last = axes[-1]
    scale(last)
    for model, (rho, line) in product(MODEL_STYLE, zip(fractions, ("-", "--", ":"), strict=False)):
        rows, look = table[(table["rho"] == rho) & (table["model"] == model)], model_style(model, linestyle=line)
        text = rf"{MODEL_STYLE[model]['label']}, $\rho$ = {rho:.2f}"
        draw_mean(out, last, text, rows, "rate", "flow_pressure", **look)
    label(last, RATE, "pressure $p$  [ε/l²]", legend=False)
    out.legend_above(last)
    out.caption = (
        f"Steady flow of {int(table['n'].iloc[0])} droplets and as many disks under drag against the affine flow "
        f"(Stokes, without the stress of the fluid), means over {table['seed'].nunique()} packings with 95 % "
        "intervals. (a), (b) Stress. (c) Pressure. Units of length: of disks their mean diameter, of "
        "droplets the mean of the square roots of their areas at rest."
    )
    return out
