"""Draw packing fraction, areas and shapes in Boromand et al., and the power laws between them: figs 4 and 11."""

from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from jamlab.arrays import Array
from jamlab.plotting import in_unit
from jamlab.plotting.palette import GREEN, ORANGE
from jamlab.statistics.power_laws import fit_exponent, fit_power_law
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import Ensemble, log_places
from studies.panels import FIT, PAPER, Drawing, TextTable, drawing, label, model_style, scale
from studies.papers.boromand.conventions import (
    DISTANCES,
    ENERGIES,
    FROM_ONSET,
    NEAR,
    SHAPES,
    SMALL,
    TWO_OVERLAPS,
    at,
    eq_11,
)
from studies.papers.statements import keywords, measure, paper, statements

N = 32  # of figs 4 and 11
PRINTED = {"B11-omega-small-sp": "0.66 to 0.67"}  # in text and caption
LATE = (0.0, 1e-4, 1e-3, 3e-3, 1e-2)  # distances beyond onset at which it might be called


def prefactor(x: Array, y: Array, low: float = 0.01, high: float = TWO_OVERLAPS) -> float:
    """Fit C of eq 11 by least squares, where the paper has it exact: pairs of disks overlap, but no triples."""
    kept = np.isfinite(y) & (x >= low) & (x < high)
    f = eq_11(x[kept])
    return float(f @ y[kept] / (f @ f)) if kept.any() else np.nan


def area_left(x: Array, lost: Array, place: float) -> float:
    """Interpolate the mean area over that at onset."""
    return 1 - at(x, lost, place)


def last_decade(x: Array, y: Array, low: float = 0.1, high: float = 1.0) -> float:
    """Fit the exponent over the last decade of the abscissa, that half of the packings reach; in units of its end."""
    last = float(np.nanmax(x))
    return float(fit_power_law(x, y, low=0.999 * low * last, high=1.001 * high * last).exponents[0])


def omega_if_late(tables: EnsembleTables, late: float, low: float, high: float) -> float:
    """Fit omega of droplets between two distances from an onset that is called too late."""
    x, y = tables.curve("dp", N, "d_rho", "excess", log_places(1e-6, 0.15, 10)).mean
    kept = np.isfinite(x) & (y > 0)
    grown = PchipInterpolator(np.log(x[kept]), np.log(y[kept]))
    d = np.geomspace(low, high, 9)
    rise = np.exp(grown(np.log(d + late))) - (np.exp(grown(np.log(late))) if late else 0.0)
    return 1 / fit_exponent(d, rise)


def late_onset(tables: EnsembleTables) -> TextTable:
    """Write omega of droplets against how late onset is called."""
    windows = ((1e-4, 1e-3), (1e-3, 1e-2))
    cells = [[f"{omega_if_late(tables, late, *window):.2f}" for window in windows] for late in LATE]
    rows = [[f"{late:g}", *row] for late, row in zip(LATE, cells, strict=True)]
    columns = ("onset called later by drho", "omega, drho from 1e-4 to 1e-3", "from 1e-3 to 1e-2")
    return TextTable(columns, rows, heading="omega of droplets if onset is called too late", words=True)


# fig 4 ----------------------------------------------------------------------------------------------------------------


def figure_4(tables: EnsembleTables) -> Drawing:
    """True against nominal packing fraction, particle areas, shape factors."""
    out, (a, b, c) = drawing("boromand-4", 1, 3, 4.6, 4.0)
    x, y = tables.curve("sp", N, "d_phi", "d_rho", DISTANCES).band
    out.curve(a, f"SP, N = {N}", x, y, **model_style("sp"))
    d, paper_c = np.linspace(0, 0.4, 50), paper("B4-C")
    out.curve(a, r"paper: $\rho = \phi$", d, d, **PAPER | {"linewidth": 1.0})
    out.curve(a, rf"paper: eq 11, $C$ = {paper_c}", d, paper_c * eq_11(d), **FIT)
    a.set_ylim(0, 0.25)
    label(a, r"$\phi - \phi_J$", r"$\rho - \rho_J$", loc="lower right")
    _draw_areas(out, b, tables)
    _draw_shapes(out, c, tables)
    return out


def _draw_areas(out: Drawing, axes: Any, tables: EnsembleTables) -> None:
    """Draw mean particle areas, and the form of the paper's power, with its height from our disks at 0.12."""
    slope = paper("B11-zeta-large")
    for model in ("sp", "dp"):
        e = tables.curve(model, N, "d_rho", "lost", SMALL)
        x, y = Ensemble(e.x, 1 - e.y).band
        out.curve(axes, f"{model.upper()}, N = {N}", x, y, **model_style(model))
    d = np.linspace(0.0, 0.155, 40)
    height = at(*tables.curve("sp", N, "d_rho", "lost", SMALL).mean, 0.12) / 0.12**slope
    out.curve(axes, rf"form $1 - c\,(\rho - \rho_J)^{{{slope}}}$, $c$ ours", d, 1 - height * d**slope, **PAPER)
    axes.set_ylim(0.82, 1.02)
    label(axes, r"$\rho - \rho_J$", r"mean particle area $\langle a\rangle / a_J$", loc="lower left")


