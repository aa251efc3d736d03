"""Draw packing fraction, areas and shapes in Boromand et al., and the power laws between them: figs 4 and 11."""

from collections.abc import Sequence
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import ConvergenceError, InputError
from jamlab.plotting.palette import GREEN
from jamlab.statistics.power_laws import PowerLaw, power_law
from studies import published_numbers as published
from studies.boromand.widest_window import widest_window
from studies.claims import Kind, halves
from studies.conventions import (
    DISTANCES,
    NEAR,
    SHAPE_TARGET,
    TWO_OVERLAPS,
    at,
    eq_11,
    first_above,
    fit_prefactor,
)
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import (
    Ensemble,
    ensemble,
    from_onset,
    has,
    log_places,
    nearest_size,
    unmeasured,
)
from studies.panels import FIT, PAPER, Drawing, drawing, label, model_style, scale

DENSEST = 1.24  # phi at which rho -> 1, [B] below eq 12
NEAREST = 0.01  # dphi up to which C is that of states near onset
_NAMES = {"d_rho": "drho", "u": "U/N"}
_STRAIGHT = 0.1  # relative residual up to which bins count as one power law


def figure_4(tables: EnsembleTables) -> Drawing:
    """True against nominal packing fraction, particle areas, shape factors."""
    states = tables.states
    out, (a, b, c) = drawing("boromand-4", 1, 3, 4.6, 4.0)
    n = nearest_size(states, "sp", 32)
    e = ensemble(states, "sp", n, "d_phi", "d_rho", DISTANCES)
    x, y = e.band
    out.curve(a, f"SP, N = {n}", x, y, **model_style("sp"))
    _claim_prefactor(out, states, n, e)
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


def _claim_prefactor(out: Drawing, states: pd.DataFrame, n: int, e: Ensemble) -> None:
    """Claim C of eq 11 with the exact rho; its family holds eq 12 as printed, which the paper used."""
    found, every = e.varied(fit_prefactor, {"low": 0.1}, {"high": 0.2}, {"high": 0.5})
    x, y = e.mean
    if len(x) > 1 and np.isfinite(local := y[1:] / eq_11(x[1:])).any():
        k = int(np.nanargmax(local))
        most, place = out.keep("largest C at one dphi", local[k]), out.keep("dphi of the largest C", x[1 + k])
        cause = f"C at one dphi rises from 1 at onset to {most:.2f} at dphi = {place:.2f}"
    else:
        cause = ""
    if has_printed(states):
        printed = ensemble(
            states.assign(d_printed=states["rho_printed"] - states["phi"] + states["d_phi"]),
            "sp",
            n,
            "d_phi",
            "d_printed",
            DISTANCES,
        )
        _, others = printed.varied(fit_prefactor, {"high": TWO_OVERLAPS}, {"high": 0.5})
        every |= {f"eq 12 as printed, {choice}": other for choice, other in others.items()}
        last = float(np.nanmax(printed.mean[1][1:] / eq_11(printed.mean[0][1:])))
        cause += f"; eq 12 as printed gives up to {out.keep('largest C at one dphi, eq 12 as printed', last):.2f}"
    how = f"N = {n}, least squares, 0.01 <= dphi < {TWO_OVERLAPS}"
    words = {"how": how, "cause": cause, "shown_by": "boromand-4 a"}
    two = f"printed as {published.EQ_11_C.value}, and as about {published.EQ_11_C_OF_TEXT.value}, with which it agrees"
    out.claim("C of eq 11", found, published.EQ_11_C, family=every, **words, unlike=two)
    text = "C of eq 11 as the appendix has it"  # the same number, printed with one digit less
    out.claim(text, found, published.EQ_11_C_OF_TEXT, kind=Kind.DUPLICATE, family=every, **words)


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
    disks = ensemble(states, "sp", n, "d_rho", "lost", DISTANCES[:18])
    words = {"how": f"N = {n}", "cause": "the loss begins at onset, as drho^1.5", "shown_by": "boromand-4 b"}
    _claim_rise(out, "drho where half a percent of the area is lost, SP", disks, published.AREA_FALLS, words)
    axes.set_ylim(0.82, 1.02)
    label(axes, r"$\rho - \rho_J$", r"mean particle area $\langle a\rangle / a_J$", loc="lower left")


def _claim_rise(out: Drawing, text: str, e: Ensemble, paper: published.Published, words: dict[str, str]) -> None:
    """Claim the place from which a curve can be told from 0: where it exceeds half a percent; family: 0.3 and 1 %."""
    found, every = e.varied(lambda x, y, share=0.005: first_above(x, y, share), {"share": 0.003}, {"share": 0.01})
    out.claim(text, found, paper, family=every, **words)


