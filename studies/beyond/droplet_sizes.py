"""Draw how z, G and the onset of droplets depend on their number, each size weighted by its packings."""

from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import InputError, StorageError
from studies.ensemble_tables import EnsembleTables, droplets_with, values_of
from studies.ensembles import (
    FEWEST,
    Ensemble,
    at_places,
    average,
    bootstrap,
    ensemble,
    groups_by,
    interpolators,
    mean_curve,
    mean_over_packings,
    select,
    size_law,
    sizes,
)
from studies.panels import FIT, Drawing, drawing, label, scale, size_style, style
from studies.papers.boromand.conventions import NEAR, ONSET_CORRECTION, onset_law
from studies.papers.statements import caption

DISTANCES = {"d_z": (1e-3, 1e-2, 0.03, 0.1), "g": (1e-2, 0.03, 0.1, 0.14)}  # from onset, in rho
WORDS = {"d_z": "z - z_J", "g": "G"}
CROSSING, UNSTABLE = "drho of four more contacts", "share with G < 0 at drho = 0.01"
LIMIT = "onset in the limit of many droplets"
FEW = 4.0  # contacts beyond those at onset, where their number begins to grow as that of large packings


def droplet_sizes(tables: EnsembleTables) -> Drawing:
    """Finite size of droplets: z - z_J and G at fixed distances, crossover, unstable boxes, onset and its width."""
    states, onset = select(_states(tables), n=[16, 32, 64, 128]), select(_onsets(tables), n=[16, 32, 64, 128, 256])
    n = sizes(onset, "dp")
    if len(n) < 2:
        raise InputError(f"droplets of {len(n)} size with onsets: it takes two; use the reference data")
    out, axes = drawing("beyond-droplet-sizes", 2, 3, 4.7, 3.8)
    for part, column in zip(axes, DISTANCES, strict=False):
        _draw_limits(out, part, states, column)
    _draw_crossover(out, axes[2], states)
    _draw_unstable(out, axes[3], states)
    _draw_onset(out, axes[4], onset, n)
    _draw_width(out, axes[5], onset, n)
    for name, table in (("packings compressed", states), ("packings at onset", onset)):
        counts = table[table["model"] == "dp"].groupby("n")["seed"].nunique()
        out.keep(name, counts.tolist(), N=counts.index)
    out.caption = caption(out.name, few=FEW, correction=ONSET_CORRECTION)
    return out


def _more(tables: EnsembleTables) -> pd.DataFrame:
    """Select states of droplets of the usual law in the campaign beyond the papers; none where it has not run."""
    try:
        return droplets_with(tables.droplet_states)
    except (InputError, StorageError, KeyError):
        return pd.DataFrame(columns=["model", "n", "seed", "state", "rho", "d_rho", "d_z", "g", "rho_J"])


def _states(tables: EnsembleTables) -> pd.DataFrame:
    """Select states of droplets that were compressed, of each size from where it has more packings."""
    droplets = tables.states[tables.states["model"] == "dp"]
    followed = droplets.groupby(["n", "seed"])["state"].transform("size") > 1  # not to onset alone
    return _of_more_packings(droplets[followed], _more(tables))


def _onsets(tables: EnsembleTables) -> pd.DataFrame:
    """Select onsets of droplets, of each size from where it has more packings."""
    more = _more(tables)
    return _of_more_packings(tables.onset[tables.onset["model"] == "dp"], more[more["state"] == 0])


def _of_more_packings(first: pd.DataFrame, second: pd.DataFrame) -> pd.DataFrame:
    shared = [column for column in first.columns if column in second.columns]
    parts = []
    for n in sorted({*first["n"], *second["n"]}):
        found = max((first[first["n"] == n], second[second["n"] == n]), key=lambda part: part["seed"].nunique())
        if found["seed"].nunique() >= FEWEST:
            parts.append(found[shared])
    return pd.concat(parts, ignore_index=True) if parts else first[shared]


