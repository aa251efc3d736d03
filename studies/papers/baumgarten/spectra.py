"""Draw the spectra of Baumgarten & Tighe: figs 1, 3, 4 and 6."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.plotting.palette import BLACK, BLUE, GREEN, RED
from jamlab.rheology.critical_scaling import CRITICAL, HIGHEST, collapse
from jamlab.statistics.bootstrap import Interval
from jamlab.statistics.power_laws import power_law
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import FEWEST, Sample, groups_by, mean_over_packings, scaled, select, vary_bootstrap
from studies.panels import BESIDE, FREQUENCY, Drawing, drawing, label, scale, sequence
from studies.papers.baumgarten.spectral_groups import (
    SIZE,
    Group,
    format_power,
    same_packings,
    sampled,
    scan,
    spectra,
)
from studies.papers.boromand.conventions import halves
from studies.papers.statements import Measured, caption, measured, measures, statistic

MODULUS = r"[$k$]"
SHOWN = 1e-4  # pressure of fig 1
LOWEST = 3.16e-6  # pressure of which the critical regime is widest, among those with five stable packings
RESAMPLES = 60  # of a collapse: each is a fit, seconds for a figure


# slopes of G* in windows of frequency ---------------------------------------------------------------------------------


def part_of(group: Group, part: str) -> Array:
    """Choose a part of G*; its critical part is left when the static modulus and the fluid's own loss are taken off."""
    return {
        "G'": group.storage,
        "G''": group.loss,
        "G' - G_0": group.storage - group.g0[:, None],
        "G'' - eta_F omega": group.loss - group.omega,  # of eta_F = 1
    }[part]


def spectrum(tables: EnsembleTables, law: str, pressure: float, part: str) -> Sample:
    """Take omega and a part of G* of packings at one pressure, with pre-stress."""
    group = spectra(tables, law)[pressure]
    return Sample([part_of(group, part)], lambda drawn: (group.omega, drawn[0]))


def slope(omega: Array, values: Array, low: float, high: float) -> float:
    """Fit the slope of the mean in a window of frequency."""
    return float(power_law(omega, values.mean(axis=0), low=low, high=high).exponents[0])


for _name, _law, _part in (
    ("T3-Delta-storage", "contact", "G' - G_0"),
    ("T3-Delta-loss", "contact", "G''"),
    ("T6-Delta-storage", "stokes", "G' - G_0"),
    ("T6-Delta-loss", "stokes", "G'' - eta_F omega"),
):
    _low, _windows = CRITICAL * LOWEST, halves(CRITICAL * LOWEST, HIGHEST)
    _whole = {"part": _part.split(" - ")[0]}  # of which neither need be a power
    _others = [_whole | window for window in ({}, *_windows)] if _whole["part"] != _part else []
    statistic(
        _name,
        sample=spectrum,
        law=_law,
        pressure=LOWEST,
        part=_part,
        low=_low,
        high=HIGHEST,
        variants=(*_windows, *_others),
    )(slope)


# exponents in pressure ------------------------------------------------------------------------------------------------


def power_in(places: Sequence[float] | Array, sample: Sample) -> Measured:
    """Fit an exponent in some places; and without the first and without the last, as any power holds there too."""

    def fit(y: Array, first: int = 0, last: int | None = None) -> float:
        return float(power_law(places[first:last], y[first:last]).exponents[0])

    if len(places) < 2:
        raise InputError(f"{len(places)} places for an exponent: two or more are needed")
    choices: tuple[dict[str, int], ...] = ({"first": 1}, {"last": -1}) if len(places) > 2 else ()
    return measured(*vary_bootstrap(sample.groups, fit, *choices, reduce=sample.reduce), "Fit an exponent in p.")


def power_in_pressure(groups: Mapping[float, ArrayLike], values: Callable[[Sequence[Array]], ArrayLike]) -> Measured:
    """Fit the exponent in pressure of what packings that are drawn at each give."""
    drawn = [np.asarray(group) for group in groups.values()]
    return power_in(list(groups), Sample(drawn, lambda d: [np.asarray(values(d))]))


