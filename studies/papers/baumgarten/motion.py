"""Draw motion, finite size and correlated displacements in Baumgarten & Tighe: figs 5, 8 and 7."""

from collections import Counter
from contextlib import suppress
from functools import cache
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.plotting import in_unit
from jamlab.plotting.palette import BLACK
from jamlab.statistics.confidence import Interval
from jamlab.statistics.data_collapse import fit_scaling_exponents
from jamlab.statistics.power_laws import fit_power_law
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import (
    FEWEST,
    Sample,
    average,
    bootstrap,
    groups_by,
    mean_over_packings,
    scaled,
    select,
)
from studies.panels import FREQUENCY, PAPER, Drawing, drawing, label, scale, sequence, size_style, style
from studies.papers.baumgarten.spectra import (
    FEWER,
    FIXED,
    LARGE,
    LAWS,
    SIZE,
    STABILIZED,
    at_pressures,
    format_power,
    power,
    sampled,
    spectra,
)
from studies.papers.statements import paper

SIZES = (*(32 * 2**k for k in range(7)), 8192, SIZE)  # of fig 8; the largest in boxes of fixed shape
HIGHEST_PRESSURE = 1e-2  # of the packings of fig 3, in k: eq 22 is a law of small p
PLATEAU_FROM = 1e-4  # a pressure down from which the mean approach might be constant, for illustration
LEAST = 1e-3  # pressure up to which a is taken in the limit of small p
TAIL = 100.0  # p N^2 from which the slope of the viscosity is fitted
MOTIONS = {  # what the paper calls them -> column without its prefix, label
    "approach": ("normal", r"normal $|\Delta u^\parallel|$"),
    "sliding": ("tangential", r"tangential $|\Delta u^\perp|$"),
    "nonaffine": ("nonaffine", r"non-affine $|u_{na}|$"),
}
MANY = 2048  # N with twenty packings: the five of the size that is drawn tell no length from another
PRESSURES = (1e-2, 1e-3, 1e-4)  # of the drawn packings
SCANNED = 1e-4  # pressure of all sizes and of all decades of frequency
SLOWEST, MIDDLE = 1e-8, 1e-5  # frequencies
PLATEAU = 0.1  # of the box; longer lengths are cut off by it, at 0.17 to 0.19 L
SHORTEST = 2.0  # d; a shorter length is the length of a pair of disks


# fig 5 ----------------------------------------------------------------------------------------------------------------


def nonaffine_response(tables: EnsembleTables, prestress: bool = False, n: int = SIZE) -> pd.DataFrame:
    """Select the packings of slow shear in boxes of fixed shape."""
    return select(tables.quasistatic, n=n, ensemble=FIXED, prestress=prestress)


def by_pressure(rows: pd.DataFrame, values: "pd.Series[float]") -> dict[float, Array]:
    """Group values of packings by pressure, of those with enough packings for fits."""
    pressures: list[float] = sorted(rows["pressure"].unique().tolist())
    groups = groups_by(rows.assign(value=values), "pressure", "value", pressures)
    n = int(rows["n"].iloc[0])
    return {p: v for p, v in zip(pressures, groups, strict=True) if len(v) >= FEWEST and p * n**2 >= LARGE}


def of_motion(tables: EnsembleTables, column: str, over: str = "", n: int = SIZE, prestress: bool = False) -> Sample:
    """Take the mean of a column, or of its ratio to another, at each pressure."""
    rows = nonaffine_response(tables, prestress, n)
    ratio = rows[column] / (rows[over] if over else 1.0)
    if ratio.notna().sum() == 0:
        raise InputError(f"no packing of slow shear has {column}: run a campaign that measures it")
    return at_pressures(by_pressure(rows, ratio), np.mean)


