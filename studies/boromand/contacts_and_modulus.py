"""Draw contacts and shear modulus in Boromand et al.: figs 5 and 6."""

from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.plotting.palette import GREEN, MODEL_STYLE
from jamlab.statistics.data_collapse import fit_scaling_exponents
from jamlab.statistics.power_laws import fit_exponent
from studies import conventions
from studies import published_numbers as published
from studies.claims import Kind, halves, write_by, write_interval, write_list
from studies.conventions import FRACTIONS, NEAR, SERIES, at
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import (
    ENOUGH,
    RESAMPLES,
    Ensemble,
    Varied,
    average,
    bootstrap,
    ensemble,
    has,
    log_places,
    mean_curve,
    median,
    nearest_size,
    sampled_sizes,
    sizes,
    unmeasured,
    vary_bootstrap,
)
from studies.panels import BESIDE, PAPER, Drawing, drawing, label, scale, size_style

REGIME = {  # where the paper sees a power law, fig 6
    "sp": (conventions.LOWEST["sp"], conventions.HIGHEST["d_phi"]),
    "dp": (conventions.LOWEST["dp"], published.CONFLUENCE),
}
NEAREST = 1e-5  # distance from onset below which G of many droplets is not known
OTHER_SHARES = {"z": (0.015, 0.025, 0.03), "g": (0.05, 0.15, 0.2)}  # by which models might be said to part as well
_UNITS = "G comes in units of eps and of eps_r, which gamma and delta tie"
DISTANT = 1e-2  # nearer to onset no single exponent of z - 3.97 exists


def figure_5(tables: EnsembleTables) -> Drawing:
    """z and G against rho and phi, with the fits of tables 1-2."""
    states = tables.states
    out, (top, bottom) = drawing("boromand-5", 1, 2, 5.6, 4.6)
    for axes, column, name in (
        (top, "z", "coordination z"),
        (bottom, "g", r"shear modulus $G$  [SP: $\epsilon/\sigma^2$, DP: $\epsilon_r/l^2$]"),
    ):
        for model, by, fill in (("sp", "phi", "full"), ("sp", "rho", "none"), ("dp", "rho", "none")):
            for n in _shown_sizes(states, model):
                small = n < 64
                x, y = ensemble(states, model, n, by, column, FRACTIONS).band
                count = states[(states["model"] == model) & (states["n"] == n)]["seed"].nunique()
                few = f" ({count} packings)" if count < ENOUGH else ""
                series = f"{model.upper()}({'φ' if by == 'phi' else 'ρ'}), N = {n}{few}"
                look: dict[str, Any] = {"color": MODEL_STYLE[model]["color"] if by == "rho" else GREEN}
                look |= {
                    "marker": ("v" if small else "o") if model == "sp" else ("D" if small else "*" if few else "p")
                }
                shown = y.value if small else y  # bands of the small ones would cover all others
                out.curve(axes, series, x, shown, linestyle="none", fillstyle=fill, **look)
        _draw_table_lines(out, axes, column)
        axes.axvline(published.MODELS_PART.value, color="#777777", linestyle="-.", linewidth=0.9)
        # far beyond confluence phi says little, and the paper's panel ends near there
        label(axes, r"packing fraction $\rho$ or $\phi$", name, legend=axes is bottom, **BESIDE)
        axes.set_xlim(0.82, 1.06)
        axes.set_ylim((3.8, 6.2) if column == "z" else (0, 0.36))
    _claim_departures(out, states)
    _claim_end_of_eq_13(out, states)
    _claim_similar(out, states)
    missing = (
        "; the paper's droplets of N = 256 are not there" if conventions.SIZES[-1] not in sizes(states, "dp") else ""
    )
    out.caption = (
        "z and G against packing fraction; bands of the largest sizes: 95 % over packings. Dashed: the paper's fits, "
        f"tables 1-2; dash-dotted: where its models part{missing}. States that are no minimum are left out."
    )
    return out


