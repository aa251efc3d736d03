"""Draw the power laws between packing fractions, energy, area and shape in Boromand et al., fig 11."""

from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import ConvergenceError, InputError
from jamlab.plotting.palette import GREEN
from jamlab.statistics import published_numbers as published
from jamlab.statistics.power_laws import PowerLaw, power_law, widest_window
from jamlab.studies.conventions import NEAR, eq_11, fit_prefactor
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.ensembles import Ensemble, ensemble, from_onset, has, log_places, nearest_size
from jamlab.studies.panels import FIT, PAPER, Drawing, drawing, label, model_style, scale

NEAREST = 0.01  # dphi up to which C is that of states near onset
_STRAIGHT = 0.1  # relative residual up to which bins count as one power law


class Law(NamedTuple):
    """A power law of the paper.

    Attributes:
        name: of its claim.
        paper: exponent of y in x, or of x in y if `inverse`.
        low, high: x between which the widest straight window is searched.
        inverse: whether the paper gives x as a power of y.
    """

    name: str
    paper: published.Published
    low: float
    high: float
    inverse: bool = False


def figure_11(tables: EnsembleTables) -> Drawing:
    """Five power laws that tie packing fractions, energy, area and shape together."""
    states = tables.states
    out, (a, b, c, d, e, f) = drawing("boromand-11", 2, 3, 4.6, 3.9)
    n = nearest_size(states, "sp", 32)
    _draw_energy(out, a, states, n)
    _draw_eq_11(out, b, states, n)
    _draw_areas(out, c, states, n)
    _draw_shapes(out, d, states, "sp")
    _draw_shapes(out, e, states, "dp")
    _draw_local_slopes(out, f, states, n)
    out.caption = (
        "Black: our fit over the widest run of points that lies within 10 % of a power law (grey), searched on each "
        "side of the paper's change of slope; dashed: the paper's slopes. (f), not in the paper: local slopes of c, d, "
        "e."
    )
    return out


def _draw_energy(out: Drawing, axes: Any, states: pd.DataFrame, n: int) -> None:
    """Draw overlap against energy."""
    e = ensemble(states, "sp", n, "u", "overlap", log_places(1e-14, 0.1, 4))
    _draw_laws(out, axes, e, ("sp", n, "u"), [Law("kappa: phi - rho ~ (U/N)^kappa", published.KAPPA, 0, 1e-5)])
    label(axes, r"energy per particle $U/N$  [$\epsilon$]", r"$\phi - \rho$")


def _draw_eq_11(out: Drawing, axes: Any, states: pd.DataFrame, n: int) -> None:
    """Draw true against nominal packing fraction; C at its limit near onset."""
    scale(axes)
    curve = ensemble(states, "sp", n, "d_phi", "d_rho", NEAR)
    x, y = curve.band
    out.curve(axes, f"SP, N = {n}", x, y, **model_style("sp"))
    line, paper = np.geomspace(1e-6, 0.4, 60), published.EQ_11_C
    out.curve(axes, rf"paper: eq 11, $C$ = {paper.value}", line, paper.value * eq_11(line), **PAPER)
    label(axes, r"$\phi - \phi_J$", r"$\rho - \rho_J$")
    near = curve.interval(lambda x, y: fit_prefactor(x, y, 0.0, NEAREST))
    contradiction = (
        f"C = {paper.value} makes rho > phi up to dphi = (1 - 1/C)^2 = {(1 - 1 / paper.value) ** 2:.3f}, "
        "where overlaps can only lower it"
    )
    words = {"how": f"N = {n}, least squares", "contradiction": contradiction, "shown_by": "boromand-11 b"}
    out.claim(f"C of eq 11 for dphi < {NEAREST}", near, paper, where="[B] appendix, fig 11 b", **words)


def _draw_areas(out: Drawing, axes: Any, states: pd.DataFrame, n: int) -> None:
    """Draw the area that disks lose."""
    small, large = published.ZETA
    laws = [
        Law("1 - <a>/a_J ~ drho^zeta, small drho", small, 0, 0.03),
        Law("1 - <a>/a_J ~ drho^zeta, large drho", large, 0.04, 0.2),
    ]
    e = ensemble(states, "sp", n, "d_rho", "lost", from_onset())
    _draw_laws(out, axes, e, ("sp", n, "d_rho"), laws)
    label(axes, r"$\rho - \rho_J$", r"$1 - \langle a\rangle / a_J$")


def _draw_shapes(out: Drawing, axes: Any, states: pd.DataFrame, model: str) -> None:
    """Draw packing fraction against shape factor."""
    big = model.upper()
    if not has(states, model):
        axes.text(0.5, 0.5, f"no {big} packings", ha="center", transform=axes.transAxes)
        label(axes, "", "", legend=False)
        return
    n = nearest_size(states, model, 32)
    small, large = published.OMEGA[model]
    laws = [
        Law(f"omega: drho ~ (A - 1)^omega, small A, {big}", small, 0, 0.02, True),
        Law(f"omega: drho ~ (A - 1)^omega, large A, {big}", large, 0.05, 0.2, True),
    ]
    e = ensemble(states, model, n, "d_rho", "excess", from_onset())
    _draw_laws(out, axes, e, (model, n, "d_rho"), laws, swap=True)
    shape = r"$\mathcal{A} - \mathcal{A}_J$" if model == "dp" else r"$\mathcal{A} - 1$"
    label(axes, shape, r"$\rho - \rho_J$", loc="lower right")


