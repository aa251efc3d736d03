"""Draw packing fraction, areas and shapes in Boromand et al.: figs 4 and 9."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from jamlab.figures.papers.boromand_contacts_and_modulus import LINEAR, select_below_confluence
from jamlab.figures.papers.claims import DP_UNKNOWN, Claim, claim
from jamlab.figures.papers.ensembles import ensemble, has, log_edges, nearest_size
from jamlab.figures.papers.panels import FIT, PAPER, Drawing, drawing, label, model_style, scale
from jamlab.figures.papers.tables import EnsembleTables
from jamlab.plotting.palette import GREEN
from jamlab.statistics import published_numbers as published
from jamlab.statistics.power_laws import power_law

Array = NDArray[np.float64]

FINE = np.arange(0.0, 0.5, 0.01) - 0.005  # edges of bins of a distance to onset, one of them around 0
C_REASON = "C is 1 at onset by definition, so it depends on the window, which the paper does not print"
TWO_OVERLAPS = 0.36  # dphi up to which only pairs overlap: phi < 1.2


def eq_11(d_phi: Array) -> Array:
    """drho over C, Boromand et al. eq 11."""
    return np.asarray(d_phi - d_phi**1.5)


def _fit_prefactor(x: Array, y: Array) -> float:
    """Fit C of eq 11 by least squares."""
    kept = np.isfinite(y) & (x > 0.01) & (x < TWO_OVERLAPS)
    f = eq_11(x[kept])
    return float(f @ y[kept] / (f @ f)) if kept.any() else np.nan


def figure_4(tables: EnsembleTables) -> Drawing:
    """True against nominal packing fraction, particle areas, shape factors."""
    states = tables.states
    out, (a, b, c) = drawing("boromand-4", 1, 3, 4.6, 4.0)
    n = nearest_size(states, "sp", 32)
    e = ensemble(states, "sp", n, "d_phi", "d_rho", FINE)
    x, y = e.band()
    out.curve(a, f"SP, N = {n}", x, y.value, y.low, y.high, **model_style("sp"))
    d = np.linspace(0, 0.4, 50)
    out.curve(a, r"paper: $\rho = \phi$", d, d, **PAPER | {"linewidth": 1.0})
    out.curve(a, rf"paper: eq 11, $C$ = {published.EQ_11_C.value}", d, published.EQ_11_C.value * eq_11(d), **FIT)
    a.set_ylim(0, 0.25)
    label(a, r"$\phi - \phi_J$", r"$\rho - \rho_J$", loc="lower right")
    window = f"N = {n}, least squares, 0.01 < dphi < {TWO_OVERLAPS}"
    out.claims.append(
        claim(out.name, "C of eq 11", e.interval(_fit_prefactor), published.EQ_11_C, how=window, reason=C_REASON)
    )
    _draw_areas(out, b, states)
    _draw_shapes(out, c, states)
    out.claims += _shape_claims(states, out.name)
    out.caption = (
        "(a) True against nominal packing fraction with eq 11; the form in the paper's caption is a misprint. (b) Mean "
        "particle area, overlaps shared. (c) Packing fraction against shape factor; regular 12- and 17-gons begin at "
        "A = 1.0235 and 1.0115, so A_J is taken off. Heights of the paper's power laws are ours."
    )
    return out


def _draw_areas(out: Drawing, axes: Any, states: pd.DataFrame) -> None:
    """Draw mean particle areas, and the paper's slope through the curve of the disks at 0.12."""
    n, slope = nearest_size(states, "sp", 32), published.LOST_AREA_EXPONENT
    for model in ("sp", "dp"):
        if not has(states, model):
            continue
        size = nearest_size(states, model, 32)
        x, y = ensemble(states, model, size, "d_rho", "lost", FINE[:18]).band(lambda v: 1 - v)
        out.curve(axes, f"{model.upper()}, N = {size}", x, y.value, y.low, y.high, **model_style(model))
    d = np.linspace(0.0, 0.155, 40)
    height = _at(0.12)(*ensemble(states, "sp", n, "d_rho", "lost", FINE[:18]).mean) / 0.12**slope
    out.curve(
        axes,
        rf"paper: slope {slope} in $\rho - \rho_J$",
        d,
        1 - height * d**slope,
        **PAPER,
    )
    axes.set_ylim(0.82, 1.02)
    label(axes, r"$\rho - \rho_J$", r"mean particle area $\langle a\rangle / a_J$", loc="lower left")


