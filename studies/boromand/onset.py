"""Draw the onset of jamming in Boromand et al., fig 10."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from scipy.special import kolmogorov

from jamlab.arrays import Array
from studies import published_numbers as published
from studies.claims import write_by, write_interval, write_list
from studies.conventions import SIZES, onset_law
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import (
    bootstrap,
    enough,
    groups_by,
    has,
    mean_over_packings,
    sampled_sizes,
    sizes,
    vary_bootstrap,
)
from studies.panels import FIT, PAPER, Drawing, drawing, label, model_style, scale, size_style

_MANY = 100  # packings of a size that tell a difference of means of a tenth of the width


def figure_10(tables: EnsembleTables) -> Drawing:
    """Distributions of onset, their width and mean against N."""
    onset = tables.onset
    out, (left, right, width, mean, contacts, count) = drawing("boromand-10", 3, 2, 5.0, 3.8)
    scale(width)
    groups: dict[str, list[Array]] = {}
    for model, axes, column in (("sp", left, "phi_J"), ("dp", right, "rho_J")):
        part = onset[onset["model"] == model]
        if part.empty:
            axes.text(0.5, 0.5, f"no {model.upper()} packings", ha="center", transform=axes.transAxes)
            label(axes, r"$\rho_J$", r"$P(\rho_J)$", legend=False)
            continue
        n = sizes(onset, model)
        groups[model] = groups_by(part, "n", column, n)
        inset = axes.inset_axes((0.1, 0.55, 0.3, 0.36))
        inset.set_gid(axes.get_gid() + "-inset")
        for size, values in zip(n, groups[model], strict=True):
            if size not in SIZES and set(n) & set(SIZES):  # the paper's, on its axes
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
        spread = bootstrap(groups[model], lambda g: [v.std(ddof=1) if len(v) > 1 else np.nan for v in g])
        centre = mean_over_packings(groups[model])
        for panel, what, found in ((width, "width", spread), (mean, "mean", centre)):
            name = f"{model.upper()}: {what}"
            out.curve(panel, name, n, found, band=False, label=model.upper(), **model_style(model))
        sampled = sampled_sizes(onset, model)
        _claim_onset(out, model, sampled, [groups[model][n.index(m)] for m in sampled])
    _claim_same_onsets(out, onset)
    first = sizes(onset, "sp" if has(onset, "sp") else "dp")[0]
    out.slope(width, -published.THETA.value, (first, 256), 0.012, rf"$N^{{-{published.THETA.value}}}$")
    label(width, "N", r"width of the distribution $\sigma$")
    limit = published.ONSET_LIMIT.value
    out.curve(mean, f"paper: large-N limit {limit}", [12, 500], [limit] * 2, **PAPER)
    mean.set_xscale("log")
    label(mean, "N", "mean onset", loc="lower right")
    _draw_contacts_at_onset(out, contacts, count, onset)
    out.caption = (
        "Onset of jamming: densities (insets: share jammed at or below), width and mean against N, with 95 % bars. "
        "Not in the paper: (e) contacts at onset beyond the isostatic 2N' - 1, where disks have none and droplets "
        "scatter; (f) z_J against N with 4 - 2/N (full) and the 3.97 of the paper's table."
    )
    return out


def _draw_contacts_at_onset(out: Drawing, extra: Any, mean: Any, onset: pd.DataFrame) -> None:
    """Draw contacts beyond the isostatic number, and z_J against N."""
    held = onset["n"] - onset["rattlers"]
    table = onset.assign(extra=(0.5 * onset["z_J"] * held - (2 * held - 1)).round()).dropna(subset=["z_J"])
    for model in ("sp", "dp"):
        n = sizes(table, model)
        if not n:
            continue
        name, look = model.upper(), model_style(model)
        last = table[(table["model"] == model) & (table["n"] == n[-1])]["extra"]
        share = last.value_counts(normalize=True).sort_index()
        out.curve(extra, f"{name}, N = {n[-1]}", share.index, share.to_numpy(), **look | {"linestyle": "-"})
        found = mean_over_packings(groups_by(table[table["model"] == model], "n", "z_J", n))
        out.curve(mean, f"{name}: z_J", n, found, band=False, label=name, **look)
    line = np.geomspace(12, 500, 40)
    out.curve(mean, "4 - 2/N", line, 4 - 2 / line, **FIT)
    paper = published.TABLE_1["SP(φ)"][0]
    out.curve(mean, f"paper: $z_J$ = {paper}", [12, 500], [paper] * 2, **PAPER)
    mean.set_xscale("log")
    label(extra, r"contacts at onset beyond $2N' - 1$", "share of packings")
    label(mean, "N", r"$z_J$", loc="lower right")


def _claim_onset(out: Drawing, model: str, n: list[int], groups: list[Array]) -> None:
    """Claim theta and the limit of large packings, at the paper's sizes; those of all sizes are kept beside them."""
    big = model.upper()
    theta = limit = of_theta = of_limit = None
    how = of_width = "needs two sizes with three packings or more"
    if len(n) > 1 and min(len(g) for g in groups) > 2:
        how = of_width = f"N = {write_list(n)}"
        same = [k for k, size in enumerate(n) if size in SIZES]
        kept, groups_kept = n, groups
        if 1 < len(same) < len(n):  # "matched N"
            kept, groups_kept = [n[k] for k in same], [groups[k] for k in same]
            every_theta = out.keep(f"theta of all sizes, {big}", bootstrap(groups, lambda g: _width_exponent(n, g)))
            whole = bootstrap(groups, lambda g: onset_law(n, g).limit)
            out.keep(f"onset in the large-N limit of all sizes, {big}", whole)
            matched, beyond = f"N = {write_list(kept)} of the paper's", f"with all, {n[0]} to {n[-1]},"
            of_width = f"{matched}; {beyond} {every_theta.value:.2f}"
            how = f"{matched}; {beyond} {write_interval(whole, 4)}"
        windows = ({"of": "quartiles"}, {"first": 1})
        theta, of_theta = vary_bootstrap(groups_kept, partial(_width_exponent, kept), *windows)
        laws: tuple[dict[str, float], ...] = ({"correction": 0.6}, {"correction": 0.8}, {"first": 1})
        limit, of_limit = vary_bootstrap(groups_kept, partial(_limit, kept), *laws)
        how += f", correction N^-{published.ONSET_CORRECTION} (O'Hern et al. 2003)"
    widths = [v.std(ddof=1) if len(v) > 1 else np.nan for v in groups]
    rise = out.keep(f"theta to the next size, {big}", -np.diff(np.log(widths)) / np.diff(np.log(n)), N=n[:-1])
    cause = f"from size to size it is {write_list(rise, '.2f')} (N = {write_list(n)})"
    words = {"how": of_width, "cause": cause, "shown_by": "boromand-10 c"}
    out.claim(f"theta: sigma ~ N^-theta, {big}", theta, published.THETA, family=of_theta, **words)
    ends = out.keep(f"mean onset, {big}", [g.mean() for g in groups], N=n)
    cause = f"N = {n[-1]} jams at {ends[-1]:.4f}, N = {n[0]} at {ends[0]:.4f}"
    words = {"how": how, "cause": cause, "shown_by": "boromand-10 d"}
    text = f"onset in the large-N limit, {big}"
    out.claim(text, limit, published.ONSET_LIMIT, family=of_limit, **words)


