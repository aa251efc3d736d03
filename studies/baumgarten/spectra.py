"""Draw the spectra of Baumgarten & Tighe: figs 1, 3, 4 and 6."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.plotting.palette import BLACK, BLUE, GREEN, RED
from jamlab.rheology.critical_scaling import CRITICAL, HIGHEST, collapse
from jamlab.statistics.bootstrap import Interval
from jamlab.statistics.power_laws import power_law
from studies import published_numbers as published
from studies.baumgarten.crossovers import claim_crossovers
from studies.baumgarten.spectral_groups import (
    LARGE,
    Group,
    cut_to_shared_frequencies,
    format_power,
    group_by_pressure,
    same_packings,
    select_large,
    select_law,
    select_sampled,
    select_spectra,
    select_sweep,
)
from studies.claims import Kind, as_interval, halves, write_by
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import (
    FEWEST,
    Varied,
    bootstrap,
    enough,
    groups_by,
    mean_over_packings,
    power_over,
    scaled,
    unmeasured,
    vary_bootstrap,
)
from studies.panels import BESIDE, FREQUENCY, Drawing, drawing, label, scale, sequence

MODULUS = r"[$k$]"
RESAMPLES = 60  # of a collapse: each is a fit, seconds for a figure


def draw(
    out: Drawing, axes: Any, group: Group, name: str, look: dict[str, Any], x: float = 1.0, y: float = 1.0
) -> None:
    """Draw G' (filled) and G'' (open) over omega, each times a factor."""
    for part, values, more in (
        ("G'", group.storage, {"linestyle": "-"}),
        ("G''", group.loss, {"linestyle": "--", "markerfacecolor": "white"}),
    ):
        both: dict[str, Any] = look | more | {"markevery": max(len(group.omega) // 20, 1)}
        mean, text = mean_over_packings([values])[0], (name or None) if part == "G'" else None
        out.curve(axes, f"{part} {name}", group.omega * x, scaled(mean, y), label=text, **both)


def _part(group: Group, part: str) -> Array:
    """Choose a part of G*; its critical part is left when the static modulus and the fluid's own loss are taken off."""
    return {
        "G'": group.storage,
        "G''": group.loss,
        "G' - G_0": group.storage - group.g0[:, None],
        "G'' - eta_F omega": group.loss - group.omega,  # of eta_F = 1
    }[part]


def _slope(omega: Array, low: float, high: float, groups: list[Array]) -> float:
    return float(power_law(omega, groups[0].mean(axis=0), low=low, high=high).exponents[0])


def figure_1(tables: EnsembleTables) -> Drawing:
    """G' and G'' of one pressure near jamming: Kelvin-Voigt at both ends, square roots between."""
    table = select_spectra(select_law(tables.spectra, "contact", prestress=True, beta=1.0))
    groups = group_by_pressure(table)
    p = min(groups, key=lambda pressure: abs(np.log(pressure / 1e-4)))
    group = groups[p]
    out, (axes,) = drawing("baumgarten-1", 1, 1, 6.4, 4.6)
    scale(axes)
    draw(out, axes, group, f"$p = {format_power(p)}$", {"color": GREEN, "marker": "o"})
    low, high = CRITICAL * p, HIGHEST
    out.window(axes, low, high)
    w = group.omega
    out.slope(axes, 1.0, (w[0], 0.1 * p), 0.4 * group.loss.mean(axis=0)[0])
    out.slope(axes, 0.5, (low, high), 2.0 * np.interp(low, w, group.storage.mean(axis=0)), above=True)
    if w[-1] > 30:
        out.slope(axes, 1.0, (10, w[-1]), 0.4 * np.interp(10, w, group.loss.mean(axis=0)))
    label(axes, FREQUENCY, rf"$G'$ (filled), $G''$ (open)  {MODULUS}")
    count = f"{len(group.g0)} packings, p = {p:g}"
    for part, regime, a, b, paper in (
        ("G''", "slow", w[0], 0.01 * p, published.KELVIN_VOIGT_SLOPE),
        ("G' - G_0", "critical", low, high, published.CRITICAL_SLOPE),
        ("G''", "critical", low, high, published.CRITICAL_SLOPE),
        ("G''", "fast", 10.0, w[-1], published.KELVIN_VOIGT_SLOPE),
        ("G'", "slow", w[0], 0.01 * p, published.STORAGE_AT_ENDS),
        ("G'", "fast", 10.0, w[-1], published.STORAGE_AT_ENDS),
    ):
        text = f"slope of {part}, {regime}"
        enough = np.count_nonzero((w >= a) & (w <= b)) >= 3
        found, every = _vary_slope(group, part, a, b) if enough else unmeasured()
        words = {"how": f"{count}, {a:.2g} < omega < {b:.2g}", "shown_by": "baumgarten-3 a"}
        words["cause"] = _at_every_pressure(out, text, groups, part) if regime == "critical" else ""
        # a passive linear system is a Kelvin-Voigt solid below its slowest and beyond its fastest rate; fig 3 has the
        # critical slopes again
        kind = Kind.DUPLICATE if regime == "critical" else Kind.IDENTITY
        out.claim(text, found, paper, kind=kind, family=every, **words)
    _claim_nonlinear_slopes(out)
    out.caption = (
        f"G' and G'' of balanced contact damping at p = {p:g}; grey: the critical window, 30 p < omega < 0.1. "
        "Displacement fields: baumgarten-1-fields."
    )
    return out


def _vary_slope(group: Group, part: str, low: float, high: float) -> Varied:
    """Fit the slope, and in both halves of its window; of a part also that of the whole, as neither need be a power."""
    whole = part.split(" - ")[0]
    both = np.stack([_part(group, part), _part(group, whole)], axis=1)

    def slope(drawn: list[Array], low: float = low, high: float = high, of: str = part) -> float:
        return _slope(group.omega, low, high, [drawn[0][:, int(of != part)]])

    windows = halves(low, high)
    of_whole = [{"of": whole} | window for window in ({}, *windows)] if whole != part else []
    return vary_bootstrap([both], slope, *windows, *of_whole)


def _claim_nonlinear_slopes(out: Drawing) -> None:
    """Claim slopes under nonlinear drag, eqs 27 to 29: G* at omega tau_alpha, which goes as omega^alpha."""
    held = {c.quantity: c for c in out.claims}
    linear = {
        "slow G''": "slope of G'', slow",
        "critical G'": "slope of G' - G_0, critical",
        "critical G''": "slope of G'', critical",
    }
    for name, paper in published.NONLINEAR_SLOPES.items():
        c = held[linear[name]]
        found = scaled(Interval(*(np.array(v) for v in (c.value, c.low, c.high))), published.DRAG_EXPONENT)
        every = {k: scaled(v, published.DRAG_EXPONENT) for k, v in c.family.items()}
        text = f"slope of {name}, drag as v^(2/3), equivalent damping"
        out.claim(
            text, found, paper, kind=Kind.DUPLICATE, family=every, how="2/3 of the slope under linear drag, above"
        )


def _at_every_pressure(out: Drawing, text: str, groups: dict[float, Group], part: str) -> str:
    """Keep the critical slope at every pressure whose window is wide enough."""
    slopes = {}
    for p, group in groups.items():
        low = CRITICAL * p
        if np.count_nonzero((group.omega >= low) & (group.omega <= HIGHEST)) >= 5:
            slopes[p] = _slope(group.omega, low, HIGHEST, [_part(group, part)])
    out.keep(text, list(slopes.values()), p=slopes)
    return f"it is {write_by(slopes, '.3f', 'p')}"


def _draw_collapse(out: Drawing, plain: Any, scaled: Any, groups: dict[float, Group]) -> None:
    """Draw spectra of all pressures, as they are (unless `plain` is None) and over p^0.5 against omega/p."""
    for index, (p, group) in enumerate(groups.items()):
        look = sequence(index, len(groups))
        name = f"$p = {format_power(p)}$"
        if plain is not None:
            draw(out, plain, group, name, look)
        kept = group.omega <= HIGHEST
        draw(out, scaled, group.at(kept), name, look, 1 / p, p**-0.5)
    x = np.concatenate([g.omega / p for p, g in groups.items()])
    low = max(x.min(), 1e-4)
    level = float(np.median([g.g0.mean() / p**0.5 for p, g in groups.items()]))
    out.slope(scaled, 1.0, (low, 1e-1), 0.1 * level * low)
    out.slope(scaled, 0.5, (30.0, 3e4), 3.0 * level * 30**0.5 / 2, above=True)
    label(scaled, r"$\omega\,\tau_1 / p$", r"$G' / p^{1/2}$ (filled), $G'' / p^{1/2}$ (open)", **BESIDE)


def figure_3(tables: EnsembleTables) -> Drawing:
    """G* of balanced contact damping for a range of pressures, and its collapse."""
    every = select_law(tables.spectra, "contact", prestress=True, beta=1.0)
    table = select_spectra(every)
    groups = group_by_pressure(table)
    out, (a, b) = drawing("baumgarten-3", 1, 2, 6.6, 4.6)
    scale(a, b)
    _draw_collapse(out, a, b, groups)
    w = next(iter(groups.values())).omega
    least = min(group.loss.mean(axis=0)[0] for group in groups.values())
    out.slope(a, 1.0, (w[0], 1e3 * w[0]), 0.25 * least)
    _draw_largest(out, a, b, every)
    label(a, FREQUENCY, rf"$G'$ (filled), $G''$ (open)  {MODULUS}", **BESIDE)
    both = select_law(tables.spectra, "contact", beta=1.0)
    both = both[both["n"] == table["n"].iloc[0]]
    _claim_exponents(out, both, "contact damping", {"beta": 1.0})
    plain = group_by_pressure(both[~both["prestress"].astype(bool)])
    claim_crossovers(out, select_sampled(groups), select_sampled(plain))
    _claim_without_rotations(out, tables)
    out.caption = (
        "G* of balanced contact damping (beta = 1) with pre-stress, and the same over p^(1/2) against omega/p."
    )
    return out


def _claim_without_rotations(out: Drawing, tables: EnsembleTables) -> None:
    """Claim that Delta is the same where disks do not turn; the family holds the other pressure."""
    table = tables.slow_shear
    for part, column in (("G' - G_0", "storage_slope"), ("G''", "loss_slope")):
        rows = table.dropna(subset=[column])
        p = [q for q in enough(rows, "pressure") if CRITICAL * q < 0.3 * HIGHEST] if len(rows) else []
        groups = groups_by(rows, "pressure", column, p)
        each = {f"p = {q:g}": mean_over_packings([v])[0] for q, v in zip(p, groups, strict=True)}
        found = each.pop(f"p = {p[0]:g}") if p else None
        how = f"N = {rows['n'].iloc[0]}, p = {p[0]:g}, mean over packings" if p else "no packing has its slope"
        text = f"Delta: {part} ~ omega^Delta, contact damping without rotations"
        words = {
            "how": how,
            "unlike": "the paper says that the form is the same, at 64 times the size, and has no number",
        }
        out.claim(text, found, published.WITHOUT_ROTATIONS, family=each, **words, shown_by="baumgarten-3 a")


def _draw_largest(out: Drawing, plain: Any, scaled: Any, table: pd.DataFrame) -> None:
    """Draw the largest packing of all as a black line, if it stands alone and has a whole spectrum."""
    n = int(table["n"].max())
    part = table[table["n"] == n]
    if n == int(select_spectra(table)["n"].iloc[0]) or part["omega"].nunique() < 10:
        return
    for p, group in group_by_pressure(part).items():
        kept = group.omega <= HIGHEST
        for name, values in (("G'", group.storage.mean(axis=0)), ("G''", group.loss.mean(axis=0))):
            series = f"{name} N = {n}, p = {p:g}"
            text = rf"$N = {n}$, $p = {format_power(p)}$" if name == "G'" else None
            out.curve(plain, series, group.omega, values, label=text, color=BLACK)
            out.curve(scaled, series, group.omega[kept] / p, values[kept] / p**0.5, label=None, color=BLACK)


def figure_4(tables: EnsembleTables) -> Drawing:
    """Sliding that is damped less, or not at all."""
    out, (a, b) = drawing("baumgarten-4", 1, 2, 6.6, 4.8)
    scale(a, b)
    every = select_law(tables.spectra, "contact")
    table = select_spectra(every)
    undamped = select_law(table, "contact", beta=0.0)
    gap: Interval | None = None
    loose: dict[float, Group] = {}
    for prestress in (True, False):
        part = undamped[undamped["prestress"].astype(bool) == prestress]
        groups = group_by_pressure(part) if len(part) else {}
        if not prestress:
            loose = groups
        for index, (p, group) in enumerate(groups.items()):
            look = sequence(index, len(groups))
            if prestress:
                draw(out, a, group, f"$p = {format_power(p)}$", look, 1.0, p**-0.5)
            else:
                _draw_loose(out, a, p, group, "no pre-stress: dotted" if not index else None)
    if loose:
        ratio = [g.loss / (g.omega * g.g0[:, None]) - 1 for g in select_sampled(loose).values()]
        gap = bootstrap(ratio, lambda g: max(float(np.abs(r).max()) for r in g))
    label(a, FREQUENCY, r"$G' / p^{1/2}$ (filled), $G'' / p^{1/2}$ (open)", loc="lower right", fontsize=8)
    out.slope(a, 1.0, (1e-6, 1e-4), 1e-5, above=True)
    text = "largest |G''/(omega G_0) - 1|, beta = 0, no pre-stress (eq 18)"
    how = "all frequencies and pressures with five packings or more"
    out.claim(text, gap, published.UNDAMPED_LOSS, kind=Kind.IDENTITY, how=how)  # K = tau B
    n = int(table["n"].iloc[0])
    _claim_undamped(out, select_large(loose, n))
    _claim_stressed(out, undamped[undamped["prestress"].astype(bool)], n)
    _claim_least_damping(out, table, n)
    _draw_beta_sweep(out, b, select_sweep(every[every["prestress"].astype(bool)], "beta"))
    out.caption = (
        "(a) No damping of sliding: G* over p^(1/2), with pre-stress and without (dotted); the frequency is not "
        "rescaled. (b) Balance beta of sliding to approach at one pressure; inset: viscosity at low and high frequency."
    )
    return out


def _draw_loose(out: Drawing, axes: Any, p: float, group: Group, name: str | None) -> None:
    """Draw G* without pre-stress as dotted lines, which nearly fall onto each other."""
    for part, values in (("G'", group.storage), ("G''", group.loss)):
        mean = values.mean(axis=0) * p**-0.5
        text = name if part == "G'" else None
        out.curve(axes, f"{part} p = {p:g}, no pre-stress", group.omega, mean, label=text, color=BLACK, linestyle=":")


def _claim_undamped(out: Drawing, groups: dict[float, Group]) -> None:
    """Claim how the viscosity without damping of sliding goes with pressure: as G_0 does, as it is tau G_0."""
    p = list(groups)
    how = f"{len(p)} pressures with p N^2 > {LARGE:g}, no pre-stress"
    found, every = power_over(p, [g.eta0 for g in groups.values()], lambda drawn: [v.mean() for v in drawn])
    text = "exponent of eta_0 in p, beta = 0 (eq 22)"
    out.claim(text, found, published.UNDAMPED_VISCOSITY, kind=Kind.DUPLICATE, family=every, how=how)


def _claim_stressed(out: Drawing, table: pd.DataFrame, n: int) -> None:
    """Claim that undamped sliding has no slow time with pre-stress either: G_0/eta_0 does not go with pressure."""
    groups = select_large(group_by_pressure(table), n) if len(table) else {}
    p, drawn = list(groups), [np.column_stack([g.g0, g.eta0]) for g in groups.values()]
    found, every = power_over(p, drawn, lambda drawn: [np.divide(*v.mean(axis=0)) for v in drawn])
    words = {
        "how": f"{len(p)} pressures with pre-stress",
        "cause": "eta_0 over that without pre-stress grows as p falls",
    }
    text = "exponent of G_0/eta_0 in p, beta = 0, with pre-stress"
    out.claim(text, found, published.NO_SLOW_TIME, family=every, **words, shown_by="baumgarten-4 a")


def _claim_least_damping(out: Drawing, table: pd.DataFrame, n: int) -> None:
    """Claim how beta*, where sliding takes as much energy as approach, goes with pressure."""

    def ratios(prestress: bool) -> dict[float, Array]:
        rows = table[table["prestress"].astype(bool) == prestress]
        none, full = (select_large(group_by_pressure(rows[rows["beta"] == beta]), n) for beta in (0.0, 1.0))
        pairs = {p: same_packings([none[p], full[p]]) for p in none if p in full}
        return {p: eta for p, eta in pairs.items() if len(eta)}

    def stars(drawn: Sequence[Array]) -> list[float]:
        return [v[:, 0].mean() / float(np.diff(v.mean(axis=0))[0]) for v in drawn]

    loose, stressed = ratios(False), ratios(True)
    found, every = power_over(list(loose), list(loose.values()), stars)
    every["with pre-stress"] = as_interval(power_over(list(stressed), list(stressed.values()), stars)[0])
    words = {"how": f"{len(loose)} pressures, no pre-stress", "shown_by": "baumgarten-4 b"}
    words["cause"] = "eta_0 at beta = 0 over what sliding adds at beta = 1"
    out.claim("exponent of beta* in p", found, published.BETA_STAR, family=every, **words)


def _draw_beta_sweep(out: Drawing, axes: Any, table: pd.DataFrame) -> None:
    """Draw G* at one pressure for every beta, viscosities in an inset, and add the claim on their growth."""
    p = float(table["target_pressure"].iloc[0])
    betas = sorted(table["beta"].unique())
    ends: dict[float, Group] = {}
    for index, beta in enumerate(betas):
        groups = group_by_pressure(table[table["beta"] == beta])
        if p in groups:
            ends[beta] = groups[p]
            text = rf"$\beta = {format_power(beta) if beta else 0}$"
            draw(out, axes, groups[p], text, sequence(index, len(betas)))
    label(axes, FREQUENCY, rf"$G'$ (filled), $G''$ (open)  {MODULUS}", loc="upper left", fontsize=7.5, ncols=2)
    axes.set_ylim(axes.get_ylim()[0], 1e3 * axes.get_ylim()[1])
    inset = axes.inset_axes((1.12, 0.55, 0.42, 0.4))
    inset.set_gid("b-inset")
    scale(inset)
    known = [beta for beta in ends if beta > 0]
    for name, colour in (("eta0", BLUE), ("eta_inf", RED)):
        values = [float(getattr(ends[beta], name).mean()) for beta in known]
        out.curve(inset, name, known, values, color=colour, marker="o", markersize=3)
    inset.set_title(r"$\eta_0$ (blue), $\eta_\infty$ (red) over $\beta$", fontsize=7.5, pad=3)
    inset.tick_params(labelsize=7)
    found, how = None, "needs beta = 0 and two others"
    if len(known) > 1 and 0.0 in ends:
        how = f"p = {p:g}"
        eta = same_packings([ends[beta] for beta in (0.0, *known)])
        found = bootstrap([eta], lambda g: power_law(known, g[0][:, 1:].mean(0) - g[0][:, 0].mean()).exponents[0])
    text = "exponent of eta_0(beta) - eta_0(0) in beta (eq 22)"
    out.claim(text, found, published.SLIDING_VISCOSITY, kind=Kind.IDENTITY, how=how)  # linear in beta by construction


def figure_6(tables: EnsembleTables) -> Drawing:
    """Stokes drag: collapse for eta_F = 1, and what the viscosity of the fluid adds."""
    every = select_law(tables.spectra, "stokes", prestress=True)
    stokes = select_spectra(every)
    groups = group_by_pressure(select_law(stokes, "stokes", eta_f=1.0))
    out, (a, b) = drawing("baumgarten-6", 1, 2, 6.4, 4.8)
    scale(a, b)
    _draw_collapse(out, None, a, groups)
    part = select_sweep(every, "eta_f")
    p = float(part["target_pressure"].iloc[0])
    viscosity: dict[float, Group] = {}
    for index, eta_f in enumerate(sorted(part["eta_f"].unique())):
        found = group_by_pressure(part[part["eta_f"] == eta_f])
        if p in found:
            viscosity[eta_f] = found[p]
            text = rf"$\eta_F = {format_power(eta_f) if eta_f else 0}$"
            draw(out, b, found[p], text, sequence(index, part["eta_f"].nunique()))
    label(b, FREQUENCY, rf"$G'$ (filled), $G''$ (open)  {MODULUS}", loc="upper left", fontsize=7.5)
    both = select_law(tables.spectra, "stokes", eta_f=1.0)
    both = both[both["n"] == stokes["n"].iloc[0]]
    _claim_exponents(out, both, "Stokes drag", {"eta_f": 1.0})
    added, how = None, "needs two fluid viscosities"
    if len(viscosity) > 1:
        low, high = min(viscosity), max(viscosity)
        how = f"eta_F = {low:g} and {high:g}, p = {p:g}"
        rise = np.diff(same_packings([viscosity[low], viscosity[high]]))[:, 0] / (high - low)
        added = bootstrap([rise], lambda g: g[0].mean())
    low, high = CRITICAL * p, HIGHEST
    if (
        viscosity
        and np.count_nonzero((viscosity[max(viscosity)].omega >= low) & (viscosity[max(viscosity)].omega <= high)) > 2
    ):
        most = max(viscosity)
        slope = bootstrap([viscosity[most].loss], partial(_slope, viscosity[most].omega, low, high))
        text, where = "slope of G'' in the critical window, largest eta_F", "[T] Stokes drag, fig 6 b"
        words = {"how": f"eta_F = {most:g}, p = {p:g}", "where": where}
        out.claim(text, slope, published.KELVIN_VOIGT_SLOPE, kind=Kind.IDENTITY, **words)
    out.claim("d eta_0 / d eta_F", added, published.FLUID_VISCOSITY, kind=Kind.IDENTITY, how=how)  # likewise
    out.caption = (
        f"Stokes drag: (a) collapse for eta_F = 1; (b) fluid viscosities at p = {p:g}, which add omega eta_F to G''."
    )
    return out


def _claim_exponents(out: Drawing, table: pd.DataFrame, law: str, parameters: dict[str, float]) -> None:
    """Claim mu and lambda, with the half-widths that `jamlab.collapse` gives, and Delta of both parts of G*."""
    n = int(table["n"].iloc[0])
    kind = "contact" if "beta" in parameters else "stokes"
    stressed = select_law(table, kind, prestress=True, **parameters)
    groups = select_large(group_by_pressure(stressed), n)
    values: list[tuple[float, float]] = [(np.nan, np.nan)] * 2
    every: list[dict[str, Interval | None]] = [{}, {}]
    how = f"needs three pressures with p N^2 > {LARGE:g} and {FEWEST} packings each"
    cause = ""
    if len(groups) >= 3 and min(len(g.g0) for g in groups.values()) >= FEWEST:
        try:
            members = [g.members() for g in cut_to_shared_frequencies(groups).values()]
            fit = collapse(list(groups), members, resamples=RESAMPLES)
        except InputError as error:
            how = str(error)
        else:
            values = [(fit.mu, fit.mu_error), (fit.lam, fit.lam_error)]
            stable, asked = sum(len(g.g0) for g in groups.values()), stressed["seed"].nunique() * len(groups)
            spread = out.keep("spread of the collapse in ln G*", fit.spread)
            ends = [np.column_stack([g.g0, g.eta0]) for g in groups.values()]
            static, _ = power_over(list(groups), ends, lambda drawn: [v[:, 0].mean() for v in drawn])
            times, _ = power_over(list(groups), ends, lambda drawn: [np.divide(*v.mean(axis=0)) for v in drawn])
            every = [{"of = G_0 alone": static}, {"of = G_0/eta_0 alone": times}]
            cause = _static_exponents(out, table, kind, parameters, n)
            how = (
                f"N = {n}, collapse of {len(groups)} pressures, omega < 0.1, {stable} of {asked} packings stable, "
                f"spread {spread:.2g} in ln G*; {cause}"
            )
    mu, lam = (Interval(np.array(v), np.array(v - e), np.array(v + e)) for v, e in values)
    shown = {"shown_by": f"{out.name} a", "how": how}
    same = Kind.MEASURED if kind == "contact" else Kind.DUPLICATE  # G_0 does not know the drag law
    out.claim(f"mu: G_0 ~ p^mu, {law}", mu, published.MU, kind=same, family=every[0], cause=cause, **shown)
    out.claim(f"lambda: tau* ~ p^-lambda, {law}", lam, published.LAMBDA, family=every[1], **shown)
    for part in ("G' - G_0", "G''" if kind == "contact" else "G'' - eta_F omega"):
        _claim_delta(out, f"Delta: {part} ~ omega^Delta, {law}", groups, part)


def _claim_delta(out: Drawing, text: str, groups: dict[float, Group], part: str) -> None:
    """Claim the critical slope of a part of G* at the lowest pressure: a mean over both parts may hide two errors."""
    wide = [p for p, g in groups.items() if np.count_nonzero((g.omega >= CRITICAL * p) & (g.omega <= HIGHEST)) >= 5]
    if not wide:
        out.claim(text, None, published.DELTA, how="no pressure has five frequencies in its critical window")
        return
    p = min(wide)
    low = CRITICAL * p
    found, every = _vary_slope(groups[p], part, low, HIGHEST)
    words = {"how": f"{len(groups[p].g0)} packings, p = {p:g}, {low:.2g} < omega < {HIGHEST:g}", "shown_by": out.name}
    words["cause"] = _at_every_pressure(out, text, groups, part)
    out.claim(text, found, published.DELTA, family=every, **words)


def _static_exponents(out: Drawing, table: pd.DataFrame, kind: str, parameters: dict[str, float], n: int) -> str:
    """Keep the exponents of G_0 itself in p, with pre-stress and without it."""
    found = []
    for prestress, word in ((True, "with"), (False, "without")):
        try:
            rows = select_law(table, kind, prestress=prestress, **parameters)
        except InputError:
            continue
        groups = select_large(group_by_pressure(rows), n)
        slope = power_law(list(groups), [g.g0.mean() for g in groups.values()]).exponents[0]
        out.keep(f"exponent of G_0 in p, {word} pre-stress", slope)
        found.append(f"{slope:.2f} {word} pre-stress")
    return f"G_0 alone rises with p^{' and '.join(found)}"