def root_mean_squares(tables: EnsembleTables) -> dict[str, dict[float, Array]]:
    """Give root mean squares of approach and sliding by pressure of the largest packings without pre-stress, from
    k times the sum of squares over the area, which is G_0, and eta_0 - G_0, [T] eqs 19 and 22. Contacts per area are
    those of N = 512, which go with a + b p^0.5 to 0.3 %."""
    small = nonaffine_response(tables, n=FEWER)
    if "contact_density" not in small or small["contact_density"].isna().all():
        raise InputError("no packing of slow shear has contacts per area: run a campaign that measures them")
    known = small.groupby("pressure")["contact_density"].mean()
    rise, least = np.polyfit(np.sqrt(known.index), known, 1)
    groups = sorted(sampled(spectra(tables, "contact", prestress=False)).items())
    density = {p: least + rise * p**0.5 for p, _ in groups}
    return {
        "normal": {p: (g.g0 / density[p]) ** 0.5 for p, g in groups},
        "tangential": {p: ((g.eta0 - g.g0) / density[p]) ** 0.5 for p, g in groups},
    }


def of_squares(tables: EnsembleTables, kind: str, n: int = FEWER) -> Sample:
    """Take root mean squares at each pressure, of small packings, or of the largest by G_0 and eta_0."""
    return (
        of_motion(tables, f"rms_{kind}", n=n) if n == FEWER else at_pressures(root_mean_squares(tables)[kind], np.mean)
    )


def figure_5(tables: EnsembleTables) -> Drawing:
    """Approach, sliding and non-affine motion in slow shear against pressure; mean approach below its bound."""
    out, (axes, bound) = drawing("baumgarten-5", 1, 2, 5.6, 4.6)
    scale(axes, bound)

    def draw(
        panel: Any, series: str, n: int, column: str, text: str | None = "", **look: Any
    ) -> tuple[Array, Interval]:
        rows = nonaffine_response(tables, n=n).dropna(subset=[column])
        p = np.sort(rows["pressure"].unique())
        mean = mean_over_packings(groups_by(rows, "pressure", column, p))
        out.curve(panel, series, p, mean, label=text, **look)
        return p, mean

    for index, (name, (column, text)) in enumerate(MOTIONS.items()):
        printed = paper(f"T5-{name}")
        p, mean = draw(axes, text, SIZE, f"median_{column}", **style(index))
        beside = 1.25 if printed < 0 else 0.6
        out.slope(axes, printed, (p[0], p[-1]), beside * float(mean.value[0]), above=printed < 0)
        if f"rms_{column}" in tables.quasistatic:
            look = style(index) | {"fillstyle": "none", "linestyle": "none"}
            draw(axes, f"root mean square {name}", FEWER, f"rms_{column}", None, **look)
    for n in (SIZE, FEWER):
        look = size_style(n) | {"linestyle": "none"}
        p, mean = draw(bound, f"mean normal, N = {n}", n, "mean_normal", **look)
    with suppress(InputError):
        squares = root_mean_squares(tables)["normal"]
        most = mean_over_packings(list(squares.values()))
        out.curve(bound, r"bound $(G_0 V / k N_c)^{1/2}$", list(squares), most, color=BLACK, linewidth=1.6)
        level = float(np.interp(np.log(PLATEAU_FROM), np.log(p), mean.value))
        out.curve(bound, r"a plateau below $10^{-4}$", [min(squares), PLATEAU_FROM], [level] * 2, **PAPER)
    for text, fill in (("median", "full"), ("root mean square", "none")):
        axes.plot([], [], color=BLACK, marker="s", linestyle="none", fillstyle=fill, label=text)
    label(axes, in_unit("pressure $p$", "k"), in_unit("displacement per strain", "d"))
    label(bound, in_unit("pressure $p$", "k"), in_unit("mean normal displacement per strain", "d"))
    return out


# fig 8 ----------------------------------------------------------------------------------------------------------------


Groups = dict[tuple[int, float], Array]  # N, pressure -> viscosities of packings


