"""Draw the onset of jamming in Boromand et al., fig 10."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import ks_2samp

from jamlab.arrays import Array
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import bootstrap, groups_by, mean_over_packings, sizes
from studies.html_page import TextTable
from studies.panels import FIT, PAPER, Drawing, drawing, label, model_style, scale, size_style
from studies.papers.boromand.conventions import ONSET, ONSET_CORRECTION, SIZES, mean, onset_law, onsets
from studies.papers.statements import paper, statistic

LEAST = 30  # packings of a density


def width_exponent(groups: list[Array], quartiles: bool = False, first: int = 0) -> float:
    """Fit the exponent of the width against N in logarithms, whose error is (2m - 2)^-0.5 for m packings."""
    groups = groups[first:]
    if quartiles:
        widths = [np.subtract(*np.percentile(v, [75, 25])) / 1.349 for v in groups]
    else:
        widths = [v.std(ddof=1) for v in groups]
    weights = np.sqrt([2 * len(v) - 2 for v in groups])
    return -float(np.polyfit(np.log(SIZES[first:]), np.log(widths), 1, w=weights)[0])


def limit(groups: list[Array], correction: float = ONSET_CORRECTION, first: int = 0) -> float:
    """Extend the mean onset to large packings, with a correction N^-0.7 (O'Hern et al. 2003)."""
    return onset_law(SIZES[first:], groups[first:], correction).limit


for _model in ("sp", "dp"):
    _widths, _laws = ({"quartiles": True}, {"first": 1}), ({"correction": 0.6}, {"correction": 0.8}, {"first": 1})
    statistic(f"B10-theta-{_model}", sample=onsets, models=[_model], n=SIZES, variants=_widths)(width_exponent)
    statistic(f"B10-onset-{_model}", sample=onsets, models=[_model], n=SIZES, variants=_laws)(limit)


_OTHER_N = ({"n": (64,)}, {"n": (128,)}, {"of": np.median})


@statistic("B10-same", sample=onsets, models=("sp", "dp"), n=(32,), variants=_OTHER_N)
def difference(groups: list[Array], of: Callable[[Array], Any] = np.mean) -> float:
    """Subtract the mean onset of disks from that of droplets."""
    return float(of(groups[1]) - of(groups[0]))


def same_distribution(tables: EnsembleTables) -> TextTable:
    """Compare phi_J of droplets with that of disks, size by size, by the test of Kolmogorov and Smirnov."""
    rows = []
    for n in SIZES:
        sp, dp = onsets(tables, ("sp", "dp"), (n,), "phi_J").groups
        test = ks_2samp(sp, dp)
        values = (mean([sp]), mean([dp]), test.statistic, test.pvalue)
        rows.append([f"{n}", f"{len(sp)}", f"{len(dp)}", *(f"{v:.3g}" if v < 0.5 else f"{v:.4f}" for v in values)])
    columns = ("N", "disks", "droplets", "mean phi_J of disks", "of droplets", "largest distance", "p")
    return TextTable(columns, rows, heading="Are onsets phi_J of droplets those of disks?", words=True)


def figure_10(tables: EnsembleTables) -> Drawing:
    """Distributions of onset, their width and mean against N."""
    onset = tables.onset
    out, (left, right, width, means, contacts, count) = drawing("boromand-10", 3, 2, 5.0, 3.8)
    scale(width)
    for model, axes in (("sp", left), ("dp", right)):
        n = sizes(onset, model)
        groups = groups_by(onset[onset["model"] == model], "n", ONSET[model], n)
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
        for panel, what, found in ((width, "width", spread), (means, "mean", mean_over_packings(groups))):
            name = f"{model.upper()}: {what}"
            out.curve(panel, name, n, found, band=False, label=model.upper(), **model_style(model))
    theta, large = paper("B10-theta-sp"), paper("B10-onset-sp")
    out.slope(width, -theta, (sizes(onset, "sp")[0], 256), 0.016, rf"$N^{{-{theta}}}$", above=True)
    label(width, "N", r"width of the distribution $\sigma$")
    out.curve(means, f"paper: large-N limit {large}", [12, 500], [large] * 2, **PAPER)
    means.set_xscale("log")
    label(means, "N", "mean onset", loc="lower right")
    _draw_contacts_at_onset(out, contacts, count, onset)
    out.text = [same_distribution(tables)]
    return out


def _draw_contacts_at_onset(out: Drawing, extra: Any, z: Any, onset: pd.DataFrame) -> None:
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
        out.curve(z, f"{name}: z_J", n, found, band=False, label=name, **look)
    line, printed = np.geomspace(12, 500, 40), paper("BT-zJ-sp-phi")
    out.curve(z, "4 - 2/N", line, 4 - 2 / line, **FIT)
    out.curve(z, f"paper: $z_J$ = {printed}", [12, 500], [printed] * 2, **PAPER)
    z.set_xscale("log")
    label(extra, r"contacts at onset beyond $2N' - 1$", "share of packings")
    label(z, "N", r"$z_J$", loc="lower right")