def _draw_limits(out: Drawing, axes: Any, states: pd.DataFrame, column: str) -> None:
    scale(axes, x="linear")
    n = sizes(states, "dp")
    curves = [interpolators(states[states["n"] == m], "d_rho", [column], False) for m in n]
    for k, d in enumerate(DISTANCES[column]):
        groups = [at_places(each, [d]).y[:, 0] for each in curves]
        kept = [(m, g[np.isfinite(g)]) for m, g in zip(n, groups, strict=True) if np.isfinite(g).sum() >= FEWEST]
        if len(kept) < 2:
            continue
        held, values = [m for m, _ in kept], [g for _, g in kept]
        limit = bootstrap(values, partial(size_law, held))
        x, look, name = 1 / np.array(held), style(k), rf"$\Delta\rho$ = {d:g}"
        out.curve(axes, name, x, mean_over_packings(values), band=False, linestyle="none", **look)
        ends, thin = np.array([0.0, x.max()]), {"label": None, "color": look["color"], "linewidth": 0.9}
        out.curve(axes, f"line to the limit, {name}", ends, limit.value[0] + limit.value[1] * ends, **thin)
        out.keep(f"{WORDS[column]}, limit", [limit[0]], drho=[d])
    symbol = r"$z - z_J$" if column == "d_z" else r"$G$  [ε/l²]"
    low, high = axes.get_ylim()
    axes.set_ylim(low, high * (high / low) ** 0.35)
    label(axes, "1/N", symbol, loc="upper left", ncols=2)


def _draw_crossover(out: Drawing, axes: Any, states: pd.DataFrame) -> None:
    """Draw contacts beyond those at onset over the distance, and keep where there are a few."""
    n = sizes(states, "dp")
    scale(axes)
    groups = []
    for m in n:
        e = ensemble(states, "dp", m, "d_rho", "d_z", NEAR)
        more = Ensemble(e.x, 0.5 * m * e.y)
        out.curve(axes, f"N = {m}", *more.band, **size_style(m))
        groups.append(more.curves)
    axes.axhline(FEW, color="#777777", linewidth=0.9, linestyle="--")
    axes.set_ylim(0.05, None)
    label(axes, r"$\Delta\rho$", r"contacts beyond onset, $(z - z_J)\,N/2$", loc="upper left")
    out.keep(CROSSING, [bootstrap([g], lambda drawn: _crossing(drawn[0])) for g in groups], N=n)
    weights = [len(g) ** 0.5 for g in groups]

    def exponent(drawn: list[Array]) -> float:
        return -float(np.polyfit(np.log(n), np.log([_crossing(g) for g in drawn]), 1, w=weights)[0])

    out.keep("a", bootstrap(groups, exponent))


def _crossing(curve: Array) -> float:
    """Find the distance at which the mean of (packings, places, 2) first exceeds `FEW`."""
    x, y = mean_curve(curve)
    above = int(np.argmax(y > FEW))
    if not above:
        return float("nan")
    ends = slice(above - 1, above + 1)
    return float(np.exp(np.interp(FEW, y[ends], np.log(x[ends]))))


def _draw_unstable(out: Drawing, axes: Any, states: pd.DataFrame) -> None:
    """Draw the share of packings whose fixed box would shear by itself, over the distance from onset."""
    scale(axes, y="linear")
    for m in sizes(states, "dp"):
        e = ensemble(states, "dp", m, "d_rho", "g", NEAR)
        x, share = Ensemble(e.x, np.where(np.isfinite(e.y), e.y < 0, np.nan)).band
        out.curve(axes, f"N = {m}", x, share, **size_style(m))
        out.keep(UNSTABLE, [share[int(np.abs(average(e.x) - 1e-2).argmin())]], N=[m])
    axes.set_ylim(0, None)
    label(axes, r"$\Delta\rho$", r"share with $G < 0$", loc="upper left")


def _draw_onset(out: Drawing, axes: Any, onset: pd.DataFrame, n: list[int]) -> None:
    groups = groups_by(onset, "n", "rho_J", n)
    out.curve(axes, "mean", n, mean_over_packings(groups), band=False, linestyle="none", label=None, **style(1))
    axes.set_xscale("log")
    label(axes, "N", r"mean onset $\rho_J$", legend=False)
    axes.set_xticks(n, [str(m) for m in n])
    if len(n) < 3:
        return
    out.keep(LIMIT, bootstrap(groups, lambda g: onset_law(n, g).limit))
    line = np.geomspace(n[0], 4 * n[-1], 40)
    out.curve(axes, "law", line, onset_law(n, groups)(line), label=None, **FIT)


