"""Draw contacts and shear modulus in Boromand et al.: figs 5 and 6, tables 1 and 2."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.plotting.palette import BLACK, BLUE, GREEN, MODEL_STYLE, RED
from jamlab.statistics.data_collapse import fit_scaling_exponents
from jamlab.statistics.power_laws import fit_exponent
from studies.ensemble_tables import PACKINGS, STABILIZED, EnsembleTables
from studies.ensembles import RESAMPLES, Ensemble, Sample, average, log_places, mean_over_packings, median
from studies.panels import BESIDE, PAPER, Drawing, drawing, label, scale, size_style
from studies.papers.boromand.conventions import (
    COMPRESSED,
    FRACTIONS,
    HIGHEST,
    LARGEST,
    LOWEST,
    NEAR,
    SERIES,
    SIZES,
    STABLE,
    SUBTRACTED,
    Curve,
    at,
    curve,
    curves,
    draw_sizes,
    evenly,
    exponent,
    halves,
    mean,
    onsets,
    table_fit,
)
from studies.papers.forest import forest
from studies.papers.statements import caption, paper, statistic
from studies.papers.verdicts import compare

SHOWN = {"sp": (32, 256), "dp": (32, 128)}  # N of fig 5; few packings of larger droplets are compressed
G_UNITS = r"$G$  [SP: $\epsilon/\sigma^2$, DP: $\epsilon_r/l^2$]"
SMALL: dict[str, Any] = {"loc": "upper right", "ncols": 2, "fontsize": 7}  # letters of a legend of many lines
AVERAGED = "mean over all packings, box of fixed shape"
DISTANT = 1e-2  # nearer to onset no single exponent of z - 3.97 exists
NEAREST = (1e-4, 1e-3)  # distance from onset between the steps of [B] sec 2.3 and the end of regime 1, sec 3
WITHOUT_G = 1e-5  # distance from onset below which G of many droplets is not known
_EQ_13 = np.arange(0.001, 0.18, 0.001)


# fig 5: models side by side -------------------------------------------------------------------------------------------


_AT_RHO: dict[str, Any] = {"sample": curves, "kinds": (("sp", 128), ("dp", 128)), "x": "rho", "places": FRACTIONS}


@statistic("B5-z-parts", y="z", share=0.02, **_AT_RHO, variants=[{"share": s} for s in (0.015, 0.025, 0.03)])
@statistic("B5-g-parts", y="g", share=0.1, **_AT_RHO, variants=[{"share": s} for s in (0.05, 0.15, 0.2)])
def parts(disks: Curve, droplets: Curve, share: float) -> float:
    """Find rho above which the mean of droplets exceeds that of disks by a share: its last crossing, else the first rho
    that both have."""
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


for _name, _kinds, _d_rho in (
    ("models", (("dp", 128), ("sp", 128)), 0.01),
    ("sizes-sp", (("sp", 256), ("sp", 32)), 0.1),
    ("sizes-dp", (("dp", 128), ("dp", 32)), 0.1),
):
    _of: dict[str, Any] = {"sample": curves, "kinds": _kinds, "x": "d_rho", "places": np.arange(0.005, 0.155, 0.005)}
    _both = ({"d_rho": 0.5 * _d_rho}, {"d_rho": 1.5 * _d_rho})
    statistic(f"B5-z-{_name}", y="z", d_rho=_d_rho, variants=(*_both, {"taken": SUBTRACTED}), **_of)(ratio)
    _stable = STABLE if _name == "sizes-sp" else ()
    statistic(f"B5-g-{_name}", y="g", d_rho=_d_rho, variants=(*_both, *_stable), **_of)(ratio)


def beside_eq_13(tables: EnsembleTables) -> Sample:
    """Take z - 3.97 of the largest disk packings over the distance from onset, and rho at onset."""
    taken = curve(tables, "sp", LARGEST["sp"], "d_rho", "z", _EQ_13)
    onset = float(tables.at_onset("sp", LARGEST["sp"])["rho"].mean())
    return Sample(taken.groups, lambda drawn: (*taken.reduce(drawn), onset))


@statistic(
    "B5-eq13-ends", sample=beside_eq_13, variants=({"share": 0.005}, {"share": 0.02}, {"end": 0.11}, {"end": 0.15})
)
def end_of_eq_13(x: Array, z: Array, onset: float, share: float = 0.01, end: float = HIGHEST["d_rho"]) -> float:
    """Find rho from which the excess contacts of disks lie a share off their own fit of eq 13 up to `end`."""
    y = z - SUBTRACTED
    off = np.abs(y / (x[:, None] ** (0.5, 1.0) @ coefficients(x, y, 2, LOWEST["sp"], end)) - 1)
    inside, known = np.flatnonzero((off <= share) & np.isfinite(y)), np.isfinite(y).sum()
    return float(onset + x[inside[-1] + 1]) if len(inside) and inside[-1] + 1 < known else float("nan")


# fig 6: exponents -----------------------------------------------------------------------------------------------------

_OTHER_G: tuple[dict[str, Any], ...] = ({"per_decade": 20}, {"middle": median}, {"column": "g_x"}, *STABLE)
_OTHER_Z: tuple[dict[str, Any], ...] = ({"per_decade": 20}, {"z_j": "own"})
for _name, _series, _column, _n, _more in (
    ("alpha0", "SP(φ)", "z", 0, _OTHER_Z),
    ("z-single-dp", "DP(ρ)", "z", 0, _OTHER_Z),
    ("beta0", "SP(φ)", "g", 0, _OTHER_G),
    ("g-small-sp", "SP(φ)", "g", 32, (*_OTHER_G, *({"n": n} for n in SIZES[1:]))),  # the caption names no N
    ("g-single-dp", "DP(ρ)", "g", 0, _OTHER_G[:2]),
):
    _where: dict[str, Any] = {"sample": evenly, "series": _series, "column": _column, "n": _n, "beyond": DISTANT}
    statistic(f"B6-{_name}", variants=(*halves(DISTANT, HIGHEST[SERIES[_series][1]]), *_more), **_where)(exponent)


def proportion(
    tables: EnsembleTables,
    series: str,
    z_j: str = "3.97",
    middle: Callable[[Array], Array] = average,
    packings: str = PACKINGS[0],
) -> Sample:
    """Take z - z_J and G at the same places."""
    both = [evenly(tables, series, column, 0, DISTANT, z_j=z_j, packings=packings).groups[0] for column in ("z", "g")]
    return Sample([np.stack(both, axis=-1)], lambda drawn: (average(drawn[0][..., 0]), middle(drawn[0][..., 1])))


_PARTS: tuple[dict[str, Any], ...] = ({"low": 1.2}, {"high": 1.2}, {"z_j": "own"}, {"middle": median})


@statistic("B6-g-of-z-sp", sample=proportion, series="SP(φ)", variants=(*_PARTS, *STABLE))
@statistic("B6-g-of-z-dp", sample=proportion, series="DP(ρ)", variants=_PARTS)
def power_of_contacts(z: Array, g: Array, low: float = -np.inf, high: float = np.inf) -> float:
    """Fit the exponent of G in z - z_J."""
    kept = (z > low) & (z < high)
    return fit_exponent(z[kept], g[kept])


WITHOUT_STOPS = ({"y": "d_z_strong"},)  # another count of the contacts of droplets
_NEAREST, _ROOT = log_places(1e-6, NEAREST[1], 10), log_places(LOWEST["sp"], DISTANT, 10)
for _name, _y, _also in (("z", "d_z", {"dp": WITHOUT_STOPS}), ("g", "g", {"sp": STABLE})):
    for _model, _by in (("sp", "d_phi"), ("dp", "d_rho")):  # of the smallest packings, where this regime is widest
        _of = {"sample": curve, "model": _model, "n": 32, "x": _by, "y": _y, "places": _NEAREST}
        _others: tuple[dict[str, Any], ...] = (*halves(*NEAREST), *_also.get(_model, ()))
        statistic(f"B6-{_name}-nearest-{_model}", within=(0.99 * NEAREST[0], np.inf), variants=_others, **_of)(exponent)
    _of = {"sample": curve, "model": "dp", "n": LARGEST["dp"], "x": "d_rho", "y": _y, "places": _ROOT}
    _others = (*halves(LOWEST["sp"], DISTANT), *_also.get("dp", ()))  # before the linear terms set in
    statistic(f"B6-{_name}-root-dp", variants=_others, **_of)(exponent)


def of_sizes(model: str, places: Array, y: str = "d_z") -> dict[str, Any]:
    """Write the keywords of a statistic of z - z_J over the distance from onset of every size of the paper's."""
    kinds = [(model, n) for n in COMPRESSED[model]]
    return {"sample": curves, "kinds": kinds, "x": "d_phi" if model == "sp" else "d_rho", "y": y, "places": places}


