"""Draw the onset of jamming in Boromand et al., fig 10."""

from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.statistics import published_numbers as published
from jamlab.statistics.power_laws import finite_size, power_law
from jamlab.studies import conventions
from jamlab.studies.claims import Claim, claim
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.ensembles import bootstrap, groups_by, has, sampled_sizes, sizes
from jamlab.studies.panels import FIT, PAPER, Drawing, drawing, label, model_style, scale, size_style


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
        inset = axes.inset_axes((0.09, 0.56, 0.36, 0.36))
        inset.set_gid(axes.get_gid() + "-inset")
        for size, values in zip(n, groups[model], strict=True):
            look = size_style(size)
            density, edges = np.histogram(values, bins=max(5, round(len(values) ** 0.5)), density=True)
            seen = np.where(density > 0, density, np.nan)
            out.curve(axes, f"N = {size} ({len(values)})", 0.5 * (edges[1:] + edges[:-1]), seen, **look)
            share = np.arange(1, len(values) + 1) / len(values)
            out.curve(inset, f"N = {size}", np.sort(values), share, color=look["color"], label=None)
        symbol = r"\phi_J" if model == "sp" else r"\rho_J"
        label(axes, f"{model.upper()}: onset ${symbol}$", f"$P({symbol})$", loc="upper right")
        scale(axes, "linear", "log")  # of 16 and of 1024 particles in one panel
        low, high = axes.get_ylim()
        axes.set_ylim(low, high * (high / low) ** 1.1)
        inset.tick_params(labelsize=7)
        inset.set_title("$f_J$", fontsize=8, pad=2)
        spread = bootstrap(groups[model], lambda g: [v.std(ddof=1) if len(v) > 1 else np.nan for v in g])
        centre = bootstrap(groups[model], lambda g: [v.mean() for v in g])
        for axes_, what, found in ((width, "width", spread), (mean, "mean", centre)):
            ends = (found.value, found.low, found.high)
            out.curve(
                axes_, f"{model.upper()}: {what}", n, *ends, band=False, label=model.upper(), **model_style(model)
            )
        sampled = sampled_sizes(onset, model)
        out.claims += _onset_claims(out.name, model, sampled, [groups[model][n.index(m)] for m in sampled])
    first = sizes(onset, "sp" if has(onset, "sp") else "dp")[0]
    out.slope(width, -published.THETA.value, (first, 256), 0.012, rf"$N^{{-{published.THETA.value}}}$")
    label(width, "N", r"width of the distribution $\sigma$")
    out.curve(
        mean,
        f"paper: large-N limit {published.ONSET_LIMIT.value}",
        [12, 500],
        [published.ONSET_LIMIT.value] * 2,
        **PAPER,
    )
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
        groups = groups_by(table[table["model"] == model], "n", "z_J", n)
        found = bootstrap(groups, lambda g: [v.mean() for v in g])
        ends = (found.value, found.low, found.high)
        out.curve(mean, f"{name}: z_J", n, *ends, band=False, label=name, **look)
    line = np.geomspace(12, 500, 40)
    out.curve(mean, "4 - 2/N", line, 4 - 2 / line, **FIT)
    paper = published.TABLE_1["SP(φ)"][0]
    out.curve(mean, f"paper: $z_J$ = {paper}", [12, 500], [paper] * 2, **PAPER)
    mean.set_xscale("log")
    label(extra, r"contacts at onset beyond $2N' - 1$", "share of packings")
    label(mean, "N", r"$z_J$", loc="lower right")


def _onset_claims(name: str, model: str, n: list[int], groups: list[Array]) -> list[Claim]:
    big = model.upper()
    theta = limit = None
    how = of_width = "needs two sizes with three packings or more"
    if len(n) > 1 and min(len(g) for g in groups) > 2:
        how = of_width = f"N = {', '.join(map(str, n))}"
        limit = whole = bootstrap(groups, lambda g: _limit(n, g))
        theta = every = bootstrap(groups, lambda g: _width_exponent(n, g))
        same = [k for k, size in enumerate(n) if size in conventions.SIZES]
        if 1 < len(same) < len(n):  # "matched N"
            kept, groups_kept = [n[k] for k in same], [groups[k] for k in same]
            theta = bootstrap(groups_kept, lambda g: _width_exponent(kept, g))
            limit = bootstrap(groups_kept, lambda g: _limit(kept, g))
            matched, beyond = f"N = {', '.join(map(str, kept))} of the paper's", f"with all, {n[0]} to {n[-1]},"
            of_width = f"{matched}; {beyond} {every.value:.2f}"
            how = f"{matched}; {beyond} {whole.value:.4f} [{whole.low:.4f}, {whole.high:.4f}]"
    return [
        claim(
            name,
            f"theta: sigma ~ N^-theta, {big}",
            theta,
            published.THETA,
            how=of_width,
            cause=_local_exponents(n, groups),
            shown_by="boromand-10 c",
        ),
        claim(
            name,
            f"onset in the large-N limit, {big}",
            limit,
            published.ONSET_LIMIT,
            how=f"{how}, correction N^-{published.ONSET_CORRECTION} (O'Hern et al. 2003)" if limit is not None else how,
            cause=f"N = {n[-1]} jams at {groups[-1].mean():.4f}, N = {n[0]} at {groups[0].mean():.4f}",
            shown_by="boromand-10 d",
        ),
    ]


def _width_exponent(n: list[int], groups: list[Array]) -> float:
    """Exponent of the width against N, sizes weighted by its error, sigma/(2m - 2)^0.5 of m packings."""
    widths = np.array([v.std(ddof=1) for v in groups])
    errors = widths / np.sqrt([2 * len(v) - 2 for v in groups])
    return -float(power_law(n, widths, error=errors).exponents[0])


def _local_exponents(n: list[int], groups: list[Array]) -> str:
    """Say what theta is from each size to the next."""
    widths = [v.std(ddof=1) if len(v) > 1 else np.nan for v in groups]
    rise = -np.diff(np.log(widths)) / np.diff(np.log(n))
    return f"from size to size it is {', '.join(f'{t:.2f}' for t in rise)} (N = {', '.join(map(str, n))})"


def _limit(n: list[int], groups: list[Array]) -> float:
    """Mean onset of large systems, each size weighted by its standard error."""
    means, errors = [v.mean() for v in groups], [v.std(ddof=1) / len(v) ** 0.5 for v in groups]
    return finite_size(n, means, errors, exponent=published.ONSET_CORRECTION).limit
