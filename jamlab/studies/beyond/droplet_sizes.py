"""Draw how z, G and the onset of droplets depend on their number, each size weighted by its packings."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import InputError, StorageError
from jamlab.statistics import published_numbers as published
from jamlab.statistics.power_laws import finite_size
from jamlab.studies.beyond.rows import droplets_with, say
from jamlab.studies.boromand.contacts_and_modulus import NEAR
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.ensembles import FEWEST, average, bootstrap, ensemble, groups_by, sampled_sizes, sizes
from jamlab.studies.panels import FIT, Drawing, drawing, label, scale, size_style, style

DISTANCES = {"d_z": (1e-3, 1e-2, 0.03, 0.1), "g": (1e-2, 0.03, 0.1, 0.14)}  # from onset, in rho
FEW = 4.0  # contacts beyond those at onset, where their number begins to grow as that of large packings


def droplet_sizes(tables: EnsembleTables) -> Drawing:
    """Finite size of droplets: z - z_J and G at fixed distances, crossover, unstable boxes, onset and its width."""
    states, onset = (table[table["n"].isin(sampled_sizes(table, "dp"))] for table in (_states(tables), _onsets(tables)))
    n = sizes(onset, "dp")
    if len(n) < 2:
        raise InputError(f"droplets of {len(n)} size with onsets: it takes two; use the reference data")
    out, axes = drawing("beyond-droplet-sizes", 2, 3, 4.7, 3.8)
    said = [_draw_limits(out, axes[0], states, "d_z"), _draw_limits(out, axes[1], states, "g")]
    said.append(_draw_crossover(out, axes[2], states))
    said.append(_draw_unstable(out, axes[3], states))
    said += [_draw_onset(out, axes[4], onset, n), _draw_width(out, axes[5], onset, n)]
    out.caption = (
        f"Droplets against their number: (a) to (d) {_packings(states)}, compressed from onset; (e) and (f) "
        f"{_packings(onset)}, at onset; bars and intervals: 95 % over packings. " + " ".join(said)
    )
    return out


def _packings(table: pd.DataFrame) -> str:
    """How many packings of each size a table has."""
    droplets = table[table["model"] == "dp"]
    return ", ".join(f"{count} of N = {n}" for n, count in droplets.groupby("n")["seed"].nunique().items())


def _more(tables: EnsembleTables) -> pd.DataFrame:
    """States of droplets of the usual law in the campaign beyond the papers; none where it has not run."""
    try:
        return droplets_with(tables.droplet_states)
    except (InputError, StorageError, KeyError):
        return pd.DataFrame(columns=["model", "n", "seed", "state", "rho", "d_rho", "d_z", "g", "rho_J"])


def _states(tables: EnsembleTables) -> pd.DataFrame:
    """States of droplets that were compressed, of each size from where it has more packings."""
    droplets = tables.states[tables.states["model"] == "dp"]
    followed = droplets.groupby(["n", "seed"])["state"].transform("size") > 1  # not to onset alone
    return _of_more_packings(droplets[followed], _more(tables))


def _onsets(tables: EnsembleTables) -> pd.DataFrame:
    """Onsets of droplets, of each size from where it has more packings."""
    more = _more(tables)
    return _of_more_packings(tables.onset[tables.onset["model"] == "dp"], more[more["state"] == 0])


def _of_more_packings(first: pd.DataFrame, second: pd.DataFrame) -> pd.DataFrame:
    shared = [column for column in first.columns if column in second.columns]
    parts = []
    for n in sorted({*first["n"], *second["n"]}):
        found = max((first[first["n"] == n], second[second["n"] == n]), key=lambda part: part["seed"].nunique())
        if found["seed"].nunique() >= FEWEST:
            parts.append(found[shared])
    return pd.concat(parts, ignore_index=True) if parts else first[shared]


def _draw_limits(out: Drawing, axes: Any, states: pd.DataFrame, column: str) -> str:
    """A mean at fixed distances over 1/N, and its limit of many droplets."""
    scale(axes, "linear", "log")
    n = sizes(states, "dp")
    said = []
    for k, d in enumerate(DISTANCES[column]):
        groups = [ensemble(states, "dp", m, "d_rho", column, [d]).y[:, 0] for m in n]
        kept = [(m, g[np.isfinite(g)]) for m, g in zip(n, groups, strict=True) if np.isfinite(g).sum() >= FEWEST]
        if len(kept) < 2:
            continue
        held, values = [m for m, _ in kept], [g for _, g in kept]
        mean = bootstrap(values, lambda g: [v.mean() for v in g])
        limit = bootstrap(values, partial(_limit, held))
        x, look = 1 / np.array(held), style(k)
        name = rf"$\Delta\rho$ = {d:g}"
        out.curve(axes, name, x, mean.value, mean.low, mean.high, band=False, linestyle="none", **look)
        ends = np.array([0.0, x.max()])
        out.curve(axes, f"line to the limit, {name}", ends, limit.value[0] + limit.value[1] * ends, label=None,
                  color=look["color"], linewidth=0.9)  # fmt: skip
        said.append(f"{say(limit[0], 3)} at {d:g}")
    symbol = r"$z - z_J$" if column == "d_z" else r"$G$  [ε/l²]"
    low, high = axes.get_ylim()
    axes.set_ylim(low, high * (high / low) ** 0.35)
    label(axes, "1/N", symbol, loc="upper left", ncols=2)
    word = "z - z_J" if column == "d_z" else "G"
    return f"({axes.get_gid()}) {word} at fixed distances from onset; limit of 1/N -> 0: {', '.join(said)}."


def _limit(n: Sequence[int], groups: list[Array]) -> tuple[float, float]:
    """Limit and slope of means over 1/N, each weighted by its standard error."""
    means = [g.mean() for g in groups]
    errors = [g.std(ddof=1) / len(g) ** 0.5 for g in groups]
    if not min(errors) > 0:
        return float("nan"), float("nan")
    slope, limit = np.polyfit(1 / np.array(n), means, 1, w=1 / np.array(errors))
    return float(limit), float(slope)


def _draw_crossover(out: Drawing, axes: Any, states: pd.DataFrame) -> str:
    """Contacts beyond those at onset over the distance, and where there are a few, against N."""
    n = sizes(states, "dp")
    scale(axes)
    curves = [ensemble(states, "dp", m, "d_rho", "d_z", NEAR) for m in n]
    for m, curve in zip(n, curves, strict=True):
        x, y = curve.band()
        out.curve(axes, f"N = {m}", x, *(0.5 * m * part for part in (y.value, y.low, y.high)), **size_style(m))
    axes.axhline(FEW, color="#777777", linewidth=0.9, linestyle="--")
    axes.set_ylim(0.05, None)
    label(axes, r"$\Delta\rho$", r"contacts beyond onset, $(z - z_J)\,N/2$", loc="upper left")
    groups = [np.stack([e.x, 0.5 * m * e.y], axis=-1) for m, e in zip(n, curves, strict=True)]
    places = [bootstrap([g], lambda drawn: _crossing(drawn[0])) for g in groups]
    weights = [len(g) ** 0.5 for g in groups]

    def exponent(drawn: list[Array]) -> float:
        return -float(np.polyfit(np.log(n), np.log([_crossing(g) for g in drawn]), 1, w=weights)[0])

    told = ", ".join(f"{say(place, 4)} for N = {m}" for m, place in zip(n, places, strict=True))
    found = say(bootstrap(groups, exponent))
    return f"({axes.get_gid()}) There are {FEW:g} more contacts (dashed) at {told}: as N^-a, a = {found}."


def _crossing(curve: Array) -> float:
    """Distance at which the mean of (packings, places, 2) first exceeds `FEW`."""
    x, y = average(curve[..., 0]), average(curve[..., 1])
    above = int(np.argmax(y > FEW))
    if not above:
        return float("nan")
    ends = slice(above - 1, above + 1)
    return float(np.exp(np.interp(FEW, y[ends], np.log(x[ends]))))


def _draw_unstable(out: Drawing, axes: Any, states: pd.DataFrame) -> str:
    """Share of packings whose fixed box would shear by itself, over the distance from onset."""
    scale(axes, "log", "linear")
    said = []
    for m in sizes(states, "dp"):
        e = ensemble(states, "dp", m, "d_rho", "g", NEAR)
        negative = np.where(np.isfinite(e.y), e.y < 0, np.nan)
        share = bootstrap([negative], lambda g: average(g[0]))
        out.curve(axes, f"N = {m}", average(e.x), share.value, share.low, share.high, **size_style(m))
        at = int(np.abs(average(e.x) - 1e-2).argmin())
        said.append(f"{share.value[at]:.2f} of N = {m}")
    axes.set_ylim(0, None)
    label(axes, r"$\Delta\rho$", r"share with $G < 0$", loc="upper left")
    return f"({axes.get_gid()}) Boxes that would shear by themselves; 0.01 above onset {', '.join(said)}."


def _draw_onset(out: Drawing, axes: Any, onset: pd.DataFrame, n: list[int]) -> str:
    """Mean onset over N, and its limit."""
    groups = groups_by(onset, "n", "rho_J", n)
    mean = bootstrap(groups, lambda g: [v.mean() for v in g])
    out.curve(axes, "mean", n, mean.value, mean.low, mean.high, band=False, linestyle="none", label=None, **style(1))
    axes.set_xscale("log")
    label(axes, "N", r"mean onset $\rho_J$", legend=False)
    axes.set_xticks(n, [str(m) for m in n])
    if len(n) < 3:
        return f"({axes.get_gid()}) Onset."

    def limit(g: list[Array]) -> float:
        errors = [v.std(ddof=1) / len(v) ** 0.5 for v in g]
        return finite_size(n, [v.mean() for v in g], errors, exponent=published.ONSET_CORRECTION).limit

    found = bootstrap(groups, limit)
    errors = [v.std(ddof=1) / len(v) ** 0.5 for v in groups]
    law = finite_size(n, [v.mean() for v in groups], errors, exponent=published.ONSET_CORRECTION)
    line = np.geomspace(n[0], 4 * n[-1], 40)
    out.curve(axes, "law", line, law(line), label=None, **FIT)
    return (
        f"({axes.get_gid()}) Onset, with a correction N^-{published.ONSET_CORRECTION} (O'Hern et al. 2003): "
        f"{say(found, 4)} in the limit of many droplets."
    )


def _draw_width(out: Drawing, axes: Any, onset: pd.DataFrame, n: list[int]) -> str:
    """Width of the distribution of onsets over N, and its exponent."""
    groups = groups_by(onset, "n", "rho_J", n)
    scale(axes)
    width = bootstrap(groups, lambda g: [v.std(ddof=1) for v in g])
    out.curve(
        axes, "width", n, width.value, width.low, width.high, band=False, linestyle="none", label=None, **style(1)
    )
    weights = np.sqrt([len(g) - 1 for g in groups])  # of ln of a standard deviation

    def fit(g: list[Array]) -> Array:
        return np.asarray(np.polyfit(np.log(n), np.log([v.std(ddof=1) for v in g]), 1, w=weights))

    found = bootstrap(groups, lambda g: -fit(g)[0])
    slope, front = fit(groups)
    line = np.geomspace(n[0], n[-1], 20)
    out.curve(axes, "law", line, np.exp(front) * line**slope, label=None, **FIT)
    label(axes, "N", r"width of onsets $\sigma$", legend=False)
    axes.set_xticks(n, [str(m) for m in n])
    return f"({axes.get_gid()}) Width of the distribution of onsets: N^-theta, theta = {say(found)}."
