"""Geometry in Boromand et al.: figs 4, 8, 9 and 11. Mechanics and onset are in boromand.py."""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from jamlab.bootstrap import Interval, bootstrap
from jamlab.figures import MODEL_STYLE
from jamlab.geometry_figures import SIDE_COLOURS
from jamlab.paper_figures.boromand import DP_UNKNOWN, LINEAR, NEAR, below_confluence, has, nearest_size
from jamlab.paper_figures.claims import Claim, claim
from jamlab.paper_figures.ensembles import RESAMPLES, Ensemble, Statistic, ensemble, log_edges
from jamlab.paper_figures.panels import BLACK, FIT, GREEN, PAPER, Drawing, drawing, label, scale
from jamlab.paper_figures.tables import Tables
from jamlab.scaling import power_law, widest_window
from jamlab.voids import PLATEAU_BORDER

Array = NDArray[np.float64]

C = 1.21  # of eq 11
FINE = np.arange(0.0, 0.5, 0.01) - 0.005
TWO_OVERLAPS = 0.36  # dphi up to which only pairs overlap: phi < 1.2
LINES = {"sp": (MODEL_STYLE["sp"]["color"], "v"), "dp": (MODEL_STYLE["dp"]["color"], "D")}


def _look(model: str, **more: Any) -> dict[str, Any]:
    colour, marker = LINES[model]
    return {"color": colour, "marker": marker, "linestyle": "none"} | more


def eq_11(d_phi: Array) -> Array:
    """drho over C, Boromand et al. eq 11."""
    return np.asarray(d_phi - d_phi**1.5)


def _prefactor(x: Array, y: Array) -> float:
    """C by least squares on eq 11."""
    kept = np.isfinite(y) & (x > 0.01) & (x < TWO_OVERLAPS)
    f = eq_11(x[kept])
    return float(f @ y[kept] / (f @ f)) if kept.any() else np.nan


def figure_4(tables: Tables) -> Drawing:
    """True against nominal packing fraction, particle areas, shape factors."""
    states = tables.states
    out, (a, b, c) = drawing("boromand-4", 1, 3, 4.6, 4.0)
    n = nearest_size(states, "sp", 32)
    e = ensemble(states, "sp", n, "d_phi", "d_rho", FINE)
    x, y = e.band()
    out.curve(a, f"SP, N = {n}", x, y.value, y.low, y.high, **_look("sp"))
    d = np.linspace(0, 0.4, 50)
    out.curve(a, r"paper: $\rho = \phi$", d, d, **PAPER | {"linewidth": 1.0})
    out.curve(a, rf"paper: eq 11, $C$ = {C}", d, C * eq_11(d), **FIT)
    a.set_ylim(0, 0.25)
    label(a, r"$\phi - \phi_J$", r"$\rho - \rho_J$", loc="lower right")
    window = f"N = {n}, least squares, 0.01 < dphi < {TWO_OVERLAPS}"
    out.claims.append(claim(out.name, "C of eq 11", e.interval(_prefactor), C, 0.005, how=window, reason=C_REASON))
    for model in ("sp", "dp"):
        if not has(states, model):
            continue
        size = nearest_size(states, model, 32)
        x, y = ensemble(states, model, size, "d_rho", "lost", FINE[:18]).band(lambda v: 1 - v)
        out.curve(b, f"{model.upper()}, N = {size}", x, y.value, y.low, y.high, **_look(model))
    d = np.linspace(0.0, 0.155, 40)
    out.curve(b, r"paper: slope 2.5 in $\rho - \rho_J$", d, 1 - 10.5 * d**2.5, **PAPER)
    b.set_ylim(0.82, 1.02)
    label(b, r"$\rho - \rho_J$", r"mean particle area $\langle a\rangle / a_J$", loc="lower left")
    scale(c, "log", "linear")
    for model, by, fill in (("sp", "d_phi", "full"), ("sp", "d_rho", "none"), ("dp", "d_rho", "none")):
        if not has(states, model):
            continue
        size = nearest_size(states, model, 32)
        look = _look(model, fillstyle=fill) | ({"color": GREEN} if by == "d_phi" else {})
        x, shape = ensemble(states, model, size, by, "excess", FINE[:22]).band()
        name = f"{model.upper()}({'φ' if by == 'd_phi' else 'ρ'})"
        out.curve(c, name, shape.value, x, **look)
    s = np.geomspace(3e-3, 0.1, 20)
    out.curve(c, r"paper: $\omega \approx 0.3$", s, 0.165 * (s / 0.07) ** 0.3, **PAPER)
    out.curve(c, r"paper: $\lambda \approx 0.67$", s[:14], 0.16 * (s[:14] / 0.03) ** 0.67, **PAPER | {"linestyle": ":"})
    c.set_xlim(3e-4, 0.15)
    c.set_ylim(0, 0.22)
    label(
        c,
        r"shape factor $\mathcal{A} - 1$  (DP: $\mathcal{A} - \mathcal{A}_J$)",
        r"$\rho - \rho_J$ or $\phi - \phi_J$",
        loc="upper left",
    )
    out.claims += _shape_claims(states, out.name)
    out.caption = (
        "(a) True against nominal packing fraction with eq 11; the form in the paper's caption is a misprint. (b) Mean "
        "particle area, overlaps shared. (c) Packing fraction against shape factor; regular 12- and 17-gons begin at "
        "A = 1.0235 and 1.0115, so A_J is taken off. Heights of the paper's power laws are ours."
    )
    return out