def _ratios(drawn: Sequence[Array]) -> list[float]:
    return [float(np.divide(*v.mean(axis=0))) for v in drawn]


@measures("T3-mu", "T3-lambda", law="contact")
@measures("T6-mu", "T6-lambda", law="stokes")
def collapsed(tables: EnsembleTables, law: str) -> list[Measured]:
    """Fit mu and lambda by `jamlab.collapse` of omega < 0.1; other analyses: G_0 and G_0/eta_0 alone."""
    groups = sampled(spectra(tables, law))
    if len(groups) < 3:
        raise InputError(f"{len(groups)} pressures with {FEWEST} stable packings: a collapse takes three")
    fit = collapse(list(groups), [g.members() for g in groups.values()], resamples=RESAMPLES)
    ends, how = {p: np.column_stack([g.g0, g.eta0]) for p, g in groups.items()}, f"collapse of {len(groups)} pressures"
    static, times = power_in_pressure(ends, lambda d: [v[:, 0].mean() for v in d]), power_in_pressure(ends, _ratios)
    return [
        measured(Interval(*map(np.array, (v, v - e, v + e))), {name: alone.interval}, f"{how}, N = {SIZE}")
        for v, e, name, alone in (
            (fit.mu, fit.mu_ci95, "of = G_0 alone", static),
            (fit.lam, fit.lam_ci95, "of = G_0/eta_0 alone", times),
        )
    ]


@measures("T4-slow-time")
def undamped(tables: EnsembleTables) -> Measured:
    """Fit the exponent in p of G_0/eta_0 without damping of sliding."""
    groups = sampled(spectra(tables, "undamped"))
    return power_in_pressure({p: np.column_stack([g.g0, g.eta0]) for p, g in groups.items()}, _ratios)


def _star(tables: EnsembleTables, prestress: bool) -> Measured:
    """Fit how beta*, where sliding takes as much energy as approach, goes with pressure."""
    none, full = (sampled(spectra(tables, law, prestress)) for law in ("undamped", "contact"))
    pairs = {p: same_packings([none[p], full[p]]) for p in none if p in full}

    def stars(drawn: Sequence[Array]) -> list[float]:
        return [v[:, 0].mean() / float(np.diff(v.mean(axis=0))[0]) for v in drawn]

    return power_in_pressure({p: eta for p, eta in pairs.items() if len(eta)}, stars)


@measures("T4-beta-star")
def beta_star(tables: EnsembleTables) -> Measured:
    """Fit how beta* goes with pressure, without pre-stress; another analysis: with it."""
    found, other = _star(tables, False), _star(tables, True)
    return measured(found.interval, {**found.variants, "with pre-stress": other.interval}, found.how)


# ends of the regimes --------------------------------------------------------------------------------------------------


def wide_spectra(tables: EnsembleTables) -> Sample:
    """Take eta_0, eta_inf and G'' of the pressures whose critical regime is not empty."""
    groups = {p: g for p, g in sampled(spectra(tables, "contact"), large=False).items() if CRITICAL * p < HIGHEST}
    drawn = [np.column_stack([g.eta0, g.eta_inf, g.loss]) for g in groups.values()]
    return Sample(drawn, lambda packings: (list(groups), [g.omega for g in groups.values()], packings))


@statistic(
    "T3-affine",
    "T3-quasistatic-end",
    "T3-critical-end",
    sample=wide_spectra,
    variants=({"at": 0.05}, {"at": 0.2}, {"pressure": 0}),
)
def regime_ends(
    p: list[float], omega: list[Array], drawn: list[Array], at: float = HIGHEST, pressure: int = -1
) -> Array:
    """Find where the law omega^0.5 through G'' at one frequency meets eta_inf omega, as a power of p, and at the lowest
    pressure where it meets eta_0 omega and eta_inf omega, in decades of omega/p and of omega."""
    means = [packings.mean(axis=0) for packings in drawn]
    roots = np.array([np.interp(at, w, mean[2:]) / at**0.5 for w, mean in zip(omega, means, strict=True)])
    slow, fast = np.square(roots / np.array([mean[:2] for mean in means]).T)
    return np.array([power_law(p, fast).exponents[0], np.log10(slow[pressure] / p[pressure]), np.log10(fast[pressure])])