@cache
def viscosities(tables: EnsembleTables, law: str, prestress: bool) -> Groups:
    """Give eta_0 of one law by size and pressure; packings with G_0 <= 0 have none."""
    rows = select(tables.spectra, prestress=prestress, n=list(SIZES), **LAWS[law])
    rows = rows[(rows["g0"] > 0) & (rows["ensemble"] == np.where(rows["n"] == SIZE, FIXED, STABILIZED))]
    rows = rows.drop_duplicates(["n", "seed", "target_pressure"]).dropna(subset=["eta0"])
    return {key: part.to_numpy() for key, part in rows.groupby(["n", "target_pressure"])["eta0"]}  # type: ignore[misc]


def up_to(every: Groups, highest: float) -> Groups:
    """Cut to pressures up to one with enough packings for an interval, and to sizes with two such pressures."""
    kept = {(n, p): v for (n, p), v in every.items() if p <= highest * (1 + 1e-9) and len(v) >= FEWEST}
    of_size = Counter(n for n, _ in kept)
    return {key: v for key, v in kept.items() if of_size[key[0]] > 1}


def of_sizes(tables: EnsembleTables, law: str, prestress: bool, highest: float = HIGHEST_PRESSURE) -> Sample:
    """Take N, pressures and mean viscosities of all sizes up to a pressure, and the a of the paper."""
    kept = up_to(viscosities(tables, law, prestress), highest)
    if not kept:
        raise InputError(f"no two sizes have {FEWEST} stable packings at two pressures up to {highest:g}")
    (n, p), a = np.array(list(kept)).T, paper(f"T8-a-{law}")
    return Sample(list(kept.values()), lambda drawn: (n, p, np.array([v.mean() for v in drawn]), a))


def size_exponent(n: Array, p: Array, eta: Array, a: float) -> float:
    """Fit a by the collapse of sizes in p N^2 and eta_0/N^a."""
    sizes = np.unique(n)
    family = [(p[n == m], eta[n == m]) for m in sizes]
    return -fit_scaling_exponents(sizes, [family], a=2.0, start=(2.0, -a)).b


def tail(n: Array, p: Array, eta: Array, a: float, low: float) -> float:
    """Fit the slope of eta_0/N^a in large packings; with pre-stress it is too shallow even where p N^2 > 10^3."""
    return float(fit_power_law(p * n**2, eta / n**a, low=low).exponents[0])


def small_end(n: Array, p: Array, eta: Array, a: float, small: float = 0.1, large: float = TAIL) -> float:
    """Find p N^2 where the plateau of small systems meets the slope -a/2 of large ones, in decades."""
    x, y = p * n**2, eta / n**a
    if not (x < small).any() or not (x > large).any():
        return float("nan")
    plateau, slope = (np.log10(v).mean() for v in (y[x < small], (y * x ** (0.5 * a))[x > large]))
    return float((slope - plateau) / (0.5 * a))


def figure_8(tables: EnsembleTables) -> Drawing:
    """Viscosity against pressure for several sizes: one curve in p N^2."""
    out, panels = drawing("baumgarten-8", 1, 2, 5.6, 4.6)
    names = ("contact damping", r"Stokes drag, $\eta_F = 1$")
    for axes, law, name in zip(panels, ("contact", "stokes"), names, strict=True):
        a = paper(f"T8-a-{law}")
        scale(axes)
        for prestress in (True, False):
            every = viscosities(tables, law, prestress)
            for n in sorted({n for n, _ in every}):
                x, values = zip(*((p * n**2, v) for (m, p), v in every.items() if m == n), strict=True)
                look = size_style(n) | {"linestyle": "none", "fillstyle": "none" if prestress else "full"}
                series = f"N = {n}, {'with' if prestress else 'no'} pre-stress"
                text = None if prestress else f"N = {n}" + (", fixed box" if n == SIZE else "")
                found = scaled(mean_over_packings(values), float(n) ** -a)
                out.curve(axes, series, x, found, band=False, label=text, **look)
        height = out.table.query("panel == @axes.get_gid() and 10 < x < 1000")["y"].median()
        ends = (1e2, max(p * n**2 for n, p in every))
        out.slope(axes, -a / 2, ends, 20 * height, rf"$-a/2$, $a = {a:g}$", above=True)
        for text, fill in (("no pre-stress", "full"), ("with pre-stress", "none")):
            axes.plot([], [], color=BLACK, marker="o", linestyle="none", fillstyle=fill, label=text)
        power = "" if a == 1 else f"^{{{a:g}}}"
        label(axes, in_unit(rf"{name}: $p\,N^2$", "k"), in_unit(rf"$\eta_0 / N{power}$", r"$k\,\tau_1$"), legend=False)
        axes.autoscale(axis="x", tight=True)
        axes.margins(x=0.03)
    out.legend_above(panels[0], ncols=6)
    return out