C_REASON = "C is 1 at onset by definition, so it depends on the window, which the paper does not print"


def _at(place: float) -> Statistic:
    """The mean curve at one x; nan beyond its ends."""

    def value(x: Array, y: Array) -> float:
        kept = np.isfinite(x) & np.isfinite(y)
        return float(np.interp(place, x[kept], y[kept], left=np.nan, right=np.nan)) if kept.any() else np.nan

    return value


def _shape_claims(states: pd.DataFrame, name: str) -> list[Claim]:
    fine = np.arange(0.8, 1.3, 0.005)
    n = nearest_size(states, "sp", 32)
    by_phi, by_rho = (ensemble(states, "sp", n, by, "shape", fine) for by in ("phi", "rho"))
    claims = [
        claim(name, "A at phi = 1, SP", by_phi.interval(_at(1.0)), 1.03, 0.005, how=f"N = {n}"),
        claim(
            name,
            "A near confluence, SP",
            by_rho.interval(_at(0.997)),
            1.10,
            0.0,
            relation=">",
            how=f"N = {n}, rho = 0.997",
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
            1.07,
            0.005,
            how=f"{how}, straight line from rho > 0.95 to 1",
            reason=f"bare polygons, without rim; {DP_UNKNOWN}",
        ),
        claim(
            name, "<a>/a_J at drho = 0.13, DP", area, 1.0, 0.01, how=how, reason=f"finite area stiffness; {DP_UNKNOWN}"
        ),
    ]


def figure_8(tables: Tables) -> Drawing:
    """Voids: share with l sides, shape factor of those with three, mean areas."""
    counts = tables.void_counts
    out, (a, b, c) = drawing("boromand-8", 1, 3, 4.8, 4.0)
    sides = (3, 4, 5, 6)
    for model in ("sp", "dp"):
        if not has(counts, model):
            continue
        n = nearest_size(counts, model, 64)
        part = counts[(counts["model"] == model) & (counts["n"] == n)]
        x, cube = _sums(part[~part["onset"].astype(bool)])
        share = bootstrap([cube], lambda g: _share(g[0], sides), resamples=RESAMPLES)
        look = (
            {"linestyle": "none", "marker": "v"}
            if model == "sp"
            else {"linestyle": "-", "marker": "D", "markersize": 3}
        )
        for k, l in enumerate(sides):
            name = f"{model.upper()}, {l} sides"
            colour = {"color": SIDE_COLOURS[l] if l != 5 else "#C9A800"}
            out.curve(a, name, x, share.value[:, k], share.low[:, k], share.high[:, k], **look | colour)
        mean = bootstrap([cube], lambda g: _means(g[0]), resamples=RESAMPLES)
        name = f"{model.upper()}, N = {n}"
        out.curve(b, name, x, mean.value[:, 0], mean.low[:, 0], mean.high[:, 0], **_look(model, linestyle="-"))
        out.curve(c, name, x, mean.value[:, 1], mean.low[:, 1], mean.high[:, 1], **_look(model, linestyle="-"))
        out.claims += _void_claims(out.name, model, n, part, x, cube)
    out.curve(b, "paper: Plateau border, 4.87", [0.83, 1.0], [PLATEAU_BORDER] * 2, **PAPER)
    label(a, r"true packing fraction $\rho$", r"share $P_l$ of voids with $l$ sides", ncols=2)
    a.set_ylim(-0.02, 1.35)
    label(b, r"true packing fraction $\rho$", r"shape factor $\mathcal{A}$ of 3-sided voids")
    c.set_yscale("log")
    label(c, r"true packing fraction $\rho$", r"mean void area / particle area")
    out.caption = (
        "Voids that do not percolate; rattlers count as particles. The paper's snapshots are not redrawn: a table holds "
        "no shapes (`jamlab demo` draws them). Panel c is not in the paper."
    )
    return out


