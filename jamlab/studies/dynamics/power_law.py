"""Draw flow under drag that grows as a power of velocity, against linear drag at the same power of the rate."""

from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.plotting.palette import BLACK
from jamlab.studies.dynamics.steady_flows import JAMMED, SETTINGS, STRESS, balanced_disks, mean_of_rows, steady_flows
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.ensembles import mean_over_packings, nearest, of_packings
from jamlab.studies.panels import Drawing, drawing, label, scale, style

ALLOWED = 0.1  # by which stresses may miss the collapse
CHECK = "ratio at the lowest rate"
_NAMES = {"n": "N =", "background": "background", "tolerance": "tolerance"}
_SAME = 1e-2  # relative: rates whose powers are one rate of linear drag


def power_law_collapse(tables: EnsembleTables) -> Drawing:
    """Stress of flow under power-law drag over the rate to that power, and what misses the collapse."""
    rows = tables.flow[(tables.flow["rate"] > 0) & (tables.flow["beta"] == 1)]
    powers = sorted(set(rows["alpha"].dropna().unique()) - {1.0})
    if not powers:
        raise InputError("the table flow has no drag with alpha below 1: run a campaign with some")
    linear = steady_flows(tables.flow)
    phi = nearest(sorted(linear["phi"].unique()), JAMMED)
    linear = linear[linear["phi"] == phi]
    out, (stress, ratio, checks) = drawing("dynamics-power-law", 1, 3, 4.6, 3.9)
    scale(stress)
    scale(ratio, y="linear")
    out.curve(stress, r"$\alpha$ = 1", *mean_of_rows(linear, "rate", "stress"), band=False, color=BLACK, marker="s")
    for k, alpha in enumerate(powers):
        bent = steady_flows(tables.flow, alpha)
        bent, text, look = bent[bent["phi"] == phi], rf"$\alpha$ = {alpha:.2f}", style(k)
        x, mean = mean_of_rows(bent, "rate", "stress")
        out.curve(stress, text, x**alpha, mean, band=False, ls="none", **look)
        x, values = _ratios(bent, linear, alpha)
        mean = out.keep(
            f"stress over that of linear drag, alpha = {alpha:.2f}", mean_over_packings([values])[0], rate=x
        )
        out.curve(ratio, text, x * 1.03**k, mean, band=False, **look)
    checked = _draw_checks(out, checks, tables.flow, powers[0], phi)
    for axes in (ratio, checks):
        axes.axhspan(1 - ALLOWED, 1 + ALLOWED, color="#999999", alpha=0.15, linewidth=0)
        axes.axhline(1.0, color=BLACK, linewidth=0.8)
    power = r"$(\dot\gamma\,\tau_1)^\alpha$"
    label(stress, power, STRESS)
    label(ratio, power, r"$\sigma_\alpha(\dot\gamma)/\sigma_1(\dot\gamma^\alpha)$", loc="lower right")
    label(checks, "settings", rf"the same, $\alpha$ = {powers[0]:.2f}, lowest rate", legend=False)
    checks.tick_params(axis="x", labelsize=7.5)
    said = ", ".join(f"{name} {out.values[f'{CHECK}, {name}'].value:.2f}" for name in checked)
    out.caption = (
        f"{int(linear['n'].iloc[0])} disks at packing fraction {phi:.2f}, {linear['seed'].nunique()} packings, "
        "95 % intervals. (a) Steady flow under contact drag that grows as velocity to the power alpha, over the rate "
        "to that power, on which it would be one curve if velocities scaled as the rate. (b) The ratio to linear drag, "
        f"of the same packings; grey, 10 %. "
        f"{f'(c) What becomes of it with other settings: {said}.' if said else ''}"
    )
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


def _draw_checks(out: Drawing, axes: Any, flow: pd.DataFrame, alpha: float, phi: float) -> list[str]:
    """Draw and keep ratios at the lowest rate with other settings that both drag laws were run with; their names."""
    both = balanced_disks(flow, alpha), balanced_disks(flow)
    bent, linear = (rows[(rows["phi"] == phi) & (rows["rate"] > 0)] for rows in both)
    usual = steady_flows(flow).iloc[0]
    bent = bent[bent["rate"] == bent["rate"].min()]
    names = []
    for settings, rows in bent.groupby(SETTINGS):
        partner = linear[(linear[SETTINGS] == list(settings)).all(axis=1)]
        if not len(_ratios(rows, partner, alpha)[0]) or partner.empty:
            continue
        mean = mean_over_packings([_ratios(rows, partner, alpha)[1]])[0]
        other = [f"{_NAMES[k]} {v:g}" for k, v in zip(SETTINGS, settings, strict=True) if v != usual[k]]
        names.append("\n".join(other) or "as (b)")
        out.keep(f"{CHECK}, {names[-1]}".replace("\n", " "), mean[0])
        out.curve(axes, names[-1].replace("\n", ", "), [len(names) - 1], mean, band=False, **style(0))
    axes.set_xticks(range(len(names)), names)
    axes.set_xlim(-0.5, max(len(names), 1) - 0.5)
    return [name.replace("\n", " ") for name in names]
