"""Draw missing contacts below confluence in Boromand et al., figs 7 and 9, and the onset of jamming, fig 10."""

from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import Sample, bootstrap, equivalence_bound, groups_by, limit_of_sizes, mean_over_packings, sizes
from studies.panels import PAPER, Drawing, TextTable, drawing, label, model_style, scale, size_style, write_interval
from studies.papers.boromand.conventions import (
    FRACTIONS,
    LEFT,
    ONSET,
    ONSET_CORRECTION,
    SIZES,
    START,
    SUBTRACTED,
    Curve,
    draw_sizes,
    mean,
    onset_rows,
    onsets,
    table_fit,
)
from studies.papers.statements import caption, paper

LEAST = 30  # packings of a density
BY_SIZE: dict[str, Any] = {"x": "to_confluence", "y": "missing"}


def size_exponent(*drawn: Curve, scaled_distance: float = 1.0) -> float:
    """Fit the exponent of (z_conf - z) N in N where (rho* - rho) N = 1; nearest to rho* it is 2 at every N."""
    n = SIZES[: len(drawn)]
    values = [m * np.interp(scaled_distance / m, x, y) for m, (x, y) in zip(n, drawn, strict=True)]
    return float(np.polyfit(np.log(n), np.log(values), 1)[0])


def at_confluence(tables: EnsembleTables, model: str, n: int, by: str = "z = 6") -> Sample:
    """Take distances from onset of the first states of packings with z >= 6, or of rho = 1."""
    if by == "z = 6":
        return Sample(groups_by(first_full(tables, model), "n", "d_rho", [n]))
    return Sample([1.0 - tables.at_onset(model, n)["rho"].to_numpy(dtype=np.float64)])


def first_full(tables: EnsembleTables, model: str) -> pd.DataFrame:
    """Find the first states of packings with z >= 6."""
    full = tables.states[(tables.states["model"] == model) & (tables.states["z"] >= 6)]
    return full.groupby(["n", "seed"], as_index=False)[["rho", "d_rho"]].min()


def left_at_confluence(tables: EnsembleTables) -> Sample:
    """Take 1 - rho* of droplets, a group a size."""
    return Sample([1 - rho for rho in groups_by(first_full(tables, "dp"), "n", "rho", SIZES)])


def limit_of_confluence(groups: list[Any], without: int = -1) -> float:
    """Extend 1 - rho* linearly in 1/N to large packings."""
    kept = [k for k in range(len(groups)) if k != without]
    return limit_of_sizes([SIZES[k] for k in kept], [groups[k] for k in kept])


def figure_7(tables: EnsembleTables) -> Drawing:
    """z_conf - z against rho* - rho, and both times N."""
    out, axes = drawing("boromand-7", 2, 2, 5.0, 3.9)
    states, reached = tables.states, []
    for model, plain, times_n in (("sp", axes[0], axes[1]), ("dp", axes[2], axes[3])):
        scale(plain, times_n)
        draw_sizes(out, plain, tables, model, **BY_SIZE)
        draw_sizes(out, times_n, tables, model, power=1, **BY_SIZE)
        rows = states[states["model"] == model]
        for n in SIZES:
            seeds = [part.loc[part["n"] == n, "seed"].nunique() for part in (rows[rows["missing"].notna()], rows)]
            reached.append(f"{seeds[0]} of {seeds[1]} {model.upper()} of N = {n}")
        if model == "sp":
            limit = paper("B7-last-contact")
            out.curve(times_n, f"paper: limit {limit:g}", [1e-3, 30], [limit, limit], **PAPER)
        else:
            out.slope(plain, paper("B7-exponent-dp"), (3e-3, 1e-1), 0.02)
        part = paper("B5-z-parts" if model == "dp" else "B5-eq13-ends")
        plain.axvline(rows["rho_star"].mean() - part, color="#777777", linestyle="-.", linewidth=0.9)
        name = model.upper()
        label(plain, rf"{name}: $\rho^* - \rho$", r"$z_{conf} - z$", loc="upper left")
        label(times_n, rf"{name}: $(\rho^* - \rho)\,N$", r"$(z_{conf} - z)\,N$", loc="upper left")
    out.caption = caption(out.name, reached=", ".join(reached))
    return out