def _sums(part: pd.DataFrame) -> tuple[Array, Array]:
    """Bins of rho, and (packings, bins, sides 0 to 7+, 3) sums: voids, areas, shape factors."""
    rho = np.sort(part["rho"].unique())
    seeds = np.sort(part["seed"].unique())
    cube = np.zeros((len(seeds), len(rho), 8, 3))
    place = (
        np.searchsorted(seeds, part["seed"]),
        np.searchsorted(rho, part["rho"]),
        np.minimum(part["sides"].to_numpy(dtype=int), 7),
    )
    np.add.at(cube, place, part[["voids", "area", "shape"]].to_numpy(dtype=np.float64))
    return np.asarray(rho, dtype=np.float64), cube


def _ratio(above: Array, below: Array) -> Array:
    return np.divide(above, below, out=np.full(above.shape, np.nan), where=below > 0)


def _share(cube: Array, sides: tuple[int, ...]) -> Array:
    """(bins, sides) P_l."""
    voids = cube[..., 0].sum(axis=0)
    total = np.broadcast_to(voids.sum(axis=1, keepdims=True), (len(voids), len(sides)))
    return _ratio(voids[:, list(sides)], total)


def _means(cube: Array) -> Array:
    """(bins, 2): mean shape factor of voids with three sides, mean area of all."""
    total = cube.sum(axis=0)
    return np.column_stack([_ratio(total[:, 3, 2], total[:, 3, 0]), _ratio(total[..., 1].sum(1), total[..., 0].sum(1))])


def _void_claims(name: str, model: str, n: int, part: pd.DataFrame, x: Array, cube: Array) -> list[Claim]:
    big, how = model.upper(), f"N = {n}"
    claims = []
    if part["onset"].astype(bool).any():
        _, first = _sums(part[part["onset"].astype(bool)].assign(rho=0.0))
        share = bootstrap([first], lambda g: _share(g[0], (3, 4, 5, 6))[0], resamples=RESAMPLES)
        for k, (l, paper, margin) in enumerate(((3, 0.4, 0.05), (4, 0.4, 0.05), (5, 0.18, 0.005), (6, 0.02, 0.005))):
            claims.append(claim(name, f"P_{l} at onset, {big}", share[k], paper, margin, how=f"{how}, states at onset"))

    def pooled(low: float, high: float, column: int) -> Interval | None:
        inside = (x > low) & (x < high)
        if not inside.any():
            return None

        def value(groups: list[Array]) -> float:
            total = groups[0][:, inside].sum(axis=(0, 1))
            if column == 0:
                return float(_ratio(total[3:4, 0], total[:, 0].sum(keepdims=True))[0])
            return float(_ratio(total[3:4, 2], total[3:4, 0])[0])

        return bootstrap([cube], value, resamples=RESAMPLES)

    if model == "dp":
        claims.append(
            claim(name, "P_3 for rho > 0.97, DP", pooled(0.97, 1.0, 0), 1.0, 0.005, how=how, reason=DP_UNKNOWN)
        )
        claims.append(
            claim(
                name,
                "A of 3-sided voids, rho > 0.97, DP",
                pooled(0.97, 1.0, 1),
                4.87,
                0.05,
                how=how,
                reason=f"rims of width delta round the corners; {DP_UNKNOWN}",
            )
        )
    else:
        claims.append(
            claim(
                name,
                "A of 3-sided voids, rho < 0.86, SP",
                pooled(0.8, 0.86, 1),
                4.87,
                0.05,
                how=how,
                reason="the paper's is that of three equal disks; sizes differ here, and near onset gaps are open",
            )
        )
        claims.append(
            claim(name, "A of 3-sided voids, rho > 0.98, SP", pooled(0.98, 1.0, 1), 2.0, 0.0, relation="<", how=how)
        )
    return claims


