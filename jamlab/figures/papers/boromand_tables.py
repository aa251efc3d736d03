"""Draw the coefficients of tables 1 and 2 of Boromand et al. from our packings, over those of the paper."""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from jamlab.figures.papers.boromand_contacts_and_modulus import DP_CONTACTS, SERIES
from jamlab.figures.papers.claims import DP_UNKNOWN, Claim, claim
from jamlab.figures.papers.ensembles import ensemble, has, near_onset, nearest_size
from jamlab.figures.papers.panels import FIT, Drawing, drawing, label
from jamlab.figures.papers.tables import EnsembleTables
from jamlab.plotting.palette import BLUE, RED
from jamlab.statistics import published_numbers as published
from jamlab.statistics.bootstrap import bootstrap
from jamlab.statistics.power_laws import power_law

Array = NDArray[np.float64]

_LOW, _HIGH = 1e-3, {"d_phi": 0.2, "d_rho": 0.13}  # window of the fits: above finite-size effects, below confluence
_TENTH = 0.1  # distance at which the fitted curve itself is compared
_EXPONENTS = {"d_phi": (0.5,), "d_rho": (0.5, 1.0)}  # against phi the paper's linear terms are 0


def tables_1_2(tables: EnsembleTables) -> Drawing:
    """Coefficients of tables 1 and 2 from our packings, over the paper's."""
    states = tables.states
    out, (axes,) = drawing("tables", 1, 1, 7.6, 6.4)
    for series, (model, _) in SERIES.items():
        if not has(states, model):
            continue
        n = nearest_size(states, model, 256)
        out.claims += _onset_claims(out.name, states, series, n)
        out.claims += _coefficient_claims(out.name, states, series, n, "d_z", "z", published.TABLE_1[series][2:])
        out.claims += _coefficient_claims(out.name, states, series, n, "g", "G", published.TABLE_2[series])
    _draw_ratios(out, axes)
    out.caption = (
        "Coefficients of tables 1-2 over the paper's: z - z_J = z_0 d^0.5 + z_1 d, G = G_0 d^0.5 + G_1 d, by least "
        "squares over the standard errors of the bins. Grey: the paper's margin, or half a unit of its last digit."
    )
    return out


def _onset_claims(name: str, states: pd.DataFrame, series: str, n: int) -> list[Claim]:
    """z_J and phi_J or rho_J."""
    model, by = SERIES[series]
    fraction = by.removeprefix("d_")
    at_onset = states[(states["model"] == model) & (states["n"] == n) & (states["state"] == 0)]
    counted = f"z_J = 4 - 2/N' by counting, here N = {n}; {published.TABLE_1[series][0]} is that of N' = 64"
    claims = []
    for column, symbol, paper, why in (
        ("z", "z_J", published.TABLE_1[series][0], counted),
        (fraction, f"{fraction}_J", published.TABLE_1[series][1], "small systems jam earlier, fig 10"),
    ):
        values = at_onset[column].to_numpy(dtype=float)
        found = bootstrap([values], lambda g: g[0].mean()) if len(values) else None
        claims.append(
            claim(name, f"{symbol}, {series}", found, published.table_onset(paper), how=f"N = {n}", reason=why)
        )
    return claims


def _coefficient_claims(
    name: str, states: pd.DataFrame, series: str, n: int, column: str, symbol: str, paper: tuple[float, ...]
) -> list[Claim]:
    """The coefficients of one law, and the fitted curve itself at a distance of 0.1."""
    model, by = SERIES[series]
    exponents, high = _EXPONENTS[by], _HIGH[by]
    e = ensemble(states, model, n, by, column, near_onset())
    error = e.error

    def fit(x: Array, y: Array) -> Array:
        """Coefficients, and the curve at 0.1."""
        law = power_law(x, y, exponents, error=error, low=_LOW, high=high)
        return np.append(law.coefficients, law(_TENTH))

    found = e.interval(fit)
    why = "" if model == "sp" else (DP_CONTACTS if column == "d_z" else DP_UNKNOWN)
    claims = []
    for k, value in enumerate(paper[: len(exponents)]):
        interval = None if found is None else found[k]
        how = f"N = {n}, 1e-3 < d < {high:g}"
        claims.append(
            claim(name, f"{symbol}_{k}, {series}", interval, published.table_entry(value), how=how, reason=why)
        )
    last_digit = 0.05 if column == "d_z" else 0.005  # half a unit of it, in both coefficients
    curve = published.Published(published.table_law(paper, _TENTH), last_digit * (_TENTH**0.5 + _TENTH))
    text = f"{'z - z_J' if column == 'd_z' else 'G'} at d = {_TENTH}, {series}"
    interval = None if found is None else found[len(exponents)]
    return [*claims, claim(name, text, interval, curve, how="the fitted curve", reason=why)]


def _draw_ratios(out: Drawing, axes: Any) -> None:
    """Draw measured over paper, one row per claim."""
    for row, c in enumerate(reversed(out.claims)):
        ratio = np.array([c.value, c.low, c.high]) / c.paper
        axes.barh(row, 2 * c.margin / abs(c.paper), left=1 - c.margin / abs(c.paper), color="#CCCCCC", height=0.7)
        color, marker = (BLUE, "o") if c.agrees else ("#888888", "s") if c.undecided else (RED, "X")
        look: dict[str, Any] = {"color": color, "marker": marker}
        out.curve(axes, c.quantity, [ratio[0]], [row], label=None, **look)
        axes.plot(ratio[1:], [row, row], color=look["color"], linewidth=1.6)
    axes.axvline(1, **{k: v for k, v in FIT.items() if k != "zorder"})
    axes.set_yticks(range(len(out.claims)), [c.quantity for c in reversed(out.claims)])
    label(axes, "measured / paper  (blue: agrees, grey square: undecided, red cross: differs)", "", legend=False)