def _shown_sizes(states: pd.DataFrame, model: str) -> list[int]:
    """Pick the sizes nearest to the paper's least and largest, and the largest itself even of few packings; none
    without packings."""
    if not has(states, model):
        return []
    ends = (conventions.SIZES[0], conventions.SIZES[-1])
    return sorted({nearest_size(states, model, wanted) for wanted in ends} | {ends[1]} & set(sizes(states, model)))


def _claim_departures(out: Drawing, states: pd.DataFrame) -> None:
    """Claim where z and G of droplets leave those of disks of the same N."""
    matched = conventions.matched_sizes(states)
    part = published.MODELS_PART.value
    for column, share in (("z", 0.02), ("g", 0.1)):
        text = f"rho from which {column} of DP exceeds SP by {100 * share:g} %"
        if not matched:
            out.claim(text, None, published.MODELS_PART, how="needs packings of both models at one N")
            continue
        sp, dp = ([ensemble(states, model, m, "rho", column, FRACTIONS) for m in matched] for model in ("sp", "dp"))
        others = [{"share": other} for other in OTHER_SHARES[column]]
        find = partial(_crossing, share=share)
        varied = [vary_bootstrap([a.curves, b.curves], find, *others) for a, b in zip(sp, dp, strict=True)]
        each, (found, every) = [number for number, _ in varied], varied[-1]
        how = f"N = {matched[-1]} of both, last crossing of the mean curves, else the first rho that both have"
        out.keep(text, each, N=matched)
        how += f"; {write_by(dict(zip(matched, each, strict=True)), '.3f')}"
        at_others = ", ".join(f"{float(v.value):.3f} ({k})" for k, v in every.items())
        words = {"cause": f"it is {at_others}", "shown_by": "boromand-5 a"}
        if column == "g":
            ratio = out.keep(
                f"G of DP over that of SP at rho = {part:g}", at(part, *dp[-1].mean) / at(part, *sp[-1].mean)
            )
            apart = _say_excess(out, sp[-1], dp[-1])
            words = {"calibrated": f"{_UNITS}: the ratio at rho = {part:g} is {ratio:.2f}; {apart}"}
        out.claim(text, found, published.MODELS_PART, family=every, how=how, **words)


def _claim_similar(out: Drawing, states: pd.DataFrame) -> None:
    """Claim that z and G of droplets are those of disks near onset, and of large packings those of small ones."""
    matched = conventions.matched_sizes(states)[-1:]
    pairs: list[tuple[str, float, list[tuple[str, int]]]] = [
        ("DP over SP near onset", 0.01, [(model, m) for m in matched for model in ("dp", "sp")])
    ]
    for model in ("sp", "dp"):
        n = [m for m in sampled_sizes(states, model) if m in conventions.SIZES]
        ends = [(model, n[-1]), (model, n[0])] if len(n) > 1 else []
        pairs.append((f"large over small N at drho = 0.1, {model.upper()}", 0.1, ends))
    for column, symbol in (("z", "z"), ("g", "G")):
        for text, d_rho, pair in pairs:
            (found, every), how, there = unmeasured(), "needs packings of both kinds", []
            curves = [
                ensemble(states, *which, "d_rho", column, np.arange(0.005, 0.155, 0.005)).curves for which in pair
            ]
            if curves:

                def ratio(groups: list[Array], d_rho: float = d_rho, taken: float = 0.0) -> float:
                    over, under = (at(d_rho, *mean_curve(part)) - taken for part in groups)
                    return over / under

                excess = [{"taken": conventions.SUBTRACTED}] if column == "z" else []
                found, every = vary_bootstrap(curves, ratio, *({"d_rho": f * d_rho} for f in (0.5, 1.5)), *excess)
                how = f"{' over '.join(f'{model.upper()}, N = {m}' for model, m in pair)}, drho = {d_rho:g}"
                there = [at(d_rho, *mean_curve(part)) for part in curves]
            name, words = f"{symbol} of {text}", {"shown_by": "boromand-5"}
            out.keep(name, there, of=range(len(there)))
            words["cause"] = f"{symbol} is {write_list(there, '.3g')} there"
            words |= {"calibrated": _UNITS} if column == "g" and len({model for model, _ in pair}) > 1 else {}
            out.claim(name, found, published.SIMILAR, family=every, how=how, **words)


