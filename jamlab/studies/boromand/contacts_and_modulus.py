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
from jamlab.studies.claims import Claim, claim
from jamlab.studies.conventions import SERIES, at
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.ensembles import (
    RESAMPLES,
    Ensemble,
    average,
    bootstrap,
    ensemble,
    has,
    log_places,
    nearest_size,
    sampled_sizes,
    sizes,
)
from jamlab.studies.panels import BESIDE, PAPER, Drawing, drawing, label, scale, size_style

NEAR = log_places(1e-6, 0.4, 5)
LINEAR = np.arange(0.80, 1.25, 0.01)
REGIME = {  # where the paper sees a power law, fig 6
    "sp": (conventions.LOWEST["sp"], conventions.HIGHEST["d_phi"]),
    "dp": (conventions.LOWEST["dp"], published.CONFLUENCE),
}
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
                x, y = ensemble(states, model, n, by, column, LINEAR).band()
                series = f"{model.upper()}({'φ' if by == 'phi' else 'ρ'}), N = {n}"
                look: dict[str, Any] = {"color": MODEL_STYLE[model]["color"] if by == "rho" else GREEN}
                look |= {"marker": ("v" if small else "o") if model == "sp" else ("D" if small else "*")}
                ends = () if small else (y.low, y.high)  # bands of the small ones would cover all others
                out.curve(axes, series, x, y.value, *ends, linestyle="none", fillstyle=fill, **look)
        _draw_table_lines(out, axes, column)
        axes.axvline(published.MODELS_PART.value, color="#777777", linestyle="-.", linewidth=0.9)
        # far beyond confluence phi says little, and the paper's panel ends near there
        label(axes, r"packing fraction $\rho$ or $\phi$", name, legend=axes is bottom, **BESIDE)
        axes.set_xlim(0.82, 1.06)
        axes.set_ylim((3.8, 6.2) if column == "z" else (0, 0.36))
    out.claims = _departure_claims(states, out.name)
    missing = (
        "; the paper's droplets of N = 256 are not there" if conventions.SIZES[-1] not in sizes(states, "dp") else ""
    )
    out.caption = (
        "z and G against packing fraction; bands of the largest sizes: 95 % over packings. Dashed: the paper's fits, "
        f"tables 1-2; dash-dotted: where its models part{missing}. States that are no minimum are left out."
    )
    return out


def _shown_sizes(states: pd.DataFrame, model: str) -> list[int]:
    """The sizes nearest to the paper's least and largest; none without packings."""
    if not has(states, model):
        return []
    return sorted({nearest_size(states, model, wanted) for wanted in (conventions.SIZES[0], conventions.SIZES[-1])})


def _departure_claims(states: pd.DataFrame, name: str) -> list[Claim]:
    """Where z and G of droplets leave those of disks of the same N."""
    matched = conventions.matched_sizes(states)
    claims = []
    for column, share in (("z", 0.02), ("g", 0.1)):
        found, how = None, "needs packings of both models at one N"
        words = {}
        if matched:
            curves = [
                tuple(ensemble(states, model, m, "rho", column, LINEAR) for model in ("sp", "dp")) for m in matched
            ]
            each = [_find_departure(sp, dp, share) for sp, dp in curves]
            found, (sp, dp) = each[-1], curves[-1]
            how = f"N = {matched[-1]} of both, last crossing of the mean curves"
            how += "" if found is None or np.isfinite(found.value) else f", which do not cross: {_say_excess(sp, dp)}"
            by_size = ", ".join(f"{float(d.value):.3f}" if d and np.isfinite(d.value) else "none" for d in each)
            how += f"; {by_size} at N = {', '.join(map(str, matched))}"
            words = {"contradiction": conventions.contradiction_of_models(), "shown_by": "boromand-5, dashed"}
            if column == "g":
                part = published.MODELS_PART.value
                ratio = at(part, *dp.mean) / at(part, *sp.mean)
                words = {
                    "calibrated": f"G comes in units of eps and of eps_r, which gamma and delta tie: the ratio at"
                    f" rho = {part:g} is {ratio:.2f}"
                }
        text = f"rho from which {column} of DP exceeds SP by {100 * share:g} %"
        claims.append(claim(name, text, found, published.MODELS_PART, how=how, **words))
    return claims


def _draw_table_lines(out: Drawing, axes: Any, column: str) -> None:
    """Draw the paper's fits of z or G, tables 1 and 2; those against rho end at rho = 1."""
    for name, (_, onset, *_) in published.TABLE_1.items():
        d = np.linspace(1e-4, 0.2 if "φ" in name else 1 - onset, 60)
        y = published.table_contacts(name, d) if column == "z" else published.table_modulus(name, d)
        colour = {"SP(φ)": GREEN, "SP(ρ)": MODEL_STYLE["sp"]["color"], "DP(ρ)": MODEL_STYLE["dp"]["color"]}[name]
        out.curve(axes, f"paper: {name}", onset + d, y, linestyle="--", color=colour, linewidth=1.4)


def _say_excess(sp: Ensemble, dp: Ensemble) -> str:
    """Between what shares the mean of DP exceeds that of SP where both have one."""
    (x, y), (u, v) = sp.mean, dp.mean
    kept = (u >= np.nanmin(x)) & (u <= np.nanmax(x)) & np.isfinite(v)
    excess = 100 * (v[kept] / np.interp(u[kept], x, y) - 1)
    if not kept.any():
        return "no common range"
    return f"DP exceeds SP by {excess.min():.0f} to {excess.max():.0f} % from {u[kept][0]:.2f} to {u[kept][-1]:.2f}"


