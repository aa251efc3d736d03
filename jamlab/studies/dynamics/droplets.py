"""Draw the steady flow of droplets beside that of disks at the same packing fraction, under drag against the flow."""

from itertools import product
from typing import Any

import pandas as pd

from jamlab.errors import InputError
from jamlab.plotting.palette import MODEL_STYLE
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.flow_rows import RATE, by_packing, mean_over_packings
from jamlab.studies.panels import Drawing, drawing, label, model_style, scale


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
            rows = table[(table["rho"] == rho) & (table["model"] == model)]
            _draw_means(out, part, rows, "stress", MODEL_STYLE[model]["label"], model_style(model, linestyle="-"))
        text = rf"shear stress $\sigma$ at $\rho$ = {rho:.2f}  [ε/l²]"
        label(part, RATE, text, legend=False)
    last = axes[-1]
    scale(last)
    for model, (rho, line) in product(MODEL_STYLE, zip(fractions, ("-", "--", ":"), strict=False)):
        rows = table[(table["rho"] == rho) & (table["model"] == model)]
        text = rf"{MODEL_STYLE[model]['label']}, $\rho$ = {rho:.2f}"
        _draw_means(out, last, rows, "flow_pressure", text, model_style(model, linestyle=line))
    label(last, RATE, "pressure $p$  [ε/l²]", legend=False)
    handles, names = last.get_legend_handles_labels()
    out.figure.legend(handles, names, loc="outside upper center", ncols=len(names), fontsize=9, frameon=False)
    out.caption = (
        f"Steady flow of {int(table['n'].iloc[0])} droplets and as many disks under drag against the affine flow "
        f"(Stokes, without the stress of the fluid), means over {table['seed'].nunique()} packings with 95 % "
        "intervals. (a), (b) Stress. (c) Pressure. Units of length: of disks their mean diameter, of "
        "droplets the mean of the square roots of their areas at rest."
    )
    return out


def _draw_means(out: Drawing, axes: Any, rows: pd.DataFrame, column: str, text: str, look: dict[str, Any]) -> None:
    rate, values = by_packing(rows, "rate", column)
    mean = mean_over_packings(values)
    out.curve(axes, text, rate, mean.value, mean.low, mean.high, band=False, **look)