def _draw_table_lines(out: Drawing, axes: Any, column: str) -> None:
    """Draw the paper's fits of z or G, tables 1 and 2; those against rho end at rho = 1."""
    for name, (_, onset, *_) in published.TABLE_1.items():
        d = np.linspace(1e-4, 0.2 if "φ" in name else 1 - onset, 60)
        y = published.table_contacts(name, d) if column == "z" else published.table_modulus(name, d)
        colour = {"SP(φ)": GREEN, "SP(ρ)": MODEL_STYLE["sp"]["color"], "DP(ρ)": MODEL_STYLE["dp"]["color"]}[name]
        out.curve(axes, f"paper: {name}", onset + d, y, linestyle="--", color=colour, linewidth=1.4)


def _say_excess(out: Drawing, sp: Ensemble, dp: Ensemble) -> str:
    """Keep between what shares the mean of DP exceeds that of SP where both have one."""
    rho, excess = _find_excess(sp.mean, dp.mean)
    if not len(excess):
        return "no common range"
    least = out.keep("least excess of DP over SP, %", 100 * excess.min())
    most = out.keep("largest excess of DP over SP, %", 100 * excess.max())
    return f"DP exceeds SP by {least:.0f} to {most:.0f} % from {rho[0]:.2f} to {rho[-1]:.2f}"


def _find_excess(sp: tuple[Array, Array], dp: tuple[Array, Array]) -> tuple[Array, Array]:
    """Find rho where both models have a mean, and the share by which that of DP exceeds that of SP."""
    (x, y), (u, v) = sp, dp
    kept = (u >= np.nanmin(x)) & (u <= np.nanmax(x)) & np.isfinite(v)
    return u[kept], v[kept] / np.interp(u[kept], x, y) - 1


def _crossing(groups: list[Array], share: float) -> float:
    """Find the rho above which the mean of DP exceeds that of SP by a given share."""
    rho, excess = _find_excess(mean_curve(groups[0]), mean_curve(groups[1]))
    inside = np.flatnonzero(excess <= share)
    if not len(inside) and len(rho):
        return float(rho[0])  # apart from the first place on
    if not len(inside) or inside[-1] == len(excess) - 1:
        return float("nan")
    k = inside[-1]
    return float(np.interp(0, excess[k : k + 2] - share, rho[k : k + 2]))


def _claim_end_of_eq_13(out: Drawing, states: pd.DataFrame) -> None:
    """Claim the rho from which the excess contacts of disks lie 1 % off our own fit of eq 13."""
    n = nearest_size(states, "sp", conventions.SIZES[-1])
    e = ensemble(states, "sp", n, "d_rho", "z", np.arange(0.001, 0.18, 0.001))
    e = Ensemble(e.x, e.y - conventions.SUBTRACTED)
    onset = float(states[(states["model"] == "sp") & (states["n"] == n) & (states["state"] == 0)]["rho"].mean())

    def distance(x: Array, y: Array, end: float = conventions.HIGHEST["d_rho"]) -> Array:
        kept = (x > conventions.LOWEST["sp"]) & (x < end)
        c_0, c_1 = conventions.fit_coefficients(x[kept], y[kept], (0.5, 1.0))
        return np.asarray(np.abs(y / (c_0 * x**0.5 + c_1 * x) - 1))

    def leaves(x: Array, y: Array, share: float = 0.01, end: float = conventions.HIGHEST["d_rho"]) -> float:
        inside, known = np.flatnonzero((distance(x, y, end) <= share) & np.isfinite(y)), np.isfinite(y).sum()
        return float(onset + x[inside[-1] + 1]) if len(inside) and inside[-1] + 1 < known else float("nan")

    found, every = e.varied(leaves, *({"share": v} for v in (0.005, 0.02)), *({"end": v} for v in (0.11, 0.15)))
    ends = published.EQ_13_ENDS
    apart = out.keep("z off eq 13 there, %", 100 * at(ends.value - onset, e.mean[0], distance(*e.mean)))
    words = {"how": f"N = {n}, rho from which z - {conventions.SUBTRACTED} lies 1 % off its own fit up to drho = 0.13"}
    words |= {"cause": f"at rho = {ends.value} it lies {apart:.2f} % off", "shown_by": "boromand-5 a"}
    out.claim("rho from which z of SP leaves eq 13", found, ends, family=every, **words)


