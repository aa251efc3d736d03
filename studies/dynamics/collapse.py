"""Draw the scaling collapse of flow curves around onset, and compare its exponents with published ones."""

from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.plotting.palette import BLACK
from studies.dynamics.critical_collapse import CriticalCollapse, collapse_through
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
