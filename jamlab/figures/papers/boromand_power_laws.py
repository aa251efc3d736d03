"""Power laws between packing fractions, energy, area and shape in Boromand et al., fig 11."""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from jamlab.figures.papers.boromand import DP_UNKNOWN, NEAR, has, nearest_size
from jamlab.figures.papers.boromand_geometry import C_REASON, C, eq_11, model_look
from jamlab.figures.papers.claims import claim
from jamlab.figures.papers.ensembles import Ensemble, ensemble, log_edges, near_onset
from jamlab.figures.papers.panels import FIT, GREEN, PAPER, Drawing, drawing, label, scale
from jamlab.figures.papers.tables import Tables
from jamlab.statistics.power_laws import power_law, widest_window

Array = NDArray[np.float64]

SQUARE = "a regular polygon has the least A of its area, so A - A_J grows as the square of small displacements"


def figure_11(tables: Tables) -> Drawing:
    """Five power laws that tie packing fractions, energy, area and shape together."""
    states = tables.states
    out, axes = drawing("boromand-11", 2, 3, 4.6, 3.9)
    n = nearest_size(states, "sp", 32)
    a, b, c, d, e, rest = axes
    _power(
        out,
        a,
        states,
        ("sp", n, "u", "overlap"),
        log_edges(10**-15.1, 0.1),
        [(0.75, 0, 1e-2, "kappa: phi - rho ~ (U/N)^kappa", False, "")],
    )
    label(a, r"energy per particle $U/N$  [$\epsilon$]", r"$\phi - \rho$")
    scale(b)
    curve = ensemble(states, "sp", n, "d_phi", "d_rho", NEAR)
    x, y = curve.band()
    out.curve(b, f"SP, N = {n}", x, y.value, y.low, y.high, **model_look("sp"))
    line = np.geomspace(1e-6, 0.4, 60)
    out.curve(b, rf"paper: eq 11, $C$ = {C}", line, C * eq_11(line), **PAPER)
    label(b, r"$\phi - \phi_J$", r"$\rho - \rho_J$")
    near = curve.interval(lambda x, y: power_law(x, y, (1.0,), high=1e-2).coefficients[0])
    out.claims.append(claim(out.name, "C of eq 11 for dphi < 0.01", near, C, 0.005, how=f"N = {n}", reason=C_REASON))
    small, large = "1 - <a>/a_J ~ drho^zeta, small drho", "1 - <a>/a_J ~ drho^zeta, large drho"
    _power(
        out,
        c,
        states,
        ("sp", n, "d_rho", "lost"),
        near_onset(),
        [
            (1.5, 0, 0.03, small, False, ""),
            (2.5, 0.04, 0.2, large, False, "the local slope rises all the way to confluence: no single power"),
        ],
    )
    label(c, r"$\rho - \rho_J$", r"$1 - \langle a\rangle / a_J$")
    for axes_, model, low_paper in ((d, "sp", 0.66), (e, "dp", 1.0)):
        if not has(states, model):
            axes_.text(0.5, 0.5, f"no {model.upper()} packings", ha="center", transform=axes_.transAxes)
            label(axes_, "", "", legend=False)
            continue
        size = nearest_size(states, model, 32)
        dp = model == "dp"
        why = DP_UNKNOWN if dp else "the local slope falls all the way to confluence: no single power"
        laws = [
            (
                low_paper,
                0,
                0.02,
                f"omega: drho ~ (A - 1)^omega, small A, {model.upper()}",
                True,
                SQUARE if dp else "",
            ),
            (0.3, 0.05, 0.2, f"omega: drho ~ (A - 1)^omega, large A, {model.upper()}", True, why),
        ]
        _power(out, axes_, states, (model, size, "d_rho", "excess"), near_onset(), laws, swap=True)
        label(
            axes_,
            r"$\mathcal{A} - \mathcal{A}_J$" if dp else r"$\mathcal{A} - 1$",
            r"$\rho - \rho_J$",
            loc="lower right",
        )
    _local_slopes(out, rest, states, n)
    out.caption = (
        "Black: our fit over the widest run of bins that lies within 10 % of a power law (grey), searched on each side "
        "of the paper's change of slope; dashed: the paper's slopes. (f), not in the paper: local slopes of c, d and e."
    )
    return out