def _draw_shapes(out: Drawing, axes: Any, tables: EnsembleTables) -> None:
    """Draw packing fraction over shape factor."""
    scale(axes, y="linear")
    for model, by, fill in (("sp", "d_phi", "full"), ("sp", "d_rho", "none"), ("dp", "d_rho", "none")):
        look = model_style(model, fillstyle=fill) | ({"color": GREEN} if by == "d_phi" else {})
        x, shape = tables.curve(model, N, by, "excess", DISTANCES[:22]).band
        out.curve(axes, f"{model.upper()}({'φ' if by == 'd_phi' else 'ρ'})", shape.value, x, **look)
        if model == "dp":
            x, shape = tables.curve(model, N, by, "shape_factor", DISTANCES[:22]).band
            out.curve(axes, r"DP(ρ), $\mathcal{A} - 1$", shape.value - 1, x, **look | {"color": ORANGE, "marker": "*"})
    s, steep, flat = np.geomspace(3e-3, 0.1, 20), paper("B4-lambda"), paper("B11-omega-large-sp")
    out.curve(axes, rf"form of $\omega = {flat}$, height free", s, 0.165 * (s / 0.07) ** flat, **PAPER)
    dotted = PAPER | {"linestyle": ":"}
    out.curve(axes, rf"form of $\lambda = {steep}$, height free", s[:14], 0.16 * (s[:14] / 0.03) ** steep, **dotted)
    axes.set_xlim(3e-4, 0.15)
    axes.set_ylim(0, 0.26)
    shape_name = r"shape factor $\mathcal{A} - 1$  (DP: $\mathcal{A} - \mathcal{A}_J$)"
    label(axes, shape_name, r"$\rho - \rho_J$ or $\phi - \phi_J$", loc="upper left")


# fig 11 ---------------------------------------------------------------------------------------------------------------


def figure_11(tables: EnsembleTables) -> Drawing:
    """Five power laws that tie packing fractions, energy, area and shape together."""
    out, (a, b, c, d, e, rest) = drawing("boromand-11", 2, 3, 4.6, 3.9)
    rest.remove()
    _draw_law(out, a, tables, "sp", ("u", "overlap", ENERGIES), "B11-kappa")
    label(a, in_unit("energy per particle $U/N$", "ε"), r"$\phi - \rho$")
    scale(b)
    x, y = tables.curve("sp", N, "d_phi", "d_rho", NEAR).band
    out.curve(b, f"SP, N = {N}", x, y, **model_style("sp"))
    line, paper_c = np.geomspace(1e-6, 0.4, 60), paper("B4-C")
    out.curve(b, rf"paper: eq 11, $C$ = {paper_c}", line, paper_c * eq_11(line), **PAPER)
    label(b, r"$\phi - \phi_J$", r"$\rho - \rho_J$")
    lost = ("d_rho", "lost", FROM_ONSET)
    _draw_law(out, c, tables, "sp", lost, "B11-zeta-small")
    _draw_last_decade(out, c, tables, "sp", lost, "B11-zeta-large")
    label(c, r"$\rho - \rho_J$", r"$1 - \langle a\rangle / a_J$")
    for axes, model, shape in ((d, "sp", "1"), (e, "dp", r"\mathcal{A}_J")):
        _draw_law(out, axes, tables, model, ("d_rho", "excess", FROM_ONSET), f"B11-omega-small-{model}", inverse=True)
        _draw_last_decade(out, axes, tables, model, ("excess", "d_rho", SHAPES), f"B11-omega-large-{model}")
        label(axes, rf"$\mathcal{{A}} - {shape}$", r"$\rho - \rho_J$", loc="lower right")
    out.text = [late_onset(tables)]
    return out


def _draw_law(
    out: Drawing,
    axes: Any,
    tables: EnsembleTables,
    model: str,
    what: tuple[str, str, Array],
    statement: str,
    inverse: bool = False,
) -> None:
    """Draw a log-log curve, our fit in the window of a number, and the paper's slope; inverse: with x upwards."""
    scale(axes)
    x, y = tables.curve(model, N, *what).band
    out.curve(axes, f"{model.upper()}, N = {N}", *((y.value, x) if inverse else (x, y)), **model_style(model))
    low, high = (keywords(statements()[statement].settings)[end] for end in ("low", "high"))
    fit = fit_power_law(x, y.value, low=0.99 * low, high=1.01 * high)
    line, theirs, ours = np.geomspace(fit.low, fit.high, 20), paper(statement), measure(statement, tables).value
    places, heights = (fit(line), line) if inverse else (line, fit(line))
    out.curve(axes, f"fit: {ours:.3g}", places, heights, **FIT)
    beside = (2.5 if inverse else 0.3) * float(heights[0])
    out.slope(axes, theirs, (places[0], places[-1]), beside, PRINTED.get(statement), above=inverse)
    span = axes.axhspan if inverse else axes.axvspan
    span(fit.low, fit.high, color="#999999", alpha=0.13, linewidth=0, zorder=0)


def _draw_last_decade(
    out: Drawing, axes: Any, tables: EnsembleTables, model: str, what: tuple[str, str, Array], statement: str
) -> None:
    """Draw our exponent over the last decade, and the paper's."""
    x, y = tables.curve(model, N, *what).mean
    line, theirs, ours = float(np.nanmax(x)) * np.array([0.1, 1.0]), paper(statement), measure(statement, tables).value
    middle = line.prod() ** 0.5
    height = float(np.interp(middle, x, y))
    out.curve(axes, f"last decade: {ours:.3g}", line, height * (line / middle) ** ours, **FIT)
    out.slope(axes, theirs, (line[0], 0.5 * line[-1]), 0.35 * height * (line[0] / middle) ** theirs)
