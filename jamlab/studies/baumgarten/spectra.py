"""Draw the spectra of Baumgarten & Tighe: figs 1, 3, 4 and 6."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.plotting.palette import BLACK, BLUE, GREEN, RED
from jamlab.rheology.critical_scaling import CRITICAL, HIGHEST
from jamlab.statistics import published_numbers as published
from jamlab.statistics.bootstrap import Interval
from jamlab.statistics.power_laws import power_law
from jamlab.studies.baumgarten.critical_exponents import exponent_claims
from jamlab.studies.baumgarten.spectral_groups import (
    LARGE,
    Group,
    format_power,
    group_by_pressure,
    same_packings,
    select_large,
    select_law,
    select_sampled,
    select_spectra,
    select_sweep,
)
from jamlab.studies.claims import Claim, claim
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.ensembles import average, bootstrap
from jamlab.studies.panels import BESIDE, FREQUENCY, Drawing, drawing, label, scale, sequence

MODULUS = r"[$k$]"


def nearest(values: Sequence[float], wanted: float) -> float:
    """Pick the value nearest by ratio."""
    return min(values, key=lambda v: abs(np.log(v / wanted)))


def draw(
    out: Drawing, axes: Any, group: Group, name: str, look: dict[str, Any], x: float = 1.0, y: float = 1.0
) -> None:
    """Draw G' (filled) and G'' (open) over omega, each times a factor."""
    for part, values, more in (
        ("G'", group.storage, {"linestyle": "-"}),
        ("G''", group.loss, {"linestyle": "--", "markerfacecolor": "white"}),
    ):
        both: dict[str, Any] = look | more
        band = bootstrap([values], lambda g: average(g[0]))
        text = (name or None) if part == "G'" else None
        series = f"{part} {name}"
        m = max(len(group.omega) // 20, 1)
        out.curve(
            axes,
            series,
            group.omega * x,
            band.value * y,
            band.low * y,
            band.high * y,
            label=text,
            markevery=m,
            **both,
        )


def _slope(values: Array, omega: Array, low: float, high: float) -> float:
    return float(power_law(omega, values.mean(axis=0), low=low, high=high).exponents[0])


def figure_1(tables: EnsembleTables) -> Drawing:
    """G' and G'' of one pressure near jamming: Kelvin-Voigt at both ends, square roots between."""
    table = select_spectra(select_law(tables.spectra, "contact", prestress=True, beta=1.0))
    groups = group_by_pressure(table)
    p = nearest(list(groups), 1e-4)
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
    for text, part, a, b, paper in (
        ("slope of G'', slow", 1, w[0], 0.01 * p, published.KELVIN_VOIGT_SLOPE),
        ("slope of G', critical", 0, low, high, published.CRITICAL_SLOPE),
        ("slope of G'', critical", 1, low, high, published.CRITICAL_SLOPE),
        ("slope of G'', fast", 1, 10.0, w[-1], published.KELVIN_VOIGT_SLOPE),
    ):
        enough = np.count_nonzero((w >= a) & (w <= b)) >= 3
        found = group.interval(lambda *g, k=part, a=a, b=b: _slope(g[k], w, a, b)) if enough else None
        how = f"{count}, {a:.2g} < omega < {b:.2g}"
        cause = _at_every_pressure(groups, part) if "critical" in text else ""
        out.claims.append(claim(out.name, text, found, paper, how=how, cause=cause, shown_by="baumgarten-3 a"))
    out.caption = (
        f"G' and G'' of balanced contact damping at p = {p:g}; grey: the critical window, 30 p < omega < 0.1. "
        "Displacement fields: baumgarten-1-fields."
    )
    return out


def _at_every_pressure(groups: dict[float, Group], part: int) -> str:
    """Say what the critical slope is at every pressure whose window is wide enough."""
    slopes = []
    for p, group in groups.items():
        low = CRITICAL * p
        if np.count_nonzero((group.omega >= low) & (group.omega <= HIGHEST)) >= 5:
            slopes.append((p, _slope((group.storage, group.loss)[part], group.omega, low, HIGHEST)))
    values = ", ".join(f"{slope:.3f}" for _, slope in slopes)
    return f"it is {values} at p = {', '.join(f'{p:g}' for p, _ in slopes)}"


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
    scale(a)
    scale(b)
    _draw_collapse(out, a, b, groups)
    w = next(iter(groups.values())).omega
    lowest = list(groups.values())[-1]
    out.slope(a, 1.0, (w[0], 1e3 * w[0]), 4 * lowest.loss.mean(axis=0)[0], above=True)
    _draw_largest(out, a, b, every)
    label(a, FREQUENCY, rf"$G'$ (filled), $G''$ (open)  {MODULUS}", **BESIDE)
    both = select_law(tables.spectra, "contact", beta=1.0)
    both = both[both["n"] == table["n"].iloc[0]]
    out.claims = exponent_claims(out.name, both, "contact damping", {"beta": 1.0})
    out.caption = (
        "G* of balanced contact damping (beta = 1) with pre-stress, and the same over p^(1/2) against omega/p."
    )
    return out


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
    scale(a)
    scale(b)
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
    out.claims.append(
        claim(
            out.name,
            "largest |G''/(omega G_0) - 1|, beta = 0, no pre-stress (eq 18)",
            gap,
            published.UNDAMPED_LOSS,
            how="all frequencies and pressures with five packings or more",
        )
    )
    out.claims += _undamped_claims(out.name, select_large(loose, int(table["n"].iloc[0])))
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


def _undamped_claims(name: str, groups: dict[float, Group]) -> list[Claim]:
    p = list(groups)
    found = None
    how = f"needs two pressures with p N^2 > {LARGE:g} without pre-stress"
    if len(p) > 1:
        how = f"{len(p)} pressures, no pre-stress"
        found = bootstrap([g.eta0 for g in groups.values()], lambda g: power_law(p, [v.mean() for v in g]).exponents[0])
    return [claim(name, "exponent of eta_0 in p, beta = 0 (eq 22)", found, published.UNDAMPED_VISCOSITY, how=how)]


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
    out.claims.append(claim(out.name, text, found, published.SLIDING_VISCOSITY, how=how))


def figure_6(tables: EnsembleTables) -> Drawing:
    """Stokes drag: collapse for eta_F = 1, and what the viscosity of the fluid adds."""
    every = select_law(tables.spectra, "stokes", prestress=True)
    stokes = select_spectra(every)
    groups = group_by_pressure(select_law(stokes, "stokes", eta_f=1.0))
    out, (a, b) = drawing("baumgarten-6", 1, 2, 6.4, 4.8)
    scale(a)
    scale(b)
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
    out.claims = exponent_claims(out.name, both, "Stokes drag", {"eta_f": 1.0})
    added, how = None, "needs two fluid viscosities"
    if len(viscosity) > 1:
        low, high = min(viscosity), max(viscosity)
        how = f"eta_F = {low:g} and {high:g}, p = {p:g}"
        rise = np.diff(same_packings([viscosity[low], viscosity[high]]))[:, 0] / (high - low)
        added = bootstrap([rise], lambda g: g[0].mean())
    out.claims.append(claim(out.name, "d eta_0 / d eta_F", added, published.FLUID_VISCOSITY, how=how))
    out.caption = (
        f"Stokes drag: (a) collapse for eta_F = 1; (b) fluid viscosities at p = {p:g}, which add omega eta_F to G''."
    )
    return out