# lengths --------------------------------------------------------------------------------------------------------------


def correlations(part: pd.DataFrame) -> Array:
    """Arrange distance and C (packings, frequencies, bins, 2) of the packings with all frequencies; bins count steps of
    each packing, as boxes differ a little."""
    shared = part.groupby("seed")["omega"].nunique()
    part = part[part["seed"].isin(shared.index[shared == part["omega"].nunique()])]
    if part.empty:
        raise InputError("no packing has its correlation at every frequency: finish the tasks of that sweep")
    step = part.groupby("seed")["delta"].transform(lambda x: np.diff(np.unique(x)).min())
    numbered = part.assign(bin=(part["delta"] / step).round().astype(int))
    wide = numbered.pivot_table(index="seed", columns=["omega", "bin"], values=["delta", "c"])
    shape = (len(wide), part["omega"].nunique(), -1)
    return np.stack([wide[name].to_numpy(dtype=np.float64).reshape(shape) for name in ("delta", "c")], axis=-1)


def in_boxes(part: pd.DataFrame) -> Array:
    """Arrange the same with distances over the mean box."""
    return correlations(part) / [float(part["box"].mean()), 1.0]


def first_zeros(whole: Array) -> Array:
    """Find the (frequencies,) distances at which the mean C of some packings, (packings, frequencies, bins, 2), first
    falls through zero, by linear interpolation; nan without one."""
    x, c = np.moveaxis(average(whole), -1, 0)
    k = (c <= 0).argmax(axis=1)  # 0 where none is, too
    rows = np.flatnonzero(k > 0)
    k = k[rows]
    left, right, above = x[rows, k - 1], x[rows, k], c[rows, k - 1]
    zeros = np.full(len(x), np.nan)
    zeros[rows] = left + (right - left) * above / (above - c[rows, k])
    return zeros


def rows_of(tables: EnsembleTables, law: str, **wanted: Any) -> pd.DataFrame:
    """Select the rows of one law, with pre-stress."""
    return select(tables.correlation, prestress=True, **LAWS[law], **wanted)


def of_pressures(tables: EnsembleTables, law: str, n: int = MANY, **wanted: Any) -> tuple[list[float], list[Array]]:
    """Give the pressures of one size, descending, and C over boxes at each, at the frequencies of the largest size."""
    table = rows_of(tables, law, **wanted)
    table = table[table["omega"].isin(table.loc[table["n"] == SIZE, "omega"].unique())]
    table = select(table, n=n)
    pressures: list[float] = sorted(table["pressure"].unique().tolist(), reverse=True)
    return pressures, [in_boxes(table[table["pressure"] == p]) for p in pressures]


# numbers --------------------------------------------------------------------------------------------------------------


def lengths(tables: EnsembleTables, n: int = MANY) -> Sample:
    """Take C under Stokes drag over boxes of one size at each pressure, at the lowest frequency."""
    return Sample(of_pressures(tables, "stokes", n, omega=SLOWEST)[1])


