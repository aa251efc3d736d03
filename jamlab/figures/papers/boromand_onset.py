"""Onset of jamming in Boromand et al., fig 10, and the coefficients of its tables 1 and 2."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.figures.packing_pictures import MODEL_STYLE
from jamlab.figures.papers.boromand import DP_CONTACTS, DP_UNKNOWN, SERIES, has, nearest_size
from jamlab.figures.papers.claims import Claim, claim
from jamlab.figures.papers.ensembles import ensemble, groups_by, near_onset, sizes
from jamlab.figures.papers.panels import FIT, PAPER, Drawing, drawing, label, scale, size_style
from jamlab.figures.papers.tables import Tables
from jamlab.statistics.bootstrap import bootstrap
from jamlab.statistics.power_laws import finite_size, power_law
from jamlab.statistics.published_tables import TABLE_1, TABLE_2

Array = NDArray[np.float64]


def figure_10(tables: Tables) -> Drawing:
    """Distributions of onset, their width and mean against N."""
    onset = tables.onset
    out, (left, right, width, mean) = drawing("boromand-10", 2, 2, 5.0, 3.8)
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
        inset = axes.inset_axes((0.1, 0.52, 0.36, 0.42))
        inset.set_gid(axes.get_gid() + "-inset")
        for size, values in zip(n, groups[model], strict=True):
            look = size_style(size)
            density, edges = np.histogram(values, bins=max(5, round(len(values) ** 0.5)), density=True)
            out.curve(axes, f"N = {size} ({len(values)})", 0.5 * (edges[1:] + edges[:-1]), density, **look)
            share = np.arange(1, len(values) + 1) / len(values)
            out.curve(inset, f"N = {size}", np.sort(values), share, color=look["color"], label=None)
        symbol = r"\phi_J" if model == "sp" else r"\rho_J"
        label(axes, f"{model.upper()}: onset ${symbol}$", f"$P({symbol})$", loc="upper right")
        axes.set_ylim(0, 1.5 * axes.get_ylim()[1])
        inset.tick_params(labelsize=7)
        inset.set_title("$f_J$", fontsize=8, pad=2)
        look = {"color": MODEL_STYLE[model]["color"], "marker": MODEL_STYLE[model]["marker"], "linestyle": "none"}
        spread = bootstrap(groups[model], lambda g: [v.std(ddof=1) if len(v) > 1 else np.nan for v in g])
        centre = bootstrap(groups[model], lambda g: [v.mean() for v in g])
        for axes_, what, found in ((width, "width", spread), (mean, "mean", centre)):
            ends = (found.value, found.low, found.high)
            out.curve(axes_, f"{model.upper()}: {what}", n, *ends, band=False, label=model.upper(), **look)
        out.claims += _onset_claims(out.name, model, n, groups[model])
    out.slope(width, -0.55, (sizes(onset, "sp" if has(onset, "sp") else "dp")[0], 256), 0.012, r"$N^{-0.55}$")
    label(width, "N", r"width of the distribution $\sigma$")
    out.curve(mean, "paper: large-N limit 0.842", [12, 500], [0.842, 0.842], **PAPER)
    mean.set_xscale("log")
    label(mean, "N", "mean onset", loc="lower right")
    out.caption = (
        "Onset of jamming: densities (insets: share jammed at or below), width and mean against N, with 95 % bars."
    )
    return out


def _onset_claims(name: str, model: str, n: list[int], groups: list[Array]) -> list[Claim]:
    big = model.upper()
    theta = limit = None
    if len(n) > 1 and min(len(g) for g in groups) > 2:
        theta = bootstrap(groups, lambda g: -power_law(n, [v.std(ddof=1) or np.nan for v in g]).exponents[0])
        limit = bootstrap(
            groups,
            lambda g: (
                finite_size(n, [v.mean() for v in g], [v.std(ddof=1) / len(v) ** 0.5 for v in g], exponent=0.7).limit
            ),
        )
    how = f"N = {', '.join(map(str, n))}" if theta is not None else "needs two sizes with three packings or more"
    return [
        claim(name, f"theta: sigma ~ N^-theta, {big}", theta, 0.55, 0.005, how=how),
        claim(
            name,
            f"onset in the large-N limit, {big}",
            limit,
            0.842,
            0.0005,
            how=f"{how}, correction N^-0.7 (O'Hern et al. 2003)" if limit is not None else how,
            reason="onset depends on the protocol of compression",
        ),
    ]


def tables_1_2(tables: Tables) -> Drawing:
    """Coefficients of tables 1 and 2 from our packings, over the paper's."""
    states = tables.states
    out, (axes,) = drawing("tables", 1, 1, 7.6, 6.4)
    for series, (model, by) in SERIES.items():
        if not has(states, model):
            continue
        n = nearest_size(states, model, 256)
        high = 0.2 if by == "d_phi" else 0.13
        onset = "phi_J" if by == "d_phi" else "rho_J"
        at = states[(states["model"] == model) & (states["n"] == n) & (states["state"] == 0)]
        for column, paper in (("z", TABLE_1[series][0]), (onset, TABLE_1[series][1])):
            values = at["z" if column == "z" else ("phi" if by == "d_phi" else "rho")].to_numpy(dtype=float)
            found = bootstrap([values], lambda g: g[0].mean()) if len(values) else None
            why = (
                f"z_J = 4 - 2/N' by counting, here N = {n}; 3.97 is that of N' = 64"
                if column == "z"
                else "small systems jam earlier, fig 10"
            )
            name = f"{'z_J' if column == 'z' else onset}, {series}"
            out.claims.append(claim(out.name, name, found, paper, 0.005, how=f"N = {n}", reason=why))
        exponents = (0.5,) if by == "d_phi" else (0.5, 1.0)
        for column, symbol, paper_values in (("d_z", "z", TABLE_1[series][2:]), ("g", "G", TABLE_2[series])):
            e = ensemble(states, model, n, by, column, near_onset())

            def fit(x: Array, y: Array, s: Array = e.error, p: tuple[float, ...] = exponents, h: float = high) -> Array:
                """Coefficients, and the curve itself at 0.1."""
                law = power_law(x, y, p, error=s, low=1e-3, high=h)
                return np.append(law.coefficients, law(0.1))

            found = e.interval(fit)
            at_tenth = paper_values[0] * 0.1**0.5 + paper_values[1] * 0.1
            why = "" if model == "sp" else (DP_CONTACTS if column == "d_z" else DP_UNKNOWN)
            last = f"{'z - z_J' if column == 'd_z' else 'G'} at d = 0.1, {series}"
            for k, paper in enumerate(paper_values[: len(exponents)]):
                out.claims.append(
                    claim(
                        out.name,
                        f"{symbol}_{k}, {series}",
                        None if found is None else found[k],
                        paper,
                        0.5 * 10.0 ** -(1 if paper >= 1 else 2),
                        how=f"N = {n}, 1e-3 < d < {high:g}",
                        reason=why,
                    )
                )
            margin = 0.05 * (0.1**0.5 + 0.1) if column == "d_z" else 0.005 * (0.1**0.5 + 0.1)
            value = None if found is None else found[len(exponents)]
            out.claims.append(
                claim(
                    out.name,
                    last,
                    value,
                    at_tenth,
                    margin,
                    how="the fitted curve",
                    reason=why,
                )
            )
    _forest(out, axes)
    out.caption = (
        "Coefficients of tables 1-2 over the paper's: z - z_J = z_0 d^0.5 + z_1 d, G = G_0 d^0.5 + G_1 d, by least "
        "squares over the standard errors of the bins. Grey: the paper's margin, or half a unit of its last digit."
    )
    return out


def _forest(out: Drawing, axes: Any) -> None:
    """Measured over paper, one row per claim."""
    for row, c in enumerate(reversed(out.claims)):
        ratio = np.array([c.value, c.low, c.high]) / c.paper
        axes.barh(row, 2 * c.margin / abs(c.paper), left=1 - c.margin / abs(c.paper), color="#CCCCCC", height=0.7)
        look: dict[str, Any] = {"color": "#0072B2" if c.agrees else "#D55E00", "marker": "o" if c.agrees else "X"}
        out.curve(axes, c.quantity, [ratio[0]], [row], label=None, **look)
        axes.plot(ratio[1:], [row, row], color=look["color"], linewidth=1.6)
    axes.axvline(1, **{k: v for k, v in FIT.items() if k != "zorder"})
    axes.set_yticks(range(len(out.claims)), [c.quantity for c in reversed(out.claims)])
    label(axes, "measured / paper  (blue: agrees, red cross: differs)", "", legend=False)
