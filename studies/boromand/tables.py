"""Draw the coefficients of tables 1 and 2 of Boromand et al. from our packings, over those of the paper."""

import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import InputError, StorageError
from jamlab.plotting.palette import BLUE, GREEN, ORANGE, RED
from jamlab.statistics.bootstrap import Interval
from studies import conventions
from studies import published_numbers as published
from studies.claims import Kind, Verdict, write_by, write_interval, write_list
from studies.conventions import SERIES, SUBTRACTED, even_curve, fit_coefficients
from studies.ensemble_tables import PACKING, EnsembleTables, at_onset_by_law, counts_at_onset, usual_law
from studies.ensembles import (
    Ensemble,
    average,
    bootstrap,
    groups_by,
    has,
    mean_over_packings,
    median,
    nearest_size,
    part_of,
    sampled_sizes,
)
from studies.panels import FIT, Drawing, drawing, label

EXPONENTS = {"d_phi": (0.5,), "d_rho": (0.5, 1.0)}  # against phi the paper's linear terms are 0
LOOKS = {
    Verdict.AGREES: (BLUE, "o"),
    Verdict.DIFFERS: (RED, "X"),
    Verdict.INCONSISTENT: (ORANGE, "^"),
    Verdict.CALIBRATED: (GREEN, "D"),
    Verdict.UNDECIDED: ("#888888", "s"),
    Verdict.MISSING: ("#888888", "x"),
}


def tables_1_2(tables: EnsembleTables) -> Drawing:
    """Coefficients of tables 1 and 2 from our packings, over the paper's."""
    states = tables.states
    out, (axes,) = drawing("tables", 1, 1, 8.2, 6.6)
    for series, (model, _) in SERIES.items():
        if not has(states, model):
            continue
        n = nearest_size(states, model, conventions.SIZES[-1])
        _claim_onset(out, tables, series, n)
        _claim_contacts(out, states, series, n)
        _claim_modulus(out, states, series, n)
    _draw_ratios(out, axes)
    _claim_ratio(out)
    out.caption = (
        f"Coefficients of tables 1-2 over the paper's: z - {SUBTRACTED} = z_0 d^0.5 + z_1 d, G = G_0 d^0.5 + G_1 d, by "
        "least squares of absolute residuals at evenly spaced d, as the paper's own steps make them. Grey: the paper's "
        "margin, or half a unit of its last digit."
    )
    return out


def _claim_onset(out: Drawing, tables: EnsembleTables, series: str, n: int) -> None:
    """Claim z_J and phi_J or rho_J."""
    model, by = SERIES[series]
    column = f"{by.removeprefix('d_')}_J"
    onset = tables.onset[tables.onset["model"] == model]  # more packings than were compressed
    at_onset = onset[onset["n"] == n]
    measured = [m for m in sampled_sizes(onset, model) if m in conventions.SIZES]
    each, means = (onset.groupby("n")[name].mean().loc[measured].to_dict() for name in ("z_J", column))
    found = [mean_over_packings([at_onset[name].dropna().to_numpy()])[0] for name in ("z_J", column)]
    groups = groups_by(onset.dropna(subset=["z_J"]), "n", "z_J", measured)
    every = {f"mean over N = {write_list(measured)}": bootstrap(groups, lambda g: np.mean([v.mean() for v in g]))}
    if model == "sp":
        words = {"cause": f"it is {write_by(each, '.3f')}, 4 - 2/N' by counting", "shown_by": "boromand-10 f"}
    else:
        words = _extra_contacts(out, at_onset, n)
        words["cause"] += _with_more_vertices(out, tables)
    paper = [published.table_onset(value) for value in published.TABLE_1[series][:2]]
    same = Kind.DUPLICATE if series == "SP(ρ)" else Kind.MEASURED  # onsets of the disks of SP(φ)
    how = f"N = {n}, of the fits of fig 5, {len(at_onset)} packings; table 1 names no N, and fig 6 has one z_J for all"
    out.claim(f"z_J, {series}", found[0], paper[0], kind=same, family=every, how=how, **words)
    name = f"{column}, {series}"
    out.keep(name, list(means.values()), N=measured)
    cause = f"small systems jam earlier: {write_by(means, '.4f')}"
    words = {"how": f"N = {n}, {len(at_onset)} packings", "cause": cause, "shown_by": "boromand-10 d"}
    out.claim(name, found[1], paper[1], kind=same, **words)