def figure_6(tables: EnsembleTables) -> Drawing:
    """z - z_J and G against the distance to onset, log-log, one curve per size."""
    states = tables.states
    out, axes = drawing("boromand-6", 2, 3, 4.4, 3.9)
    panels = [("d_z", s) for s in SERIES] + [("g", s) for s in SERIES]
    for part, (column, series) in zip(axes, panels, strict=True):
        scale(part)
        model, by = SERIES[series]
        for n in sizes(states, model):
            x, y = ensemble(states, model, n, by, column, NEAR).band
            out.curve(part, f"N = {n}", x, y, linestyle="none", **size_style(n))
        d = np.geomspace(1e-4, 0.4 if by == "d_phi" else 0.16, 40)
        coefficients = published.TABLE_1[series][2:] if column == "d_z" else published.TABLE_2[series]
        out.curve(part, "paper: table fit", d, published.table_law(coefficients, d), **PAPER)
        if column == "d_z":
            out.slope(part, 1.0, (3e-5, 3e-4), 1.5e-3)
        elif model == "dp":
            out.slope(part, published.DROPLET_EXPONENT.value, (1e-3, 1e-1), 2e-3)
        name = r"$\Delta\phi$" if by == "d_phi" else r"$\Delta\rho$"
        units = r"$\epsilon/\sigma^2$" if model == "sp" else r"$\epsilon_r/l^2$"
        out.window(part, *(REGIME[model]))
        symbol = r"$z - z_J$" if column == "d_z" else rf"$G$  [{units}]"
        label(part, f"{series[:2]}: {name}", symbol, loc="upper left")
        part.set_xlim(5e-7, 0.7)
        part.set_ylim((1e-3, 5) if column == "d_z" else (3e-4, 1))
    _claim_exponents(out, states)
    out.caption = (
        "Excess contacts (own z_J taken off) and shear modulus against the distance to each packing's own onset. "
        "Dashed: the paper's fits and slopes; grey: the regime where it sees a power law. Mean moduli of small "
        "packings near onset may be negative in a fixed box and are then not shown."
        + _share_without_modulus(out, states)
    )
    return out


