"""Draw the scaling collapse of flow curves around onset, and compare its exponents with published ones."""

from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.plotting.palette import BLACK
from jamlab.statistics.bootstrap import Interval
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
from studies.ensembles import average, bootstrap, mean_over_packings, nearest, of_packings
from studies.panels import FIT, Drawing, drawing, label, scale, sequence, style
from studies.published_numbers import (
    FLOW_AT_ONSET,
    JAMMING_IN_SHEAR,
    STRESS_AT_ONSET,
    VISCOSITY_EXPONENT,
    YIELD_EXPONENT,
    Published,
)

WINDOW = (0.82, 0.86)  # packing fractions of the fit
SHIFT = 0.003  # of onset, to see how much hangs on it
START = (0.843, 0.45, 0.35)  # first guess of onset and of the exponents of stress and width


def flow_collapse(tables: EnsembleTables) -> Drawing:
    """Scaling collapse of flow curves around onset, with its exponents."""
    table = _fitted_rows(steady_flows(tables.flow))
    phi, rate, values = _grid(table)

    def fit(groups: list[Array]) -> CriticalCollapse:
        return collapse_through(phi, rate, average(groups[0]), START, critical=JAMMING_IN_SHEAR.value)

    best, free = fit([values]), collapse_through(phi, rate, average(values), START)
    found = bootstrap([values], lambda groups: _numbers(fit(groups)), resamples=100)
    out, (smooth, branches) = drawing("dynamics-collapse", 1, 2, 5.0, 4.2)
    scale(smooth, x="linear", y="linear")
    scale(branches)
    _draw(out, smooth, branches, best, phi, rate, average(values))
    label(smooth, r"$(\phi - \phi_J)/\dot\gamma^{\,w}$", r"$\sigma/\dot\gamma^{\,q}$", loc="upper left")
    label(*(branches, r"$\dot\gamma/|\phi - \phi_J|^{1/w}$", r"$\sigma/|\phi - \phi_J|^{\,q/w}$"), legend=False)
    slower = _slower(table)
    others = {f"rates up to {highest:g}": numbers for highest, numbers in slower.items()}
    moved = [JAMMING_IN_SHEAR.value - SHIFT, JAMMING_IN_SHEAR.value + SHIFT]
    for onset in moved:
        fit_there = collapse_through(phi, rate, average(values), START, critical=onset)
        others[f"onset at {onset:g}"] = _numbers(fit_there)
    others["onset left free"] = _numbers(free)
    out.keep("q", [others[f"onset at {onset:g}"][0] for onset in moved], onset=moved)
    _claim(out, found, slower, others)
    kept = {"q of the fit": best.q, "w of the fit": best.w, "onset left free": free.critical}
    for name, number in (kept | {"spread before scaling": best.before, "spread": best.spread}).items():
        out.keep(name, number)
    out.caption = (
        f"Stress of steady flow of {int(table['n'].iloc[0])} disks, means over {len(values)} packings, packing "
        f"fractions {WINDOW[0]} to {WINDOW[1]}, rates up to {HIGHEST:g}, scaled by one fit of q = {best.q:.3f} and "
        f"w = {best.w:.3f} with onset at {best.critical}, that of Olsson & Teitel 2011; points lie "
        f"{100 * best.spread:.1f} % from the line, and {100 * best.before:.0f} % before scaling. Rates like these do "
        f"not settle onset itself: left free, it is put at {free.critical:.3f}. (a) One smooth curve through onset. "
        "(b) The same on its two sides: a yield stress above, a liquid below, one power law where both meet."
    )
    return out


def _fitted_rows(table: pd.DataFrame) -> pd.DataFrame:
    rows = table[table["phi"].between(*WINDOW) & (table["rate"] <= HIGHEST)]
    if rows["phi"].nunique() < 3 or rows["rate"].nunique() < 3:
        raise InputError(
            f"{rows['phi'].nunique()} packing fractions from {WINDOW[0]} to {WINDOW[1]} and {rows['rate'].nunique()} "
            f"rates up to {HIGHEST:g}: a collapse takes three of each"
        )
    return rows


def _grid(table: pd.DataFrame) -> tuple[Array, Array, Array]:
    """Arrange (m,) packing fractions and rates, and (packings, m) stresses."""
    stress = table.pivot_table(index="seed", columns=["phi", "rate"], values="stress")
    phi, rate = (stress.columns.get_level_values(k).to_numpy(dtype=np.float64) for k in (0, 1))
    return phi, rate, stress.to_numpy(dtype=np.float64)


def _slower(table: pd.DataFrame) -> dict[float, Array]:
    """Fit slower and slower flow, as far as there are points enough: highest rate -> its numbers."""
    found = {}
    for highest in np.sort(table["rate"].unique())[:1:-1]:
        rows = table[table["rate"] <= highest]
        rows = rows[rows.groupby("phi")["rate"].transform("nunique") > 1]
        phi, rate, values = _grid(rows)
        try:
            fit = collapse_through(phi, rate, average(values), START, critical=JAMMING_IN_SHEAR.value)
        except InputError:  # too few points
            break
        found[float(highest)] = _numbers(fit)
    return found


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


def _numbers(found: CriticalCollapse) -> Array:
    return np.array([found.q, found.above, found.below])


# Olsson & Teitel's rates, drag and fit are others than ours: a difference would not tell which of them makes it
_UNLIKE = "their drag is against the mean flow, and their fit has corrections to scaling: not compared"


def _claim(out: Drawing, found: Interval, slower: dict[float, Array], others: dict[str, Array]) -> None:
    """Claim the exponents, with those of fits up to lower rates and of other onsets beside them."""
    how = f"collapse of packing fractions {WINDOW[0]} to {WINDOW[1]} and rates up to {HIGHEST:g}, without corrections"
    published: list[tuple[str, int, Published, str]] = [
        ("exponent q of stress over rate at onset, Tighe et al. 2010", 0, FLOW_AT_ONSET, ""),
        ("exponent q of stress over rate at onset, Olsson & Teitel 2011", 0, STRESS_AT_ONSET, _UNLIKE),
        ("exponent of the yield stress, Olsson & Teitel 2011", 1, YIELD_EXPONENT, _UNLIKE),
        ("exponent of the viscosity below onset, Olsson & Teitel 2011", 2, VISCOSITY_EXPONENT, _UNLIKE),
    ]
    for k, name in enumerate(("q", "exponent of the yield stress", "exponent of the viscosity")):
        out.keep(f"{name}, fitted up to", [numbers[k] for numbers in slower.values()], rate=slower)
    for quantity, k, number, unlike in published:
        family = {name: float(numbers[k]) for name, numbers in others.items()}
        shown_by = f"python -m studies draw {out.name}"
        out.claim(quantity, found[k], number, family=family, how=how, unlike=unlike, shown_by=shown_by)


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
