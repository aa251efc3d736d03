"""Draw the steady flow of droplets beside that of disks at the same packing fraction, from the table shipped beside.

`dynamics_droplets.csv` holds rows of `jamlab.flow.droplets_beside_disks.flow_rows` for 16 particles;
`tests/flow/benchmark_droplets_beside_disks.py` makes them anew.
"""

from importlib import resources
from itertools import product
from typing import Any

import numpy as np
import pandas as pd

from jamlab.figures.papers.panels import Drawing, drawing, label, model_style, scale
from jamlab.figures.papers.tables import EnsembleTables
from jamlab.plotting.palette import MODEL_STYLE

_RATE = r"rate of shear $\dot\gamma\,\tau_1$"


def read_droplet_flow() -> pd.DataFrame:
    """The table shipped with jamlab."""
    with resources.files("jamlab.figures.papers").joinpath("dynamics_droplets.csv").open("rb") as file:
        return pd.read_csv(file)


def droplets_beside_disks(tables: EnsembleTables) -> Drawing:
    """Flow curves of droplets and disks at the same packing fraction, and their pressure."""
    table = read_droplet_flow()
    fractions = sorted(table["rho"].unique())
    out, axes = drawing("dynamics-droplets", 1, len(fractions) + 1, 4.6, 3.9)
    for part, rho in zip(axes, fractions, strict=False):
        scale(part)
        for model in MODEL_STYLE:
            rows = table[(table["rho"] == rho) & (table["model"] == model)]
            _draw_means(out, part, rows, "stress", MODEL_STYLE[model]["label"], model_style(model, linestyle="-"))
        text = rf"shear stress $\sigma$ at $\rho$ = {rho:.2f}  [ε/l²]"
        label(part, _RATE, text, legend=False)
    last = axes[-1]
    scale(last)
    for model, (rho, line) in product(MODEL_STYLE, zip(fractions, ("-", "--"), strict=True)):
        rows = table[(table["rho"] == rho) & (table["model"] == model)]
        text = rf"{MODEL_STYLE[model]['label']}, $\rho$ = {rho:.2f}"
        _draw_means(out, last, rows, "pressure", text, model_style(model, linestyle=line))
    label(last, _RATE, "pressure $p$  [ε/l²]", legend=False)
    handles, names = last.get_legend_handles_labels()
    out.figure.legend(handles, names, loc="outside upper center", ncols=len(names), fontsize=9, frameon=False)
    out.caption = (
        f"Steady flow of {int(table['n'].iloc[0])} droplets and as many disks under drag against the affine flow "
        f"(Stokes, without the stress of the fluid), means over {table['seed'].nunique()} packings with standard "
        "errors. (a), (b) Stress. (c) Pressure. Units of length: of disks their mean diameter, of "
        "droplets the mean of the square roots of their areas at rest."
    )
    return out


def _draw_means(out: Drawing, axes: Any, rows: pd.DataFrame, column: str, text: str, look: dict[str, Any]) -> None:
    groups = rows.groupby("rate")[column]
    mean = groups.mean()
    error = groups.std(ddof=1).to_numpy() / np.sqrt(groups.count().to_numpy())
    out.curve(axes, text, mean.index.to_numpy(), mean, mean - error, mean + error, band=False, **look)