def _limit(n: list[int], groups: list[Array], correction: float | None = None, first: int = 0) -> float:
    return onset_law(n[first:], groups[first:], correction).limit


def _claim_same_onsets(out: Drawing, onset: pd.DataFrame) -> None:
    """Claim how far the mean onsets of both models lie apart, at the smallest N; its family holds medians and the other
    sizes."""
    sp, dp = (enough(onset[onset["model"] == model], "n", _MANY) for model in ("sp", "dp"))
    n = [m for m in sp if m in dp and m in SIZES]
    groups = {
        m: [groups_by(onset[onset["model"] == x], "n", c, [m])[0] for x, c in (("sp", "phi_J"), ("dp", "rho_J"))]
        for m in n
    }

    def apart(groups: list[Array], of: Callable[[Array], Any] = np.mean) -> float:
        return float(of(groups[1]) - of(groups[0]))

    each = {m: bootstrap(two, apart) for m, two in groups.items()}
    out.keep("mean rho_J of DP less phi_J of SP", list(each.values()), N=n)
    same = out.keep("Kolmogorov-Smirnov p of onsets, DP and SP", [_same_distribution(*groups[m]) for m in n], N=n)
    found, every, how = None, {}, f"needs {_MANY} onsets of both models at one N"
    if n:
        found, how = each[n[0]], f"N = {n[0]}"
        every = {f"N = {m}": each[m] for m in n[1:]}
        every["medians"] = bootstrap(groups[n[0]], partial(apart, of=np.median))
    by_size = write_by(dict(zip(n, same, strict=True)), ".2g")
    words = {"how": how, "cause": f"both have one distribution with p = {by_size} (Kolmogorov-Smirnov)"}
    out.claim("mean onset, DP less SP", found, published.SAME_ONSETS, family=every, **words, shown_by="boromand-10 d")


def _same_distribution(a: Array, b: Array) -> float:
    """Compute the probability of such a distance or more between two samples of one distribution, for large samples."""
    both = np.concatenate([a, b])
    shares = [np.searchsorted(np.sort(part), both, side="right") / len(part) for part in (a, b)]
    return float(kolmogorov(np.abs(shares[0] - shares[1]).max() / (1 / len(a) + 1 / len(b)) ** 0.5))


def _width_exponent(n: list[int], groups: list[Array], of: str = "variance", first: int = 0) -> float:
    """Fit the exponent of the width against N in logarithms, whose error is (2m - 2)^-0.5 for m packings."""
    n, groups = n[first:], groups[first:]
    if of == "quartiles":
        widths = [np.subtract(*np.percentile(v, [75, 25])) / 1.349 for v in groups]
    else:
        widths = [v.std(ddof=1) for v in groups]
    weights = np.sqrt([2 * len(v) - 2 for v in groups])
    return -float(np.polyfit(np.log(n), np.log(widths), 1, w=weights)[0])