def _draw_shapes(out: Drawing, axes: Any, states: pd.DataFrame) -> None:
    """Draw packing fraction over shape factor."""
    scale(axes, y="linear")
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
    curve = ensemble(states, "sp", n, "d_rho", "shape", DISTANCES)
    how = f"N = {n}, drho = {published.CONFLUENCE}, where the paper has confluence"
    every = {f"phi = {DENSEST}, where rho = 1": found[1]}
    there = curve.interval(partial(at, published.CONFLUENCE))
    out.claim("A near confluence, SP", there, published.SHAPE_OF_DENSE_DISKS, family=every, how=how)
    _claim_fractions(out, states, n)
    _claim_mean_shapes(out, states)
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


def _claim_fractions(out: Drawing, states: pd.DataFrame, n: int) -> None:
    """Claim rho of disks at the packing fractions phi of which the paper gives it."""
    m = nearest_size(states, "sp", 64)
    rho = ensemble(states, "sp", m, "phi", "rho", [1.0])
    out.claim("rho at phi = 1, SP", rho.interval(partial(at, 1.0)), published.RHO_AT_UNIT_PHI, how=f"N = {m}")
    words = {"how": f"N = {m}, phi - rho = 0.005: two decimals show no less", "shown_by": "boromand-4 a"}
    overlap = ensemble(states, "sp", m, "phi", "overlap", np.arange(0.84, 0.95, 0.01))
    _claim_rise(out, "phi up to which rho is phi, SP", overlap, published.RHO_AS_PHI, words)
    found, how = None, "no packing has rho by eq 12 as printed"
    if has_printed(states):
        dense = {c: ensemble(states, "sp", n, "phi", c, [DENSEST - 1e-6]) for c in ("rho", "rho_printed")}
        found = dense["rho_printed"].interval(partial(at, DENSEST - 1e-6))
        exact = out.keep(f"rho at phi = {DENSEST}, exact", at(DENSEST - 1e-6, *dense["rho"].mean))
        how = f"N = {n}, eq 12 as printed; exact {exact:.4f}"
    out.claim(f"rho at phi = {DENSEST}, eq 12 as printed, SP", found, published.RHO_AT_DENSEST, how=how)
    if has_printed(states):  # which counts what three disks share once more
        shared = states.assign(three=states["rho_printed"] - states["rho"])
        found = ensemble(shared, "sp", n, "phi", "three", [1.19, 1.2]).interval(partial(at, 1.2))
        how = f"N = {n}, rho by eq 12 as printed less the exact one"
    out.claim("area that three disks share at phi = 1.2, SP", found, published.THREE_OVERLAP, how=how)


def _claim_mean_shapes(out: Drawing, states: pd.DataFrame) -> None:
    """Claim the mean A of the packings of figs 2 and 3, and exponents of fig 4 c."""
    for (model, wanted, rho), paper in published.SHAPES.items():
        (found, every), how = unmeasured(), f"no {model} packings"
        if has(states, model):
            n = nearest_size(states, model, wanted)
            ends = round(rho, 2) - 0.005, round(rho, 2) + 0.005
            e = ensemble(states, model, n, "rho", "shape", [ends[0], rho, ends[1]])
            found, every = e.varied(lambda x, y, rho=rho: at(rho, x, y), *({"rho": end} for end in ends))
            how = f"N = {n}; rho is printed with two digits, which are the family"
        words = {"how": how, "shown_by": f"boromand-{2 if wanted == 64 else 3}"}
        out.claim(f"mean A at rho = {rho}, {model.upper()}", found, paper, family=every, **words)
    n = nearest_size(states, "sp", 32)
    for text, by, window, paper in (
        ("lambda: dphi ~ (A - 1)^lambda, SP", "d_phi", (1e-2, 0.4), published.LAMBDA_OF_SHAPE),
        ("omega: drho ~ (A - 1)^omega, small A, caption of fig 4", "d_rho", (7e-3, 0.05), published.OMEGA_OF_CAPTION),
    ):
        e = ensemble(states, "sp", n, by, "excess", from_onset())
        low, high = window
        more = [{"high": 0.04}] if by == "d_phi" else []

        def exponent(x: Array, y: Array, low: float = low, high: float = high) -> float:
            return 1 / float(power_law(x, y, low=0.999 * low, high=1.001 * high).exponents[0])  # ends are places

        found, every = e.varied(exponent, *halves(*window), *more)
        words = {"how": f"N = {n}, {low:g} < {by} < {high:g}", "shown_by": "boromand-11 f"}
        if by == "d_rho":
            words["how"] += ", A - 1 from 1e-3 to 1e-2, the left decade of the panel"
            words["cause"] = "the text and fig 11 d have 0.66 for the same curve"
        out.claim(text, found, paper, family=every, **words)


