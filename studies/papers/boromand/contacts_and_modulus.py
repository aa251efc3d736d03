"""Draw contacts and shear modulus in Boromand et al.: figs 5 and 6, tables 1 and 2."""

from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.plotting import in_unit
from jamlab.plotting.palette import BLACK, BLUE, GREEN, RED
from jamlab.statistics.data_collapse import fit_scaling_exponents
from jamlab.statistics.power_laws import fit_exponent
from studies.ensemble_tables import PACKINGS, STABILIZED, EnsembleTables
from studies.ensembles import Ensemble, Sample, average, log_places, mean_over_packings
from studies.panels import BESIDE, MODEL_STYLE, PAPER, Drawing, drawing, label, scale, size_style
from studies.papers.boromand.conventions import (
    FRACTIONS,
    HIGHEST,
    LOWEST,
    MIDDLES,
    NEAR,
    SERIES,
    SIZES,
    SUBTRACTED,
    Curve,
    at,
    curve,
    draw_sizes,
    evenly,
    exponent,
    join_samples,
    table_fit,
)
from studies.papers.forest import forest
from studies.papers.statements import caption, paper
from studies.papers.verdicts import compare

SHOWN = (SIZES[0], SIZES[-1])  # N of fig 5
G_UNITS = in_unit("$G$", "SP: ε/σ², DP: ε/l²")
SMALL: dict[str, Any] = {"loc": "upper right", "ncols": 2, "fontsize": 7}  # letters of a legend of many lines
AVERAGED = "mean over all packings, box of fixed shape"
DISTANT = 1e-2  # nearer to onset no single exponent of z - 3.97 exists
WITHOUT_G = 1e-5  # distance from onset below which G of many droplets is not known


# fig 5: models side by side -------------------------------------------------------------------------------------------


def parts(disks: Curve, droplets: Curve, share: float) -> float:
    """Find rho above which the mean of droplets exceeds the mean of disks by a share: the last crossing, or the first
    rho that both have."""
    (x, y), (u, v) = disks, droplets
    kept = (u >= np.nanmin(x)) & (u <= np.nanmax(x)) & np.isfinite(v)
    rho, excess = u[kept], v[kept] / np.interp(u[kept], x, y) - 1
    inside = np.flatnonzero(excess <= share)
    if not len(inside) and len(rho):
        return float(rho[0])  # apart from the first place on
    if not len(inside) or inside[-1] == len(excess) - 1:
        return float("nan")
    k = inside[-1]
    return float(np.interp(0, excess[k : k + 2] - share, rho[k : k + 2]))


def ratio(over: Curve, under: Curve, d_rho: float, taken: float = 0.0) -> float:
    """Compute the ratio of two means at one distance from onset."""
    return (at(*over, d_rho) - taken) / (at(*under, d_rho) - taken)


def beside_eq_13(tables: EnsembleTables) -> Sample:
    """Take z - 3.97 of the largest disk packings over the distance from onset, and rho at onset."""
    taken = curve(tables, "sp", SIZES[-1], "d_rho", "z", "EVERY")
    onset = float(tables.at_onset("sp", SIZES[-1])["rho"].mean())
    return Sample(taken.groups, lambda drawn: (*taken.reduce(drawn), onset))


def end_of_eq_13(x: Array, z: Array, onset: float, share: float = 0.01, end: float = HIGHEST["d_rho"]) -> float:
    """Find rho from which the excess contacts of disks lie a share off their own fit of eq 13 up to `end`."""
    y = z - SUBTRACTED
    off = np.abs(y / (x[:, None] ** (0.5, 1.0) @ coefficients(x, y, 2, LOWEST["sp"], end)) - 1)
    inside, known = np.flatnonzero((off <= share) & np.isfinite(y)), np.isfinite(y).sum()
    return float(onset + x[inside[-1] + 1]) if len(inside) and inside[-1] + 1 < known else float("nan")


# fig 6: exponents -----------------------------------------------------------------------------------------------------


