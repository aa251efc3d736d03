"""Draw motion and finite size in Baumgarten & Tighe: figs 5 and 8."""

from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import InputError, StorageError
from jamlab.statistics.bootstrap import Interval
from jamlab.statistics.data_collapse import ScalingExponents, fit_scaling_exponents
from jamlab.statistics.power_laws import power_law
from studies import published_numbers as published
from studies.baumgarten.spectral_groups import (
    FIXED,
    LARGE,
    STABILIZED,
    select_ensemble,
    select_largest,
    select_law,
    select_limits,
)
from studies.claims import write_list
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import (
    FEWEST,
    RESAMPLES,
    Varied,
    bootstrap,
    enough,
    groups_by,
    mean_over_packings,
    power_over,
    scaled,
    unmeasured,
    vary_bootstrap,
)
from studies.panels import Drawing, drawing, label, scale, size_style, style

_MEAN_SQUARE = "exponent of the root mean square of {} in p"
_LEAST = 1e-3  # pressure up to which a is taken in the limit of small p
_TAIL = 100.0  # p N^2 from which the slope of the viscosity is fitted


def figure_5(tables: EnsembleTables) -> Drawing:
    """Medians of approach, sliding and non-affine motion in slow shear against pressure."""
    table = select_ensemble(tables.quasistatic)
    stressed = table["prestress"].astype(bool)
    if stressed.all():
        raise InputError("fig 5 is of packings without pre-stress: add prestress = [true, false] to the campaign")
    part = select_largest(table[~stressed])
    n, p = int(part["n"].iloc[0]), enough(part, "pressure")
    fitted = [k for k, q in enumerate(p) if q * n**2 >= LARGE]
    out, (axes,) = drawing("baumgarten-5", 1, 1, 6.0, 4.6)
    scale(axes)
    for index, (name, text) in enumerate(
        (
            ("approach", r"approach $|\Delta u^\parallel|$"),
            ("sliding", r"sliding $|\Delta u^\perp|$"),
            ("nonaffine", r"non-affine $|u_{na}|$"),
        )
    ):
        paper = published.SLOW_SHEAR[name]
        groups = groups_by(part, "pressure", name, p)
        mean = mean_over_packings(groups)
        out.curve(axes, text, p, mean, **style(index))
        beside = 1.4 if paper.value < 0 else 0.6
        out.slope(axes, paper.value, (p[0], p[-1]), beside * float(mean.value[0]), f"{paper.value:+g}")
        used = {p[k]: groups[k] for k in fitted}
        found, every = _fit_motion(used)
        how = f"N = {n}, {len(fitted)} pressures with p N^2 > {LARGE:g}, no pre-stress"
        words = {"how": how, "cause": _local_exponents(out, name, p, mean.value), "shown_by": "baumgarten-5"}
        if square := _mean_square(out, tables, n, [p[k] for k in fitted], name):
            words |= {"how": f"{how}; {square}", "cause": f"{square}; {words['cause']}"}
        out.claim(f"exponent of {name} in p", found, paper, family=every, **words)
        same = table[stressed & (table["n"] == n)]
        used = {
            q: v
            for q, v in zip(p, groups_by(same, "pressure", name, p), strict=True)
            if len(v) >= FEWEST and q * n**2 >= LARGE
        }
        found, every = _fit_motion(used)
        words = {"how": f"N = {n}, {len(used)} pressures with five packings or more", "shown_by": "baumgarten-5"}
        out.claim(f"exponent of {name} in p, with pre-stress", found, paper, family=every, **words)
    _claim_means(out, tables.slow_shear)
    label(axes, r"pressure $p$  [$k$]", r"median displacement per strain $/\,\gamma$  [$d$]")
    out.caption = "Medians over contacts and disks, per strain, mean over packings, without pre-stress as in the paper."
    return out


def _fit_motion(groups: dict[float, Array]) -> Varied:
    """Fit the exponent of means in p; its family: without the lowest, and without the highest pressure."""
    return power_over(list(groups), list(groups.values()), lambda drawn: [v.mean() for v in drawn])