def _extra_contacts(out: Drawing, at_onset: pd.DataFrame, n: int) -> dict[str, str]:
    """Keep how far the contacts of droplets at onset are from 2N' - 1, and what contacts of vertices hold."""
    held = at_onset["n"] - at_onset["rattlers"]
    extra = 0.5 * at_onset["z_J"] * held - (2 * held - 1)
    numbers = {"mean": extra.mean(), "least": extra.min(), "most": extra.max()}
    middle, low, high = (out.keep(f"contacts beyond 2N' - 1, DP, {k}", v) for k, v in numbers.items())
    words = f"contacts beyond 2N' - 1: {middle:+.1f} on average, {low:+.0f} to {high:+.0f}"
    try:
        counts = counts_at_onset(at_onset)
    except InputError:
        return {"cause": words, "shown_by": "boromand-10 e"}
    free = out.keep("motions left free, DP", counts["free"].mean())
    states = out.keep("states of self-stress, DP", counts["self_stresses"].mean())
    words += (
        f"; contacts of vertices leave {free:.2f} motions a droplet free and have {states:.2f} states of self-stress, "
        f"the mean of {len(counts)} packings, where those of disks have none and one"
    )
    return {"cause": words, "shown_by": "beyond-droplet-contacts"}


def _with_more_vertices(out: Drawing, tables: EnsembleTables) -> str:
    """Keep contacts at onset beyond 2N' - 1 by vertices and stiffness of rims, of the largest size that has several."""
    try:
        rows = tables.droplet_states
    except (InputError, StorageError, KeyError):
        return ""
    onset = tables.onset.query("model == 'dp'").rename(columns={"z_J": "z"})
    usual = usual_law(rows)
    every = (
        pd.concat([rows, onset.assign(state=0)], ignore_index=True).fillna(usual).drop_duplicates([*PACKING, "state"])
    )
    held = every["n"] - every["rattlers"]
    extra = 0.5 * every["z"] * held - (2 * held - 1)
    said = []
    for n, law, part in at_onset_by_law(every.assign(extra=extra).dropna(subset=["extra"])):
        found = out.keep(
            f"contacts beyond 2N' - 1, N = {n:g}, {law}", mean_over_packings([part["extra"].to_numpy()])[0]
        )
        said.append(f"{write_interval(found, 1)} with {law} at N = {n:g}")
    return f"; they are {', '.join(said)}" if said else ""


def _by_size(
    out: Drawing, name: str, states: pd.DataFrame, series: str, column: str, statistic: Callable[[Array, Array], float]
) -> str:
    """Keep a statistic of the mean curve of each size of a series, and write it."""
    n = sampled_sizes(states, SERIES[series][0])
    found = {m: statistic(*even_curve(states, series, m, column).mean) for m in n}
    out.keep(name, list(found.values()), N=found)
    return write_by(found, ".3g")


def _claim_contacts(out: Drawing, states: pd.DataFrame, series: str, n: int) -> None:
    """Claim z_0 and z_1."""
    model, by = SERIES[series]
    paper, exponents = published.TABLE_1[series][2:], EXPONENTS[by]
    e = even_curve(states, series, n, "excess contacts")

    def coefficients(x: Array, y: Array, taken: float = 0.0, **window: float) -> Array:
        return _fit_within(x, y - taken, exponents, **window)

    own = conventions.own_contacts(states, model, n)
    words = {"how": f"N = {n}, z - {SUBTRACTED} as in the paper (own z_J {own:.3f}), {_window(series)}"}
    if model == "sp":
        by_size = _by_size(out, f"z_0, {series}", states, series, "excess contacts", lambda x, y: coefficients(x, y)[0])
        words |= {"cause": f"the paper fits N = {conventions.SIZES[-1]}, and z_0 is {by_size}"}
        words["shown_by"] = "boromand-6 a and b"
    else:
        ends = f"the fit itself makes z more than 6 from rho = {conventions.end_of_droplet_fit():.3f} on"
        words["calibrated"] = f"{conventions.TABLE_TARGET}; {ends}"
    varied = e.varied(coefficients, *_windows(series), {"taken": own - SUBTRACTED})
    for k in range(len(exponents)):
        found, every = part_of(varied, k)
        out.claim(f"z_{k}, {series}", found, published.table_entry(paper[k]), family=every, **words)
    if series == "SP(ρ)":
        _claim_contacts_on_the_way(out, states, n, e)