# without rotations, without damping, with a fluid ---------------------------------------------------------------------


def of_column(tables: EnsembleTables, column: str, pressure: float) -> Sample:
    """Take a column of slow shear of small packings at one pressure, with all pressures that have it."""
    rows = select(tables.quasistatic.dropna(subset=[column]), n=512)
    return Sample(groups_by(rows, "pressure", column, [pressure]))


def mean(groups: list[Array]) -> float:
    """Average over packings."""
    return float(groups[0].mean())


for _part in ("storage", "loss"):
    statistic(
        f"T3-Delta-{_part}-no-rotation",
        sample=of_column,
        column=f"{_part}_slope",
        pressure=1e-4,
        variants=({"pressure": 3.16e-4},),
    )(mean)


# drawings -------------------------------------------------------------------------------------------------------------


def draw(
    out: Drawing, axes: Any, group: Group, name: str, look: dict[str, Any], x: float = 1.0, y: float = 1.0
) -> None:
    """Draw G' (filled) and G'' (open) over omega, each times a factor."""
    for part, values, more in (
        ("G'", group.storage, {"linestyle": "-"}),
        ("G''", group.loss, {"linestyle": "--", "markerfacecolor": "white"}),
    ):
        both: dict[str, Any] = look | more | {"markevery": max(len(group.omega) // 20, 1)}
        found, text = mean_over_packings([values])[0], name if part == "G'" else None
        out.curve(axes, f"{part} {name}", group.omega * x, scaled(found, y), label=text, **both)


def figure_1(tables: EnsembleTables) -> Drawing:
    """G' and G'' of one pressure near jamming: Kelvin-Voigt at both ends, square roots between."""
    group = spectra(tables, "contact")[SHOWN]
    out, (axes,) = drawing("baumgarten-1", 1, 1, 6.4, 4.6)
    scale(axes)
    draw(out, axes, group, f"$p = {format_power(SHOWN)}$", {"color": GREEN, "marker": "o"})
    low, high, w = CRITICAL * SHOWN, HIGHEST, group.omega
    storage, loss = group.storage.mean(axis=0), group.loss.mean(axis=0)
    out.window(axes, low, high)
    out.slope(axes, 1.0, (w[0], 0.1 * SHOWN), 0.4 * loss[0])
    out.slope(axes, 0.5, (low, high), 2.0 * np.interp(low, w, storage), above=True)
    out.slope(axes, 1.0, (10, w[-1]), 0.4 * np.interp(10, w, loss))
    label(axes, FREQUENCY, rf"$G'$ (filled), $G''$ (open)  {MODULUS}")
    out.caption = caption(out.name)
    return out


def _draw_collapse(out: Drawing, plain: Any, over: Any, groups: dict[float, Group]) -> None:
    """Draw spectra of all pressures, as they are (unless `plain` is None) and over p^0.5 against omega/p."""
    for index, (p, group) in enumerate(groups.items()):
        look, name = sequence(index, len(groups)), f"$p = {format_power(p)}$"
        if plain is not None:
            draw(out, plain, group, name, look)
        draw(out, over, group.at(group.omega <= HIGHEST), name, look, 1 / p, p**-0.5)
    low = max(min(g.omega[0] / p for p, g in groups.items()), 1e-4)
    level = float(np.median([g.g0.mean() / p**0.5 for p, g in groups.items()]))
    out.slope(over, 1.0, (low, 1e-1), 0.1 * level * low)
    out.slope(over, 0.5, (30.0, 3e4), 3.0 * level * 30**0.5 / 2, above=True)
    place = BESIDE if plain is None else {"legend": False}
    label(over, r"$\omega\,\tau_1 / p$", r"$G' / p^{1/2}$ (filled), $G'' / p^{1/2}$ (open)", **place)


def figure_3(tables: EnsembleTables) -> Drawing:
    """G* of balanced contact damping for a range of pressures, and its collapse."""
    groups = spectra(tables, "contact")
    out, (a, b) = drawing("baumgarten-3", 1, 2, 6.6, 4.6)
    scale(a, b)
    _draw_collapse(out, a, b, groups)
    w = next(iter(groups.values())).omega
    least = min(group.loss.mean(axis=0)[0] for group in groups.values())
    out.slope(a, 1.0, (w[0], 1e3 * w[0]), 0.25 * least)
    label(a, FREQUENCY, rf"$G'$ (filled), $G''$ (open)  {MODULUS}", **BESIDE)
    out.caption = caption(out.name)
    return out


def figure_4(tables: EnsembleTables) -> Drawing:
    """Sliding that is damped less, or not at all."""
    out, (a, b, c) = drawing("baumgarten-4", 1, 3, 5.6, 4.8)
    scale(a, b, c)
    groups = spectra(tables, "undamped")
    for index, (p, group) in enumerate(groups.items()):
        draw(out, a, group, f"$p = {format_power(p)}$", sequence(index, len(groups)), 1.0, p**-0.5)
    for index, (p, group) in enumerate(spectra(tables, "undamped", prestress=False).items()):
        for part, values in (("G'", group.storage), ("G''", group.loss)):  # which nearly fall onto each other
            text = "no pre-stress: dotted" if part == "G'" and not index else None
            name, over = f"{part} p = {p:g}, no pre-stress", values.mean(axis=0) * p**-0.5
            out.curve(a, name, group.omega, over, label=text, color=BLACK, linestyle=":")
    label(a, FREQUENCY, r"$G' / p^{1/2}$ (filled), $G'' / p^{1/2}$ (open)", loc="lower right", fontsize=8)
    out.slope(a, 1.0, (1e-6, 1e-4), 1e-5, above=True)
    _draw_scan(out, b, scan(tables, "contact", "beta"), r"\beta")
    known = {beta: group for beta, group in scan(tables, "contact", "beta").items() if beta > 0}
    for name, text, colour in (("eta0", r"$\eta_0$", BLUE), ("eta_inf", r"$\eta_\infty$", RED)):
        mean_values = [float(getattr(group, name).mean()) for group in known.values()]
        out.curve(c, name, list(known), mean_values, label=text, color=colour, marker="o")
    label(c, r"balance $\beta$", r"viscosity  [$k\,\tau_1$]")
    out.caption = caption(out.name)
    return out


def _draw_scan(out: Drawing, axes: Any, groups: dict[float, Group], symbol: str) -> None:
    """Draw G* at one pressure for every value of a parameter of damping."""
    for index, (value, group) in enumerate(groups.items()):
        draw(out, axes, group, rf"${symbol} = {format_power(value) if value else 0}$", sequence(index, len(groups)))
    ncols = 2 if symbol == r"\beta" else 1
    label(axes, FREQUENCY, rf"$G'$ (filled), $G''$ (open)  {MODULUS}", loc="best", fontsize=7.5, ncols=ncols)


def figure_6(tables: EnsembleTables) -> Drawing:
    """Stokes drag: collapse for eta_F = 1, and what the viscosity of the fluid adds."""
    out, (a, b) = drawing("baumgarten-6", 1, 2, 6.4, 4.8)
    scale(a, b)
    _draw_collapse(out, None, a, spectra(tables, "stokes"))
    _draw_scan(out, b, scan(tables, "stokes", "eta_f"), r"\eta_F")
    out.caption = caption(out.name)
    return out
