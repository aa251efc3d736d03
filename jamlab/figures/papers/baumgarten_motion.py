"""Draw motion and finite size in Baumgarten & Tighe: figs 5, 7 and 8."""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from jamlab.errors import InputError, StorageError
from jamlab.figures.papers.claims import Claim, claim
from jamlab.figures.papers.ensembles import FEWEST, RESAMPLES, average, bootstrap, groups_by
from jamlab.figures.papers.panels import PAPER, Drawing, drawing, label, scale, sequence, size_style, style
from jamlab.figures.papers.spectral_groups import LARGE, format_power, select_largest, select_law, select_limits
from jamlab.figures.papers.tables import EnsembleTables
from jamlab.statistics import published_numbers as published
from jamlab.statistics.data_collapse import fit_scaling_exponents
from jamlab.statistics.power_laws import power_law

Array = NDArray[np.float64]

_PLATEAU = 0.2  # of the box; longer lengths may be cut off by it, at L/4
_SHORTEST = 2.0  # d; a shorter length is that of a pair of disks
_TAIL = 100.0  # p N^2 from which the slope of the viscosity is fitted


def figure_5(tables: EnsembleTables) -> Drawing:
    """Medians of approach, sliding and non-affine motion in slow shear against pressure."""
    table = tables.quasistatic
    loose = table[~table["prestress"].astype(bool)]
    part = loose if len(loose) else table
    n = int(part["n"].max())
    part = part[part["n"] == n]
    p = sorted(part["pressure"].unique())
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
        words = {"how": how}
        if name == "approach":
            words |= {"cause": _half_modulus(tables, n, [p[k] for k in fitted]), "shown_by": "baumgarten-5"}
            words["how"] += f"; {words['cause']}" if words["cause"] else ""
        out.claims.append(claim(out.name, f"exponent of {name} in p", found, paper, **words))
    label(axes, r"pressure $p$  [$k$]", r"median displacement per strain $/\,\gamma$  [$d$]")
    out.caption = "Medians over contacts and disks, per strain, mean over packings" + (
        ", without pre-stress as in the paper."
        if len(loose)
        else ". The paper leaves pre-stress out; these data do not."
    )
    return out


def _half_modulus(tables: EnsembleTables, n: int, pressures: list[float]) -> str:
    """Half the exponent of G_0 without pre-stress in the same packings: approach ~ G_0^(1/2), [T] eq 19."""
    try:
        rows = select_law(tables.spectra, "contact", prestress=False, beta=1.0)
    except (InputError, StorageError):
        return ""
    groups = groups_by(
        rows[rows["n"] == n].drop_duplicates(["seed", "target_pressure"]), "target_pressure", "g0", pressures
    )
    if not groups or min(map(len, groups)) == 0:
        return ""
    mu = power_law(pressures, [g.mean() for g in groups]).exponents[0]
    return (
        f"it goes as the root of G_0, which rises with p^{mu:.3f} in these packings, hence {0.5 * mu:.3f};"
        " the paper's is a guide line"
    )