def _find_departure(sp: Ensemble, dp: Ensemble, share: float) -> Interval | None:
    """Find the rho above which the mean of DP exceeds that of SP by a given share."""

    def crossing(groups: list[Array]) -> float:
        (x, y), (u, v) = [(average(g[..., 0]), average(g[..., 1])) for g in groups]
        kept = (u >= np.nanmin(x)) & (u <= np.nanmax(x)) & np.isfinite(v)
        excess = v[kept] / np.interp(u[kept], x, y) - 1 - share
        inside = np.flatnonzero(excess <= 0)
        if not len(inside) or inside[-1] == len(excess) - 1:
            return np.nan
        k = inside[-1]
        return float(np.interp(0, excess[k : k + 2], u[kept][k : k + 2]))

    return bootstrap([np.stack([e.x, e.y], axis=-1) for e in (sp, dp)], crossing)


def figure_6(tables: EnsembleTables) -> Drawing:
    """z - z_J and G against the distance to onset, log-log, one curve per size."""
    states = tables.states
    out, axes = drawing("boromand-6", 2, 3, 4.4, 3.9)
    panels = [("d_z", s) for s in SERIES] + [("g", s) for s in SERIES]
    for part, (column, series) in zip(axes, panels, strict=True):
        scale(part)
        model, by = SERIES[series]
        for n in sizes(states, model):
            x, y = ensemble(states, model, n, by, column, NEAR).band()
            out.curve(part, f"N = {n}", x, y.value, y.low, y.high, linestyle="none", **size_style(n))
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
        label(
            part,
            f"{series[:2]}: {name}",
            r"$z - z_J$" if column == "d_z" else rf"$G$  [{units}]",
            loc="upper left",
        )
        part.set_xlim(5e-7, 0.7)
        part.set_ylim((1e-3, 5) if column == "d_z" else (3e-4, 1))
    out.claims = _exponent_claims(states, out.name)
    out.caption = (
        "Excess contacts (own z_J taken off) and shear modulus against the distance to each packing's own onset. "
        "Dashed: the paper's fits and slopes; grey: the regime where it sees a power law. Mean moduli of small "
        "packings near onset may be negative in a fixed box and are then not shown."
    )
    return out


def _exponent_claims(states: pd.DataFrame, name: str) -> list[Claim]:
    """Single exponents as the paper fits them, at its largest size."""
    claims = []
    for column, series, paper, text in (
        ("excess contacts", "SP(φ)", published.ALPHA_0, "alpha_0: z - z_J ~ dphi^alpha_0"),
        ("g", "SP(φ)", published.BETA_0, "beta_0: G ~ dphi^beta_0"),
        ("excess contacts", "DP(ρ)", published.DROPLET_EXPONENT, "single exponent of z - z_J in drho"),
        ("g", "DP(ρ)", published.DROPLET_EXPONENT, "single exponent of G in drho"),
    ):
        model, by = SERIES[series]
        found, how = None, f"no {model} packings"
        words: dict[str, str] = {}
        if has(states, model):
            n = nearest_size(states, model, conventions.SIZES[-1])
            curve = _above_a_hundredth(conventions.even_curve(states, series, n, column))
            found = curve.interval(conventions.fit_exponent)
            what = f"z - {conventions.SUBTRACTED}" if column != "g" else "mean G"
            how = f"N = {n}, {what}, {DISTANT:g} < d < {conventions.HIGHEST[by]:g}"
            if model == "sp":
                measured = sampled_sizes(states, model)
                every = [_exponent_of_size(states, series, m, column) for m in measured]
                shown = ", ".join(f"{e:.2f}" for e in every)
                words["cause"] = f"it is {shown} at N = {', '.join(map(str, measured))}"
                words["shown_by"] = "boromand-6 a and d"
        if model == "dp":
            kind = "g" if column == "g" else "d_z"
            words["contradiction"] = conventions.contradiction_of_single_exponent(kind)
            words["shown_by"] = "boromand-6 c and f, dashed"
        claims.append(claim(name, f"{text}, {series[:2]}", found, paper, how=how, **words))
    crossover = claim(
        name,
        "a: (z - z_J) N against dphi N^a, SP",
        _size_exponent(states),
        published.CROSSOVER_EXPONENT,
        how=f"best collapse of N <= 256, dphi < {REGIME['sp'][1]:g}, own z_J",
    )
    return [*claims, crossover]


def _above_a_hundredth(e: Ensemble) -> Ensemble:
    """Places beyond 0.01: nearer to onset z - 3.97 changes its sign, where a logarithm has no value."""
    return between(e, DISTANT, np.inf)


def between(e: Ensemble, low: float, high: float) -> Ensemble:
    x = average(e.x)
    kept = (x > low) & (x < high)
    return Ensemble(e.x[:, kept], e.y[:, kept])


def _exponent_of_size(states: pd.DataFrame, series: str, n: int, column: str) -> float:
    return conventions.fit_exponent(*_above_a_hundredth(conventions.even_curve(states, series, n, column)).mean)


def _size_exponent(states: pd.DataFrame) -> Interval | None:
    """Fit a of the crossover dphi* ~ N^-a by the collapse of the paper's sizes."""
    n = [m for m in sizes(states, "sp") if m in conventions.SIZES]
    if len(n) < 2:
        return None
    curves = [ensemble(states, "sp", m, "d_phi", "d_z", NEAR) for m in n]
    groups = [np.stack([e.x, e.y], axis=-1) for e in curves]

    def exponent(drawn: list[Array]) -> float:
        family = []
        for g in drawn:
            x, y = average(g[..., 0]), average(g[..., 1])
            kept = (y > 0) & (x < REGIME["sp"][1])
            family.append((x[kept], y[kept]))
        return fit_scaling_exponents(np.array(n, dtype=float), [family], b=1.0, start=(2.0, 1.0)).a

    return bootstrap(groups, exponent, resamples=RESAMPLES // 4)
