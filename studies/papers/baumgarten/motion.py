"""Draw motion and finite size in Baumgarten & Tighe: figs 5 and 8."""

from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.plotting.palette import BLACK
from jamlab.statistics.bootstrap import Interval
from jamlab.statistics.data_collapse import fit_scaling_exponents
from jamlab.statistics.power_laws import power_law
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import (
    FEWEST,
    RESAMPLES,
    bootstrap,
    groups_by,
    mean_over_packings,
    scaled,
    select,
    vary_bootstrap,
)
from studies.panels import PAPER, Drawing, drawing, label, scale, size_style, style
from studies.papers.baumgarten.spectra import power_in_pressure
from studies.papers.baumgarten.spectral_groups import FIXED, LARGE, LAWS, SIZE, STABILIZED, sampled, spectra
from studies.papers.statements import Measured, caption, measured, measures, paper

SIZES = (*(32 * 2**k for k in range(7)), 8192, SIZE)  # of fig 8; the largest in boxes of fixed shape
HIGHEST_PRESSURE = 1e-2  # of the packings of fig 3, in k: eq 22 is a law of small p
FEWER = 512  # disks of packings with means and root mean squares
PLATEAU_FROM = 1e-4  # a pressure down from which the mean approach might be constant, for illustration
LEAST = 1e-3  # pressure up to which a is taken in the limit of small p
TAIL = 100.0  # p N^2 from which the slope of the viscosity is fitted
MOTIONS = {
    "approach": r"approach $|\Delta u^\parallel|$",
    "sliding": r"sliding $|\Delta u^\perp|$",
    "nonaffine": r"non-affine $|u_{na}|$",
}


# fig 5 ----------------------------------------------------------------------------------------------------------------


def slow_shear(tables: EnsembleTables, prestress: bool = False, n: int = SIZE) -> pd.DataFrame:
    """Select the packings of slow shear in boxes of fixed shape."""
    return select(tables.quasistatic, n=n, ensemble=FIXED, prestress=prestress)


def by_pressure(rows: pd.DataFrame, values: "pd.Series[float]") -> dict[float, Array]:
    """Group values of packings by pressure, of those with enough packings for fits."""
    pressures: list[float] = sorted(rows["pressure"].unique().tolist())
    groups = groups_by(rows.assign(value=values), "pressure", "value", pressures)
    n = int(rows["n"].iloc[0])
    return {p: v for p, v in zip(pressures, groups, strict=True) if len(v) >= FEWEST and p * n**2 >= LARGE}


def power_of_motion(tables: EnsembleTables, column: str, over: str = "", **packings: Any) -> Measured:
    """Fit the exponent in p of the mean of a column, or of its ratio to another."""
    rows = slow_shear(tables, **packings)
    ratio = rows[column] / (rows[over] if over else 1.0)
    if ratio.notna().sum() == 0:
        raise InputError(f"no packing of slow shear has {column}: run a campaign that measures it")
    return power_in_pressure(by_pressure(rows, ratio), lambda drawn: [v.mean() for v in drawn])


@measures("T5-mean-sliding", column="mean_sliding", over="sliding")
@measures("T5-mean-nonaffine", column="mean_nonaffine", over="nonaffine")
@measures("T5-mean-approach", column="mean_approach")
@measures("T5-sheared", column="sheared")
def at_two_sizes(tables: EnsembleTables, column: str, over: str = "") -> Measured:
    """Fit the exponent in p of the mean of a column, or of its ratio to another; another analysis: N = 512."""
    found, other = (power_of_motion(tables, column, over, n=n) for n in (SIZE, FEWER))
    return measured(found.interval, {**found.variants, f"N = {FEWER}": other.interval}, found.how)


for _name in MOTIONS:
    measures(f"T5-{_name}", column=_name)(power_of_motion)
    measures(f"T5-{_name}-stressed", column=_name, prestress=True)(power_of_motion)