def mean_length(drawn: list[Array]) -> float:
    """Average the first zeros of C over pressures and frequencies, in boxes."""
    return float(np.nanmean([np.nanmean(first_zeros(whole)) for whole in drawn]))


def over_ends(tables: EnsembleTables, axis: int) -> Sample:
    """Take frequencies (axis 0) or pressures (1), and l under contact damping averaged over the other."""
    pressures, cubes = of_pressures(tables, "contact")
    table = rows_of(tables, "contact", n=SIZE)
    x = np.array(pressures) if axis else np.sort(table["omega"].unique())
    return Sample(cubes, lambda drawn: (x, np.nanmean([first_zeros(whole) for whole in drawn], axis=axis)))


def over_all_decades(tables: EnsembleTables) -> Sample:
    """Take twelve decades of frequency, and l in the packings that have them."""
    rows = rows_of(tables, "contact", n=MANY, pressure=SCANNED)
    rows = rows[rows["seed"].isin(rows.loc[rows["omega"] == rows["omega"].max(), "seed"])]
    omega = np.sort(rows["omega"].unique())
    return Sample([correlations(rows)], lambda drawn: (omega, first_zeros(drawn[0])))


def ratio_of_ends(x: Array, length: Array, first: int = 0, last: int | None = None) -> float:
    """Compute by how much l changes from the smallest x to the largest, by the power of x that fits best: over many
    decades a small exponent is a large factor."""
    return float((x.max() / x.min()) ** power(x, length, first, last))


def over_sizes(tables: EnsembleTables) -> Sample:
    """Take N, and l/L at one frequency and pressure."""
    n = [512, MANY, SIZE]
    cubes = [in_boxes(rows_of(tables, "contact", n=m, pressure=SCANNED, omega=MIDDLE)) for m in n]
    return Sample(cubes, lambda drawn: (n, [first_zeros(whole)[0] for whole in drawn]))


def minima(tables: EnsembleTables) -> Sample:
    """Take frequencies from 1e-4 to 0.1, and the distance where C under Stokes drag is least."""
    rows = rows_of(tables, "stokes", n=SIZE, pressure=min(PRESSURES))
    rows = rows[rows["omega"].between(0.99e-4, 1.01e-1)]
    omega = np.sort(rows["omega"].unique())

    def least(drawn: list[Array]) -> tuple[Array, Array]:
        x, c = np.moveaxis(average(drawn[0]), -1, 0)
        return omega, x[np.arange(len(x)), np.nanargmin(c, axis=1)]

    return Sample([correlations(rows)], least)


def reduced_lengths(tables: EnsembleTables) -> Sample:
    """Take omega/p^0.5 and C under Stokes drag at each pressure, and the side of the box."""
    rows = [rows_of(tables, "stokes", n=SIZE, pressure=p) for p in PRESSURES]
    x = [np.sort(part["omega"].unique()) / p**0.5 for part, p in zip(rows, PRESSURES, strict=True)]
    side = float(pd.concat(rows)["box"].mean())
    return Sample([correlations(part) for part in rows], lambda drawn: (x, drawn, side))


def power_of_logarithm(
    x: list[Array], drawn: list[Array], side: float, low: float = SHORTEST, high: float = PLATEAU
) -> float:
    """Fit the exponent of -ln p that collapses lengths between a few disks and the cut-off of the box."""
    curves = []
    for place, whole in zip(x, drawn, strict=True):
        length = first_zeros(whole)
        kept = np.isfinite(length) & (length < high * side) & (length > low)
        if kept.sum() < 2:
            return float("nan")
        curves.append((place[kept], length[kept]))
    start = (0.0, paper("T7-logarithm"))
    return fit_scaling_exponents(-np.log(PRESSURES), [curves], a=0.0, start=start).b


# drawing --------------------------------------------------------------------------------------------------------------


