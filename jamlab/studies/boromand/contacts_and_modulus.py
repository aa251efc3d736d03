"""Draw contacts and shear modulus in Boromand et al.: figs 5 and 6."""

from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.plotting.palette import GREEN, MODEL_STYLE
from jamlab.statistics import published_numbers as published
from jamlab.statistics.bootstrap import Interval
from jamlab.statistics.data_collapse import fit_scaling_exponents
from jamlab.studies import conventions
from jamlab.studies.claims import Kind, write_by, write_list
from jamlab.studies.conventions import FRACTIONS, NEAR, SERIES, at
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.ensembles import (
    RESAMPLES,
    Ensemble,
    bootstrap,
    ensemble,
    has,
    mean_curve,
    nearest_size,
    sampled_sizes,
    sizes,
)
from jamlab.studies.panels import BESIDE, PAPER, Drawing, drawing, label, scale, size_style

REGIME = {  # where the paper sees a power law, fig 6
    "sp": (conventions.LOWEST["sp"], conventions.HIGHEST["d_phi"]),
    "dp": (conventions.LOWEST["dp"], published.CONFLUENCE),
}
OTHER_SHARES = {"z": (0.015, 0.025, 0.03), "g": (0.05, 0.15, 0.2)}  # by which models might be said to part as well
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
                series = f"{model.upper()}({'φ' if by == 'phi' else 'ρ'}), N = {n}"
                look: dict[str, Any] = {"color": MODEL_STYLE[model]["color"] if by == "rho" else GREEN}
                look |= {"marker": ("v" if small else "o") if model == "sp" else ("D" if small else "*")}
                shown = y.value if small else y  # bands of the small ones would cover all others
                out.curve(axes, series, x, shown, linestyle="none", fillstyle=fill, **look)
        _draw_table_lines(out, axes, column)
        axes.axvline(published.MODELS_PART.value, color="#777777", linestyle="-.", linewidth=0.9)
        # far beyond confluence phi says little, and the paper's panel ends near there
        label(axes, r"packing fraction $\rho$ or $\phi$", name, legend=axes is bottom, **BESIDE)
        axes.set_xlim(0.82, 1.06)
        axes.set_ylim((3.8, 6.2) if column == "z" else (0, 0.36))
    _claim_departures(out, states)
    missing = (
        "; the paper's droplets of N = 256 are not there" if conventions.SIZES[-1] not in sizes(states, "dp") else ""
    )
    out.caption = (
        "z and G against packing fraction; bands of the largest sizes: 95 % over packings. Dashed: the paper's fits, "
        f"tables 1-2; dash-dotted: where its models part{missing}. States that are no minimum are left out."
    )
    return out


def _shown_sizes(states: pd.DataFrame, model: str) -> list[int]:
    """Pick the sizes nearest to the paper's least and largest; none without packings."""
    if not has(states, model):
        return []
    return sorted({nearest_size(states, model, wanted) for wanted in (conventions.SIZES[0], conventions.SIZES[-1])})


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
        each = [_find_departure(*pair, share) for pair in zip(sp, dp, strict=True)]
        found = each[-1]
        how = f"N = {matched[-1]} of both, last crossing of the mean curves"
        how += (
            ""
            if found is None or np.isfinite(found.value)
            else f", which do not cross: {_say_excess(out, sp[-1], dp[-1])}"
        )
        out.keep(text, each, N=matched)
        how += f"; {write_by(dict(zip(matched, each, strict=True)), '.3f')}"
        moved = [_find_departure(sp[-1], dp[-1], other) for other in OTHER_SHARES[column]]
        away = [float(m.value) for m in moved if m is not None and np.isfinite(m.value)]
        out.keep(f"{text}, other shares", moved, share=OTHER_SHARES[column])
        systematic = max((abs(value - float(found.value)) for value in away), default=None) if found else None
        others = write_list((100 * other for other in OTHER_SHARES[column]), "g")
        words = {"cause": f"it is {write_list(moved, '.3f')} for {others} %", "shown_by": "boromand-5 a"}
        if column == "g":
            ratio = out.keep(
                f"G of DP over that of SP at rho = {part:g}", at(part, *dp[-1].mean) / at(part, *sp[-1].mean)
            )
            tied = "G comes in units of eps and of eps_r, which gamma and delta tie"
            words = {"calibrated": f"{tied}: the ratio at rho = {part:g} is {ratio:.2f}"}
        out.claim(text, found, published.MODELS_PART, Kind.MEASURED, systematic, how=how, **words)


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


def _find_departure(sp: Ensemble, dp: Ensemble, share: float) -> Interval | None:
    """Find the rho above which the mean of DP exceeds that of SP by a given share."""

    def crossing(groups: list[Array]) -> float:
        rho, excess = _find_excess(mean_curve(groups[0]), mean_curve(groups[1]))
        inside = np.flatnonzero(excess <= share)
        if not len(inside) or inside[-1] == len(excess) - 1:
            return np.nan
        k = inside[-1]
        return float(np.interp(0, excess[k : k + 2] - share, rho[k : k + 2]))

    return bootstrap([sp.curves, dp.curves], crossing)


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
        found, how = None, f"no {model} packings"
        words: dict[str, str] = {}
        if has(states, model):
            n = nearest_size(states, model, conventions.SIZES[-1])
            found = _beyond_a_hundredth(states, series, n, column).interval(conventions.fit_exponent)
            what = f"z - {conventions.SUBTRACTED}" if column != "g" else "mean G"
            how = f"N = {n}, {what}, {DISTANT:g} < d < {conventions.HIGHEST[by]:g}"
            if model == "sp":
                measured = sampled_sizes(states, model)
                means = [_beyond_a_hundredth(states, series, m, column).mean for m in measured]
                every = [conventions.fit_exponent(*mean) for mean in means]
                out.keep(text, every, N=measured)
                words["cause"] = f"it is {write_by(dict(zip(measured, every, strict=True)), '.2f')}"
                words["shown_by"] = "boromand-6 a and d"
        if model == "dp":
            if column == "g":
                words["calibrated"] = conventions.TABLE_TARGET
            else:
                words["contradiction"] = conventions.contradiction_of_single_exponent()
            words["shown_by"] = "boromand-6 c and f, dashed"
        out.claim(text, found, paper, how=how, **words)
    how = f"best collapse of N <= 256, dphi < {REGIME['sp'][1]:g}, own z_J"
    text = "a: (z - z_J) N against dphi N^a, SP"
    out.claim(text, _size_exponent(states), published.CROSSOVER_EXPONENT, how=how)


def _beyond_a_hundredth(states: pd.DataFrame, series: str, n: int, column: str) -> Ensemble:
    """Cut a curve to places beyond 0.01: nearer to onset z - 3.97 changes its sign, where a logarithm has no value."""
    return conventions.even_curve(states, series, n, column).between(DISTANT, np.inf)


def _size_exponent(states: pd.DataFrame) -> Interval | None:
    """Fit a of the crossover dphi* ~ N^-a by the collapse of the paper's sizes."""
    n = [m for m in sizes(states, "sp") if m in conventions.SIZES]
    if len(n) < 2:
        return None
    groups = [ensemble(states, "sp", m, "d_phi", "d_z", NEAR).curves for m in n]

    def exponent(drawn: list[Array]) -> float:
        family = []
        for x, y in map(mean_curve, drawn):
            kept = (y > 0) & (x < REGIME["sp"][1])
            family.append((x[kept], y[kept]))
        return fit_scaling_exponents(np.array(n, dtype=float), [family], b=1.0, start=(2.0, 1.0)).a

    return bootstrap(groups, exponent, resamples=RESAMPLES // 4)