def _local_slopes(out: Drawing, axes: Any, states: pd.DataFrame, n: int) -> None:
    """zeta and omega between neighbouring bins, which show where a single power holds."""
    scale(axes, "log", "linear")
    curves: tuple[tuple[str, str, str, dict[str, Any]], ...] = (
        ("sp", "lost", r"$\zeta$, SP", {"color": GREEN, "marker": "s"}),
        ("sp", "excess", r"$\omega$, SP", model_look("sp")),
        ("dp", "excess", r"$\omega$, DP", model_look("dp")),
    )
    for model, column, name, look in curves:
        if not has(states, model):
            continue
        size = n if model == "sp" else nearest_size(states, model, 32)
        x, y = ensemble(states, model, size, "d_rho", column, log_edges(10**-6.1, 0.25, 5)).mean
        kept = np.isfinite(x) & (y > 0)
        x, y = x[kept], y[kept]
        rise = np.diff(np.log(y)) / np.diff(np.log(x))
        slope = rise if column == "lost" else 1 / rise
        out.curve(axes, name, np.sqrt(x[1:] * x[:-1]), slope, **look | {"linestyle": "-"})
    for value in (0.3, 0.66, 1.0, 1.5, 2.5):
        axes.axhline(value, **PAPER | {"linewidth": 0.7})
    axes.set_ylim(0, 3.5)
    label(axes, r"$\rho - \rho_J$", "local slope (dashed: the paper's)", loc="upper left")


Law = tuple[float, float, float, str, bool, str]


def _power(
    out: Drawing,
    axes: Any,
    states: pd.DataFrame,
    what: tuple[str, int, str, str],
    edges: Array,
    laws: list[Law],
    swap: bool = False,
) -> Ensemble:
    """A log-log curve with the paper's slopes and our fits; each law: paper, low, high, name, inverse, reason.

    swap: draw x upwards; the exponent of x in y is then the inverse of the fitted one.
    """
    scale(axes)
    model, n, column, value = what
    e = ensemble(states, model, n, column, value, edges)
    x, y = e.band()
    series = f"{model.upper()}, N = {n}"
    if swap:
        out.curve(axes, series, y.value, x, **model_look(model))
    else:
        out.curve(axes, series, x, y.value, y.low, y.high, **model_look(model))
    for paper, low, high, name, inverse, reason in laws:
        try:
            fit = widest_window(x, y.value, tolerance=0.1, low=low, high=high)
        except (ValueError, RuntimeError) as error:
            out.claims.append(claim(out.name, name, None, paper, how=str(error)))
            continue
        ends = (fit.low, fit.high)

        def exponent(x: Array, y: Array, ends: tuple[float, float] = ends, inverse: bool = inverse) -> float:
            found = float(power_law(x, y, low=ends[0] * 0.99, high=ends[1] * 1.01).exponents[0])
            return 1 / found if inverse else found

        how = f"N = {n}, {ends[0]:.2g} < {column} < {ends[1]:.2g}"
        margin = 0.05 if paper < 1.5 else 0.1
        out.claims.append(
            claim(
                out.name, name, e.interval(exponent), paper, margin if paper != 0.75 else 0.005, how=how, reason=reason
            )
        )
        line = np.geomspace(*ends, 20)
        own = out.claims[-1].value
        slope = 1 / paper if inverse else paper
        middle = (ends[0] * ends[1]) ** 0.5
        theirs = float(fit(middle)) * 0.4 * (line / middle) ** slope
        pairs = [(f"fit: {own:.3g}", fit(line), FIT), (f"paper: {paper:g}", theirs, PAPER)]
        for text, values, look in pairs:
            out.curve(axes, text, *((values, line) if swap else (line, values)), **look)
        if swap:
            axes.axhspan(*ends, color="#999999", alpha=0.13, linewidth=0, zorder=0)
        else:
            out.window(axes, *ends)
    return e