def figure_9(tables: Tables) -> Drawing:
    """z(rho) and rho(A) of polygons, the curves that the paper lays over its experiments."""
    states = tables.states
    out, (a, b) = drawing("boromand-9", 1, 2, 5.0, 4.0)
    slope, how = None, "no dp packings"
    for model in ("sp", "dp"):
        if not has(states, model):
            continue
        n = nearest_size(states, model, 64)
        x, y = ensemble(states, model, n, "rho", "z", LINEAR).band()
        out.curve(a, f"{model.upper()}, N = {n}", x, y.value, y.low, y.high, **_look(model, linestyle="-"))
        e = ensemble(states, model, n, "rho", "excess", LINEAR)
        x, y = e.band()
        out.curve(b, f"{model.upper()}, N = {n}", y.value, x, **_look(model, linestyle="-"))
        if model == "dp":
            how = f"N = {n}, rho > 0.9"
            near = below_confluence(states[(states["model"] == model) & (states["n"] == n)]).assign(
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
            1.0,
            0.05,
            how=how,
            reason="rho* < 1 in small packings",
        )
    )
    out.caption = (
        "The curves that the paper compares with micrographs. Its experimental points are printed in no table and are "
        "not redrawn: read your own with `jamlab.read_points` and `jamlab.micrograph`."
    )
    return out


def figure_11(tables: Tables) -> Drawing:
    """Five power laws that tie packing fractions, energy, area and shape together."""
    states = tables.states
    out, axes = drawing("boromand-11", 2, 3, 4.6, 3.9)
    n = nearest_size(states, "sp", 32)
    a, b, c, d, e, rest = axes
    rest.set_axis_off()
    tilted = _power(
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
    out.curve(b, f"SP, N = {n}", x, y.value, y.low, y.high, **_look("sp"))
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
        NEAR,
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
                "vertices of the bare polygon move first; A_J is taken off" if dp else "",
            ),
            (0.3, 0.05, 0.2, f"omega: drho ~ (A - 1)^omega, large A, {model.upper()}", True, why),
        ]
        _power(out, axes_, states, (model, size, "d_rho", "excess"), NEAR, laws, swap=True)
        label(
            axes_,
            r"$\mathcal{A} - \mathcal{A}_J$" if dp else r"$\mathcal{A} - 1$",
            r"$\rho - \rho_J$",
            loc="lower right",
        )
    del tilted
    out.caption = (
        "Black: our fit over the widest run of bins that lies within 10 % of a power law (grey), searched on each side "
        "of the paper's change of slope; dashed: the paper's slopes."
    )
    return out


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
        out.curve(axes, series, y.value, x, **_look(model))
    else:
        out.curve(axes, series, x, y.value, y.low, y.high, **_look(model))
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
        theirs = fit(np.array([ends[0]]))[0] * 0.5 * (line / ends[0]) ** slope
        pairs = [(f"fit: {own:.3g}", fit(line), FIT), (f"paper: {paper:g}", theirs, PAPER)]
        for text, values, look in pairs:
            out.curve(axes, text, *((values, line) if swap else (line, values)), **look)
        if swap:
            axes.axhspan(*ends, color="#999999", alpha=0.13, linewidth=0, zorder=0)
        else:
            out.window(axes, *ends)
    return e