def root_mean_squares(tables: EnsembleTables) -> dict[str, dict[float, Array]]:
    """Give root mean squares of approach and sliding by pressure of the largest packings without pre-stress, from
    k times the sum of squares over the area, which is G_0, and eta_0 - G_0, [T] eqs 19 and 22. Contacts per area are
    those of N = 512, which go with a + b p^0.5 to 0.3 %."""
    small = slow_shear(tables, n=FEWER)
    if "contact_density" not in small or small["contact_density"].isna().all():
        raise InputError("no packing of slow shear has contacts per area: run a campaign that measures them")
    known = small.groupby("pressure")["contact_density"].mean()
    rise, least = np.polyfit(np.sqrt(known.index), known, 1)
    groups = sorted(sampled(spectra(tables, "contact", prestress=False)).items())
    density = {p: least + rise * p**0.5 for p, _ in groups}
    return {
        "approach": {p: (g.g0 / density[p]) ** 0.5 for p, g in groups},
        "sliding": {p: ((g.eta0 - g.g0) / density[p]) ** 0.5 for p, g in groups},
    }


@measures("T5-rms-approach", kind="approach")
@measures("T5-rms-sliding", kind="sliding")
def power_of_squares(tables: EnsembleTables, kind: str) -> Measured:
    """Fit the exponent in p of the root mean square, N = 512; another analysis: the largest packings by G_0, eta_0."""
    found = power_of_motion(tables, f"rms_{kind}", n=FEWER)
    large = power_in_pressure(root_mean_squares(tables)[kind], lambda drawn: [v.mean() for v in drawn])
    return measured(found.interval, {**found.variants, f"N = {SIZE}": large.interval}, found.how)


def figure_5(tables: EnsembleTables) -> Drawing:
    """Approach, sliding and non-affine motion in slow shear against pressure; mean approach below its bound."""
    out, (axes, bound) = drawing("baumgarten-5", 1, 2, 5.6, 4.6)
    scale(axes, bound)
    by_size = {n: slow_shear(tables, n=n) for n in (SIZE, FEWER)}
    pressures = {n: sorted(rows["pressure"].unique()) for n, rows in by_size.items()}
    for index, (name, text) in enumerate(MOTIONS.items()):
        printed, p = paper(f"T5-{name}"), pressures[SIZE]
        mean = mean_over_packings(groups_by(by_size[SIZE], "pressure", name, p))
        out.curve(axes, text, p, mean, **style(index))
        beside = 1.25 if printed < 0 else 0.6
        out.slope(axes, printed, (p[0], p[-1]), beside * float(mean.value[0]), above=printed < 0)
        if f"rms_{name}" in by_size[FEWER]:
            mean = mean_over_packings(groups_by(by_size[FEWER], "pressure", f"rms_{name}", pressures[FEWER]))
            look = style(index) | {"fillstyle": "none", "linestyle": "none"}
            out.curve(axes, f"root mean square {name}", pressures[FEWER], mean, label=None, **look)
    label(axes, r"pressure $p$  [$k$]", r"displacement per strain, median (full), r.m.s. (open)  [$d$]")
    _draw_bound(out, bound, tables, by_size)
    out.caption = caption(out.name)
    return out


def _draw_bound(out: Drawing, axes: Any, tables: EnsembleTables, by_size: dict[int, pd.DataFrame]) -> None:
    """Draw the mean approach below the root mean square, which it cannot pass, and the plateau of the text."""
    for n, rows in by_size.items():
        rows = rows.dropna(subset=["mean_approach"])
        p = sorted(rows["pressure"].unique())
        mean = mean_over_packings(groups_by(rows, "pressure", "mean_approach", p))
        out.curve(axes, f"mean approach, N = {n}", p, mean, **size_style(n) | {"linestyle": "none"})
    with suppress(InputError):
        squares = root_mean_squares(tables)["approach"]
        most = mean_over_packings(list(squares.values()))
        out.curve(axes, r"bound $(G_0 V / k N_c)^{1/2}$", list(squares), most, color=BLACK, linewidth=1.6)
        level = float(np.interp(np.log(PLATEAU_FROM), np.log(list(squares)), most.value))
        out.curve(axes, r"a plateau below $10^{-4}$", [min(squares), PLATEAU_FROM], [level] * 2, **PAPER)
    label(axes, r"pressure $p$  [$k$]", r"mean approach per strain  [$d$]")