def _claim_exponents(out: Drawing, states: pd.DataFrame) -> None:
    """Claim single exponents as the paper fits them, at its largest size, and that of the crossover."""
    for column, series, paper, text in (
        ("excess contacts", "SP(φ)", published.ALPHA_0, "alpha_0: z - z_J ~ dphi^alpha_0, SP"),
        ("g", "SP(φ)", published.BETA_0, "beta_0: G ~ dphi^beta_0, SP"),
        ("excess contacts", "DP(ρ)", published.DROPLET_EXPONENT, "single exponent of z - z_J in drho, DP"),
        ("g", "DP(ρ)", published.DROPLET_EXPONENT, "single exponent of G in drho, DP"),
    ):
        model, by = SERIES[series]
        (found, every), how = unmeasured(), f"no {model} packings"
        words: dict[str, str] = {}
        if has(states, model):
            n = nearest_size(states, model, conventions.SIZES[-1])
            found, every = _vary_exponent(states, series, n, column)
            what = f"z - {conventions.SUBTRACTED}" if column != "g" else "mean G"
            how = f"N = {n}, {what}, {DISTANT:g} < d < {conventions.HIGHEST[by]:g}"
            if model == "sp":
                measured = sampled_sizes(states, model)
                means = [_beyond_a_hundredth(states, series, m, column).mean for m in measured]
                by_size = [fit_exponent(*mean) for mean in means]
                out.keep(text, by_size, N=measured)
                words["cause"] = f"it is {write_by(dict(zip(measured, by_size, strict=True)), '.2f')}"
                words["shown_by"] = "boromand-6 a and d"
        if model == "dp":
            words["contradiction"] = conventions.contradiction_of_single_exponent(2 if column == "g" else 1)
            words["shown_by"] = "boromand-6 c and f, dashed"
        out.claim(text, found, paper, family=every, how=how, **words)
    how = f"best collapse of N <= 256, dphi < {REGIME['sp'][1]:g}, own z_J"
    text = "a: (z - z_J) N against dphi N^a, SP"
    found, every = _size_exponent(states)
    out.claim(text, found, published.CROSSOVER_EXPONENT, family=every, how=how)
    for series in ("SP(φ)", "DP(ρ)"):
        _claim_proportion(out, states, series)
    _claim_regime_1(out, states)
    _claim_roots(out, states)
    for series in ("SP(ρ)", "DP(ρ)"):
        _claim_crossover(out, states, series)
    several = [m for m in sampled_sizes(states, "sp") if m in conventions.SIZES]
    found, every = _vary_exponent(states, "SP(φ)", several[0], "g") if several else unmeasured()
    every |= {f"N = {m}": _beyond_a_hundredth(states, "SP(φ)", m, "g").interval(_exponent) for m in several[1:]}
    words = {"how": f"N = {min(several, default=0)}, window as of beta_0; the caption names no N"}
    words |= {"cause": "it falls with N", "shown_by": "boromand-6 d"}
    out.claim("slope of G of small SP packings", found, published.DOTTED_SLOPE, family=every, **words)


def _exponent(x: Array, y: Array, low: float = 0.0, high: float = np.inf) -> float:
    """Fit an exponent between two places, which count."""
    kept = (x > 0.99 * low) & (x < 1.01 * high)
    return fit_exponent(x[kept], y[kept])


def _vary_exponent(states: pd.DataFrame, series: str, n: int, column: str) -> Varied:
    """Fit an exponent beyond 0.01; its family: half the window, even in logarithms, own z_J, medians, G along x."""
    model, by = SERIES[series]
    high = conventions.HIGHEST[by]
    e = _beyond_a_hundredth(states, series, n, column)
    found, every = e.varied(_exponent, *halves(DISTANT, high))
    log = conventions.even_curve(states, series, n, column, log_places(DISTANT, high, 20))
    every["even in ln d"] = log.interval(_exponent)
    if column == "g":
        every["medians"] = bootstrap([e.curves], lambda g: _exponent(average(g[0][..., 0]), median(g[0][..., 1])))
        along = _beyond_a_hundredth(conventions.along_x(states), series, n, column)
        every["direction = x"] = along.interval(_exponent)
    else:
        own = conventions.own_contacts(states, model, n) - conventions.SUBTRACTED
        every["z_J = own"] = e.interval(lambda x, y: _exponent(x, y - own))
    return found, every


