"""Draw the onset of jamming in Boromand et al., fig 10."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import Sample, bootstrap, groups_by, mean_over_packings, select, sizes
from studies.panels import FIT, PAPER, Drawing, drawing, label, model_style, scale, size_style
from studies.papers.boromand.conventions import ONSET_CORRECTION, SIZES, onset_law
from studies.papers.statements import caption, paper, statistic

LEAST = 30  # packings of a density
COLUMN = {"sp": "phi_J", "dp": "rho_J"}


def onsets(tables: EnsembleTables, model: str) -> Sample:
    """Take the onsets of packings of the paper's sizes."""
    return Sample(groups_by(select(tables.onset, model=model), "n", COLUMN[model], SIZES))


_WIDTHS = ({"quartiles": True}, {"first": 1})


@statistic("B10-theta-sp", sample=onsets, model="sp", variants=_WIDTHS)
@statistic("B10-theta-dp", sample=onsets, model="dp", variants=_WIDTHS)
def width_exponent(groups: list[Array], quartiles: bool = False, first: int = 0) -> float:
    """Fit the exponent of the width against N in logarithms, whose error is (2m - 2)^-0.5 for m packings."""
    groups = groups[first:]
    if quartiles:
        widths = [np.subtract(*np.percentile(v, [75, 25])) / 1.349 for v in groups]
    else:
        widths = [v.std(ddof=1) for v in groups]
    weights = np.sqrt([2 * len(v) - 2 for v in groups])
    return -float(np.polyfit(np.log(SIZES[first:]), np.log(widths), 1, w=weights)[0])


_LAWS = ({"correction": 0.6}, {"correction": 0.8}, {"first": 1})


@statistic("B10-onset-sp", sample=onsets, model="sp", variants=_LAWS)
@statistic("B10-onset-dp", sample=onsets, model="dp", variants=_LAWS)
def limit(groups: list[Array], correction: float = ONSET_CORRECTION, first: int = 0) -> float:
    """Extend the mean onset to large packings, with a correction N^-0.7 (O'Hern et al. 2003)."""
    return onset_law(SIZES[first:], groups[first:], correction).limit


def both_models(tables: EnsembleTables, n: int) -> Sample:
    """Take the onsets of disks and of droplets of one size."""
    return Sample([groups_by(select(tables.onset, model=m), "n", c, [n])[0] for m, c in COLUMN.items()])


@statistic("B10-same", sample=both_models, n=32, variants=({"n": 64}, {"n": 128}, {"of": np.median}))
def difference(groups: list[Array], of: Callable[[Array], Any] = np.mean) -> float:
    """Subtract the mean onset of disks from that of droplets."""
    return float(of(groups[1]) - of(groups[0]))


def figure_10(tables: EnsembleTables) -> Drawing:
    """Distributions of onset, their width and mean against N."""
    onset = tables.onset
    out, (left, right, width, mean, contacts, count) = drawing("boromand-10", 3, 2, 5.0, 3.8)
    scale(width)
    for model, axes in (("sp", left), ("dp", right)):
        n = sizes(onset, model)
        groups = groups_by(onset[onset["model"] == model], "n", COLUMN[model], n)
        inset = axes.inset_axes((0.1, 0.55, 0.3, 0.36))
        inset.set_gid(axes.get_gid() + "-inset")
        for size, values in zip(n, groups, strict=True):
            if size not in SIZES or len(values) < LEAST:  # the paper's, on its axes
                continue
            look = size_style(size)
            density, edges = np.histogram(values, bins=max(5, round(len(values) ** 0.5)), density=True)
            seen = np.where(density > 0, density, np.nan)
            out.curve(axes, f"N = {size} ({len(values)})", 0.5 * (edges[1:] + edges[:-1]), seen, **look)
            share = np.arange(1, len(values) + 1) / len(values)
            out.curve(inset, f"N = {size}", np.sort(values), share, color=look["color"], label=None)
        symbol = r"\phi_J" if model == "sp" else r"\rho_J"
        label(axes, f"{model.upper()}: onset ${symbol}$", f"$P({symbol})$", loc="upper right")
        axes.set_xlim(0.74, 0.93)
        inset.tick_params(labelsize=7)
        inset.set_title("$f_J$", fontsize=8, pad=2)
        spread = bootstrap(groups, lambda g: [v.std(ddof=1) if len(v) > 1 else np.nan for v in g])
        for panel, what, found in ((width, "width", spread), (mean, "mean", mean_over_packings(groups))):
            name = f"{model.upper()}: {what}"
            out.curve(panel, name, n, found, band=False, label=model.upper(), **model_style(model))
    theta, large = paper("B10-theta-sp"), paper("B10-onset-sp")
    out.slope(width, -theta, (sizes(onset, "sp")[0], 256), 0.016, rf"$N^{{-{theta}}}$", above=True)
    label(width, "N", r"width of the distribution $\sigma$")
    out.curve(mean, f"paper: large-N limit {large}", [12, 500], [large] * 2, **PAPER)
    mean.set_xscale("log")
    label(mean, "N", "mean onset", loc="lower right")
    _draw_contacts_at_onset(out, contacts, count, onset)
    out.caption = caption(out.name)
    return out


def _draw_contacts_at_onset(out: Drawing, extra: Any, mean: Any, onset: pd.DataFrame) -> None:
    """Draw contacts beyond the isostatic number, and z_J against N."""
    held = onset["n"] - onset["rattlers"]
    table = onset.assign(extra=(0.5 * onset["z_J"] * held - (2 * held - 1)).round()).dropna(subset=["z_J"])
    for model in ("sp", "dp"):
        n, name, look = sizes(table, model), model.upper(), model_style(model)
        of_model = table[table["model"] == model]
        largest = [size for size in n if (of_model["n"] == size).sum() >= LEAST][-1]
        share = of_model.loc[of_model["n"] == largest, "extra"].value_counts(normalize=True).sort_index()
        out.curve(extra, f"{name}, N = {largest}", share.index, share.to_numpy(), **look | {"linestyle": "-"})
        found = mean_over_packings(groups_by(of_model, "n", "z_J", n))
        out.curve(mean, f"{name}: z_J", n, found, band=False, label=name, **look)
    line, printed = np.geomspace(12, 500, 40), paper("BT-zJ-sp-phi")
    out.curve(mean, "4 - 2/N", line, 4 - 2 / line, **FIT)
    out.curve(mean, f"paper: $z_J$ = {printed}", [12, 500], [printed] * 2, **PAPER)
    mean.set_xscale("log")
    label(extra, r"contacts at onset beyond $2N' - 1$", "share of packings")
    label(mean, "N", r"$z_J$", loc="lower right")
