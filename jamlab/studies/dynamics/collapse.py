"""Draw the scaling collapse of flow curves around onset, and compare its exponents with published ones."""

from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.statistics.bootstrap import Interval
from jamlab.statistics.data_collapse import CriticalCollapse, collapse_through
from jamlab.statistics.published_numbers import (
    FLOW_AT_ONSET,
    JAMMING_IN_SHEAR,
    STRESS_AT_ONSET,
    VISCOSITY_EXPONENT,
    YIELD_EXPONENT,
    Published,
)
from jamlab.studies.claims import write_list
from jamlab.studies.dynamics.steady_flows import HIGHEST, steady_flows
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.ensembles import average, bootstrap
from jamlab.studies.panels import FIT, Drawing, drawing, label, scale, sequence

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
    moved = [JAMMING_IN_SHEAR.value + shift for shift in (-SHIFT, SHIFT)]
    q = [collapse_through(phi, rate, average(values), START, critical=onset).q for onset in moved]
    lower, higher = out.keep("q", q, onset=moved)
    _claim(out, found, _slower(table), f"with onset {SHIFT} lower and higher q is {lower:.3f} and {higher:.3f}")
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
        out.curve(
            branches,
            f"fit {'above' if side > 0 else 'below'}",
            *(np.abs(far) ** (-1 / best.w), best.function(far) * np.abs(far) ** -best.above),
            **FIT,
        )


def _numbers(found: CriticalCollapse) -> Array:
    return np.array([found.q, found.above, found.below])


def _claim(out: Drawing, found: Interval, slower: dict[float, Array], shifted: str) -> None:
    """Claim the exponents, with those of fits up to lower rates beside them."""
    how = f"collapse of packing fractions {WINDOW[0]} to {WINDOW[1]} and rates up to {HIGHEST:g}, without corrections"
    published: list[tuple[str, int, Published]] = [
        ("exponent q of stress over rate at onset, Tighe et al. 2010", 0, FLOW_AT_ONSET),
        ("exponent q of stress over rate at onset, Olsson & Teitel 2011", 0, STRESS_AT_ONSET),
        ("exponent of the yield stress, Olsson & Teitel 2011", 1, YIELD_EXPONENT),
        ("exponent of the viscosity below onset, Olsson & Teitel 2011", 2, VISCOSITY_EXPONENT),
    ]
    for k, name in enumerate(("q", "exponent of the yield stress", "exponent of the viscosity")):
        out.keep(f"{name}, fitted up to", [numbers[k] for numbers in slower.values()], rate=slower)
    for quantity, k, number in published:
        each = write_list((numbers[k] for numbers in slower.values()), ".3f")
        cause = f"fitted up to rates of {write_list(slower)} it is {each}; {shifted}"
        out.claim(quantity, found[k], number, how=how, cause=cause, shown_by=f"jamlab figure {out.name}")