def _claim_proportion(out: Drawing, states: pd.DataFrame, series: str) -> None:
    """Claim that G goes in proportion to z - z_J: the exponent of one in the other, where both are powers."""
    model, by = SERIES[series]
    text, (found, every), how = f"exponent of G in z - z_J, {model.upper()}", unmeasured(), f"no {model} packings"
    if has(states, model):
        n = nearest_size(states, model, conventions.SIZES[-1])
        z, g = (_beyond_a_hundredth(states, series, n, column) for column in ("excess contacts", "g"))
        how = f"N = {n}, {DISTANT:g} < d < {conventions.HIGHEST[by]:g}"
        if z.y.shape == g.y.shape:
            middle, own = (
                float(np.median(average(z.y))),
                conventions.own_contacts(states, model, n) - conventions.SUBTRACTED,
            )

            def exponent(z: Array, g: Array, low: float = 0.0, high: float = np.inf, taken: float = 0.0) -> float:
                kept = (z > low) & (z < high)
                return fit_exponent(z[kept] - taken, g[kept])

            both = Ensemble(z.y, g.y)
            found, every = both.varied(exponent, {"low": middle}, {"high": middle}, {"taken": own})
            every["medians"] = bootstrap([both.curves], lambda d: exponent(average(d[0][..., 0]), median(d[0][..., 1])))
    words = {"shown_by": "boromand-6 a and d"}
    if model == "dp":
        z_rises, g_rises = conventions.exponents_of_tables()
        words = {"calibrated": f"{conventions.TABLE_TARGET}, whose fits give {g_rises / z_rises:.2f}"}
    out.claim(text, found, published.PROPORTIONAL, family=every, how=how, **words)


def _claim_regime_1(out: Drawing, states: pd.DataFrame) -> None:
    """Claim exponents nearest to onset, of the smallest packings, where this regime is widest: between the paper's
    steps and the end that it gives the regime."""
    low, high = published.NEAREST_REGIME
    for column, series in (("z", "SP(φ)"), ("g", "SP(φ)"), ("z", "DP(ρ)"), ("g", "DP(ρ)")):
        model, by = SERIES[series]
        (found, every), how, words = unmeasured(), f"no {model} packings", {}
        if has(states, model):
            n = nearest_size(states, model, conventions.SIZES[0])
            whole = ensemble(states, model, n, by, "d_z" if column == "z" else "g", log_places(1e-6, high, 10))
            e = whole.between(0.99 * low, np.inf)
            found, every = e.varied(_exponent, *halves(low, high))
            how = f"N = {n}, {low:g} < d < {high:g}"
            how += (
                ", own z_J" if column == "z" else "" if model == "sp" else "; of those that have a G, see the caption"
            )
            words = {
                "cause": f"from {e.mean[1][0]:.3g} to {e.mean[1][-1]:.3g} over the window",
                "shown_by": "boromand-6",
            }
            if column == "g":
                nearer = out.keep(
                    f"exponent of G below {low:g}, {series}", whole.between(0, 1.01 * low).interval(_exponent)
                )
                words["cause"] += f"; below {low:g}, the paper's steps, the exponent is {write_interval(nearer)}"
        text = f"exponent of {'z - z_J' if column == 'z' else 'G'} nearest to onset, {series}"
        out.claim(text, found, published.REGIME_1[column], family=every, how=how, **words)


def _claim_roots(out: Drawing, states: pd.DataFrame) -> None:
    """Claim that z - z_J and G of large droplet packings go as the root of drho, before the linear terms set in."""
    low, high = REGIME["sp"][0], DISTANT
    g_0, g_1 = published.TABLE_2["DP(ρ)"]
    equal = f"the linear term exceeds the root from drho = {(g_0 / g_1) ** 2:.2g} on"
    linear = f"{conventions.TABLE_TARGET}, of which {equal}"
    for column, what, words in (("d_z", "z - z_J", {}), ("g", "G", {"calibrated": linear})):
        (found, every), how = unmeasured(), "no dp packings"
        if has(states, "dp"):
            n = nearest_size(states, "dp", conventions.SIZES[-1])
            e = ensemble(states, "dp", n, "d_rho", column, log_places(low, high, 10))
            found, every = e.varied(_exponent, *halves(low, high))
            how = f"N = {n}, {low:g} < drho < {high:g}"
        text = f"exponent of {what} near onset, large N, DP"
        out.claim(text, found, published.ROOT_NEAR_ONSET, family=every, how=how, **words, shown_by="boromand-6")


