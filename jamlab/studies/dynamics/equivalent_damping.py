"""Draw where the equivalent linear damping of Baumgarten & Tighe, eqs 23-29, holds, and where not."""

from typing import Any

import numpy as np
import pandas as pd

from jamlab.errors import InputError
from jamlab.plotting.palette import BLACK
from jamlab.studies.dynamics.steady_flows import mean_of_rows
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.ensembles import select_usual
from jamlab.studies.panels import FREQUENCY, Drawing, drawing, label, scale, sequence

PARTS = {"storage": "G'", "loss": "G''"}
ALLOWED = 10.0  # %


def equivalent_damping(tables: EnsembleTables) -> Drawing:
    """Error of the equivalent linear damping against frequency and the power of the drag."""
    table = _small_oscillations(tables.oscillation)
    powers = sorted(table["alpha"].unique())
    out, (grid, *parts) = drawing("dynamics-equivalent-damping", 1, 3, 4.8, 4.0)
    scale(grid, y="linear")
    said = []
    for axes, (part, name) in zip(parts, PARTS.items(), strict=True):
        scale(axes, y="linear")
        for k, alpha in enumerate(powers):
            rows = table[table["alpha"] == alpha]
            omega, mean = mean_of_rows(rows, "omega", f"{part}_error")
            x = mean_of_rows(rows, "omega", "reduced")[1].value
            text = rf"$\alpha$ = {alpha:.2f}"
            out.curve(axes, text, x, mean, band=False, **sequence(k, len(powers)))
            out.keep(f"error of {name} in percent, alpha = {alpha:.2f}", mean, omega=omega)
            said.append(f"{name} at alpha {alpha:.2f}: {round(mean.value.min())} to {round(mean.value.max())}")
        axes.axhspan(-ALLOWED, ALLOWED, color="#999999", alpha=0.15, linewidth=0)
        axes.axhline(0.0, color=BLACK, linewidth=0.8)
        label(axes, r"$\omega\,\tau_\alpha$", f"error of {name}  [%]", legend=part == "storage")
    _draw_map(out, grid, table)
    label(grid, FREQUENCY, r"power $\alpha$ of the drag", legend=False)
    first = table.iloc[0]
    out.caption = (
        f"{int(first['n'])} disks at pressure {first['target_pressure']:g} k, {table['seed'].nunique()} packings: "
        "error of G* by the equivalent linear damping of Baumgarten & Tighe, eqs 23-29, against the drag law itself "
        f"at strain amplitude {first['amplitude']:g}. (a) Error of |G*| in percent, against frequency and alpha. (b), "
        "(c) Error of the storage and loss modulus over frequency times the equivalent time; grey, 10 %; 95 % "
        "intervals. Linear drag is the check: its error is that of finite amplitude. "
        f"In percent: {'; '.join(said)}."
    )
    return out


def _small_oscillations(table: pd.DataFrame) -> pd.DataFrame:
    """Select rows at the amplitude at which powers were measured, with errors in percent."""
    bent = table[table["alpha"] < 1]
    if bent.empty:
        raise InputError("the table oscillation has no drag with alpha below 1: run a campaign with some")
    settings = ("n", "target_pressure", "amplitude", "background", "tolerance")
    rows = select_usual(table, settings, of=bent).dropna(subset=["equivalent_time"]).round({"alpha": 4})
    for part in PARTS:
        rows[f"{part}_error"] = 100 * (rows[f"equivalent_{part}"] / rows[part] - 1)
    size = np.hypot(rows["equivalent_storage"], rows["equivalent_loss"]) / np.hypot(rows["storage"], rows["loss"])
    return rows.assign(reduced=rows["omega"] * rows["equivalent_time"], size_error=100 * (size - 1))


def _draw_map(out: Drawing, axes: Any, table: pd.DataFrame) -> None:
    mean = table.groupby(["alpha", "omega"], as_index=False)["size_error"].mean()
    span = max(float(mean["size_error"].abs().max()), ALLOWED)
    look = {"c": mean["size_error"], "cmap": "PuOr", "vmin": -span, "vmax": span, "edgecolor": BLACK}
    axes.scatter(mean["omega"], mean["alpha"], s=330, marker="s", linewidth=0.5, **look)
    for alpha, rows in mean.groupby("alpha"):
        out.curve(axes, f"alpha {alpha:.2f}", rows["omega"], np.full(len(rows), alpha), ls="none")
    for _, row in mean.iterrows():
        colour = "white" if abs(row["size_error"]) > 0.6 * span else BLACK
        at = (row["omega"], row["alpha"])
        axes.annotate(f"{round(row['size_error']):+d}", at, ha="center", va="center", fontsize=7.5, color=colour)
    axes.margins(0.1, 0.15)