def _claim_means(out: Drawing, table: pd.DataFrame) -> None:
    """Claim that means go as medians do, and sliding without its affine part; in packings of which both are known."""
    loose = table[~table["prestress"].astype(bool)].dropna(subset=["mean_sliding"])
    sizes = [int(n) for n in sorted(loose["n"].unique())]
    p = {n: [q for q in enough(loose[loose["n"] == n], "pressure") if q * n**2 >= LARGE] for n in sizes}
    sizes = [n for n in sizes if len(p[n]) > 2]
    how, approach = "no packing has means beside medians", {}
    if sizes:
        n = sizes[-1]
        how = f"N = {n}, {len(p[n])} pressures down to {min(p[n]):g}, no pre-stress"
        same = loose[loose["n"] == n].rename(columns={"approach": "ratio"})
        median = float(power_law(p[n], [v.mean() for v in _at_pressures(same, p[n]).values()]).exponents[0])
        approach = {"cause": f"the median of the same packings goes with {median:.2f}"}
        if n < published.SIZE:
            approach["unlike"] = f"a plateau below p = {min(p[n]):g}, in {published.SIZE} disks, is not excluded"
    for text, over, under, paper, words in (
        ("exponent of mean over median sliding in p", "mean_sliding", "sliding", published.MEAN_AS_MEDIAN, {}),
        ("exponent of mean over median nonaffine in p", "mean_nonaffine", "nonaffine", published.MEAN_AS_MEDIAN, {}),
        ("exponent of mean approach in p", "mean_approach", "", published.MEAN_APPROACH, approach),
        ("exponent of sliding without its affine part in p", "sheared", "", published.SLOW_SHEAR["sliding"], {}),
    ):
        ratio = loose.assign(ratio=loose[over] / (loose[under] if under else 1.0))
        fits = {m: _fit_motion(_at_pressures(ratio[ratio["n"] == m], p[m])) for m in sizes}
        found, every = fits.pop(sizes[-1]) if fits else unmeasured()
        every = every | {f"N = {m}": other for m, (other, _) in fits.items() if other is not None}
        out.claim(text, found, paper, family=every, how=how, shown_by="baumgarten-5", **words)


def _at_pressures(table: pd.DataFrame, pressures: list[float]) -> dict[float, Array]:
    return dict(zip(pressures, groups_by(table, "pressure", "ratio", pressures), strict=True))


def _of_same_packings(tables: EnsembleTables, n: int, pressures: list[float], column: str) -> dict[float, Array]:
    """Find G_0 or eta_0 of contact damping without pre-stress, by pressure, of one size; {} where none is known."""
    try:
        rows = select_law(tables.spectra, "contact", prestress=False, beta=1.0)
    except (InputError, StorageError):
        return {}
    rows = rows[rows["n"] == n].drop_duplicates(["seed", "target_pressure"])
    groups = groups_by(rows, "target_pressure", column, pressures)
    return {p: values for p, values in zip(pressures, groups, strict=True) if len(values)}


def _local_exponents(out: Drawing, name: str, pressures: list[float], means: Array) -> str:
    """Keep the exponent from each pressure to the next lower one: whether it has a limit by now."""
    rise = (np.diff(np.log(means)) / np.diff(np.log(pressures)))[::-1]
    places = pressures[::-1]
    out.keep(f"exponent of {name} down to the next pressure", rise, p=places[:-1])
    return f"from pressure to pressure it is {write_list(rise, '.2f')} (p = {write_list(places)})"


def _mean_square(out: Drawing, tables: EnsembleTables, n: int, pressures: list[float], name: str) -> str:
    """Keep the exponent of the root mean square in the same packings, from G_0 and eta_0 by [T] eqs 19 and 22."""
    column, source = {"approach": ("g0", "G_0"), "sliding": ("eta0", "eta_0")}.get(name, ("", ""))
    groups = _of_same_packings(tables, n, pressures, column) if column else {}
    if len(groups) < len(pressures):
        return ""
    half = 0.5 * power_law(pressures, [g.mean() for g in groups.values()]).exponents[0]
    out.keep(_MEAN_SQUARE.format(name), half)
    return f"of the median; root mean squares, by {source} of the same packings, go with {half:.3f}"