def has_printed(states: pd.DataFrame) -> bool:
    """Whether some packings have rho by eq 12 as printed."""
    return "rho_printed" in states and bool(states["rho_printed"].notna().any())


class Law(NamedTuple):
    """A power law of the paper."""

    name: str  # of its claim
    paper: published.Published  # exponent of y in x, or of x in y if `inverse`
    # low, high: x between which the widest straight window is searched
    low: float
    high: float
    inverse: bool = False  # whether the paper gives x as a power of y
    choices: Sequence[dict[str, float]] = ()  # other windows


def figure_11(tables: EnsembleTables) -> Drawing:
    """Five power laws that tie packing fractions, energy, area and shape together."""
    states = tables.states
    out, (a, b, c, d, e, f) = drawing("boromand-11", 2, 3, 4.6, 3.9)
    n = nearest_size(states, "sp", 32)
    _draw_energy(out, a, states, n)
    _draw_eq_11(out, b, states, n)
    _draw_lost_areas(out, c, states, n)
    _draw_shape_laws(out, d, states, "sp")
    _draw_shape_laws(out, e, states, "dp")
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
    for text, column, paper in (
        ("phi - rho ~ dphi^a, SP", "overlap", published.OVERLAP_IN_PHI),
        ("dphi ~ (U/N)^a, SP", "u", published.PHI_IN_ENERGY),
    ):
        of_phi = ensemble(states, "sp", n, "d_phi", column, log_places(1e-4, 1e-1, 5))

        def exponent(x: Array, y: Array, low: float = 1e-4, high: float = 1e-1, inverse: bool = column == "u") -> float:
            found = float(power_law(x, y, low=0.999 * low, high=1.001 * high).exponents[0])
            return 1 / found if inverse else found

        found, every = of_phi.varied(exponent, *_decades(1e-4, 1e-1))
        words = {"how": f"N = {n}, 1e-4 < dphi < 0.1", "shown_by": "boromand-11 a"}
        out.claim(text, found, paper, family=every, **words)


def _decades(low: float, high: float) -> list[dict[str, float]]:
    """Choose every decade of a window: where a power holds, each gives it."""
    return [{"low": float(a), "high": float(b)} for a, b in pairwise(log_places(low, high, 1))]


def _draw_eq_11(out: Drawing, axes: Any, states: pd.DataFrame, n: int) -> None:
    """Draw true against nominal packing fraction; C at its limit near onset."""
    scale(axes)
    curve = ensemble(states, "sp", n, "d_phi", "d_rho", NEAR)
    x, y = curve.band
    out.curve(axes, f"SP, N = {n}", x, y, **model_style("sp"))
    line, paper = np.geomspace(1e-6, 0.4, 60), published.EQ_11_C
    out.curve(axes, rf"paper: eq 11, $C$ = {paper.value}", line, paper.value * eq_11(line), **PAPER)
    label(axes, r"$\phi - \phi_J$", r"$\rho - \rho_J$")

    def prefactor(x: Array, y: Array, high: float = NEAREST) -> float:
        return fit_prefactor(x, y, 0.0, high)

    near, every = curve.varied(prefactor, {"high": 0.003}, {"high": 0.03})
    cause = (
        f"C = {paper.value} makes rho > phi up to dphi = (1 - 1/C)^2 = {(1 - 1 / paper.value) ** 2:.3f}, "
        "where overlaps can only lower it"
    )
    words = {"how": f"N = {n}, least squares", "cause": cause, "shown_by": "boromand-11 b"}
    out.claim(f"C of eq 11 for dphi < {NEAREST}", near, paper, family=every, **words)


def _draw_lost_areas(out: Drawing, axes: Any, states: pd.DataFrame, n: int) -> None:
    """Draw the area that disks lose."""
    small, large = published.ZETA
    e = ensemble(states, "sp", n, "d_rho", "lost", from_onset())
    law = Law("1 - <a>/a_J ~ drho^zeta, small drho", small, 0, 0.03, choices=_decades(1e-4, 1e-2))
    _draw_laws(out, axes, e, ("sp", n, "d_rho"), [law])
    _claim_last_decade(out, axes, e, f"N = {n}, {{}} < drho < {{}}", "1 - <a>/a_J ~ drho^zeta, large drho", large)
    label(axes, r"$\rho - \rho_J$", r"$1 - \langle a\rangle / a_J$")


