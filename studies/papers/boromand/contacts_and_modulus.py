"""Draw contacts and shear modulus in Boromand et al.: figs 5 and 6."""

from collections.abc import Callable
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.plotting.palette import GREEN, MODEL_STYLE
from jamlab.statistics.data_collapse import fit_scaling_exponents
from jamlab.statistics.power_laws import fit_exponent
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import RESAMPLES, Ensemble, Sample, average, log_places, median, sizes
from studies.panels import BESIDE, PAPER, Drawing, drawing, label, scale, size_style
from studies.papers.boromand.conventions import (
    COMPRESSED,
    CONFLUENCE,
    FRACTIONS,
    HIGHEST,
    LARGEST,
    LOWEST,
    NEAR,
    SERIES,
    SIZES,
    SUBTRACTED,
    at,
    curve,
    curves,
    even_places,
    exponent,
    halves,
    table_fit,
)
from studies.papers.statements import caption, paper, statistic

SHOWN = {"sp": (32, 256), "dp": (32, 128, 256)}  # N of fig 5
FEW = {("dp", 256): 5}  # packings of sizes that are only begun
DISTANT = 1e-2  # nearer to onset no single exponent of z - 3.97 exists
NEAREST = (1e-4, 1e-3)  # distance from onset between the steps of [B] sec 2.3 and the end of regime 1, sec 3
WITHOUT_G = 1e-5  # distance from onset below which G of many droplets is not known
_EQ_13 = np.arange(0.001, 0.18, 0.001)


# fig 5: models side by side -------------------------------------------------------------------------------------------


Curve = tuple[Array, Array]


def of_two(
    tables: EnsembleTables, first: tuple[str, int], second: tuple[str, int], x: str, y: str, places: Array
) -> Sample:
    """Take the mean curves of two kinds of packings."""
    return Sample(*curves(tables, (first, second), x, y, places))


_AT_RHO: dict[str, Any] = {
    "sample": of_two,
    "first": ("sp", 128),
    "second": ("dp", 128),
    "x": "rho",
    "places": FRACTIONS,
}


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


_DISTANCES: dict[str, Any] = {"sample": of_two, "x": "d_rho", "places": np.arange(0.005, 0.155, 0.005)}


def ratio(over: Curve, under: Curve, d_rho: float, taken: float = 0.0) -> float:
    """Compute the ratio of two means at one distance from onset."""
    return (at(*over, d_rho) - taken) / (at(*under, d_rho) - taken)


for _column, _excess in (("z", ({"taken": SUBTRACTED},)), ("g", ())):
    for _name, _over, _under, _d_rho in (
        ("models", ("dp", 128), ("sp", 128), 0.01),
        ("sizes-sp", ("sp", 256), ("sp", 32), 0.1),
        ("sizes-dp", ("dp", 128), ("dp", 32), 0.1),
    ):
        _variants = ({"d_rho": 0.5 * _d_rho}, {"d_rho": 1.5 * _d_rho}, *_excess)
        statistic(
            f"B5-{_column}-{_name}",
            first=_over,
            second=_under,
            y=_column,
            d_rho=_d_rho,
            variants=_variants,
            **_DISTANCES,
        )(ratio)


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
    kept = (x > LOWEST["sp"]) & (x < end)
    fit = np.linalg.lstsq(x[kept, None] ** (0.5, 1.0), y[kept], rcond=None)[0]
    off = np.abs(y / (x[:, None] ** (0.5, 1.0) @ fit) - 1)
    inside, known = np.flatnonzero((off <= share) & np.isfinite(y)), np.isfinite(y).sum()
    return float(onset + x[inside[-1] + 1]) if len(inside) and inside[-1] + 1 < known else float("nan")


# fig 6: exponents -----------------------------------------------------------------------------------------------------


def regime(
    tables: EnsembleTables,
    series: str,
    column: str,
    n: int = 0,
    per_decade: int = 0,
    z_j: str = "3.97",
    middle: Callable[[Array], Array] = average,
) -> Sample:
    """Take z - z_J or G beyond 0.01 from onset, at even places or, with `per_decade`, even ones in logarithms; nearer
    to onset z - 3.97 changes its sign, where a logarithm has no value."""
    return _regime(tables, series, column, n, per_decade, z_j).sample(middle)


def _regime(
    tables: EnsembleTables, series: str, column: str, n: int = 0, per_decade: int = 0, z_j: str = "3.97"
) -> Ensemble:
    model, by = SERIES[series]
    n = n or LARGEST[model]
    places = log_places(DISTANT, HIGHEST[by], per_decade) if per_decade else even_places(model, by)
    e = tables.curve(model, n, by, column, places)
    if column == "z":
        e = Ensemble(e.x, e.y - (SUBTRACTED if z_j == "3.97" else tables.at_onset(model, n)["z"].mean()))
    return e if per_decade else e.between(DISTANT, np.inf)