def figure_7(tables: EnsembleTables) -> Drawing:
    """Correlation of transverse displacements under both laws, and its length."""
    table = tables.correlation
    stressed = table["prestress"].astype(bool)
    table = table[stressed] if stressed.any() else table
    out, (a, b, c, d) = drawing("baumgarten-7", 2, 2, 5.4, 4.2)
    balanced = select_law(table, "contact", beta=1.0)
    contact, stokes = select_largest(balanced), select_largest(select_law(table, "stokes", eta_f=1.0))
    _draw_contact_correlation(out, a, balanced)
    _draw_stokes_correlation(out, b, stokes)
    scale(c)
    scale(d)
    n, side = int(stokes["n"].iloc[0]), float(stokes["box"].mean())
    pressures = sorted(stokes["pressure"].unique(), reverse=True)
    family: list[tuple[Array, list[Array]]] = []
    for index, p in enumerate(pressures):
        part = stokes[stokes["pressure"] == p]
        omega = np.sort(part["omega"].unique())
        cubes = [correlations(part[part["omega"] == w]) for w in omega]
        found = [bootstrap([cube], lambda g: find_first_zero(g[0])) for cube in cubes]
        y = [np.array([float(getattr(f, end)) for f in found]) for end in ("value", "low", "high")]
        look, name = sequence(index, len(pressures)), f"$p = {format_power(p)}$"
        out.curve(c, name, omega, *y, **look)
        out.curve(d, name, omega / p**0.5, *(v * (-np.log(p)) ** published.LOG_EXPONENT.value for v in y), **look)
        family.append((omega / p**0.5, cubes))
    ends = [stokes["omega"].min(), stokes["omega"].max()]
    out.curve(c, "paper: plateau $L/4$", ends, [side * published.CORRELATION_LENGTH.value] * 2, **PAPER)
    label(c, FREQUENCY, r"length $l$  [$d$]")
    label(d, r"$\omega\,\tau_1 / p^{1/2}$", rf"$l\,(-\ln p)^{{{published.LOG_EXPONENT.value:g}}}$")
    for part, text in ((contact, "l/L, contact damping"), (stokes, "plateau l/L, Stokes drag")):
        out.claims.append(_plateau_claim(out.name, text, part))
    _log_claim(out, n, side, pressures, family)
    out.caption = (
        "Correlation C of transverse displacements, mean over packings: (a) contact damping against distance over box; "
        "(b) Stokes drag; (c) first zero l of C under Stokes drag; (d) its collapse as in the paper."
    )
    return out


def _plateau_claim(name: str, text: str, part: pd.DataFrame) -> Claim:
    """Claim on l/L of slow shear, the mean over pressures, since the paper has it independent of pressure."""
    slow = part[part["omega"] == part["omega"].min()]
    pressures = sorted(slow["pressure"].unique(), reverse=True)
    cubes = [correlations(slow[slow["pressure"] == p]) / [float(slow["box"].mean()), 1.0] for p in pressures]
    each = [find_first_zero(cube) for cube in cubes]
    found = bootstrap(cubes, lambda g: np.nanmean([find_first_zero(cube) for cube in g]))
    listed = f"{', '.join(f'{v:.3f}' for v in each)} at p = {', '.join(f'{p:g}' for p in pressures)}"
    return claim(
        name,
        text,
        found,
        published.CORRELATION_LENGTH,
        how=f"N = {int(part['n'].iloc[0])}, lowest frequency, where both damping laws give the same quasi-static "
        f"motion; mean of {listed}",
        cause=f"it scatters with the packing: {listed}",
        shown_by="baumgarten-7 c",
    )


def correlations(part: pd.DataFrame) -> Array:
    """Distance and C (packings, bins, 2); bins are counted in steps of each packing, whose boxes differ a little."""
    step = part.groupby("seed")["delta"].transform(lambda x: np.diff(np.sort(x)).min())
    numbered = part.assign(bin=(part["delta"] / step).round().astype(int))
    wide = numbered.pivot_table(index="seed", columns="bin", values=["delta", "c"])
    return np.stack([wide["delta"].to_numpy(dtype=np.float64), wide["c"].to_numpy(dtype=np.float64)], axis=-1)


def find_first_zero(cube: Array) -> float:
    """Find the distance at which the mean C first falls through zero, by linear interpolation; nan without one."""
    x, c = average(cube[..., 0]), average(cube[..., 1])
    below = np.flatnonzero(c <= 0)
    if not len(below) or below[0] == 0:
        return float("nan")
    k = below[0]
    return float(x[k - 1] + (x[k] - x[k - 1]) * c[k - 1] / (c[k - 1] - c[k]))


FREQUENCY = r"frequency $\omega\,\tau_1$"