def proportion(
    tables: EnsembleTables, series: str, z_j: str = "3.97", middle: str = "mean", packings: str = PACKINGS[0]
) -> Sample:
    """Take z - z_J and G at the same places."""
    both = [evenly(tables, series, column, 0, DISTANT, z_j=z_j, packings=packings).groups[0] for column in ("z", "g")]
    if both[0].shape != both[1].shape:
        raise InputError(f"{series}: z and G are not known for the same packings and places")
    of_g = MIDDLES[middle]
    return Sample([np.stack(both, axis=-1)], lambda drawn: (average(drawn[0][..., 0]), of_g(drawn[0][..., 1])))


def power_of_contacts(z: Array, g: Array, low: float = -np.inf, high: float = np.inf) -> float:
    """Fit the exponent of G in z - z_J."""
    kept = (z > low) & (z < high)
    return fit_exponent(z[kept], g[kept])


def size_exponent(*drawn: Curve, high: float = HIGHEST["d_phi"], first: int = 0) -> float:
    """Fit a of the crossover dphi* ~ N^-a by the collapse of sizes."""
    family = [(x[kept], y[kept]) for x, y in drawn[first:] for kept in [(y > 0) & (x < high)]]
    n = np.array(SIZES[first:], dtype=float)
    return fit_scaling_exponents(n, [family], b=1.0, start=(2.0, 1.0)).a


def crossover(*drawn: Curve, contacts: float = 2.0) -> float:
    """Fit how the distance at which packings have gained two contacts goes with N."""
    places, sizes = [], SIZES[: len(drawn)]
    for n, (x, y) in zip(sizes, drawn, strict=True):
        more = np.flatnonzero(0.5 * n * y >= contacts)
        if not len(more) or not more[0]:
            return float("nan")
        k = slice(more[0] - 1, more[0] + 1)
        places.append(float(np.exp(np.interp(contacts, 0.5 * n * y[k], np.log(x[k])))))
    return -float(np.polyfit(np.log(sizes), np.log(places), 1)[0])


def exponent_less(over: Curve, under: Curve, low: float = 0.0, high: float = np.inf) -> float:
    """Subtract the exponents of two means in one window."""
    return exponent(*over, low, high) - exponent(*under, low, high)


# tables 1 and 2 -------------------------------------------------------------------------------------------------------


def coefficients(x: Array, y: Array, terms: int, low: float = 0.0, high: float = np.inf) -> Array:
    """Fit the coefficients of eqs 13 and 14 by least squares of absolute residuals."""
    kept = np.isfinite(x + y) & (x > low) & (x < high)
    if kept.sum() <= terms:
        return np.full(terms, np.nan)
    return np.asarray(np.linalg.lstsq(x[kept, None] ** (0.5, 1.0)[:terms], y[kept], rcond=None)[0])


def over_table_2(x: Array, g: Array, fit: str, place: float = 0.1) -> float:
    """Divide G by the fit of table 2 at one distance from onset."""
    return at(x, g, place) / float(table_fit(fit, "G")(place))


def of_both(tables: EnsembleTables, column: str) -> Sample:
    """Take the curves of droplets and of disks."""
    return join_samples(*(evenly(tables, series, column) for series in ("DP(ρ)", "SP(ρ)")))


def ratio_of_terms(droplets: Curve, disks: Curve) -> float:
    """Divide C_1/C_0 of droplets by C_1/C_0 of disks."""
    (d_0, d_1), (s_0, s_1) = (coefficients(*part, 2) for part in (droplets, disks))
    return float(d_1 / d_0 / (s_1 / s_0))


def tables_1_2(tables: EnsembleTables) -> Drawing:
    """Coefficients of tables 1 and 2 from our packings beside the paper's."""
    return forest(compare("tables", tables), "tables", {"[B], tables 1 and 2": ("tables",)})


# drawings -------------------------------------------------------------------------------------------------------------