def _draw_shapes(out: Drawing, axes: Any, states: pd.DataFrame) -> None:
    """Draw packing fraction over shape factor."""
    scale(axes, "log", "linear")
    for model, by, fill in (("sp", "d_phi", "full"), ("sp", "d_rho", "none"), ("dp", "d_rho", "none")):
        if not has(states, model):
            continue
        size = nearest_size(states, model, 32)
        look = model_style(model, fillstyle=fill) | ({"color": GREEN} if by == "d_phi" else {})
        x, shape = ensemble(states, model, size, by, "excess", FINE[:22]).band()
        name = f"{model.upper()}({'φ' if by == 'd_phi' else 'ρ'})"
        out.curve(axes, name, shape.value, x, **look)
    s, (steep, flat) = np.geomspace(3e-3, 0.1, 20), published.SHAPE_EXPONENTS
    out.curve(axes, rf"paper: $\omega \approx {flat}$", s, 0.165 * (s / 0.07) ** flat, **PAPER)
    dotted = PAPER | {"linestyle": ":"}
    out.curve(axes, rf"paper: $\lambda \approx {steep}$", s[:14], 0.16 * (s[:14] / 0.03) ** steep, **dotted)
    axes.set_xlim(3e-4, 0.15)
    axes.set_ylim(0, 0.22)
    label(
        axes,
        r"shape factor $\mathcal{A} - 1$  (DP: $\mathcal{A} - \mathcal{A}_J$)",
        r"$\rho - \rho_J$ or $\phi - \phi_J$",
        loc="upper left",
    )


def _at(place: float) -> Callable[[Array, Array], float]:
    """Statistic: the mean curve at one x; nan beyond its ends."""

    def value(x: Array, y: Array) -> float:
        kept = np.isfinite(x) & np.isfinite(y)
        return float(np.interp(place, x[kept], y[kept], left=np.nan, right=np.nan)) if kept.any() else np.nan

    return value


def _shape_claims(states: pd.DataFrame, name: str) -> list[Claim]:
    fine = np.arange(0.8, 1.3, 0.005)
    n = nearest_size(states, "sp", 32)
    by_phi, by_rho = (ensemble(states, "sp", n, by, "shape", fine) for by in ("phi", "rho"))
    claims = [
        claim(name, "A at phi = 1, SP", by_phi.interval(_at(1.0)), published.SHAPE_AT_UNIT_PHI, how=f"N = {n}"),
        claim(
            name,
            "A near confluence, SP",
            by_rho.interval(lambda x, y: y[np.nanargmax(x)]),
            published.SHAPE_OF_DENSE_DISKS,
            how=f"N = {n}, mean over rho > {0.005 * np.floor(200 * np.nanmax(by_rho.mean[0])):.3f}",
        ),
    ]
    area = shape = None
    how = "no dp packings"
    if has(states, "dp"):
        n = nearest_size(states, "dp", 32)
        how = f"N = {n}"
        area = ensemble(states, "dp", n, "d_rho", "lost", FINE[:18]).interval(lambda x, y: 1 - _at(0.13)(x, y))
        dense = ensemble(states, "dp", n, "rho", "shape", fine)

        def confluent(x: Array, y: Array) -> float:
            kept = (x > 0.95) & np.isfinite(y)
            return float(np.polyval(np.polyfit(x[kept], y[kept], 1), 1.0)) if kept.sum() > 2 else np.nan

        shape = dense.interval(confluent)
    return [
        *claims,
        claim(
            name,
            "A at confluence, DP",
            shape,
            published.SHAPE_AT_CONFLUENCE,
            how=f"{how}, straight line from rho > 0.95 to 1",
            reason=f"bare polygons, without rim; {DP_UNKNOWN}",
        ),
        claim(
            name,
            "<a>/a_J at drho = 0.13, DP",
            area,
            published.AREA_OF_DENSE_DROPLETS,
            how=how,
            reason=f"finite area stiffness; {DP_UNKNOWN}",
        ),
    ]


def figure_9(tables: EnsembleTables) -> Drawing:
    """z(rho) and rho(A) of polygons, the curves that the paper lays over its experiments."""
    states = tables.states
    out, (a, b) = drawing("boromand-9", 1, 2, 5.0, 4.0)
    slope, how = None, "no dp packings"
    for model in ("sp", "dp"):
        if not has(states, model):
            continue
        n = nearest_size(states, model, 64)
        x, y = ensemble(states, model, n, "rho", "z", LINEAR).band()
        out.curve(a, f"{model.upper()}, N = {n}", x, y.value, y.low, y.high, **model_style(model, linestyle="-"))
        e = ensemble(states, model, n, "rho", "excess", LINEAR)
        x, y = e.band()
        out.curve(b, f"{model.upper()}, N = {n}", y.value, x, **model_style(model, linestyle="-"))
        if model == "dp":
            how = f"N = {n}, rho > 0.9"
            near = select_below_confluence(states[(states["model"] == model) & (states["n"] == n)]).assign(
                left=lambda t: 1 - t["rho"]
            )
            slope = ensemble(near, model, n, "left", "missing", log_edges(5e-3, 0.15, 8)).interval(
                lambda x, y: power_law(x, y, low=5e-3, high=0.1).exponents[0]
            )
    label(a, r"true packing fraction $\rho$", "coordination z", loc="upper left")
    label(
        b, r"$\mathcal{A} - 1$  (DP: $\mathcal{A} - \mathcal{A}_J$)", r"true packing fraction $\rho$", loc="lower right"
    )
    out.claims.append(
        claim(
            out.name,
            "exponent of z_conf - z in 1 - rho, DP",
            slope,
            published.MISSING_CONTACTS_EXPONENT,
            how=how,
            reason="rho* < 1 in small packings",
        )
    )
    out.caption = (
        "The curves that the paper compares with micrographs. Its experimental points are printed in no table and are "
        "not redrawn: read your own with `jamlab.read_points` and `jamlab.micrograph`."
    )
    return out