for _name, _series in (("alpha0", "SP(φ)"), ("z-single-dp", "DP(ρ)")):
    _windows = halves(DISTANT, HIGHEST[SERIES[_series][1]])
    _others = (*_windows, {"per_decade": 20}, {"z_j": "own"})
    statistic(f"B6-{_name}", sample=regime, series=_series, column="z", variants=_others)(exponent)
_OTHER_G: tuple[dict[str, Any], ...] = ({"per_decade": 20}, {"middle": median}, {"column": "g_x"})
_WINDOWS = halves(DISTANT, HIGHEST["d_phi"])
statistic("B6-beta0", sample=regime, series="SP(φ)", column="g", variants=(*_WINDOWS, *_OTHER_G))(exponent)
statistic(  # the caption names no N
    "B6-g-small-sp",
    sample=regime,
    series="SP(φ)",
    column="g",
    n=32,
    variants=(*_WINDOWS, *_OTHER_G, *({"n": n} for n in SIZES[1:])),
)(exponent)
statistic(
    "B6-g-single-dp",
    sample=regime,
    series="DP(ρ)",
    column="g",
    variants=(*halves(DISTANT, HIGHEST["d_rho"]), *_OTHER_G[:2]),
)(exponent)


def proportion(
    tables: EnsembleTables, series: str, z_j: str = "3.97", middle: Callable[[Array], Array] = average
) -> Sample:
    """Take z - z_J and G at the same places."""
    z, g = _regime(tables, series, "z", z_j=z_j), _regime(tables, series, "g")
    return Sample([np.stack([z.y, g.y], axis=-1)], lambda drawn: (average(drawn[0][..., 0]), middle(drawn[0][..., 1])))


_PARTS: tuple[dict[str, Any], ...] = ({"low": 1.2}, {"high": 1.2}, {"z_j": "own"}, {"middle": median})


@statistic("B6-g-of-z-sp", sample=proportion, series="SP(φ)", variants=_PARTS)
@statistic("B6-g-of-z-dp", sample=proportion, series="DP(ρ)", variants=_PARTS)
def power_of_contacts(z: Array, g: Array, low: float = -np.inf, high: float = np.inf) -> float:
    """Fit the exponent of G in z - z_J."""
    kept = (z > low) & (z < high)
    return fit_exponent(z[kept], g[kept])


for _column, _y in (("z", "d_z"), ("g", "g")):
    for _model, _by in (("sp", "d_phi"), ("dp", "d_rho")):  # of the smallest packings, where this regime is widest
        statistic(
            f"B6-{_column}-nearest-{_model}",
            sample=curve,
            model=_model,
            n=32,
            x=_by,
            y=_y,
            places=log_places(1e-6, NEAREST[1], 10),
            within=(0.99 * NEAREST[0], np.inf),
            variants=halves(*NEAREST),
        )(exponent)
    statistic(  # before the linear terms set in
        f"B6-{_column}-root-dp",
        sample=curve,
        model="dp",
        n=LARGEST["dp"],
        x="d_rho",
        y=_y,
        places=log_places(LOWEST["sp"], DISTANT, 10),
        variants=halves(LOWEST["sp"], DISTANT),
    )(exponent)


def of_sizes(tables: EnsembleTables, model: str, by: str, places: Array) -> Sample:
    """Take z - z_J over the distance from onset of every size of the paper's, and their N."""
    n = COMPRESSED[model]
    groups, reduce = curves(tables, [(model, m) for m in n], by, "d_z", places)
    return Sample(groups, lambda drawn: (n, reduce(drawn)))


@statistic(
    "B6-a",
    sample=of_sizes,
    model="sp",
    by="d_phi",
    places=NEAR,
    resamples=RESAMPLES // 4,
    variants=({"high": 0.02}, {"first": 1}),
)
def size_exponent(n: tuple[int, ...], drawn: list[Curve], high: float = HIGHEST["d_phi"], first: int = 0) -> float:
    """Fit a of the crossover dphi* ~ N^-a by the collapse of sizes."""
    family = [(x[kept], y[kept]) for x, y in drawn[first:] for kept in [(y > 0) & (x < high)]]
    return fit_scaling_exponents(np.array(n[first:], dtype=float), [family], b=1.0, start=(2.0, 1.0)).a


_GAINED = ({"contacts": 1.0}, {"contacts": 4.0})
_TENTHS = log_places(1e-6, 0.1, 10)


@statistic("B6-crossover-sp", sample=of_sizes, model="sp", by="d_rho", places=_TENTHS, variants=_GAINED)
@statistic("B6-crossover-dp", sample=of_sizes, model="dp", by="d_rho", places=_TENTHS, variants=_GAINED)
def crossover(n: tuple[int, ...], drawn: list[Curve], contacts: float = 2.0) -> float:
    """Fit how the distance at which packings have gained two contacts goes with N."""
    places = []
    for m, (x, y) in zip(n, drawn, strict=True):
        more = np.flatnonzero(0.5 * m * y >= contacts)
        if not len(more) or not more[0]:
            return float("nan")
        k = slice(more[0] - 1, more[0] + 1)
        places.append(float(np.exp(np.interp(contacts, 0.5 * m * y[k], np.log(x[k])))))
    return -float(np.polyfit(np.log(n), np.log(places), 1)[0])