@statistic("B6-a", **of_sizes("sp", NEAR), resamples=RESAMPLES // 4, variants=({"high": 0.02}, {"first": 1}))
def size_exponent(*drawn: Curve, high: float = HIGHEST["d_phi"], first: int = 0) -> float:
    """Fit a of the crossover dphi* ~ N^-a by the collapse of sizes."""
    family = [(x[kept], y[kept]) for x, y in drawn[first:] for kept in [(y > 0) & (x < high)]]
    n = np.array(COMPRESSED["sp"][first:], dtype=float)
    return fit_scaling_exponents(n, [family], b=1.0, start=(2.0, 1.0)).a


_GAINED = ({"contacts": 1.0}, {"contacts": 4.0})


@statistic("B6-crossover-dp", **of_sizes("dp", log_places(1e-6, 0.1, 10), "d_z_strong"), variants=_GAINED)
def crossover(*drawn: Curve, contacts: float = 2.0) -> float:
    """Fit how the distance at which packings have gained two contacts goes with N."""
    places = []
    for n, (x, y) in zip(COMPRESSED["dp"], drawn, strict=True):
        more = np.flatnonzero(0.5 * n * y >= contacts)
        if not len(more) or not more[0]:
            return float("nan")
        k = slice(more[0] - 1, more[0] + 1)
        places.append(float(np.exp(np.interp(contacts, 0.5 * n * y[k], np.log(x[k])))))
    return -float(np.polyfit(np.log(COMPRESSED["dp"]), np.log(places), 1)[0])


# tables 1 and 2 -------------------------------------------------------------------------------------------------------

for _id, _model, _column in (
    ("BT-zJ-sp-phi", "sp", "z_J"),
    ("BT-phiJ-sp", "sp", "phi_J"),
    ("BT-zJ-dp", "dp", "z_J"),
    ("BT-rhoJ-dp", "dp", "rho_J"),
):
    _sizes = ({"n": SIZES},) if _column == "z_J" else ()  # table 1 names no N, and fig 6 has one z_J for all
    statistic(_id, sample=onsets, models=[_model], n=(LARGEST[_model],), column=_column, variants=_sizes)(mean)


def coefficients(x: Array, y: Array, terms: int, low: float = 0.0, high: float = np.inf) -> Array:
    """Fit the coefficients of eqs 13 and 14 by least squares of absolute residuals."""
    kept = np.isfinite(x + y) & (x > low) & (x < high)
    if kept.sum() <= terms:
        return np.full(terms, np.nan)
    return np.asarray(np.linalg.lstsq(x[kept, None] ** (0.5, 1.0)[:terms], y[kept], rcond=None)[0])


for _series, _name, _terms in (("SP(φ)", "sp-phi", 1), ("SP(ρ)", "sp-rho", 2), ("DP(ρ)", "dp", 2)):  # linear in phi: 0
    _half = 0.5 * HIGHEST[SERIES[_series][1]]
    _of_g: tuple[dict[str, Any], ...] = ({"middle": median}, {"direction": "x"}, *(STABLE if _name != "dp" else ()))
    for _symbol, _kin in (("z", _OTHER_Z[1:]), ("G", _of_g)):
        _ids = [f"BT-{_symbol}{k}-{_name}" for k in range(_terms)]
        _of = {"sample": evenly, "series": _series, "column": _symbol.lower(), "terms": _terms}
        statistic(*_ids, variants=({"low": _half}, {"high": _half}, *_kin), **_of)(coefficients)
# where row SP(ρ) of table 1 may be read without its two coefficients, which make up for one another
statistic("BT-z-sp-rho", sample=evenly, series="SP(ρ)", column="z", place=0.1, variants=({"z_j": "own"},))(at)


def of_both(tables: EnsembleTables, column: str) -> Sample:
    """Take the curves of droplets and of disks."""
    both = [evenly(tables, series, column) for series in ("DP(ρ)", "SP(ρ)")]
    return Sample(
        [part.groups[0] for part in both],
        lambda drawn: [part.reduce([one]) for part, one in zip(both, drawn, strict=True)],
    )


@statistic("BT-z-ratio", sample=of_both, column="z")
@statistic("BT-G-ratio", sample=of_both, column="g")
def ratio_of_terms(droplets: Curve, disks: Curve) -> float:
    """Divide C_1/C_0 of droplets by that of disks."""
    (d_0, d_1), (s_0, s_1) = (coefficients(*part, 2) for part in (droplets, disks))
    return float(d_1 / d_0 / (s_1 / s_0))


def tables_1_2(tables: EnsembleTables) -> Drawing:
    """Coefficients of tables 1 and 2 from our packings beside the paper's."""
    return forest(compare("tables", tables), "tables", {"[B], tables 1 and 2": ("tables",)})


# drawings -------------------------------------------------------------------------------------------------------------


def figure_5(tables: EnsembleTables) -> Drawing:
    """z and G against rho and phi, with the fits of tables 1-2."""
    out, (top, bottom) = drawing("boromand-5", 1, 2, 5.8, 4.8)
    for axes, column, table in ((top, "z", 1), (bottom, "g", 2)):
        for series, (model, by) in SERIES.items():
            x = by.removeprefix("d_")
            colour = GREEN if x == "phi" else MODEL_STYLE[model]["color"]
            look: dict[str, Any] = {"color": colour, "linestyle": "none"}
            look["fillstyle"] = "full" if x == "phi" else "none"
            for n, marker in zip(SHOWN[model], "vo" if model == "sp" else "Dp", strict=True):
                e = tables.curve(model, n, x, column, FRACTIONS)  # bands of the small ones would cover all others
                out.curve(axes, f"{series}, N = {n}", *(e.mean if n < 64 else e.band), marker=marker, **look)
            onset = paper({"SP(φ)": "BT-phiJ-sp", "SP(ρ)": "BT-rhoJ-sp", "DP(ρ)": "BT-rhoJ-dp"}[series])
            d = np.linspace(1e-4, 0.2 if by == "d_phi" else 1 - onset, 60)  # fits against rho end at rho = 1
            fit = table_fit(series, "z")(d) + SUBTRACTED if column == "z" else table_fit(series, "G")(d)
            text = f"paper: fit of table {table}, {series}"
            out.curve(axes, text, onset + d, fit, linestyle="--", color=colour, linewidth=1.4)
        axes.axvline(paper("B5-z-parts"), color="#777777", linestyle="-.", linewidth=0.9)
    for n, width in zip(SHOWN["sp"], (1.0, 2.0), strict=True):
        for packings, e in stable_curves(tables, n, "phi", FRACTIONS):
            look = {"linestyle": ":" if packings != STABILIZED else "-", "linewidth": width, "color": BLACK}
            out.curve(bottom, f"SP(φ), N = {n}, {packings}", *e.mean, **look)
    top.axhline(6.0, color="#777777", linewidth=0.9, linestyle=":")  # full in the plane
    # far beyond confluence phi says little, and the paper's panel ends near there
    label(top, r"packing fraction $\rho$ or $\phi$", "coordination z", legend=False)
    label(bottom, r"packing fraction $\rho$ or $\phi$", f"shear modulus {G_UNITS}", **BESIDE)
    bottom.set_title(f"points: {AVERAGED}", fontsize=9, loc="right")
    for axes, ends in ((top, (3.8, 6.5)), (bottom, (0, 0.36))):
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
    for n in SHOWN["sp"]:
        every = [("all", tables.curve("sp", n, "d_phi", "g", places)), *stable_curves(tables, n, "d_phi", places)]
        for packings, e in every:
            look = size_style(n) | {"linestyle": dict(zip(PACKINGS, (":", "--", "-"), strict=True))[packings]}
            found = mean_over_packings([e.y / e.x**0.5])[0]
            out.curve(axes, f"N = {n}, {packings}", average(e.x), found, **look | {"marker": ""})
    g_0 = paper("BT-G0-sp-phi")
    out.curve(axes, f"paper: $G_0$ = {g_0}", [places[0], places[-1]], [g_0] * 2, **PAPER)
    axes.set_ylim(0, 2.2)
    label(axes, r"SP: $\Delta\phi$", r"$G / \Delta\phi^{1/2}$  [$\epsilon/\sigma^2$]", **SMALL)


def _draw_both_counts(out: Drawing, axes: Any, tables: EnsembleTables) -> None:
    """Draw z - z_J of droplets by both counts of contacts, beside that of disks."""
    scale(axes)
    n = SHOWN["dp"][0]
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