def _share_without_modulus(out: Drawing, states: pd.DataFrame) -> str:
    """Keep the share of droplets near onset without a modulus: a motion is left that nothing holds; "" if all have one.
    Curves and claims of G are of the rest."""
    near = states[(states["model"] == "dp") & states["d_rho"].between(0, NEAREST, inclusive="right")]
    share = near["g"].isna().groupby(near["n"]).mean()
    if share.empty or not share.any():
        return ""
    out.keep(f"share of droplets without G below {NEAREST:g}", share.tolist(), N=share.index)
    percent = ", ".join(f"{100 * part:.0f} % of N = {n}" for n, part in share.items())
    return f" Droplets whose G is not known below {NEAREST:g}, left out: {percent}."


def _claim_crossover(out: Drawing, states: pd.DataFrame, series: str) -> None:
    """Claim how the distance at which packings have gained two contacts goes with N."""
    model, by = SERIES[series]
    n = [m for m in sampled_sizes(states, model) if m in conventions.SIZES]
    found, every = unmeasured()
    if len(n) > 1:
        curves = [ensemble(states, model, m, by, "d_z", log_places(1e-6, 0.1, 10)).curves for m in n]

        def exponent(groups: list[Array], contacts: float = 2.0) -> float:
            places = []
            for m, (x, y) in zip(n, map(mean_curve, groups), strict=True):
                more = np.flatnonzero(0.5 * m * y >= contacts)
                if not len(more) or not more[0]:
                    return float("nan")
                k = slice(more[0] - 1, more[0] + 1)
                places.append(float(np.exp(np.interp(contacts, 0.5 * m * y[k], np.log(x[k])))))
            return -float(np.polyfit(np.log(n), np.log(places), 1)[0])

        found, every = vary_bootstrap(curves, exponent, {"contacts": 1.0}, {"contacts": 4.0})
    words = {"how": f"N = {write_list(n)}, distance at which two contacts are gained", "shown_by": "boromand-6"}
    same = Kind.DUPLICATE if series == "SP(ρ)" else Kind.MEASURED  # so near to onset rho is phi: that of the collapse
    out.claim(f"a of d* ~ N^-a, {series}", found, published.CROSSOVER_EXPONENT, kind=same, family=every, **words)


def _beyond_a_hundredth(states: pd.DataFrame, series: str, n: int, column: str) -> Ensemble:
    """Cut a curve to places beyond 0.01: nearer to onset z - 3.97 changes its sign, where a logarithm has no value."""
    return conventions.even_curve(states, series, n, column).between(DISTANT, np.inf)


def _size_exponent(states: pd.DataFrame) -> Varied:
    """Fit a of the crossover dphi* ~ N^-a by the collapse of the paper's sizes; its family: the window, the sizes."""
    n = [m for m in sizes(states, "sp") if m in conventions.SIZES]
    if len(n) < 2:
        return None, {}
    groups = [ensemble(states, "sp", m, "d_phi", "d_z", NEAR).curves for m in n]

    def exponent(drawn: list[Array], high: float = REGIME["sp"][1], first: int = 0) -> float:
        family = []
        for x, y in map(mean_curve, drawn[first:]):
            kept = (y > 0) & (x < high)
            family.append((x[kept], y[kept]))
        return fit_scaling_exponents(np.array(n[first:], dtype=float), [family], b=1.0, start=(2.0, 1.0)).a

    return vary_bootstrap(groups, exponent, {"high": 0.02}, {"first": 1}, resamples=RESAMPLES // 4)