def figure_5(tables: EnsembleTables) -> Drawing:
    """z and G against rho and phi, with the fits of tables 1-2."""
    out, (top, bottom) = drawing("boromand-5", 1, 2, 5.8, 4.8)
    for axes, column in ((top, "z"), (bottom, "g")):
        for series, (model, by) in SERIES.items():
            x = by.removeprefix("d_")
            colour = GREEN if x == "phi" else MODEL_STYLE[model]["color"]
            look: dict[str, Any] = {"color": colour, "linestyle": "none"}
            look["fillstyle"] = "full" if x == "phi" else "none"
            for n, marker in zip(SHOWN, "vo" if model == "sp" else "Dp", strict=True):
                e = tables.curve(model, n, x, column, FRACTIONS)  # bands of the small ones would cover all others
                out.curve(axes, f"{series}, N = {n}", *(e.mean if n < 64 else e.band), marker=marker, **look)
            onset = paper({"SP(φ)": "BT-phiJ-sp", "SP(ρ)": "BT-rhoJ-sp", "DP(ρ)": "BT-rhoJ-dp"}[series])
            d = np.linspace(1e-4, 0.2 if by == "d_phi" else 1 - onset, 60)  # fits against rho end at rho = 1
            fit = table_fit(series, "z")(d) + SUBTRACTED if column == "z" else table_fit(series, "G")(d)
            text = f"paper: tables 1 (a), 2 (b), {series}"
            out.curve(axes, text, onset + d, fit, linestyle="--", color=colour, linewidth=1.4)
        axes.axvline(paper("B5-z-parts"), color="#777777", linestyle="-.", linewidth=0.9)
    for n, width in zip(SHOWN, (1.0, 2.0), strict=True):
        for packings, e in stable_curves(tables, n, "phi", FRACTIONS):
            look = {"linestyle": ":" if packings != STABILIZED else "-", "linewidth": width, "color": BLACK}
            text = f"SP(φ), N = {n}, {packings}"
            out.curve(bottom, text, *e.mean, label=text.replace("G_x", "$G_x$"), **look)
    top.axhline(6.0, color="#777777", linewidth=0.9, linestyle=":")  # full in the plane
    # far beyond confluence phi says little, and the paper's panel ends near there
    label(top, r"packing fraction $\rho$ or $\phi$", r"coordination $z$", legend=False)
    label(bottom, r"packing fraction $\rho$ or $\phi$", f"shear modulus {G_UNITS}", **BESIDE)
    for axes, ends in ((top, (3.8, 6.5)), (bottom, (0, 0.36))):
        axes.set_title(f"points: {AVERAGED}", fontsize=9, loc="right")
        axes.set_xlim(0.82, 1.06)
        axes.set_ylim(*ends)
    return out


def stable_curves(tables: EnsembleTables, n: int, by: str, places: Array) -> Iterator[tuple[str, Ensemble]]:
    """Give G of disks as it is if only stable packings are averaged, by which those are; none that tables lack."""
    for packings in PACKINGS[1:]:
        with suppress(InputError):
            e = tables.curve("sp", n, by, "g", places, packings)
            if np.isfinite(e.y).any():
                yield packings, e


def figure_6(tables: EnsembleTables) -> Drawing:
    """z - z_J and G against the distance to onset, log-log, one curve per size."""
    out, axes = drawing("boromand-6", 3, 3, 4.4, 3.7)
    panels = [(column, series) for column in ("d_z", "g") for series in SERIES]
    for part, (column, series) in zip(axes, panels, strict=False):
        scale(part)
        model, by = SERIES[series]
        draw_sizes(out, part, tables, model, by, column)
        d = np.geomspace(1e-4, 0.4 if by == "d_phi" else 0.16, 40)
        text = f"paper: fit of table {1 if column == 'd_z' else 2}"
        out.curve(part, text, d, table_fit(series, "z" if column == "d_z" else "G")(d), **PAPER)
        if column == "d_z":
            out.slope(part, 1.0, (3e-5, 3e-4), 1.5e-3)
        else:
            out.slope(part, paper("B6-g-single-dp"), (1e-3, 1e-1), 2e-3 if model == "dp" else 8e-4)
        part.set_title(AVERAGED, fontsize=9, loc="right")
        _mark_regimes(part, by)
        name = r"$\Delta\phi$" if by == "d_phi" else r"$\Delta\rho$"
        y_name = r"$z - z_J$" if column == "d_z" else G_UNITS
        label(part, f"{series[:2]}: {name}", y_name, loc="upper left", fontsize=7.5)
        part.set_xlim(5e-7, 0.7)
        part.set_ylim((1e-3, 5) if column == "d_z" else (3e-4, 1))
    _draw_collapse(out, axes[6], tables)
    _draw_stable(out, axes[7], tables)
    _draw_both_counts(out, axes[8], tables)
    states = tables.states
    near = states[(states["model"] == "dp") & states["d_rho"].between(0, WITHOUT_G, inclusive="right")]
    share = near["g"].isna().groupby(near["n"]).mean()  # whose last free motion nothing holds
    percent = ", ".join(f"{100 * part:.0f} % of N = {n}" for n, part in share.items())
    out.caption = caption(out.name, near=WITHOUT_G, share=percent or "none")
    return out