# drawings -------------------------------------------------------------------------------------------------------------


def figure_5(tables: EnsembleTables) -> Drawing:
    """z and G against rho and phi, with the fits of tables 1-2."""
    out, (top, bottom) = drawing("boromand-5", 1, 2, 5.6, 4.6)
    for axes, column, name in (
        (top, "z", "coordination z"),
        (bottom, "g", r"shear modulus $G$  [SP: $\epsilon/\sigma^2$, DP: $\epsilon_r/l^2$]"),
    ):
        for model, by, fill in (("sp", "phi", "full"), ("sp", "rho", "none"), ("dp", "rho", "none")):
            for n in SHOWN[model]:
                small, few = n < 64, FEW.get((model, n), 0)
                x, y = tables.curve(model, n, by, column, FRACTIONS).band
                marker = ("v" if small else "o") if model == "sp" else ("D" if small else "*" if few else "p")
                look: dict[str, Any] = {
                    "color": MODEL_STYLE[model]["color"] if by == "rho" else GREEN,
                    "marker": marker,
                }
                text = f"{model.upper()}({'φ' if by == 'phi' else 'ρ'}), N = {n}{f' ({few} packings)' if few else ''}"
                shown = y.value if small else y  # bands of the small ones would cover all others
                out.curve(axes, text, x, shown, linestyle="none", fillstyle=fill, **look)
        for series, (model, by) in SERIES.items():
            onset = paper({"SP(φ)": "BT-phiJ-sp", "SP(ρ)": "BT-rhoJ-sp", "DP(ρ)": "BT-rhoJ-dp"}[series])
            d = np.linspace(1e-4, 0.2 if by == "d_phi" else 1 - onset, 60)  # fits against rho end at rho = 1
            fit = table_fit(series, "z")(d) + SUBTRACTED if column == "z" else table_fit(series, "G")(d)
            colour = GREEN if by == "d_phi" else MODEL_STYLE[model]["color"]
            out.curve(axes, f"paper: {series}", onset + d, fit, linestyle="--", color=colour, linewidth=1.4)
        axes.axvline(paper("B5-z-parts"), color="#777777", linestyle="-.", linewidth=0.9)
        # far beyond confluence phi says little, and the paper's panel ends near there
        label(axes, r"packing fraction $\rho$ or $\phi$", name, legend=axes is bottom, **BESIDE)
        axes.set_xlim(0.82, 1.06)
        axes.set_ylim((3.8, 6.2) if column == "z" else (0, 0.36))
    out.caption = caption(out.name)
    return out


def figure_6(tables: EnsembleTables) -> Drawing:
    """z - z_J and G against the distance to onset, log-log, one curve per size."""
    out, axes = drawing("boromand-6", 2, 3, 4.4, 3.9)
    panels = [(column, series) for column in ("d_z", "g") for series in SERIES]
    for part, (column, series) in zip(axes, panels, strict=True):
        scale(part)
        model, by = SERIES[series]
        for n in sizes(tables.states, model):
            x, y = tables.curve(model, n, by, column, NEAR).band
            out.curve(part, f"N = {n}", x, y, linestyle="none", **size_style(n))
        d = np.geomspace(1e-4, 0.4 if by == "d_phi" else 0.16, 40)
        out.curve(part, "paper: table fit", d, table_fit(series, "z" if column == "d_z" else "G")(d), **PAPER)
        if column == "d_z":
            out.slope(part, 1.0, (3e-5, 3e-4), 1.5e-3)
        elif model == "dp":
            out.slope(part, paper("B6-g-single-dp"), (1e-3, 1e-1), 2e-3)
        out.window(part, LOWEST[model], HIGHEST["d_phi"] if model == "sp" else CONFLUENCE)
        name = r"$\Delta\phi$" if by == "d_phi" else r"$\Delta\rho$"
        units = r"$\epsilon/\sigma^2$" if model == "sp" else r"$\epsilon_r/l^2$"
        label(part, f"{series[:2]}: {name}", r"$z - z_J$" if column == "d_z" else rf"$G$  [{units}]", loc="upper left")
        part.set_xlim(5e-7, 0.7)
        part.set_ylim((1e-3, 5) if column == "d_z" else (3e-4, 1))
    states = tables.states
    near = states[(states["model"] == "dp") & states["d_rho"].between(0, WITHOUT_G, inclusive="right")]
    share = near["g"].isna().groupby(near["n"]).mean()  # whose last free motion nothing holds
    percent = ", ".join(f"{100 * part:.0f} % of N = {n}" for n, part in share.items())
    out.caption = caption(out.name, near=WITHOUT_G, share=percent or "none")
    return out
