"""Draw motion and finite size in Baumgarten & Tighe: figs 5 and 8."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import InputError, StorageError
from jamlab.statistics import published_numbers as published
from jamlab.statistics.data_collapse import ScalingExponents, fit_scaling_exponents
from jamlab.statistics.power_laws import power_law
from jamlab.studies.baumgarten.spectral_groups import (
    FIXED,
    LARGE,
    STABILIZED,
    select_ensemble,
    select_largest,
    select_law,
    select_limits,
)
from jamlab.studies.claims import claim
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.ensembles import FEWEST, RESAMPLES, bootstrap, groups_by
from jamlab.studies.panels import Drawing, drawing, label, scale, size_style, style

_TAIL = 100.0  # p N^2 from which the slope of the viscosity is fitted


def figure_5(tables: EnsembleTables) -> Drawing:
    """Medians of approach, sliding and non-affine motion in slow shear against pressure."""
    table = select_ensemble(tables.quasistatic)
    loose = table[~table["prestress"].astype(bool)]
    part = loose if len(loose) else table
    part = select_largest(part)
    n, packings = int(part["n"].iloc[0]), part.groupby("pressure")["seed"].nunique()
    p = sorted(packings.index[packings >= min(FEWEST, packings.max())])
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
        band = bootstrap(groups, lambda g: [float(v.mean()) for v in g])
        out.curve(axes, text, p, band.value, band.low, band.high, **style(index))
        beside = 1.4 if paper.value < 0 else 0.6
        out.slope(axes, paper.value, (p[0], p[-1]), beside * float(band.value[0]), f"{paper.value:+g}")
        found = None
        if len(fitted) > 1:
            found = bootstrap(
                [groups[k] for k in fitted],
                lambda g: power_law([p[k] for k in fitted], [v.mean() for v in g]).exponents[0],
            )
        how = f"N = {n}, {len(fitted)} pressures with p N^2 > {LARGE:g}, " + (
            "no pre-stress" if len(loose) else "WITH pre-stress"
        )
        means = [float(v.mean()) for v in groups]
        words = {"how": how, "cause": _local_exponents(p, means), "shown_by": "baumgarten-5"}
        if square := _mean_square(tables, n, [p[k] for k in fitted], name):
            words |= {"how": f"{how}; {square}", "cause": f"{square}; {words['cause']}"}
        out.claims.append(claim(out.name, f"exponent of {name} in p", found, paper, **words))
    label(axes, r"pressure $p$  [$k$]", r"median displacement per strain $/\,\gamma$  [$d$]")
    out.caption = "Medians over contacts and disks, per strain, mean over packings" + (
        ", without pre-stress as in the paper."
        if len(loose)
        else ". The paper leaves pre-stress out; these data do not."
    )
    return out


def _local_exponents(pressures: list[float], means: list[float]) -> str:
    """Say what the exponent is from each pressure to the next lower one: whether it has a limit by now."""
    rise = np.diff(np.log(means)) / np.diff(np.log(pressures))
    places = ", ".join(f"{p:g}" for p in reversed(pressures))
    return f"from pressure to pressure it is {', '.join(f'{e:.2f}' for e in reversed(rise))} (p = {places})"


def _mean_square(tables: EnsembleTables, n: int, pressures: list[float], name: str) -> str:
    """Exponent of the root mean square in the same packings: [T] eqs 19 and 22 take it from G_0 and from eta_0."""
    column = {"approach": "g0", "sliding": "eta0"}.get(name)
    try:
        rows = select_law(tables.spectra, "contact", prestress=False, beta=1.0)
    except (InputError, StorageError):
        return ""
    rows = rows[rows["n"] == n].drop_duplicates(["seed", "target_pressure"])
    groups = groups_by(rows, "target_pressure", column, pressures) if column else []
    if not groups or min(map(len, groups)) == 0:
        return ""
    half = 0.5 * power_law(pressures, [g.mean() for g in groups]).exponents[0]
    source = "G_0" if column == "g0" else "eta_0"
    return f"of the median; root mean squares, by {source} of the same packings, go with {half:.3f}"


def figure_8(tables: EnsembleTables) -> Drawing:
    """Viscosity against pressure for several sizes: one curve in p N^2."""
    limits = select_limits(tables.spectra)
    out, panels = drawing("baumgarten-8", 1, 2, 5.6, 4.6)
    drawn: list[pd.DataFrame] = []
    for axes, law, parameters in (
        (panels[0], "contact", {"beta": 1.0}),
        (panels[1], "stokes", {"eta_f": 1.0}),
    ):
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
                band = bootstrap([v for _, v in kept], lambda g: [float(v.mean()) for v in g])
                y = [v / n**a for v in (band.value, band.low, band.high)]
                look = size_style(n) | {"linestyle": "none", "fillstyle": "none" if prestress else "full"}
                name = f"N = {n}"
                series = f"{name}, {'with' if prestress else 'no'} pre-stress"
                out.curve(
                    axes, series, x * n**2, *y, band=False, label=None if prestress and n in named else name, **look
                )
            _size_claims(out, law, prestress, sizes, p, groups)
        x0, x1 = 1e2, max(1e4, float(limits["target_pressure"].max()) * float(limits["n"].max()) ** 2)
        y0 = _height(out, axes, x0)
        out.slope(axes, -a / 2, (x0, x1), 6 * y0, rf"$-a/2$, $a = {a:g}$")
        name = "contact damping" if law == "contact" else r"Stokes drag, $\eta_F = 1$"
        label(axes, rf"$p\,N^2$  [$k$], {name}", rf"$\eta_0 / N^{{{a:g}}}$  [$k\,\tau_1$]")
    out.caption = (
        "Viscosity at low frequency over N^a against p N^2. Filled: without pre-stress, open: with it (text of the "
        "paper; its caption says the reverse). Packings unstable in shear have no viscosity and are left out. "
        + _say_ensembles(pd.concat(drawn))
    )
    return out


def _say_ensembles(limits: pd.DataFrame) -> str:
    """Which sizes are of which ensemble, with how many packings."""
    said = []
    for ensemble, words in ((STABILIZED, "sheared until stable"), (FIXED, "of fixed shape")):
        packings = limits[limits["ensemble"] == ensemble].groupby("n")["seed"].nunique()
        if len(packings):
            found = ", ".join(f"N = {n} ({count})" for n, count in packings.items())
            said.append(f"boxes {words}: {found}")
    return f"Packings in {'; in '.join(said)}."


def _height(out: Drawing, axes: Any, x0: float) -> float:
    """Median y of the points drawn near x0."""
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
        """Up to a pressure, where there are packings enough for an interval; sizes with two such pressures or more."""
        kept = [k for k, p in enumerate(self.pressures) if p <= highest * (1 + 1e-9)]
        few = [[v[k] if len(v[k]) >= FEWEST else v[k][:0] for k in kept] for v in self.eta0]
        several = [i for i, values in enumerate(few) if sum(len(v) > 0 for v in values) > 1]
        return _Sizes([self.n[i] for i in several], [self.pressures[k] for k in kept], [few[i] for i in several])

    @property
    def drawn(self) -> list[Array]:
        """The packings of each size and pressure that has some, in one list, as a bootstrap draws them."""
        return [v for values in self.eta0 for v in values if len(v)]

    def curves(self, drawn: list[Array]) -> list[tuple[Array, Array]]:
        """Mean viscosity over pressure, one curve a size."""
        rest, out = iter(drawn), []
        for values in self.eta0:
            points = [(p, float(next(rest).mean())) for p, v in zip(self.pressures, values, strict=True) if len(v)]
            out.append((np.array([x for x, _ in points]), np.array([y for _, y in points])))
        return out

    def fit(self, drawn: list[Array], **fixed: Any) -> ScalingExponents:
        """Collapse of the curves in p N^2 and eta_0/N^a, a = -b."""
        return fit_scaling_exponents(np.array(self.n, dtype=float), [self.curves(drawn)], a=2.0, **fixed)


def _size_claims(
    out: Drawing, law: str, prestress: bool, sizes: list[int], p: list[float], groups: list[list[Array]]
) -> None:
    """Exponents of the collapse up to the highest pressure of the paper: eq 22 is a law of small p."""
    paper, text = published.SIZE_EXPONENT[law], f"{law}, {'with' if prestress else 'no'} pre-stress"
    every = _Sizes(sizes, p, groups)
    near = every.up_to(published.HIGHEST_PRESSURE)
    start = (2.0, -paper.value)

    def tail(drawn: list[Array]) -> float:
        curves = zip(near.n, near.curves(drawn), strict=True)
        points = np.array([(q * n**2, y / n**paper.value) for n, c in curves for q, y in zip(*c, strict=True)])
        return float(power_law(*points.T, low=_TAIL).exponents[0])

    found = slope = None
    words = {"how": f"N = {', '.join(map(str, near.n))}, p <= {published.HIGHEST_PRESSURE:g} as in fig 3"}
    if len(near.n) > 1:
        found = bootstrap(near.drawn, lambda drawn: -near.fit(drawn, start=start).b, resamples=RESAMPLES // 4)
        far = [q * n**2 >= _TAIL for n, (x, _) in zip(near.n, near.curves(near.drawn), strict=True) for q in x]
        if sum(far) >= 3:
            slope = bootstrap(near.drawn, tail, resamples=RESAMPLES // 2)
        at_paper, best = (near.fit(near.drawn, b=-a).spread for a in (paper.value, float(found.value)))
        words["cause"] = f"curves lie apart by {at_paper:.3f} in ln eta_0 with the paper's a, by {best:.3f} with ours"
        words["shown_by"] = f"baumgarten-8 {'a' if law == 'contact' else 'b'}"
        if max(p) > max(near.pressures):
            whole = every.up_to(max(p))
            words["how"] += f"; up to p = {max(p):g} a = {-whole.fit(whole.drawn, start=start).b:.2f}"
    out.claims.append(claim(out.name, f"a: eta_0/N^a against p N^2, {text}", found, paper, **words))
    if not prestress:
        how = f"{words['how'].split(';')[0]}, of eta_0/N^{paper.value:g}"
        name = f"slope for p N^2 > {_TAIL:g}, {text}"
        out.claims.append(claim(out.name, name, slope, published.VISCOSITY_TAIL, how=how))