def _draw_local_slopes(out: Drawing, axes: Any, states: pd.DataFrame, n: int) -> None:
    """Draw zeta and omega between neighbouring bins, which show where a single power holds."""
    scale(axes, "log", "linear")
    curves: tuple[tuple[str, str, str, dict[str, Any]], ...] = (
        ("sp", "lost", r"$\zeta$, SP", {"color": GREEN, "marker": "s"}),
        ("sp", "excess", r"$\omega$, SP", model_style("sp")),
        ("dp", "excess", r"$\omega$, DP", model_style("dp")),
    )
    for model, column, name, look in curves:
        if not has(states, model):
            continue
        size = n if model == "sp" else nearest_size(states, model, 32)
        x, y = ensemble(states, model, size, "d_rho", column, log_places(1e-6, 0.2, 5)).mean
        kept = np.isfinite(x) & (y > 0)
        x, y = x[kept], y[kept]
        rise = np.diff(np.log(y)) / np.diff(np.log(x))
        slope = rise if column == "lost" else 1 / rise
        out.curve(axes, name, np.sqrt(x[1:] * x[:-1]), slope, **look | {"linestyle": "-"})
    for value in sorted({law.value for law in (*published.OMEGA["sp"], *published.OMEGA["dp"], *published.ZETA)}):
        axes.axhline(value, **PAPER | {"linewidth": 0.7})
    axes.set_ylim(0, 3.5)
    label(axes, r"$\rho - \rho_J$", "local slope (dashed: the paper's)", loc="upper left")


def _draw_laws(
    out: Drawing, axes: Any, e: Ensemble, what: tuple[str, int, str], laws: list[Law], swap: bool = False
) -> None:
    """Draw a log-log curve with the paper's slopes and our fits, and claim the exponents.

    Args:
        what: model, number of particles, name of x.
        swap: draw x upwards.
    """
    scale(axes)
    model, n, column = what
    x, y = e.band
    out.curve(axes, f"{model.upper()}, N = {n}", *((y.value, x) if swap else (x, y)), **model_style(model))
    e = e.whole
    x, means = e.mean
    for law in laws:
        try:
            fit = widest_window(x, means, tolerance=_STRAIGHT, low=law.low, high=law.high)
        except (InputError, ConvergenceError) as error:
            out.claim(law.name, None, law.paper, how=str(error))
            continue

        def exponent(x: Array, y: Array, fit: PowerLaw = fit, inverse: bool = law.inverse) -> float:
            found = float(power_law(x, y, low=fit.low * 0.99, high=fit.high * 1.01).exponents[0])
            return 1 / found if inverse else found

        how = f"N = {n}, {fit.low:.2g} < {column} < {fit.high:.2g}, the widest straight window, held in all resamples"
        words = {"how": how, "cause": _local_exponents(out, x, means, law), "shown_by": "boromand-11 f"}
        found = out.claim(law.name, e.interval(exponent), law.paper, **words)
        _draw_fit(out, axes, law, fit, found.value, swap)


def _local_exponents(out: Drawing, x: Array, y: Array, law: Law) -> str:
    """Keep how the exponent between neighbouring points changes through the window of a law.

    That of droplets starts at 1/2: a regular polygon has the least A of its area, so A - A_J has no linear term.
    """
    kept = (x >= law.low) & (x <= law.high) & (y > 0)
    x, y = x[kept], y[kept]
    if len(x) < 3:
        return ""
    slope = np.diff(np.log(y)) / np.diff(np.log(x))
    both = (1 / slope if law.inverse else slope)[[0, -1]]
    first, last = out.keep(f"local exponent, {law.name}", both, drho=x[[0, -1]])
    ends = f"the local exponent is {first:.2f} at drho = {x[0]:.2g} and {last:.2f} at {x[-1]:.2g}"
    return f"{ends}: no single power" if abs(last - first) > 0.1 else ends


def _draw_fit(out: Drawing, axes: Any, law: Law, fit: PowerLaw, own: float, swap: bool) -> None:
    """Draw our fit and the paper's slope in the window of the fit, which is shaded."""
    line = np.geomspace(fit.low, fit.high, 20)
    slope = 1 / law.paper.value if law.inverse else law.paper.value
    middle = (fit.low * fit.high) ** 0.5
    theirs = float(fit(middle)) * 0.4 * (line / middle) ** slope
    pairs = [(f"fit: {own:.3g}", fit(line), FIT), (f"paper: {law.paper.value:g}", theirs, PAPER)]
    for text, values, look in pairs:
        out.curve(axes, text, *((values, line) if swap else (line, values)), **look)
    if swap:
        axes.axhspan(fit.low, fit.high, color="#999999", alpha=0.13, linewidth=0, zorder=0)
    else:
        out.window(axes, fit.low, fit.high)
