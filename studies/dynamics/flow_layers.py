"""Drag that sets in over a thin layer of overlap, beside its limit, which is solved: steps, and change of the stress.

The table was measured once, with explicit steps in plain numpy for the layers; 36 more cells would take over ten CPU
minutes and were left out.
"""

from jamlab.plotting import in_unit
from studies.ensemble_tables import EnsembleTables
from studies.panels import MARKERS, Drawing, drawing, label, scale, sequence
from studies.papers.statements import caption
from studies.study import Study

LAWS = {"linear": (2.0, 1.0), r"$\alpha$ = 1/2": (2.0, 0.5), "linear, Hertz": (2.5, 1.0)}  # exponent, alpha
_START = 1e-4  # layer, mean diameters, that leaves the start-up as it is


def draw_layers(tables: EnsembleTables) -> Drawing:
    """Draw steps over steps of the limit, and the change of the largest stress, against the thickness of the layer."""
    table = tables.read("flow-layers")
    ended = table[table["stopped"] == 0]
    out, (steps, stress) = drawing("flow-layers", 1, 2, 5.2, 4.0)
    scale(steps)
    scale(stress, y="linear")
    sizes = sorted(ended["n"].unique())
    for k, (name, (exponent, alpha)) in enumerate(LAWS.items()):
        for m, n in enumerate(sizes):
            rows = ended[(ended["exponent"] == exponent) & (ended["alpha"] == alpha) & (ended["n"] == n)]
            if rows.empty:
                continue
            look = {**sequence(k, len(LAWS)), "marker": MARKERS[m], "linestyle": "none", "markersize": 5, "alpha": 0.8}
            apart = rows["layer"] * 1.15 ** (k * len(sizes) + m - 4)  # side by side
            out.curve(steps, f"{name}, N = {n}", apart, rows["ratio_high"], **look)
            out.curve(stress, f"{name}, N = {n}", apart, rows["largest_change"], **look)
    steps.axhline(1.0, color="black", linewidth=0.8)
    stress.axhline(0.0, color="black", linewidth=0.8)
    label(steps, in_unit("layer", "mean diameters"), "steps over steps of the limit", legend=False)
    label(stress, in_unit("layer", "mean diameters"), in_unit("change of the largest stress", "%"), loc="lower left")
    thin = ended[(ended["layer"] <= _START) & (ended["exponent"] == LAWS["linear"][0])]
    said = {"cells": len(table), "layer": _START, "low": thin["ratio_low"].min(), "high": thin["ratio_high"].max()}
    said |= {"moved": thin["largest_change"].abs().max(), "drop": -ended["largest_change"].min()}
    out.caption = caption(out.name, **said)
    return out


STUDY = Study("flow-layers", "Drag that sets in over a layer: steps and stress against its limit", {}, draw_layers)
