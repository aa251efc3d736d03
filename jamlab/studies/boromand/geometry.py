"""Draw packing fraction, areas and shapes in Boromand et al.: figs 4 and 9."""

from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.plotting.palette import GREEN
from jamlab.statistics import published_numbers as published
from jamlab.statistics.power_laws import power_law
from jamlab.studies.claims import write_list
from jamlab.studies.conventions import (
    DISTANCES,
    FRACTIONS,
    SHAPE_TARGET,
    TWO_OVERLAPS,
    at,
    eq_11,
    fit_prefactor,
    select_below_confluence,
)
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.ensembles import Ensemble, ensemble, has, log_places, nearest_size, sampled_sizes
from jamlab.studies.panels import FIT, PAPER, Drawing, drawing, label, model_style, scale

DENSEST = 1.24  # phi at which rho -> 1, [B] below eq 12


def figure_4(tables: EnsembleTables) -> Drawing:
    """True against nominal packing fraction, particle areas, shape factors."""
    states = tables.states
    out, (a, b, c) = drawing("boromand-4", 1, 3, 4.6, 4.0)
    n = nearest_size(states, "sp", 32)
    e = ensemble(states, "sp", n, "d_phi", "d_rho", DISTANCES)
    x, y = e.band
    out.curve(a, f"SP, N = {n}", x, y, **model_style("sp"))
    found = e.interval(fit_prefactor)
    words = {"cause": _steepest_prefactor(out, e), "shown_by": "boromand-4 a"}
    how = f"N = {n}, least squares, 0.01 <= dphi < {TWO_OVERLAPS}"
    out.claim("C of eq 11", found, published.EQ_11_C, how=how, **words)
    d = np.linspace(0, 0.4, 50)
    out.curve(a, r"paper: $\rho = \phi$", d, d, **PAPER | {"linewidth": 1.0})
    out.curve(a, rf"paper: eq 11, $C$ = {published.EQ_11_C.value}", d, published.EQ_11_C.value * eq_11(d), **FIT)
    a.set_ylim(0, 0.25)
    label(a, r"$\phi - \phi_J$", r"$\rho - \rho_J$", loc="lower right")
    _draw_areas(out, b, states)
    _draw_shapes(out, c, states)
    _claim_shapes(out, states)
    out.caption = (
        "(a) True against nominal packing fraction with eq 11; the form in the paper's caption is a misprint. (b) Mean "
        "particle area, overlaps shared. (c) Packing fraction against shape factor, A - 1 for disks; regular 12- and "
        "17-gons begin at A = 1.0235 and 1.0115, so A - A_J for droplets (small diamonds: their A - 1, the paper's "
        "abscissa). Exponents of dashed lines in b and c are the paper's, their heights are ours."
    )
    return out


def _steepest_prefactor(out: Drawing, e: Ensemble) -> str:
    """Keep how large C can be in any window: the largest drho/(dphi - dphi^1.5) of the mean curve, and its place."""
    x, y = e.mean
    local = y[1:] / eq_11(x[1:])
    if not np.isfinite(local[x[1:] < TWO_OVERLAPS]).any():
        return ""
    k = int(np.nanargmax(local[x[1:] < TWO_OVERLAPS]))
    most, place = out.keep("largest C at one dphi", local[k]), out.keep("dphi of the largest C", x[1 + k])
    return f"C at one dphi rises from 1 at onset to {most:.2f} at dphi = {place:.2f}: no window gives more"


def _draw_areas(out: Drawing, axes: Any, states: pd.DataFrame) -> None:
    """Draw mean particle areas, and the paper's slope through the curve of the disks at 0.12."""
    n, slope = nearest_size(states, "sp", 32), published.LOST_AREA_EXPONENT
    for model in ("sp", "dp"):
        if not has(states, model):
            continue
        size = nearest_size(states, model, 32)
        e = ensemble(states, model, size, "d_rho", "lost", DISTANCES[:18])
        x, y = Ensemble(e.x, 1 - e.y).band
        out.curve(axes, f"{model.upper()}, N = {size}", x, y, **model_style(model))
    d = np.linspace(0.0, 0.155, 40)
    height = at(0.12, *ensemble(states, "sp", n, "d_rho", "lost", DISTANCES[:18]).mean) / 0.12**slope
    out.curve(axes, rf"paper: slope {slope} in $\rho - \rho_J$", d, 1 - height * d**slope, **PAPER)
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
        x, shape = ensemble(states, model, size, by, "excess", DISTANCES[:22]).band
        name = f"{model.upper()}({'φ' if by == 'd_phi' else 'ρ'})"
        out.curve(axes, name, shape.value, x, **look)
        if model == "dp":
            x, shape = ensemble(states, model, size, by, "shape", DISTANCES[:22]).band
            out.curve(axes, r"DP(ρ), $\mathcal{A} - 1$", shape.value - 1, x, **look | {"markersize": 2.5})
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