def figure_9(tables: EnsembleTables) -> Drawing:
    """Contacts and shape of droplets, which the paper lays over its experiments, and how contacts go to 6."""
    out, (a, b, c) = drawing("boromand-9", 1, 3, 4.6, 4.0)
    scale(c)
    look, name = model_style("dp", linestyle="-"), "DP, N = 64"
    out.curve(a, name, *tables.curve("dp", 64, "rho", "z", FRACTIONS).band, **look)
    onset, fit = paper("BT-rhoJ-dp"), table_fit("DP(ρ)", "z")
    rho = np.linspace(onset + 1e-4, 1.0, 60)
    out.curve(a, "paper: fit of table 1", rho, SUBTRACTED + fit(rho - onset), **PAPER)
    a.axhline(6.0, color="#777777", linewidth=0.9, linestyle=":")
    x, y = tables.curve("dp", 64, "rho", "shape_factor", FRACTIONS).band
    out.curve(b, name, y.value - 1, x, **look)
    out.curve(c, name, *tables.curve("dp", 64, "left", "missing", LEFT).band, **look)
    out.slope(c, paper("B9-exponent-dp"), (8e-3, 0.03), 0.2)
    label(a, r"true packing fraction $\rho$", r"coordination $z$", loc="upper left")
    label(b, r"shape factor $\mathcal{A} - 1$", r"true packing fraction $\rho$", loc="lower right")
    label(c, r"$1 - \rho$", r"$z_{conf} - z$", loc="upper left")
    return out


# onset ----------------------------------------------------------------------------------------------------------------


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
    return limit_of_sizes(SIZES[first:], groups[first:], correction)


def difference(groups: list[Array], of: str = "mean") -> float:
    """Subtract the mean onset of disks from the mean onset of droplets."""
    disks, droplets = (getattr(np, of)(group) for group in groups)
    return float(droplets - disks)


def same_distribution(tables: EnsembleTables) -> TextTable:
    """Compare the mean phi_J of droplets and of disks, size by size, with bounds of equivalence."""
    rows = []
    for n in SIZES:
        sp, dp = onsets(tables, "sp dp", n, "phi_J").groups
        found = bootstrap([sp, dp], difference)
        cells = [f"{mean([sp]):.4f}", f"{mean([dp]):.4f}", write_interval(found, 4), f"{equivalence_bound(found):.4f}"]
        rows.append([f"{n}", f"{len(sp)}", f"{len(dp)}", *cells])
    columns = ("N", "disks", "droplets", "mean phi_J of disks", "of droplets", "difference", "below, at 95 %")
    return TextTable(columns, rows, heading=f"Onset phi_J of disks and of droplets, start {START!r}", words=True)


def figure_10(tables: EnsembleTables) -> Drawing:
    """Distributions of onset, their width and mean against N."""
    out, (left, right, width, means) = drawing("boromand-10", 2, 2, 5.0, 3.8)
    scale(width)
    for model, axes in (("sp", left), ("dp", right)):
        onset = onset_rows(tables, model)
        n = sizes(onset, model)
        groups = groups_by(onset, "n", ONSET[model], n)
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
    out.slope(width, -theta, (sizes(tables.onset, "sp")[0], 256), 0.016, rf"$N^{{-{theta}}}$", above=True)
    label(width, "number of particles $N$", r"width of the distribution $\sigma$")
    out.curve(means, f"paper: large-N limit {large}", [12, 500], [large] * 2, **PAPER)
    means.set_xscale("log")
    label(means, "number of particles $N$", "mean onset", loc="lower right")
    out.text = [same_distribution(tables)]
    return out