def figure_8(tables: EnsembleTables) -> Drawing:
    """Viscosity against pressure for several sizes: one curve in p N^2."""
    limits = select_limits(tables.spectra)
    out, panels = drawing("baumgarten-8", 1, 2, 5.6, 4.6)
    drawn: list[pd.DataFrame] = []
    for axes, law, parameters in ((panels[0], "contact", {"beta": 1.0}), (panels[1], "stokes", {"eta_f": 1.0})):
        a = published.SIZE_EXPONENT[law].value
        scale(axes)
        parts = {
            prestress: select_law(limits, law, STABILIZED, prestress=prestress, **parameters)
            for prestress in (True, False)
        }
        drawn += parts.values()
        named = set(parts[False]["n"])  # in the legend once, filled if it can be
        for prestress, part in parts.items():
            sizes = sorted(int(n) for n in part["n"].unique())
            p = sorted(part["target_pressure"].unique())
            groups = [groups_by(part[part["n"] == n], "target_pressure", "eta0", p) for n in sizes]
            for n, values in zip(sizes, groups, strict=True):
                kept = [(q, v) for q, v in zip(p, values, strict=True) if len(v)]
                x = np.array([q for q, _ in kept])
                y = scaled(mean_over_packings([v for _, v in kept]), n**-a)
                look = size_style(n) | {"linestyle": "none", "fillstyle": "none" if prestress else "full"}
                name = None if prestress and n in named else f"N = {n}"
                series = f"N = {n}, {'with' if prestress else 'no'} pre-stress"
                out.curve(axes, series, x * n**2, y, band=False, label=name, **look)
            _claim_sizes(out, law, prestress, _Sizes(sizes, p, groups))
        x0, x1 = 1e2, max(1e4, float(limits["target_pressure"].max()) * float(limits["n"].max()) ** 2)
        y0 = _height(out, axes, x0)
        out.slope(axes, -a / 2, (x0, x1), 6 * y0, rf"$-a/2$, $a = {a:g}$")
        name = "contact damping" if law == "contact" else r"Stokes drag, $\eta_F = 1$"
        label(axes, rf"$p\,N^2$  [$k$], {name}", rf"$\eta_0 / N^{{{a:g}}}$  [$k\,\tau_1$]")
    out.caption = (
        "Viscosity at low frequency over N^a against p N^2. Filled: without pre-stress, open: with it (text of the "
        "paper; its caption says the reverse). Packings unstable in shear have no viscosity and are left out. "
        + _keep_ensembles(out, pd.concat(drawn))
    )
    return out


def _keep_ensembles(out: Drawing, limits: pd.DataFrame) -> str:
    """Keep which sizes are of which ensemble, with how many packings."""
    said = []
    for ensemble, words in ((STABILIZED, "sheared until stable"), (FIXED, "of fixed shape")):
        packings = limits[limits["ensemble"] == ensemble].groupby("n")["seed"].nunique()
        if len(packings):
            out.keep(f"packings, {ensemble}", packings.tolist(), N=packings.index)
            found = ", ".join(f"N = {n} ({count})" for n, count in packings.items())
            said.append(f"boxes {words}: {found}")
    return f"Packings in {'; in '.join(said)}."


def _height(out: Drawing, axes: Any, x0: float) -> float:
    """Find the median y of the points drawn near x0."""
    t = out.table
    t = t[(t["panel"] == axes.get_gid()) & (t["x"] > x0 / 10) & (t["x"] < x0 * 10)]
    return float(t["y"].median()) if len(t) else 1.0


@dataclass(frozen=True)
class _Sizes:
    """Viscosities of several sizes over pressure: for each size and pressure those of the packings."""

    n: list[int]
    pressures: list[float]
    eta0: list[list[Array]]

    def up_to(self, highest: float) -> "_Sizes":
        """Cut to pressures up to one with enough packings for an interval, and to sizes with two such pressures."""
        kept = [k for k, p in enumerate(self.pressures) if p <= highest * (1 + 1e-9)]
        few = [[v[k] if len(v[k]) >= FEWEST else v[k][:0] for k in kept] for v in self.eta0]
        several = [i for i, values in enumerate(few) if sum(len(v) > 0 for v in values) > 1]
        return _Sizes([self.n[i] for i in several], [self.pressures[k] for k in kept], [few[i] for i in several])

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

    def fit(self, drawn: list[Array], **fixed: Any) -> ScalingExponents:
        """Collapse the curves in p N^2 and eta_0/N^a, a = -b."""
        return fit_scaling_exponents(np.array(self.n, dtype=float), [self.curves(drawn)], a=2.0, **fixed)