# fig 8 ----------------------------------------------------------------------------------------------------------------


class Viscosities(NamedTuple):
    """Viscosities of several sizes over pressure: for each size and pressure those of the packings."""

    n: list[int]
    pressures: list[float]
    eta0: list[list[Array]]

    def up_to(self, highest: float) -> "Viscosities":
        """Cut to pressures up to one with enough packings for an interval, and to sizes with two such pressures."""
        kept = [k for k, p in enumerate(self.pressures) if p <= highest * (1 + 1e-9)]
        few = [[v[k] if len(v[k]) >= FEWEST else v[k][:0] for k in kept] for v in self.eta0]
        several = [i for i, values in enumerate(few) if sum(len(v) > 0 for v in values) > 1]
        return Viscosities([self.n[i] for i in several], [self.pressures[k] for k in kept], [few[i] for i in several])

    @property
    def drawn(self) -> list[Array]:
        """List the packings of each size and pressure that has some, in one list, as a bootstrap draws them."""
        return [v for values in self.eta0 for v in values if len(v)]

    def curves(self, drawn: list[Array]) -> list[tuple[Array, Array]]:
        """Average viscosities over pressure, one curve a size."""
        rest, out = iter(drawn), []
        for values in self.eta0:
            points = [(p, float(next(rest).mean())) for p, v in zip(self.pressures, values, strict=True) if len(v)]
            out.append((np.array([x for x, _ in points]), np.array([y for _, y in points])))
        return out

    def scaled(self, drawn: list[Array], a: float) -> tuple[Array, Array]:
        """Arrange p N^2 and eta_0/N^a of all sizes and pressures."""
        curves = zip(self.n, self.curves(drawn), strict=True)
        x, y = np.array([(q * n**2, v / n**a) for n, c in curves for q, v in zip(*c, strict=True)]).T
        return x, y


@cache
def viscosities(tables: EnsembleTables, law: str, prestress: bool) -> Viscosities:
    """Give eta_0 of one law by size and pressure; packings with G_0 <= 0 have none."""
    rows = select(tables.spectra, prestress=prestress, n=list(SIZES), **LAWS[law])
    rows = rows[(rows["g0"] > 0) & (rows["ensemble"] == np.where(rows["n"] == SIZE, FIXED, STABILIZED))]
    rows = rows.drop_duplicates(["n", "seed", "target_pressure"])
    n, p = (sorted(rows[name].unique().tolist()) for name in ("n", "target_pressure"))
    return Viscosities(n, p, [groups_by(rows[rows["n"] == m], "target_pressure", "eta0", p) for m in n])


