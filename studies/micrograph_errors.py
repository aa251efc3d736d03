"""Draw the errors of `jamlab.micrograph` against light, noise, blur, films and size, from a table that ships.

`micrograph-errors.csv` is `error_table` of `tests/support/rendered_pictures.py`, of packings of 64 droplets, seed 2, at
rho 0.84, 0.90 and 0.95; `tests/micrographs/benchmark_error_table.py` makes it anew. Limits of the verdict were set on
that seed and on seed 1; `tests/micrographs/benchmark_degraded_pictures.py` judges others.
"""

from typing import Any

import numpy as np
import pandas as pd

from jamlab.micrographs.picture_numbers import LIMITS
from studies.ensemble_tables import EnsembleTables
from studies.panels import COLOURS, MARKERS, Drawing, drawing, label

LABELS = {
    "light": "dimmest light / brightest",
    "noise": "noise / contrast",
    "blur": "blur (pixels)",
    "film": "width of films (pixels)",
    "radius": "radius (pixels)",
}
QUANTITIES = {
    "count": "error of count",
    "rho": r"error of $\rho$",
    "z": "error of z",
    "shape": r"error of $\mathcal{A}$",
}
RANGE = 2.5  # limits that a panel shows; what lies beyond is drawn at its edge


def micrograph_errors(tables: EnsembleTables) -> Drawing:
    """Errors of micrographs against light, noise, blur, films and size of droplets."""
    table = tables.read("micrograph-errors")
    out, axes = drawing("micrograph-errors", len(QUANTITIES), len(LABELS), 2.9, 2.3)
    for row, (quantity, text) in enumerate(QUANTITIES.items()):
        for column, (parameter, name) in enumerate(LABELS.items()):
            ax = axes[row * len(LABELS) + column]
            _draw(out, ax, table[table["parameter"] == parameter], quantity)
            label(ax, name, text, legend=False)
    out.legend_above(axes[0])
    good, right = table["quality"] == "good", table["right"]
    silent = int((good & ~right).sum())
    out.caption = (
        "Errors (measured minus true) of rendered pictures of 64 droplets, along one parameter at a time. Filled: "
        f"judged good ({good.sum()} of {len(table)}, {silent} of them beyond a limit); open: doubtful. Dashed: limits "
        "of what counts as right, 2 droplets, 0.02 in packing fraction, 0.4 in z, 0.02 in shape factor. Points beyond "
        "the panel stand at its edge."
    )
    return out


def _draw(out: Drawing, ax: Any, table: pd.DataFrame, quantity: str) -> None:
    limit = LIMITS[quantity]
    edge = RANGE * limit
    for k, (state, rows) in enumerate(table.groupby("state")):
        look: dict[str, Any] = {"color": COLOURS[k], "marker": MARKERS[k], "linestyle": "none"}
        errors = np.clip(rows[quantity].to_numpy(), -edge, edge)
        for quality, fill in (("good", "full"), ("doubtful", "none")):
            chosen = (rows["quality"] == quality).to_numpy()
            name = f"ρ = {state:.2f}, {quality}"
            out.curve(ax, name, rows["value"].to_numpy()[chosen], errors[chosen], fillstyle=fill, **look)
    for height in (-limit, limit):
        ax.axhline(height, color="#777777", linestyle="--", linewidth=0.8)
    ax.axhline(0, color="#777777", linewidth=0.6)
    ax.set_ylim(-1.15 * edge, 1.15 * edge)