def _claim_sizes(out: Drawing, law: str, prestress: bool, every: _Sizes) -> None:
    """Claim exponents of the collapse up to the highest pressure of the paper: eq 22 is a law of small p."""
    paper, text = published.SIZE_EXPONENT[law], f"{law}, {'with' if prestress else 'no'} pre-stress"
    near = every.up_to(published.HIGHEST_PRESSURE)
    start = (2.0, -paper.value)

    def up_to(highest: float) -> Interval | None:
        part = every.up_to(highest)
        if len(part.n) > 1:
            with suppress(InputError):  # curves that do not overlap
                return bootstrap(part.drawn, lambda drawn: -part.fit(drawn, start=start).b, resamples=RESAMPLES // 4)
        return None

    words = {"how": f"N = {write_list(near.n)}, p <= {published.HIGHEST_PRESSURE:g} as in fig 3"}
    ends = (published.HIGHEST_PRESSURE, _LEAST, max(every.pressures))
    found, least, whole = (up_to(p) for p in ends)
    if found is not None:
        spreads = [near.fit(near.drawn, b=-a).spread for a in (paper.value, float(found.value))]
        theirs, ours = out.keep(f"spread in ln eta_0, {text}", spreads, a=(paper.value, float(found.value)))
        words["cause"] = f"curves lie apart by {theirs:.3f} in ln eta_0 with the paper's a, by {ours:.3f} with ours"
        words["shown_by"] = f"baumgarten-8 {'a' if law == 'contact' else 'b'}"
    named = [f"p <= {p:g}" for p in ends]
    moved = dict(zip(named[1:], (least, whole), strict=True))
    out.claim(f"a: eta_0/N^a against p N^2, {text}", found, paper, family=moved, **words)
    _claim_tail(out, law, prestress, near)
    if not prestress:
        _claim_crossover(out, law, near)
    if law == "stokes" and not prestress and least is not None:
        moved = {named[0]: found, named[2]: whole}
        words |= {"how": named[1], "cause": "a does not fall towards 1 with p"}
        likely = published.STOKES_AS_CONTACT
        out.claim("a of Stokes drag, as of contact damping", least, likely, family=moved, **words)


def _claim_tail(out: Drawing, law: str, prestress: bool, near: _Sizes) -> None:
    """Claim the slope of eta_0/N^a in large packings; with pre-stress it is too shallow even where p N^2 > 10^3."""
    a = published.SIZE_EXPONENT[law].value
    low, paper = (10 * _TAIL, published.SHALLOWER) if prestress else (_TAIL, published.VISCOSITY_TAIL[law])

    def slope(drawn: list[Array], low: float = low) -> float:
        curves = zip(near.n, near.curves(drawn), strict=True)
        points = np.array([(q * n**2, y / n**a) for n, c in curves for q, y in zip(*c, strict=True)])
        return float(power_law(*points.T, low=low).exponents[0])

    found, moved = unmeasured()
    far = [q * n**2 >= low for n, (x, _) in zip(near.n, near.curves(near.drawn), strict=True) for q in x]
    if sum(far) >= 3:
        found, moved = vary_bootstrap(near.drawn, slope, {"low": 3 * low}, {"low": 10 * low}, resamples=RESAMPLES // 2)
    text = f"slope for p N^2 > {low:g}, {law}, {'with' if prestress else 'no'} pre-stress"
    words = {"how": f"N = {write_list(near.n)}, eta_0/N^{a:g}", "shown_by": "baumgarten-8"}
    out.claim(text, found, paper, family=moved, **words)


def _claim_crossover(out: Drawing, law: str, near: _Sizes) -> None:
    """Claim p N^2 where the viscosity stops depending on it: the plateau of small systems meets the slope -a/2."""
    a = published.SIZE_EXPONENT[law].value

    def meets(drawn: list[Array], small: float = 0.1, large: float = _TAIL) -> float:
        curves = zip(near.n, near.curves(drawn), strict=True)
        x, y = np.array([(q * n**2, v / n**a) for n, c in curves for q, v in zip(*c, strict=True)]).T
        if not (x < small).any() or not (x > large).any():
            return float("nan")
        plateau, tail = (np.log10(v).mean() for v in (y[x < small], (y * x ** (0.5 * a))[x > large]))
        return float((tail - plateau) / (0.5 * a))

    found, moved = vary_bootstrap(near.drawn, meets, {"small": 0.03}, {"large": 1e3}) if near.n else unmeasured()
    words = {"how": f"N = {write_list(near.n)}, p N^2 < 0.1 and > {_TAIL:g}", "shown_by": "baumgarten-8"}
    text = f"decades of p N^2 at the crossover, {law}, no pre-stress"
    out.claim(text, found, published.SMALL_ENDS, family=moved, **words)
