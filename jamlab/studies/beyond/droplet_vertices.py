"""Draw z, G, A and voids of droplets in the limit of many vertices."""

from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.studies.droplet_tables import droplets_with, values_of
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.ensembles import bootstrap, ensemble, line_in_inverse, mean_over_packings
from jamlab.studies.panels import FIT, Drawing, drawing, label, style

PLACES = np.arange(0.01, 0.17, 0.01)  # distances from onset
COMPARED = 0.1  # distance at which the limit is taken
QUANTITIES = {"z": "coordination z", "g": r"$G$  [ε/l²]", "excess": r"$\mathcal{A} - \mathcal{A}_J$"}
WORDS = {"z": "z", "g": "G", "excess": "A - A_J"}


def droplet_vertices(tables: EnsembleTables) -> Drawing:
    """z, G and A of droplets over the distance to onset for more and more vertices, and their limit of many."""
    table = _of_smallest_size(tables.droplet_states)
    vertices = values_of(table, "nv_small")
    if len(vertices) < 2:
        raise InputError("the table droplet_states has no two numbers of vertices: run the campaign beyond_the_papers")
    n = int(table["n"].iloc[0])
    out, axes = drawing("beyond-droplet-vertices", 2, 3, 4.6, 3.7)
    for k, column in enumerate(QUANTITIES):
        groups = []
        for index, nv in enumerate(vertices):
            e = ensemble(droplets_with(table, nv_small=nv), "dp", n, "d_rho", column, PLACES)
            x, y = e.band
            out.curve(axes[k], _name(nv), x, y, **style(index))
            at = int(np.abs(x - COMPARED).argmin())
            groups.append(e.y[np.isfinite(e.y[:, at]), at])
        label(axes[k], r"$\Delta\rho$", QUANTITIES[column], loc="upper left")
        _draw_limit(out, axes[3 + k], vertices, groups, column)
    ends = f"{vertices[-1]:.0f} less {vertices[0]:.0f} vertices"
    limits = [(word, out.write(f"{word}, limit", 3), out.write(f"{word}, {ends}", 3)) for word in WORDS.values()]
    said = ", ".join(f"{word} {limit} ({ends}: {change})" for word, limit, change in limits)
    counts = ", ".join(f"{_packings(table, nv)} with {_name(nv)}" for nv in vertices)
    out.caption = (
        f"{n} droplets with more and more vertices (of small and of large ones), packings: {counts}; 95 % bands and "
        f"bars. Below: the same at a distance of {COMPARED:g} from onset over the inverse number of vertices of small "
        f"droplets, with a line, each mean weighted by its error; limit of many vertices: {said}."
    )
    return out


def _of_smallest_size(table: pd.DataFrame) -> pd.DataFrame:
    """Select the size of which there are droplets with several numbers of vertices."""
    several = table.groupby("n")["nv_small"].nunique()
    rows: pd.DataFrame = table.loc[table["n"] == several.index.to_numpy()[several.to_numpy().argmax()]]
    return rows


def _packings(table: pd.DataFrame, nv: float) -> int:
    return int(droplets_with(table, nv_small=nv)["seed"].nunique())


def _name(nv: float) -> str:
    return f"{nv:.0f}, {round(17 / 12 * nv):.0f} vertices"


def _draw_limit(out: Drawing, axes: Any, vertices: list[float], groups: list[Array], column: str) -> None:
    """Draw means at one distance over the inverse number of vertices, with a line to zero, and keep its end."""
    x = 1 / np.array(vertices)
    mean = mean_over_packings(groups)
    limit = bootstrap(groups, partial(line_in_inverse, vertices))
    for k, nv in enumerate(vertices):
        out.curve(axes, _name(nv), x[k], mean[k], band=False, label=None, linestyle="none", **style(k))
    ends = np.array([0.0, x.max()])
    out.curve(axes, "line", ends, limit.value[0] + limit.value[1] * ends, label=None, **FIT)
    label(axes, r"1/vertices of small droplets", rf"{QUANTITIES[column]} at $\Delta\rho$ = {COMPARED:g}", legend=False)
    out.keep(f"{WORDS[column]}, limit", limit[0])
    change = bootstrap([groups[0], groups[-1]], lambda g: g[1].mean() - g[0].mean())
    out.keep(f"{WORDS[column]}, {vertices[-1]:.0f} less {vertices[0]:.0f} vertices", change)