def _draw_shape_laws(out: Drawing, axes: Any, states: pd.DataFrame, model: str) -> None:
    """Draw packing fraction against shape factor."""
    big = model.upper()
    if not has(states, model):
        axes.text(0.5, 0.5, f"no {big} packings", ha="center", transform=axes.transAxes)
        label(axes, "", "", legend=False)
        return
    n = nearest_size(states, model, 32)
    small, large = published.OMEGA[model]
    laws = [Law(f"omega: drho ~ (A - 1)^omega, small A, {big}", small, 0, 0.02, True, [{"high": 0.03}, {"high": 0.05}])]
    e = ensemble(states, model, n, "d_rho", "excess", from_onset())
    _draw_laws(out, axes, e, (model, n, "d_rho"), laws, swap=True)
    shapes = ensemble(states, model, n, "excess", "d_rho", log_places(1e-4, 0.16, 20))
    text = f"omega: drho ~ (A - 1)^omega, large A, {big}"
    _claim_last_decade(out, axes, shapes, f"N = {n}, {{}} < A - {'1' if model == 'sp' else 'A_J'} < {{}}", text, large)
    shape = r"$\mathcal{A} - \mathcal{A}_J$" if model == "dp" else r"$\mathcal{A} - 1$"
    label(axes, shape, r"$\rho - \rho_J$", loc="lower right")


def _claim_last_decade(out: Drawing, axes: Any, e: Ensemble, how: str, text: str, paper: published.Published) -> None:
    """Claim an exponent over the last decade of the panel's abscissa, which half of the packings reach at its end."""
    x, y = e.mean
    last = float(np.nanmax(x))

    def exponent(x: Array, y: Array, low: float = 0.1, high: float = 1.0) -> float:
        return float(power_law(x, y, low=low * last * 0.999, high=high * last * 1.001).exponents[0])

    number, every = e.varied(exponent, {"low": 0.5}, {"low": 0.45}, *halves(0.1, 1.0))
    kept = (x > 0.1 * last) & (y > 0)
    slopes = np.diff(np.log(y[kept])) / np.diff(np.log(x[kept]))
    first, final = out.keep(
        f"local exponent, {text}", slopes[[0, -1]] if len(slopes) else (np.nan, np.nan), x=(0.1 * last, last)
    )
    words = {"how": how.format(f"{0.1 * last:.3g}", f"{last:.3g}") + ", the last decade; family in units of its end"}
    words |= {"cause": f"the local exponent goes from {first:.2f} to {final:.2f} there", "shown_by": "boromand-11 f"}
    found = out.claim(text, number, paper, family=every, **words)
    line = np.array([0.1 * last, last])
    middle = float(np.interp(line.prod() ** 0.5, x, y))
    out.curve(axes, f"last decade: {found.value:.3g}", line, middle * (line / line.prod() ** 0.5) ** found.value, **FIT)
    out.curve(
        axes,
        f"paper: {paper.value:g} at large",
        line,
        0.5 * middle * (line / line.prod() ** 0.5) ** paper.value,
        **PAPER,
    )


def _draw_local_slopes(out: Drawing, axes: Any, states: pd.DataFrame, n: int) -> None:
    """Draw zeta and omega between neighbouring bins, which show where a single power holds."""
    scale(axes, y="linear")
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
    """Draw a log-log curve with the paper's slopes and our fits, and claim exponents; with `swap` x goes upwards."""
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

        def exponent(
            x: Array, y: Array, low: float = fit.low, high: float = fit.high, inverse: bool = law.inverse
        ) -> float:
            found = float(power_law(x, y, low=low * 0.99, high=high * 1.01).exponents[0])
            return 1 / found if inverse else found

        how = f"N = {n}, {fit.low:.2g} < {column} < {fit.high:.2g}, the widest straight window, held in all resamples"
        words = {"how": how, "cause": _local_exponents(out, x, means, law, _NAMES[column]), "shown_by": "boromand-11 f"}
        number, every = e.varied(exponent, *halves(fit.low, fit.high), *law.choices)
        found = out.claim(law.name, number, law.paper, family=every, **words)
        _draw_fit(out, axes, law, fit, found.value, swap)


def _local_exponents(out: Drawing, x: Array, y: Array, law: Law, of: str) -> str:
    """Keep how the exponent between neighbouring points changes through the window of a law. That of droplets starts at
    1/2: a regular polygon has the least A of its area, so A - A_J has no linear term."""
    kept = (x >= law.low) & (x <= law.high) & (y > 0)
    x, y = x[kept], y[kept]
    if len(x) < 3:
        return ""
    slope = np.diff(np.log(y)) / np.diff(np.log(x))
    both = (1 / slope if law.inverse else slope)[[0, -1]]
    first, last = out.keep(f"local exponent, {law.name}", both, **{of: x[[0, -1]]})
    ends = f"the local exponent is {first:.2f} at {of} = {x[0]:.2g} and {last:.2f} at {x[-1]:.2g}"
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