def _mark_regimes(axes: Any, by: str) -> None:
    """Mark where the paper's regimes of a panel end: two of phi, [B] sec 3; one of rho, where its single power ends."""
    for place in (LOWEST["sp"], HIGHEST["d_phi"]) if by == "d_phi" else (DISTANT,):
        axes.axvline(place, color="#777777", linestyle="-.", linewidth=0.8)


def _draw_collapse(out: Drawing, axes: Any, tables: EnsembleTables) -> None:
    """Draw the collapse of sizes that gives a: (z - z_J) N over dphi N^a."""
    scale(axes)
    a = paper("B6-a")
    draw_sizes(out, axes, tables, "sp", "d_phi", "d_z", power=a)
    for power, ends, height in ((1.0, (0.01, 1.0), 0.3), (0.5, (1e2, 1e4), 60.0)):
        out.slope(axes, power, ends, height, above=power < 1)
    axes.set_ylim(top=4 * axes.get_ylim()[1])  # room for the legend
    label(axes, rf"SP: $\Delta\phi\, N^{a:g}$", r"$(z - z_J)\, N$", loc="upper left")


def _draw_stable(out: Drawing, axes: Any, tables: EnsembleTables) -> None:
    """Draw G of disks by which packings are averaged, over the root of the distance."""
    scale(axes, y="linear")
    places = log_places(LOWEST["sp"], HIGHEST["d_phi"], 6)
    for n in SHOWN:
        every = [("all", tables.curve("sp", n, "d_phi", "g", places)), *stable_curves(tables, n, "d_phi", places)]
        for packings, e in every:
            look = size_style(n) | {"linestyle": dict(zip(PACKINGS, (":", "--", "-"), strict=True))[packings]}
            found = mean_over_packings([e.y / e.x**0.5])[0]
            text = f"N = {n}, {packings}"
            look |= {"marker": "", "label": text.replace("G_x", "$G_x$")}
            out.curve(axes, text, average(e.x), found, **look)
    g_0 = paper("BT-G0-sp-phi")
    out.curve(axes, f"paper: $G_0$ = {g_0}", [places[0], places[-1]], [g_0] * 2, **PAPER)
    axes.set_ylim(0, 2.2)
    label(axes, r"SP: $\Delta\phi$", in_unit(r"$G / \Delta\phi^{1/2}$", "ε/σ²"), **SMALL)


def _draw_both_counts(out: Drawing, axes: Any, tables: EnsembleTables) -> None:
    """Draw z - z_J of droplets by both counts of contacts, and z - z_J of disks."""
    scale(axes)
    n = SHOWN[0]
    for series, model, column, colour, fill in (
        ("DP, all contacts", "dp", "d_z", RED, "full"),
        ("DP, without stops", "dp", "d_z_strong", RED, "none"),
        ("SP", "sp", "d_z", BLUE, "full"),
    ):
        x, y = tables.curve(model, n, "d_rho", column, NEAR).band
        look: dict[str, Any] = {"color": colour, "fillstyle": fill, "marker": "D" if model == "dp" else "o"}
        out.curve(axes, f"{series}, N = {n}", x, y, linestyle="none", **look)
    out.slope(axes, 1.0, (1e-4, 1e-3), 1e-3)
    _mark_regimes(axes, "d_rho")
    label(axes, r"$\Delta\rho$", r"$z - z_J$", loc="upper left")
    axes.set_xlim(5e-7, 0.7)
    axes.set_ylim(1e-3, 5)