def _claim_shapes(out: Drawing, states: pd.DataFrame) -> None:
    """Claim shapes of disks at phi = 1 and near confluence, shapes and areas of droplets at confluence."""
    n = nearest_size(states, "sp", 32)
    nominal = ensemble(states, "sp", n, "phi", "shape", [1.0, DENSEST - 1e-6])
    found = [nominal.interval(partial(at, phi)) for phi in (1.0, DENSEST - 1e-6)]
    how = f"N = {n}, interpolated in each packing"
    out.claim("A at phi = 1, SP", found[0], published.SHAPE_AT_UNIT_PHI, how=how)
    how = f"N = {n}, phi = {DENSEST}, where rho -> 1 in the paper"
    out.claim("A near confluence, SP", found[1], published.SHAPE_OF_DENSE_DISKS, how=how)
    area = shape = None
    how = "no dp packings"
    if has(states, "dp"):
        n = nearest_size(states, "dp", 32)
        how = f"N = {n}, drho = {published.CONFLUENCE}, where the paper has confluence; bare polygons"
        lost, curve = (ensemble(states, "dp", n, "d_rho", column, DISTANCES[:18]) for column in ("lost", "shape"))
        area = lost.interval(lambda x, y: 1 - at(0.13, x, y))
        shape = curve.interval(lambda x, y: at(published.CONFLUENCE, x, y))
    out.claim("A at confluence, DP", shape, published.SHAPE_AT_CONFLUENCE, how=how, calibrated=SHAPE_TARGET)
    words = {"how": f"N = {n}", "calibrated": SHAPE_TARGET}
    out.claim("<a>/a_J at drho = 0.13, DP", area, published.AREA_OF_DENSE_DROPLETS, **words)


def _approach_to_unity(states: pd.DataFrame, n: int) -> Ensemble:
    """Arrange 6 - z of droplets over 1 - rho, up to z = 6."""
    near = select_below_confluence(states[(states["model"] == "dp") & (states["n"] == n)])
    return ensemble(near.assign(left=1 - near["rho"]), "dp", n, "left", "missing", log_places(5e-3, 0.13, 8))


def _near_unity(x: Array, y: Array) -> float:
    return float(power_law(x, y, low=5e-3, high=0.1).exponents[0])


def _keep_confluence(out: Drawing, states: pd.DataFrame) -> str:
    """Keep where droplets of each size reach z = 6, and the exponent in 1 - rho there: whether rho* tends to 1."""
    full = states[(states["model"] == "dp") & (states["z"] >= 6)]
    measured = [n for n in sampled_sizes(states, "dp") if n in set(full["n"])]
    if not measured:
        return ""
    first = full.groupby(["n", "seed"])["rho"].min().groupby("n").mean()
    reached = out.keep("1 - rho where z = 6, DP", [1 - first[n] for n in measured], N=measured)
    slopes = [_approach_to_unity(states, n).interval(_near_unity) for n in measured]
    out.keep("exponent of z_conf - z in 1 - rho, DP", slopes, N=measured)
    ends = f"z = 6 is reached at 1 - rho = {write_list(reached, '.4f')}"
    return f"{ends}, and the exponent is {write_list(slopes, '.2f')}, at N = {write_list(measured)}"


def figure_9(tables: EnsembleTables) -> Drawing:
    """z(rho) and rho(A) of polygons, the curves that the paper lays over its experiments."""
    states = tables.states
    out, (a, b) = drawing("boromand-9", 1, 2, 5.0, 4.0)
    slope, how, cause = None, "no dp packings", ""
    for model in ("sp", "dp"):
        if not has(states, model):
            continue
        n = nearest_size(states, model, 64)
        x, y = ensemble(states, model, n, "rho", "z", FRACTIONS).band
        out.curve(a, f"{model.upper()}, N = {n}", x, y, **model_style(model, linestyle="-"))
        x, y = ensemble(states, model, n, "rho", "excess", FRACTIONS).band
        out.curve(b, f"{model.upper()}, N = {n}", y.value, x, **model_style(model, linestyle="-"))
        if model == "dp":
            how, cause = f"N = {n}, rho > 0.9", _keep_confluence(out, states)
            slope = _approach_to_unity(states, n).interval(_near_unity)
    label(a, r"true packing fraction $\rho$", "coordination z", loc="upper left")
    label(
        b, r"$\mathcal{A} - 1$  (DP: $\mathcal{A} - \mathcal{A}_J$)", r"true packing fraction $\rho$", loc="lower right"
    )
    text, words = "exponent of z_conf - z in 1 - rho, DP", {"how": how, "cause": cause, "shown_by": "boromand-9 a"}
    out.claim(text, slope, published.MISSING_CONTACTS_EXPONENT, **words)
    out.caption = (
        "The curves that the paper compares with micrographs. Its experimental points are printed in no table and are "
        "not redrawn: read your own with `jamlab.read_points` and `jamlab.micrograph`."
    )
    return out