def figure_7(tables: EnsembleTables) -> Drawing:
    """Correlation of transverse displacements under both laws, and its length."""
    out, (a, b, c, d) = drawing("baumgarten-7", 2, 2, 5.4, 4.2)
    _draw_contact_correlation(out, a, tables)
    _draw_stokes_correlation(out, b, rows_of(tables, "stokes", n=SIZE, pressure=min(PRESSURES)))
    scale(c, d)
    stokes, power = rows_of(tables, "stokes", n=SIZE), paper("T7-logarithm")
    for index, p in enumerate(PRESSURES):
        part = select(stokes, pressure=p)
        omega, whole = np.sort(part["omega"].unique()), correlations(part)
        found = bootstrap([whole], lambda g: first_zeros(g[0]))
        look, name = sequence(index, len(PRESSURES)), f"$p = {format_power(p)}$"
        out.curve(c, name, omega, found, **look)
        out.curve(d, name, omega / p**0.5, scaled(found, (-np.log(p)) ** power), **look)
    ends = [stokes["omega"].min(), stokes["omega"].max()]
    out.curve(c, "paper: plateau $L/4$", ends, [float(stokes["box"].mean()) * paper("T7-length-stokes")] * 2, **PAPER)
    label(c, f"Stokes drag: {FREQUENCY}", in_unit("length $l$", "d"))
    label(d, r"Stokes drag: $\omega\,\tau_1 / p^{1/2}$", rf"$l\,(-\ln p)^{{{power:g}}}$")
    return out


def _draw_contact_correlation(out: Drawing, axes: Any, tables: EnsembleTables) -> None:
    """Draw C over boxes of the packings with twelve decades of frequency, at both ends and in between."""
    part = rows_of(tables, "contact", pressure=SCANNED, n=[512, MANY])
    fastest = part[part["omega"] == part["omega"].max()]
    part = part.merge(fastest[["n", "seed"]].drop_duplicates())
    omegas = np.sort(part.loc[part["n"] == MANY, "omega"].unique())
    for index, omega in enumerate(omegas[[0, len(omegas) // 2, -1]]):
        for n, fill in ((MANY, "full"), (512, "none")):
            rows = part[(part["n"] == n) & np.isclose(part["omega"], omega)]
            if len(rows):
                name = rf"$N = {n}$, $\omega = {format_power(float(omega))}$"
                look = style(index) | {"fillstyle": fill}
                _draw_correlation(out, axes, name, rows, float(rows["box"].mean()), look)
    axes.axhline(0, color="#888888", linewidth=0.8)
    label(axes, rf"contact damping, $p = {format_power(SCANNED)}$: $\delta / L$", r"$C$")


def _draw_stokes_correlation(out: Drawing, axes: Any, part: pd.DataFrame) -> None:
    """Draw C at seven frequencies."""
    omegas = np.sort(part["omega"].unique())
    omegas = omegas[np.unique(np.linspace(0, len(omegas) - 1, 7).round().astype(int))]
    for index, omega in enumerate(omegas):
        name = rf"$\omega = {format_power(float(omega))}$"
        _draw_correlation(out, axes, name, part[part["omega"] == omega], 1.0, sequence(index, len(omegas)))
    axes.axhline(0, color="#888888", linewidth=0.8)
    p = format_power(float(part["pressure"].iloc[0]))
    label(axes, in_unit(rf"Stokes drag, $p = {p}$: distance $\delta$", "d"), r"$C$")


def _draw_correlation(
    out: Drawing, axes: Any, name: str, rows: pd.DataFrame, unit: float, look: dict[str, Any]
) -> None:
    cube = correlations(rows)[:, 0]
    c = bootstrap(
        [cube[..., 1]], lambda drawn: average(drawn[0]) / average(drawn[0][:, 0])
    )  # 1 at the shortest distance
    out.curve(axes, name, average(cube[..., 0]) / unit, c, **look)