def _claim_contacts_on_the_way(out: Drawing, states: pd.DataFrame, n: int, e: Ensemble) -> None:
    """Claim z - 3.97 where row SP(ρ) of table 1 may be read without its two coefficients, which make up for another."""
    d_rho, (_, by_phi, paper) = 0.1, conventions.same_states()
    margins = tuple(published.table_entry(c).margin for c in published.TABLE_1["SP(ρ)"][2:])
    margin = published.table_law(margins, d_rho)
    drawn = published.Published(paper, margin, "=", "[B] figs 5 and 6 b, dashed-dotted")

    def there(x: Array, y: Array, taken: float = 0.0) -> float:
        return conventions.at(d_rho, x, y - taken)

    found, every = e.varied(there, {"taken": conventions.own_contacts(states, "sp", n) - SUBTRACTED})
    text = f"z - {SUBTRACTED} at drho = {d_rho:g}, SP(ρ)"
    of_size = _by_size(out, text, states, "SP(ρ)", "excess contacts", there)
    words = {"how": f"N = {n}, the fit of table 1 there, with the margins of both coefficients"}
    words["cause"] = f"it is {of_size}; row SP(φ) of table 1 gives {by_phi:.2f} for the same states"
    out.claim(text, found, drawn, family=every, **words, shown_by="boromand-5")


def _claim_modulus(out: Drawing, states: pd.DataFrame, series: str, n: int) -> None:
    """Claim G_0 and G_1; means, with medians beside them."""
    by = SERIES[series][1]
    paper, exponents = published.TABLE_2[series], EXPONENTS[by]
    e = even_curve(states, series, n, "g")

    def coefficients(x: Array, y: Array, **window: float) -> Array:
        return _fit_within(x, y, exponents, **window)

    x, middle = average(e.x), median(e.y)
    sheared = _along_x(out, states, series, n)
    medians = out.keep(f"G, medians of packings, {series}", coefficients(x, middle), k=range(len(exponents)))
    words = {"how": f"N = {n}, {_window(series)}; medians of packings: {write_list(medians, '.3g')}"}
    if series == "DP(ρ)":
        words["calibrated"] = conventions.TABLE_TARGET
    else:
        stable = average(np.where(e.y > 0, e.y, np.nan))
        only = out.keep(f"G_0 of packings with G > 0, {series}", coefficients(x, stable)[0])
        by_size = _by_size(out, f"G_0, {series}", states, series, "g", lambda x, y: coefficients(x, y)[0])
        words["cause"] = f"the paper fits N = {conventions.SIZES[-1]}, and G_0 is {by_size}"
        words["cause"] += f"; packings with G > 0 alone give {only:.3g}"
        if sheared is not None:
            ratio = out.write(f"G along x over the mean over directions, {series}")
            words["cause"] += f", and the paper shears along x, where G is {ratio} times the mean over directions"
        words["shown_by"] = "boromand-6 d and e"
    varied = e.varied(coefficients, *_windows(series))
    varied[1]["medians"] = bootstrap([e.curves], lambda g: coefficients(average(g[0][..., 0]), median(g[0][..., 1])))
    if sheared is not None:
        varied[1]["G along x"] = Ensemble(e.x, e.y * sheared).interval(coefficients)
    for k in range(len(exponents)):
        found, every = part_of(varied, k)
        out.claim(f"G_{k}, {series}", found, published.table_entry(paper[k]), family=every, **words)


def _along_x(out: Drawing, states: pd.DataFrame, series: str, n: int) -> Array | None:
    """Keep G of shear along x over the mean over directions; of the mean curves of the packings that have both."""
    if "g_x" not in states:
        return None
    both = states[states["g_x"].notna()]
    curves = [even_curve(both, series, n, column).curves for column in ("g", "g_x")]
    if curves[0].shape != curves[1].shape or not np.isfinite(curves[0][..., 1]).any():
        return None

    def ratio(drawn: list[Array]) -> float:
        mean, along = (average(part[..., 1]) for part in drawn)
        return float(mean @ along / (mean @ mean))

    stacked = bootstrap([np.concatenate(curves, axis=-1)], lambda g: ratio([g[0][..., :2], g[0][..., 2:]]))
    out.keep(f"G along x over the mean over directions, {series}", stacked)
    return average(curves[1][..., 1]) / average(curves[0][..., 1])


