"""Collapse flow curves y(x, s) around onset onto y = s^q f((x - x_c)/s^w), with ln f a polynomial, and draw it."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from jamlab.arrays import Array
from jamlab.checks import finite_array
from jamlab.errors import InputError
from jamlab.plotting.palette import BLACK
from studies.dynamics.flow_curves import (
    HIGHEST,
    JAMMED,
    SETTINGS,
    STRESS,
    balanced_disks,
    mean_of_rows,
    steady_flows,
)
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import Sample, average, mean_over_packings, of_packings, select
from studies.panels import FIT, Drawing, drawing, label, scale, sequence, style
from studies.papers.statements import caption, statistic

WINDOW = (0.82, 0.86)  # packing fractions of the fit
ONSET = 0.84347  # onset in shear: Olsson & Teitel, Phys. Rev. E 83, 030302 (2011)
SHIFT = 0.003  # of onset, to see how much hangs on it
START = (0.843, 0.45, 0.35)  # first guess of onset and of the exponents of stress and width


ORDER = 4  # of the polynomial


@dataclass(frozen=True)
class CriticalCollapse:
    """What brings the data onto one curve."""

    critical: float  # x_c
    q: float  # y ~ s^q at x_c
    w: float  # the width of the critical region in x grows as s^w
    coefficients: Array = field(repr=False)  # (k,) of ln f, highest power first
    spread: float  # root mean square distance of ln y from the curve
    before: float  # the same of ln y from one curve in x alone

    @property
    def above(self) -> float:
        """Exponent y of the limit of small s above x_c, y ~ (x - x_c)^(q/w): of the yield stress."""
        return self.q / self.w

    @property
    def below(self) -> float:
        """Exponent beta below x_c, y/s ~ (x_c - x)^-beta if y ~ s there, beta = (1 - q)/w: of the viscosity."""
        return (1 - self.q) / self.w

    def function(self, z: ArrayLike) -> Array:
        """f, of the shape of z; inside the data only."""
        return np.asarray(np.exp(np.polyval(self.coefficients, np.asarray(z, dtype=np.float64))))


def collapse_through(
    x: ArrayLike,
    s: ArrayLike,
    y: ArrayLike,
    start: Sequence[float],
    *,
    critical: float | None = None,
    order: int = ORDER,
) -> CriticalCollapse:
    """Fit both exponents, and the critical point unless it is given, by least squares in ln y (m,), from a guess (x_c,
    q, w). A narrow range of s does not settle all three: data far above x_c scale with many of them."""
    points = [finite_array(name, value, (None,)) for name, value in (("x", x), ("s", s), ("y", y))]
    place, log_s, log_y = points[0], *(np.log(np.maximum(p, 1e-300)) for p in points[1:])
    if not len(place) == len(log_s) == len(log_y) > order + 4:
        raise InputError(f"{len(place)} points: {order + 5} or more are needed for {order + 4} unknowns")
    if min(points[1].min(), points[2].min()) <= 0:
        raise InputError("a collapse is measured in logarithms: s and y must be positive")
    width, middle = float(np.ptp(place)) or 1.0, float(np.median(log_s))

    def misfit(at: float, q: float, w: float) -> tuple[Array, Array]:
        """Distances (m,) of ln y from the polynomial that is best for these numbers, and its coefficients."""
        z = (place - at) * np.exp(-w * log_s)
        powers = np.vander(z / np.exp(-w * middle) / width, order + 1)
        found, *_ = np.linalg.lstsq(powers, log_y - q * log_s, rcond=None)
        return powers @ found - log_y + q * log_s, found / (np.exp(-w * middle) * width) ** np.arange(order, -1, -1)

    first, steps = np.array(start, dtype=np.float64), np.array([0.1 * width, 0.1, 0.1])
    if critical is not None:
        first[0] = critical
    fixed = 0 if critical is None else 1  # leading unknowns that stay

    def unknowns(move: Array) -> list[float]:
        return [*first[:fixed].tolist(), *(first[fixed:] + steps[fixed:] * move).tolist()]

    at, q, w = unknowns(least_squares(lambda move: misfit(*unknowns(move))[0], np.zeros(3 - fixed)).x)
    rest, coefficients = misfit(at, q, w)
    spread, before = (float(np.sqrt(np.mean(part**2))) for part in (rest, misfit(at, 0.0, 0.0)[0]))
    return CriticalCollapse(at, q, w, coefficients, spread, before)


def flows(tables: EnsembleTables, highest: float = HIGHEST) -> Sample:
    """Take packing fractions, rates and mean stresses of the fit, at rates up to one."""
    table = steady_flows(tables.flow)
    table = table[table["phi"].between(*WINDOW) & (table["rate"] <= highest)]
    table = table[table.groupby("phi")["rate"].transform("nunique") > 1]
    stress = table.pivot_table(index="seed", columns=["phi", "rate"], values="stress")
    phi, rate = (stress.columns.get_level_values(k).to_numpy(dtype=np.float64) for k in (0, 1))
    return Sample([stress.to_numpy(dtype=np.float64)], lambda drawn: (phi, rate, average(drawn[0])))


_OTHERS: tuple[dict[str, Any], ...] = (
    *({"highest": rate} for rate in (1e-2, 3e-3, 1e-3)),
    *({"onset": ONSET - SHIFT}, {"onset": ONSET + SHIFT}, {"onset": None}),
)


@statistic(
    "flow-q-tighe", "flow-q-olsson", "flow-yield", "flow-viscosity", sample=flows, variants=_OTHERS, resamples=100
)
def exponents(phi: Array, rate: Array, stress: Array, onset: float | None = ONSET) -> Array:
    """Collapse flow curves around onset, without corrections: q (twice), of the yield stress, of the viscosity."""
    found = collapse_through(phi, rate, stress, START, critical=onset)
    return np.array([found.q, found.q, found.above, found.below])


def flow_collapse(tables: EnsembleTables) -> Drawing:
    """Scaling collapse of flow curves around onset, with its exponents."""
    sample = flows(tables)
    values = list(sample.groups)
    phi, rate, stress = sample.reduce(values)
    best, free = (collapse_through(phi, rate, stress, START, critical=onset) for onset in (ONSET, None))
    out, (smooth, branches) = drawing("dynamics-collapse", 1, 2, 5.0, 4.2)
    scale(smooth, x="linear", y="linear")
    scale(branches)
    _draw(out, smooth, branches, best, phi, rate, stress)
    label(smooth, r"$(\phi - \phi_J)/\dot\gamma^{\,w}$", r"$\sigma/\dot\gamma^{\,q}$", loc="upper left")
    label(*(branches, r"$\dot\gamma/|\phi - \phi_J|^{1/w}$", r"$\sigma/|\phi - \phi_J|^{\,q/w}$"), legend=False)
    fit = {"q": best.q, "w": best.w, "onset": best.critical, "spread": 100 * best.spread, "before": 100 * best.before}
    fit |= {"n": SETTINGS["n"], "made": len(values[0]), "low": WINDOW[0], "high": WINDOW[1], "highest": HIGHEST}
    out.caption = caption(out.name, free=free.critical, **fit)
    return out


def _draw(
    out: Drawing, smooth: Any, branches: Any, best: CriticalCollapse, phi: Array, rate: Array, stress: Array
) -> None:
    fractions = np.unique(phi)
    z = (phi - best.critical) / rate**best.w
    for k, each in enumerate(fractions):
        at, look = phi == each, {**sequence(k, len(fractions)), "linestyle": "none"}
        out.curve(smooth, f"$\\phi$ = {each:.2f}", z[at], stress[at] / rate[at] ** best.q, **look)
        distance = abs(each - best.critical)
        x, y = rate[at] / distance ** (1 / best.w), stress[at] / distance**best.above
        out.curve(branches, f"$\\phi$ = {each:.2f}", x, y, **look)
    line = np.linspace(z.min(), z.max(), 200)
    out.curve(smooth, "fit", line, best.function(line), **FIT)
    for side in (-1, 1):
        ends = np.abs(z[side * z > 0])
        if not len(ends):
            continue
        far = side * np.geomspace(ends.min(), ends.max(), 100)
        scaled_rate, scaled_stress = np.abs(far) ** (-1 / best.w), best.function(far) * np.abs(far) ** -best.above
        out.curve(branches, f"fit {'above' if side > 0 else 'below'}", scaled_rate, scaled_stress, **FIT)


ALLOWED = 0.1  # by which stresses may miss the collapse
_NAMES = {"n": "N =", "background": "background", "tolerance": "tolerance"}
_SAME = 1e-2  # relative: rates whose powers are one rate of linear drag


def power_law_collapse(tables: EnsembleTables) -> Drawing:
    """Stress of flow under power-law drag over the rate to that power, and what misses the collapse."""
    rows = tables.flow[(tables.flow["rate"] > 0) & (tables.flow["beta"] == 1)]
    powers = sorted(set(rows["alpha"].dropna().unique()) - {1.0})
    if not powers:
        raise InputError("the table flow has no drag with alpha below 1: run a campaign with some")
    linear = steady_flows(tables.flow, phi=JAMMED)
    out, (stress, ratio, checks) = drawing("dynamics-power-law", 1, 3, 4.6, 3.9)
    scale(stress)
    scale(ratio, y="linear")
    out.curve(stress, r"$\alpha$ = 1", *mean_of_rows(linear, "rate", "stress"), band=False, color=BLACK, marker="s")
    for k, alpha in enumerate(powers):
        bent, text, look = steady_flows(tables.flow, alpha, phi=JAMMED), rf"$\alpha$ = {alpha:.2f}", style(k)
        x, mean = mean_of_rows(bent, "rate", "stress")
        out.curve(stress, text, x**alpha, mean, band=False, ls="none", **look)
        x, values = _ratios(bent, linear, alpha)
        out.curve(ratio, text, x * 1.03**k, mean_over_packings([values])[0], band=False, **look)
    said = _draw_checks(out, checks, tables.flow, powers[0])
    for axes in (ratio, checks):
        axes.axhspan(1 - ALLOWED, 1 + ALLOWED, color="#999999", alpha=0.15, linewidth=0)
        axes.axhline(1.0, color=BLACK, linewidth=0.8)
    power = r"$(\dot\gamma\,\tau_1)^\alpha$"
    label(stress, power, STRESS)
    label(ratio, power, r"$\sigma_\alpha(\dot\gamma)/\sigma_1(\dot\gamma^\alpha)$", loc="lower right")
    label(checks, "settings", rf"the same, $\alpha$ = {powers[0]:.2f}, lowest rate", legend=False)
    checks.tick_params(axis="x", labelsize=7.5)
    made = linear["seed"].nunique()
    out.caption = caption(out.name, n=SETTINGS["n"], jammed=JAMMED, made=made, said=said)
    return out


def _ratios(bent: pd.DataFrame, linear: pd.DataFrame, alpha: float) -> tuple[Array, Array]:
    """Find rates of linear drag (m,), and ratios (packings, m) at rates whose power they are; nan without a partner."""
    parts = []
    for rate in sorted(linear["rate"].unique()):
        both = linear[linear["rate"] == rate].merge(
            bent[np.abs(bent["rate"] ** alpha / rate - 1) < _SAME], on="seed", suffixes=("_linear", "")
        )
        parts.append(both.assign(linear=rate, ratio=both["stress"] / both["stress_linear"]))
    return of_packings(pd.concat(parts), "linear", "ratio")


def _draw_checks(out: Drawing, axes: Any, flow: pd.DataFrame, alpha: float) -> str:
    """Draw and write ratios at the lowest rate with other settings that both drag laws were run with."""
    bent, linear = (rows[rows["rate"] > 0] for rows in (balanced_disks(flow, a, phi=JAMMED) for a in (alpha, 1.0)))
    names, said = [], []
    for settings, rows in bent[bent["rate"] == bent["rate"].min()].groupby(list(SETTINGS)):
        changed = dict(zip(SETTINGS, settings, strict=True))
        mean = mean_over_packings([_ratios(rows, select(linear, **changed), alpha)[1]])[0]
        names.append("\n".join(f"{_NAMES[k]} {v:g}" for k, v in changed.items() if v != SETTINGS[k]) or "as (b)")
        said.append(f"{names[-1]} {mean.value[0]:.2f}".replace("\n", " "))
        out.curve(axes, names[-1].replace("\n", ", "), [len(names) - 1], mean, band=False, **style(0))
    axes.set_xticks(range(len(names)), names)
    axes.set_xlim(-0.5, len(names) - 0.5)
    return ", ".join(said)


FIGURES = {"dynamics-collapse": flow_collapse, "dynamics-power-law": power_law_collapse}