def size_exponent(tables: EnsembleTables, law: str, prestress: bool, pressures: Sequence[float]) -> Measured:
    """Fit a by the collapse of sizes in p N^2 and eta_0/N^a, up to a pressure; other analyses: up to others."""
    start, every = (2.0, -paper(f"T8-a-{law}")), viscosities(tables, law, prestress)
    found: dict[str, Interval] = {}
    for highest in pressures:
        part = every.up_to(highest)
        if len(part.n) > 1:

            def fit(drawn: list[Array], part: Viscosities = part) -> float:
                n = np.array(part.n, dtype=float)
                return -fit_scaling_exponents(n, [part.curves(drawn)], a=2.0, start=start).b

            found[f"p <= {highest:g}"] = bootstrap(part.drawn, fit, resamples=RESAMPLES // 4)
    first = f"p <= {pressures[0]:g}"
    return measured(found.pop(first, None), found, f"Fit a by the collapse of sizes, {first}.")


def tail(tables: EnsembleTables, law: str, prestress: bool) -> Measured:
    """Fit the slope of eta_0/N^a in large packings; with pre-stress it is too shallow even where p N^2 > 10^3."""
    near, low = viscosities(tables, law, prestress).up_to(HIGHEST_PRESSURE), 10 * TAIL if prestress else TAIL

    def fit(drawn: list[Array], low: float = low) -> float:
        return float(power_law(*near.scaled(drawn, paper(f"T8-a-{law}")), low=low).exponents[0])

    found, others = vary_bootstrap(near.drawn, fit, {"low": 3 * low}, {"low": 10 * low}, resamples=RESAMPLES // 2)
    return measured(found, others, f"Fit the slope of eta_0/N^a for p N^2 > {low:g}.")


def small_end(tables: EnsembleTables, law: str) -> Measured:
    """Find p N^2 where the plateau of small systems meets the slope -a/2 of large ones, in decades."""
    near, a = viscosities(tables, law, False).up_to(HIGHEST_PRESSURE), paper(f"T8-a-{law}")

    def meets(drawn: list[Array], small: float = 0.1, large: float = TAIL) -> float:
        x, y = near.scaled(drawn, a)
        if not (x < small).any() or not (x > large).any():
            return float("nan")
        plateau, slope = (np.log10(v).mean() for v in (y[x < small], (y * x ** (0.5 * a))[x > large]))
        return float((slope - plateau) / (0.5 * a))

    return measured(*vary_bootstrap(near.drawn, meets, {"small": 0.03}, {"large": 1e3}), (small_end.__doc__ or ""))


for _law in ("contact", "stokes"):
    for _prestress, _end in ((True, "-stressed"), (False, "")):
        _which: dict[str, Any] = {"law": _law, "prestress": _prestress}
        measures(f"T8-a-{_law}{_end}", pressures=(HIGHEST_PRESSURE, LEAST, 0.1), **_which)(size_exponent)
        measures(f"T8-tail-{_law}{_end}", **_which)(tail)
    measures(f"T8-crossover-{_law}", law=_law)(small_end)
measures("T8-a-same", law="stokes", prestress=False, pressures=(LEAST, HIGHEST_PRESSURE, 0.1))(size_exponent)


def figure_8(tables: EnsembleTables) -> Drawing:
    """Viscosity against pressure for several sizes: one curve in p N^2."""
    out, panels = drawing("baumgarten-8", 1, 2, 5.6, 4.6)
    for axes, law, name in (
        (panels[0], "contact", "contact damping"),
        (panels[1], "stokes", r"Stokes drag, $\eta_F = 1$"),
    ):
        a = paper(f"T8-a-{law}")
        scale(axes)
        for prestress in (True, False):
            every = viscosities(tables, law, prestress)
            for n, values in zip(every.n, every.eta0, strict=True):
                kept = [(q, v) for q, v in zip(every.pressures, values, strict=True) if len(v)]
                x, y = np.array([q for q, _ in kept]), scaled(mean_over_packings([v for _, v in kept]), n**-a)
                look = size_style(n) | {"linestyle": "none", "fillstyle": "none" if prestress else "full"}
                series, text = f"N = {n}, {'with' if prestress else 'no'} pre-stress", f"N = {n}"
                text += ", fixed box" if n == SIZE else ""
                out.curve(axes, series, x * n**2, y, band=False, label=None if prestress else text, **look)
        height = out.table.query("panel == @axes.get_gid() and 10 < x < 1000")["y"].median()
        text = rf"$-a/2$, $a = {a:g}$"
        out.slope(axes, -a / 2, (1e2, max(every.pressures) * max(every.n) ** 2), 20 * height, text, above=True)
        axes.plot([], [], color=BLACK, marker="o", linestyle="none", label="no pre-stress")
        axes.plot([], [], color=BLACK, marker="o", linestyle="none", fillstyle="none", label="with pre-stress")
        power = "" if a == 1 else f"^{{{a:g}}}"
        axes.set_ylim(top=300 * axes.get_ylim()[1])  # room for the legend
        label(axes, rf"$p\,N^2$  [$k$], {name}", rf"$\eta_0 / N{power}$  [$k\,\tau_1$]", ncols=2)
        axes.autoscale(axis="x", tight=True)
        axes.margins(x=0.03)
    out.caption = caption(out.name)
    return out