def _draw_contact_correlation(out: Drawing, axes: Any, part: pd.DataFrame) -> None:
    count = part.groupby("pressure")["n"].nunique()
    p = float(count.index[count == count.max()].min())
    part = part[part["pressure"] == p]
    sizes = np.sort(part["n"].unique())[-2:][::-1]
    omegas = np.sort(part.loc[part["n"] == sizes[0], "omega"].unique())
    shown = omegas[np.unique([0, len(omegas) // 2, len(omegas) - 1])]
    for index, omega in enumerate(shown):
        for n, fill in zip(sizes, ("full", "none"), strict=False):
            rows = part[(part["n"] == n) & np.isclose(part["omega"], omega)]
            if rows.empty:
                continue
            look = style(index) | {"fillstyle": fill}
            name = rf"$N = {n}$, $\omega = {format_power(float(omega))}$"
            _draw_correlation(out, axes, name, rows, float(rows["box"].mean()), look)
    axes.axhline(0, color="#888888", linewidth=0.8)
    label(axes, rf"contact damping, $p = {format_power(p)}$: $\delta / L$", r"$C$")


def _draw_stokes_correlation(out: Drawing, axes: Any, part: pd.DataFrame) -> None:
    p = part["pressure"].min()
    part = part[part["pressure"] == p]
    omegas = np.sort(part["omega"].unique())
    omegas = omegas[np.unique(np.linspace(0, len(omegas) - 1, 7).round().astype(int))]
    for index, omega in enumerate(omegas):
        name = rf"$\omega = {format_power(float(omega))}$"
        _draw_correlation(out, axes, name, part[part["omega"] == omega], 1.0, sequence(index, len(omegas)))
    axes.axhline(0, color="#888888", linewidth=0.8)
    label(axes, rf"Stokes drag, $p = {format_power(p)}$: distance $\delta$  [$d$]", r"$C$")


def _draw_correlation(
    out: Drawing, axes: Any, name: str, rows: pd.DataFrame, unit: float, look: dict[str, Any]
) -> None:
    cube = correlations(rows)
    band = bootstrap([cube[..., 1]], lambda g: average(g[0]))
    out.curve(axes, name, average(cube[..., 0]) / unit, band.value, band.low, band.high, **look)


def _log_claim(
    out: Drawing, n: int, side: float, pressures: list[float], family: list[tuple[Array, list[Array]]]
) -> None:
    """Claim the exponent of -ln p that collapses the lengths between a few disks and the cut-off of the box."""

    def usable(x: Array, cubes: list[Array]) -> tuple[Array, Array]:
        lengths = np.array([find_first_zero(cube) for cube in cubes])
        kept = np.isfinite(lengths) & (lengths < _PLATEAU * side) & (lengths > _SHORTEST)
        return x[kept], lengths[kept]

    several = [k for k, (x, cubes) in enumerate(family) if len(usable(x, cubes)[0]) > 1]
    scales = -np.log([pressures[k] for k in several])
    flat = [cube for k in several for cube in family[k][1]]
    places = np.cumsum([0, *(len(family[k][1]) for k in several)])

    def fit(drawn: list[Array]) -> float:
        curves = [
            usable(family[k][0], drawn[first:last])
            for k, first, last in zip(several, places[:-1], places[1:], strict=True)
        ]
        if min(len(x) for x, _ in curves) < 2:
            return np.nan
        return fit_scaling_exponents(scales, [curves], a=0.0, start=(0.0, published.LOG_EXPONENT.value)).b

    decades = np.log10(_PLATEAU * side / _SHORTEST)
    enough = len(several) > 2 and decades >= 1
    found = bootstrap(flat, fit, resamples=RESAMPLES // 4) if enough else None
    window = f"{_SHORTEST:g} d < l < {_PLATEAU} L"
    how = (
        f"N = {n}, best collapse of {window} at {len(several)} pressures against omega/p^0.5"
        if enough
        else f"it takes a decade of lengths {window} at three pressures; N = {n} has {decades:.1f} at {len(several)}"
    )
    out.claims.append(
        claim(
            out.name,
            "exponent of -ln p in the collapse of l",
            found,
            published.LOG_EXPONENT,
            how=how,
            cause=f"lengths span {decades:.1f} decades between two disks and the box",
            shown_by="baumgarten-7 c",
        )
    )


def figure_8(tables: EnsembleTables) -> Drawing:
    """Viscosity against pressure for several sizes: one curve in p N^2."""
    limits = select_limits(tables.spectra)
    out, panels = drawing("baumgarten-8", 1, 2, 5.6, 4.6)
    for axes, law, parameters in (
        (panels[0], "contact", {"beta": 1.0}),
        (panels[1], "stokes", {"eta_f": 1.0}),
    ):
        a = published.SIZE_EXPONENT[law].value
        scale(axes)
        for prestress in (True, False):
            part = select_law(limits, law, prestress=prestress, **parameters)
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
                out.curve(axes, series, x * n**2, *y, band=False, label=None if prestress else name, **look)
            groups = [[v if len(v) >= FEWEST else v[:0] for v in values] for values in groups]
            several = [k for k, values in enumerate(groups) if sum(len(v) > 0 for v in values) > 1]
            kept_sizes = [sizes[k] for k in several]
            _size_claims(out, law, prestress, kept_sizes, p, [groups[k] for k in several])
        x0, x1 = 1e2, max(1e4, float(limits["target_pressure"].max()) * float(limits["n"].max()) ** 2)
        y0 = _height(out, axes, x0)
        out.slope(axes, -a / 2, (x0, x1), 1.6 * y0, rf"$-a/2$, $a = {a:g}$")
        name = "contact damping" if law == "contact" else r"Stokes drag, $\eta_F = 1$"
        label(axes, rf"$p\,N^2$  [$k$], {name}", rf"$\eta_0 / N^{{{a:g}}}$  [$k\,\tau_1$]")
    out.caption = (
        "Viscosity at low frequency over N^a against p N^2. Filled: without pre-stress, open: with it (text of the "
        "paper; its caption says the reverse). Packings unstable in shear have no viscosity and are left out."
    )
    return out


def _height(out: Drawing, axes: Any, x0: float) -> float:
    """Median y of the points drawn near x0."""
    t = out.table
    t = t[(t["panel"] == axes.get_gid()) & (t["x"] > x0 / 10) & (t["x"] < x0 * 10)]
    return float(t["y"].median()) if len(t) else 1.0


def _size_claims(
    out: Drawing, law: str, prestress: bool, sizes: list[int], p: list[float], groups: list[list[Array]]
) -> None:
    flat = [v for values in groups for v in values if len(v)]
    place = [(i, j) for i, values in enumerate(groups) for j, v in enumerate(values) if len(v)]

    def curves(drawn: list[Array]) -> list[tuple[Array, Array]]:
        family: list[list[tuple[float, float]]] = [[] for _ in sizes]
        for (i, j), values in zip(place, drawn, strict=True):
            family[i].append((p[j], float(values.mean())))
        return [(np.array([x for x, _ in points]), np.array([y for _, y in points])) for points in family]

    def exponent(drawn: list[Array]) -> float:
        return -fit_scaling_exponents(
            np.array(sizes, dtype=float), [curves(drawn)], a=2.0, start=(2.0, -published.SIZE_EXPONENT[law].value)
        ).b

    def tail(drawn: list[Array]) -> float:
        points = np.array(
            [(q * n**2, y / n) for n, c in zip(sizes, curves(drawn), strict=True) for q, y in zip(*c, strict=True)]
        )
        return float(power_law(*points.T, low=_TAIL).exponents[0])

    text = f"{law}, {'with' if prestress else 'no'} pre-stress"
    found = slope = None
    if len(sizes) > 1 and all(len(x) > 1 for x, _ in curves(flat)):
        found = bootstrap(flat, exponent, resamples=RESAMPLES // 4)
        if sum(q * n**2 >= _TAIL for n, (x, _) in zip(sizes, curves(flat), strict=True) for q in x) >= 3:
            slope = bootstrap(flat, tail, resamples=RESAMPLES // 2)
    how = f"N = {', '.join(map(str, sizes))}"
    words = {"how": how}
    if found is not None:
        at_paper = fit_scaling_exponents(
            np.array(sizes, dtype=float), [curves(flat)], a=2.0, b=-published.SIZE_EXPONENT[law].value
        ).spread
        best = fit_scaling_exponents(np.array(sizes, dtype=float), [curves(flat)], a=2.0, b=-float(found.value)).spread
        words["cause"] = f"curves lie apart by {at_paper:.3f} in ln eta_0 with the paper's a, by {best:.3f} with ours"
        words["shown_by"] = f"baumgarten-8 {'a' if law == 'contact' else 'b'}"
    out.claims.append(
        claim(out.name, f"a: eta_0/N^a against p N^2, {text}", found, published.SIZE_EXPONENT[law], **words)
    )
    if not prestress:
        out.claims.append(
            claim(out.name, f"slope for p N^2 > {_TAIL:g}, {text}", slope, published.VISCOSITY_TAIL, how=how)
        )
