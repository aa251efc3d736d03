"""Draw how far displacements are correlated in Baumgarten & Tighe: fig 7."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.statistics.bootstrap import Interval
from jamlab.statistics.data_collapse import fit_scaling_exponents
from studies import published_numbers as published
from studies.baumgarten.spectral_groups import format_power, select_largest, select_law
from studies.claims import Kind, write_by, write_list
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import (
    ENOUGH,
    Varied,
    average,
    bootstrap,
    enough,
    mean_over_packings,
    power_over,
    scaled,
    unmeasured,
    vary_bootstrap,
)
from studies.panels import FREQUENCY, PAPER, Drawing, drawing, label, scale, sequence, style

SLOW = 1e-2  # omega in the critical regime, at which lanes and both parts of the motion are compared
_PLATEAU = 0.1  # of the box; longer lengths are cut off by it, at 0.17 to 0.19 L
_REACH = 5.0  # longest over shortest length between these, from which their exponents tell something
_SHORTEST = 2.0  # d; a shorter length is that of a pair of disks


def figure_7(tables: EnsembleTables) -> Drawing:
    """Correlation of transverse displacements under both laws, and its length."""
    table = tables.correlation
    stressed = table["prestress"].astype(bool)
    table = table[stressed] if stressed.any() else table
    out, (a, b, c, d) = drawing("baumgarten-7", 2, 2, 5.4, 4.2)
    balanced = select_law(table, "contact", beta=1.0)
    dragged = select_law(table, "stokes", eta_f=1.0)
    contact, stokes = select_largest(balanced), select_largest(dragged)
    _draw_contact_correlation(out, a, balanced)
    _draw_stokes_correlation(out, b, stokes)
    scale(c, d)
    n, side = int(stokes["n"].iloc[0]), float(stokes["box"].mean())
    pressures = sorted(stokes["pressure"].unique(), reverse=True)
    family: list[tuple[Array, Array]] = []
    for index, p in enumerate(pressures):
        part = stokes[stokes["pressure"] == p]
        omega, whole = np.sort(part["omega"].unique()), by_frequency(part)
        found = bootstrap([whole], lambda g: first_zeros(g[0]))
        look, name = sequence(index, len(pressures)), f"$p = {format_power(p)}$"
        out.curve(c, name, omega, found, **look)
        out.curve(d, name, omega / p**0.5, scaled(found, (-np.log(p)) ** published.LOG_EXPONENT.value), **look)
        family.append((omega / p**0.5, whole))
    ends = [stokes["omega"].min(), stokes["omega"].max()]
    out.curve(c, "paper: plateau $L/4$", ends, [side * published.CORRELATION_LENGTH.value] * 2, **PAPER)
    label(c, f"Stokes drag: {FREQUENCY}", r"length $l$  [$d$]")
    label(d, r"Stokes drag: $\omega\,\tau_1 / p^{1/2}$", rf"$l\,(-\ln p)^{{{published.LOG_EXPONENT.value:g}}}$")
    slow = stokes[stokes["omega"] == stokes["omega"].min()]
    _claim_length(out, "l/L, contact damping", contact, balanced)
    _claim_length(out, "plateau l/L, Stokes drag", slow, dragged)
    _claim_logarithm(out, n, side, pressures, family)
    _claim_box_alone(out, balanced)
    _claim_minimum(out, stokes)
    _claim_other_lanes(out, tables)
    out.caption = (
        "Correlation C of transverse displacements, mean over packings: (a) contact damping against distance over box; "
        "(b) Stokes drag; (c) first zero l of C under Stokes drag; (d) its collapse as in the paper."
    )
    return out


def _claim_length(out: Drawing, text: str, part: pd.DataFrame, table: pd.DataFrame) -> None:
    """Claim l/L, the mean over pressures and frequencies, of which the paper has it independent. `part` holds the size
    with several packings at the frequencies that count, `table` all sizes."""
    table_at = table[table["omega"].isin(part["omega"].unique())]
    sampled = enough(table_at, "n", ENOUGH)[-1]  # five packings of the largest size tell no length from another
    part = table_at[table_at["n"] == sampled]
    pressures = enough(part, "pressure")[::-1]
    rows = [part[part["pressure"] == p] for p in pressures]
    cubes = [_in_boxes(each) for each in rows]
    each = {p: float(np.nanmean(first_zeros(whole))) for p, whole in zip(pressures, cubes, strict=True)}
    out.keep(text, list(each.values()), p=each)
    found = _mean_length(cubes)
    low, high = part["omega"].min(), part["omega"].max()
    where = f"omega = {low:g}" if low == high else f"mean over omega = {low:g} to {high:g}"
    by_size = _lengths_of_sizes(table[table["omega"].between(low, high)])
    out.keep(text, list(by_size.values()), N=by_size)
    zeros = ", ".join(f"{length.value:.3f} at N = {n}" for n, length in by_size.items())
    words = {
        "how": f"N = {int(part['n'].iloc[0])}, {where}; mean of {write_by(each, '.3f', 'p')}",
        "cause": f"the zero of C lies at {zeros}",
        "shown_by": "baumgarten-7 a" if low < high else "baumgarten-7 c",
    }
    every = {f"N = {m}": length for m, length in by_size.items() if m != sampled}
    # of contact damping the paper reads a radius of swirls off pictures; its zero of C is that of slow Stokes drag
    same = Kind.DUPLICATE if low < high else Kind.MEASURED
    out.claim(text, found, published.CORRELATION_LENGTH, kind=same, family=every, **words)
    if low == high:
        return
    words = {"how": f"N = {sampled}, l in boxes, between the ends by its power", "shown_by": "baumgarten-7 a"}
    over = np.sort(part["omega"].unique())
    for what, x, other in (("omega", over, 0), ("p", np.array(pressures), 1)):
        ratio, every = _ratio_over(x, cubes, partial(_mean_zeros, axis=other))
        text = f"l at the largest over l at the smallest {what}, contact damping"
        out.claim(text, ratio, published.INDEPENDENT, family=every, **words)


def _ratio_over(x: Array, cubes: list[Array], values: Callable[[Sequence[Array]], Array]) -> Varied:
    """Compute by how much values change from the smallest x to the largest, by the power of x that fits them best: over
    many decades a small exponent is a large factor."""

    def ratio(exponent: Interval) -> Interval:
        return Interval(*((x.max() / x.min()) ** end for end in (exponent.value, exponent.low, exponent.high)))

    found, every = power_over(x, cubes, values)
    return None if found is None else ratio(found), {choice: ratio(other) for choice, other in every.items()}


def _mean_zeros(cubes: Sequence[Array], axis: int) -> Array:
    """Average the first zeros of C over pressures (axis 0) or frequencies (axis 1)."""
    return np.asarray(np.nanmean([first_zeros(whole) for whole in cubes], axis=axis))


def _claim_box_alone(out: Drawing, balanced: pd.DataFrame) -> None:
    """Claim that l of contact damping is that of the box at every size, and over all frequencies of fig 7 a."""
    p = balanced.groupby("pressure")["n"].nunique().idxmax()
    rows = balanced[balanced["pressure"] == p]
    shared = set.intersection(*(set(part["omega"]) for _, part in rows.groupby("n")))
    middle = rows[rows["omega"] == sorted(shared)[len(shared) // 2]]
    n = enough(middle, "n")
    cubes = [by_frequency(part) / [float(part["box"].mean()), 1.0] for part in (middle[middle["n"] == m] for m in n)]

    found, every = power_over(n, cubes, lambda drawn: [first_zeros(whole)[0] for whole in drawn])
    words = {
        "how": f"N = {write_list(n)}, p = {p:g}, omega = {middle['omega'].iloc[0]:g}",
        "shown_by": "baumgarten-7 a",
    }
    out.claim("exponent of l/L in N, contact damping", found, published.OF_THE_BOX, family=every, **words)
    fastest = rows[rows["omega"] == rows["omega"].max()]
    wide = rows[(rows["n"] == fastest["n"].max()) & rows["seed"].isin(fastest["seed"])]
    omega, whole = np.sort(wide["omega"].unique()), by_frequency(wide)

    found, every = _ratio_over(omega, [whole], lambda drawn: first_zeros(drawn[0]))
    words["how"] = f"N = {wide['n'].iloc[0]}, p = {p:g}, omega = {omega[0]:g} to {omega[-1]:g}, by its power of omega"
    text = "l at the largest over l at the smallest omega of all decades, contact damping"
    out.claim(text, found, published.INDEPENDENT, family=every, **words)


def _claim_minimum(out: Drawing, stokes: pd.DataFrame) -> None:
    """Claim that C under Stokes drag is least further out the slower the shear: the exponent of that place in omega."""
    low, high = 1e-4, 1e-1
    part = stokes[(stokes["pressure"] == stokes["pressure"].min()) & stokes["omega"].between(0.99 * low, 1.01 * high)]
    omega, whole = np.sort(part["omega"].unique()), by_frequency(part)

    def least(drawn: Sequence[Array]) -> Array:
        x, c = np.moveaxis(average(drawn[0]), -1, 0)
        return np.asarray(x[np.arange(len(x)), np.nanargmin(c, axis=1)])

    found, every = power_over(omega, [whole], least)
    words = {"how": f"N = {part['n'].iloc[0]}, p = {part['pressure'].min():g}, {low:g} < omega < {high:g}"}
    text, shown = "exponent of the place of the least C in omega, Stokes drag", "baumgarten-7 b"
    out.claim(text, found, published.MOVES_OUT, family=every, **words, shown_by=shown)


def _claim_other_lanes(out: Drawing, tables: EnsembleTables) -> None:
    """Claim that lengths of correlation are those of lower lanes, and of the motion at zero stress."""
    table = tables.slow_shear
    for text, name in (("lanes half as high", "length_half_lane"), ("the imaginary part", "length_imaginary")):
        rows = table.dropna(subset=["length", name])
        p = enough(rows, "pressure") if len(rows) else []
        ratios = [part[name].to_numpy() / part["length"].to_numpy() for _, part in rows.groupby("pressure")]
        found = bootstrap(ratios, lambda g: np.concatenate(g).mean()) if p else None
        every = {f"p = {q:g}": mean_over_packings([v])[0] for q, v in zip(p, ratios, strict=True)}
        if name == "length_half_lane" and p:
            quarter = (rows["length_quarter_lane"] / rows["length"]).dropna().to_numpy()
            every["a quarter as high"] = mean_over_packings([quarter])[0]
        how = f"N = {rows['n'].iloc[0]}, omega = {SLOW:g}, mean over packings" if p else "no packing has both"
        words = {"how": how, "shown_by": "baumgarten-7 a"}
        out.claim(f"l of {text} over l, contact damping", found, published.SAME_LENGTH, family=every, **words)


def _lengths_of_sizes(table: pd.DataFrame) -> dict[int, Interval]:
    """Find l/L in packings of every size, the mean over pressures and frequencies."""
    found = {}
    for n in enough(table, "n", 1):
        rows = table[table["n"] == n]
        found[n] = _mean_length([_in_boxes(part) for _, part in rows.groupby("pressure")])
    return found


def _in_boxes(part: pd.DataFrame) -> Array:
    return by_frequency(part) / [float(part["box"].mean()), 1.0]


def _mean_length(cubes: list[Array]) -> Interval:
    return bootstrap(cubes, lambda g: np.nanmean([np.nanmean(first_zeros(whole)) for whole in g]))


def _compare_lengths(out: Drawing, pressures: list[float], curves: list[tuple[Array, Array]], middle: float) -> str:
    """Keep l at every pressure where omega/p^0.5 makes it `middle` at the first one; "" without curves."""
    if not curves:
        return ""
    x, y = curves[0]
    place = np.interp(-np.log(middle), -np.log(y), np.log(x))
    held = [(p, x, y) for p, (x, y) in zip(pressures, curves, strict=True) if x[0] <= np.exp(place) <= x[-1]]
    lengths = {p: float(np.exp(np.interp(place, np.log(x), np.log(y)))) for p, x, y in held}
    if len(lengths) < 2:
        return ""
    out.keep("omega/p^0.5 where l is compared", np.exp(place))
    out.keep("l there, in d", list(lengths.values()), p=lengths)
    logs = -np.log(list(lengths))
    factor = (logs.max() / logs.min()) ** published.LOG_EXPONENT.value
    return (
        f"at omega/p^0.5 = {np.exp(place):.2g} l is {write_list(lengths.values(), '.1f')} d at p = "
        f"{write_list(lengths)}, where the paper's power of -ln p would change it by a factor of {factor:.1f}"
    )


def correlations(part: pd.DataFrame) -> Array:
    """Arrange distance and C (packings, frequencies, bins, 2); bins count steps of each packing, as boxes differ a
    little."""
    step = part.groupby("seed")["delta"].transform(lambda x: np.diff(np.unique(x)).min())
    numbered = part.assign(bin=(part["delta"] / step).round().astype(int))
    wide = numbered.pivot_table(index="seed", columns=["omega", "bin"], values=["delta", "c"])
    shape = (len(wide), part["omega"].nunique(), -1)
    return np.stack([wide[name].to_numpy(dtype=np.float64).reshape(shape) for name in ("delta", "c")], axis=-1)


def by_frequency(part: pd.DataFrame) -> Array:
    """Stack distance and C (packings, frequencies, bins, 2) of the packings with all frequencies."""
    shared = part.groupby("seed")["omega"].nunique()
    part = part[part["seed"].isin(shared.index[shared == part["omega"].nunique()])]
    if part.empty:
        raise InputError("no packing has its correlation at every frequency: finish the tasks of that sweep")
    return correlations(part)


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


def _draw_contact_correlation(out: Drawing, axes: Any, part: pd.DataFrame) -> None:
    count = part.groupby("pressure")["n"].nunique()
    p = float(count.index[count == count.max()].min())
    part = part[part["pressure"] == p]
    fastest = part[part["omega"] == part["omega"].max()]  # packings of the widest range, twelve decades as in the paper
    part = part.merge(fastest[["n", "seed"]].drop_duplicates())
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
    cube = correlations(rows)[:, 0]
    out.curve(axes, name, average(cube[..., 0]) / unit, mean_over_packings([cube[..., 1]])[0], **look)


def _claim_logarithm(
    out: Drawing, n: int, side: float, pressures: list[float], family: list[tuple[Array, Array]]
) -> None:
    """Claim the exponent of -ln p that collapses the lengths between a few disks and the cut-off of the box."""

    def usable(x: Array, whole: Array, low: float = _SHORTEST, high: float = _PLATEAU) -> tuple[Array, Array]:
        lengths = first_zeros(whole)
        kept = np.isfinite(lengths) & (lengths < high * side) & (lengths > low)
        return x[kept], lengths[kept]

    several = [k for k, (x, whole) in enumerate(family) if len(usable(x, whole)[0]) > 1]
    scales = -np.log([pressures[k] for k in several])

    def fit(drawn: list[Array], **window: float) -> float:
        curves = [usable(family[k][0], whole, **window) for k, whole in zip(several, drawn, strict=True)]
        if min(len(x) for x, _ in curves) < 2:
            return np.nan
        return fit_scaling_exponents(scales, [curves], a=0.0, start=(0.0, published.LOG_EXPONENT.value)).b

    reach = _PLATEAU * side / _SHORTEST
    wide = len(several) > 2 and reach >= _REACH
    drawn = [family[k][1] for k in several]
    choices = ({"low": 1.5 * _SHORTEST}, {"high": 0.75 * _PLATEAU}, {"high": 2 * _PLATEAU})
    found, every = vary_bootstrap(drawn, fit, *choices) if wide else unmeasured()
    window = f"{_SHORTEST:g} d < l < {_PLATEAU} L"
    how = (
        f"N = {n}, best collapse of {window} at {len(several)} pressures against omega/p^0.5"
        if wide
        else f"it takes {_REACH:g} times the shortest length {window} at three pressures; N = {n} has {reach:.1f} at "
        f"{len(several)}"
    )
    curves = [usable(*family[k]) for k in several]
    middle = np.sqrt(_SHORTEST * _PLATEAU * side)
    cause = _compare_lengths(out, [pressures[k] for k in several], curves, middle)
    words = {"how": how, "cause": cause, "shown_by": "baumgarten-7 c"}
    text = "exponent of -ln p in the collapse of l"
    out.claim(text, found, published.LOG_EXPONENT, family=every, **words)