def _draw_width(out: Drawing, axes: Any, onset: pd.DataFrame, n: list[int]) -> None:
    groups = groups_by(onset, "n", "rho_J", n)
    scale(axes)
    width = bootstrap(groups, lambda g: [v.std(ddof=1) for v in g])
    out.curve(axes, "width", n, width, band=False, linestyle="none", label=None, **style(1))
    weights = np.sqrt([len(g) - 1 for g in groups])  # of ln of a standard deviation

    def fit(g: list[Array]) -> Array:
        return np.asarray(np.polyfit(np.log(n), np.log([v.std(ddof=1) for v in g]), 1, w=weights))

    out.keep("theta", bootstrap(groups, lambda g: -fit(g)[0]))
    slope, front = fit(groups)
    line = np.geomspace(n[0], n[-1], 20)
    out.curve(axes, "law", line, np.exp(front) * line**slope, label=None, **FIT)
    label(axes, "N", r"width of onsets $\sigma$", legend=False)
    axes.set_xticks(n, [str(m) for m in n])


PLACES = np.arange(0.01, 0.17, 0.01)  # distances from onset
COMPARED = 0.1  # distance at which the limit is taken
QUANTITIES = {"z": "coordination z", "g": r"$G$  [ε/l²]", "excess": r"$\mathcal{A} - \mathcal{A}_J$"}
BY_VERTICES = {"z": "z", "g": "G", "excess": "A - A_J"}


def droplet_vertices(tables: EnsembleTables) -> Drawing:
    """z, G and A of droplets over the distance to onset for more and more vertices, and their limit of many."""
    table = tables.droplet_states
    several = table.groupby("n")["nv_small"].nunique()
    n = int(
        several.index.to_numpy()[several.to_numpy().argmax()]
    )  # the smallest of those with the most numbers of vertices
    table = table[table["n"] == n]
    vertices = values_of(table, "nv_small")
    if len(vertices) < 2:
        raise InputError("the table droplet_states has no two numbers of vertices: run the campaign beyond_the_papers")
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
    made = {nv: droplets_with(table, nv_small=nv)["seed"].nunique() for nv in vertices}
    counts = ", ".join(f"{packings} with {_name(nv)}" for nv, packings in made.items())
    out.caption = caption(out.name, n=n, counts=counts, at=COMPARED)
    return out


def _name(nv: float) -> str:
    return f"{nv:.0f}, {round(17 / 12 * nv):.0f} vertices"


def _draw_limit(out: Drawing, axes: Any, vertices: list[float], groups: list[Array], column: str) -> None:
    """Draw means at one distance over the inverse number of vertices, with a line to zero, and keep its end."""
    x = 1 / np.array(vertices)
    mean = mean_over_packings(groups)
    limit = bootstrap(groups, partial(size_law, vertices))
    for k, nv in enumerate(vertices):
        out.curve(axes, _name(nv), x[k], mean[k], band=False, label=None, linestyle="none", **style(k))
    ends = np.array([0.0, x.max()])
    out.curve(axes, "line", ends, limit.value[0] + limit.value[1] * ends, label=None, **FIT)
    label(axes, r"1/vertices of small droplets", rf"{QUANTITIES[column]} at $\Delta\rho$ = {COMPARED:g}", legend=False)
    out.keep(f"{BY_VERTICES[column]}, limit", limit[0])
    change = bootstrap([groups[0], groups[-1]], lambda g: g[1].mean() - g[0].mean())
    out.keep(f"{BY_VERTICES[column]}, {vertices[-1]:.0f} less {vertices[0]:.0f} vertices", change)


FIGURES = {"beyond-droplet-sizes": droplet_sizes, "beyond-droplet-vertices": droplet_vertices}