def _windows(series: str) -> tuple[dict[str, float], ...]:
    """Write the family of windows: half the range of distances either way, which are spaced evenly."""
    by = SERIES[series][1]
    return {"low": 0.5 * conventions.HIGHEST[by]}, {"high": 0.5 * conventions.HIGHEST[by]}


def _fit_within(x: Array, y: Array, exponents: tuple[float, ...], low: float = 0.0, high: float = np.inf) -> Array:
    """Fit coefficients at distances between two."""
    kept = (x > low) & (x < high)
    return fit_coefficients(x[kept], y[kept], exponents)


def _claim_ratio(out: Drawing) -> None:
    """Claim how much larger C_1/C_0 of droplets is than of disks, for z and for G, from the claims of both."""
    held = {c.quantity: c for c in out.claims if c.measured and c.low > 0}
    for name in ("z", "G"):
        names = [f"{name}_{k}, {series}" for series in ("DP(ρ)", "SP(ρ)") for k in (1, 0)]
        if not set(names) <= set(held):
            continue
        parts = np.array([[c.value, c.low / c.value, c.high / c.value] for c in map(held.__getitem__, names)])
        value = parts[0, 0] / parts[1, 0] / (parts[2, 0] / parts[3, 0])
        spread = np.exp(np.sqrt(np.sum(np.log(parts[:, 1:]) ** 2, axis=0)))
        found = Interval(np.array(value), np.array(value / spread[0]), np.array(value * spread[1]))
        paper: Mapping[str, tuple[float, ...]] = published.TABLE_1 if name == "z" else published.TABLE_2
        theirs = [paper[series][-1] / paper[series][-2] for series in ("DP(ρ)", "SP(ρ)")]
        words = {"how": f"paper {theirs[0]:.3g} over {theirs[1]:.3g}", "calibrated": conventions.TABLE_TARGET}
        text = f"{name}_1/{name}_0, DP over SP"
        out.claim(text, found, published.LARGER_RATIO, **words, shown_by="boromand-5")


def _window(series: str) -> str:
    model, by = SERIES[series]
    return f"{conventions.LOWEST[model]:g} < d < {conventions.HIGHEST[by]:g}"


def _symbols(quantity: str) -> str:
    """Set z_J, phi_J and their like as symbols."""
    quantity = quantity.replace("z -", "$z$ −").replace("drho", r"$\Delta\rho$")
    return re.sub(r"\b(phi|rho)_(\w)", r"$\\\1_\2$", re.sub(r"\b(z|G)_(\w)", r"$\1_\2$", quantity))


def _draw_ratios(out: Drawing, axes: Any) -> None:
    """Draw measured over paper, one row per claim."""
    used = set()
    for row, c in enumerate(reversed(out.claims)):
        ratio = np.array([c.value, c.low, c.high]) / c.paper
        axes.barh(row, 2 * c.margin / abs(c.paper), left=1 - c.margin / abs(c.paper), color="#CCCCCC", height=0.7)
        color, marker = LOOKS[c.verdict]
        look: dict[str, Any] = {"color": color, "marker": marker, "linestyle": "none"}
        name = None if c.verdict in used else str(c.verdict)
        used.add(c.verdict)
        out.curve(axes, c.quantity, [ratio[0]], [row], label=name, **look)
        axes.plot(ratio[1:], [row, row], color=color, linewidth=1.6)
    axes.axvline(1, **{k: v for k, v in FIT.items() if k != "zorder"})
    axes.set_yticks(range(len(out.claims)), [_symbols(c.quantity) for c in reversed(out.claims)])
    beside: dict[str, Any] = {"transform": axes.get_yaxis_transform(), "fontsize": 8, "va": "center"}
    for row, c in enumerate(reversed(out.claims)):
        axes.text(1.02, row, f"{c.value:.4g}", **beside)
        axes.text(1.16, row, c.paper_text, **beside)
    axes.text(1.02, len(out.claims), "measured", weight="bold", **beside)
    axes.text(1.16, len(out.claims), "paper", weight="bold", **beside)
    label(axes, "measured / paper", "", loc="upper center", bbox_to_anchor=(0.5, -0.09), ncols=5)
