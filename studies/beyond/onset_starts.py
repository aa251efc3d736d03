"""Draw onsets of droplets that are compressed from the beginning, or take the place of disks, beside those of disks."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.statistics.confidence import Interval
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import bootstrap, equivalence_bound, scaled, side_by_side
from studies.panels import Drawing, TextTable, drawing, label, scale, style, write_interval
from studies.papers.statements import caption
from studies.study import Study

DIRECT, FROM_DISKS, ONLY_DISKS = "direct", "from-disks", "disks"
SIZES = (16, 32, 64, 128, 256)
SHOWN = 32  # whose distributions are drawn
PAIRS = ((DIRECT, ONLY_DISKS), (FROM_DISKS, ONLY_DISKS), (DIRECT, FROM_DISKS))
LOOK: dict[str, dict[str, Any]] = {name: style(k) for k, name in enumerate((DIRECT, FROM_DISKS, ONLY_DISKS))}
FEWEST = 30  # packings
COLUMNS = ["phi_J", "z_J", "self_stresses", "free_motions"]
WORDS = ("mean", "ratio of widths less 1", "z", "S", "F")


def onsets_of(tables: EnsembleTables) -> dict[tuple[str, int], pd.DataFrame]:
    """Onsets by start and N, a row a seed. Droplets that start from disks come from the campaign of starts where it
    has as many as of the others, else from the table of onsets."""
    usual, by_start = tables.onset, tables.onset_starts
    found = {}
    for n in SIZES:
        for name in (DIRECT, FROM_DISKS, ONLY_DISKS):
            model, start = ("sp", FROM_DISKS) if name == ONLY_DISKS else ("dp", name)
            own = by_start[(by_start["n"] == n) & (by_start["model"] == model) & (by_start["start"] == start)]
            kept = usual[(usual["n"] == n) & (usual["model"] == model)] if name != DIRECT else own
            rows = own if len(own) >= len(kept) else kept
            if len(rows) >= FEWEST:
                found[name, n] = rows.drop_duplicates("seed").set_index("seed")
    if (DIRECT, SHOWN) not in found:
        raise InputError(f"no {FEWEST} onsets of {SHOWN} droplets of start 'direct': run the campaign onset_starts")
    return found


def of_pairs(one: pd.DataFrame, other: pd.DataFrame) -> Array:
    """(seeds, 4, 2) `COLUMNS` of the seeds that both have, which begin with particles at the same places."""
    seeds = one.index.intersection(other.index)
    both = [rows.loc[seeds].reindex(columns=COLUMNS).to_numpy(dtype=np.float64) for rows in (one, other)]
    return np.stack(both, axis=-1)


def compared(pairs: Array) -> Interval:
    """Difference of the mean onsets, ratio of the widths less 1, differences of the means of z, S and F."""

    def numbers(groups: list[Array]) -> Array:
        first, second = groups[0].mean(axis=0).T
        ratio = groups[0][:, 0, 0].std() / groups[0][:, 0, 1].std() - 1
        return np.insert(first - second, 1, ratio)

    return bootstrap([pairs], numbers)


def table_of_pairs(found: Mapping[tuple[str, int], pd.DataFrame]) -> Iterator[tuple[str, str, int, int, Interval]]:
    """Each pair of starts at each N: names, N, number of seeds, and what `compared` gives."""
    for one, other in PAIRS:
        for n in SIZES:
            if (one, n) in found and (other, n) in found:
                pairs = of_pairs(found[one, n], found[other, n])
                yield one, other, n, len(pairs), compared(pairs)


def counts_of(rows: pd.DataFrame, n: int) -> Interval:
    """Mean and width of phi_J, z, z without contacts that only stop a droplet, (S - 1)/N and F/N."""
    values = rows.reindex(columns=[*COLUMNS, "z_strong"]).to_numpy(dtype=np.float64)

    def means(groups: list[Array]) -> Array:
        phi, z, s, f = groups[0][:, :4].mean(axis=0)
        strong = groups[0][:, 4][np.isfinite(groups[0][:, 4])]  # a packing that only stops hold has none
        held = strong.mean() if len(strong) else np.nan
        return np.array([phi, groups[0][:, 0].std(ddof=1), z, held, (s - 1) / n, f / n])

    return bootstrap([values], means)


def draw_starts(tables: EnsembleTables) -> Drawing:
    """Onset of droplets by start, and of disks: distributions, differences of means, widths, and floppy modes."""
    found = onsets_of(tables)
    out, (shares, means, widths, modes) = drawing("onset-starts", 2, 2, 5.2, 3.8)
    scale(means, widths, y="linear")
    scale(modes)
    for name, look in LOOK.items():
        phi = np.sort(found[name, SHOWN]["phi_J"].to_numpy(dtype=np.float64))
        of = name if name == ONLY_DISKS else f"droplets, {name}"
        out.curve(shares, of, phi, np.arange(1, len(phi) + 1) / len(phi), **look | {"marker": ""})
    every = list(table_of_pairs(found))
    for k, (one, other) in enumerate(PAIRS):
        rows = [(n, values) for a, b, n, _, values in every if (a, b) == (one, other)]
        at = [n * 1.04 ** (k - 1) for n, _ in rows]
        for axes, part in ((means, 0), (widths, 1)):
            values = side_by_side(each[part] for _, each in rows)
            out.curve(axes, f"{one} less {other}", at, values, band=False, **style(k) | {"linestyle": "none"})
    for axes in (means, widths):
        axes.axhline(0.0, color="#777777", linewidth=0.9, linestyle=":")
    numbers = {key: counts_of(rows, key[1]) for key, rows in found.items()}
    for name in (DIRECT, FROM_DISKS):
        own = [n for n in SIZES if (name, n) in found]
        for part, symbol, line in ((4, "(S − 1)/N", "-"), (5, "F/N", "--")):
            values = side_by_side(numbers[name, n][part] for n in own)
            out.curve(modes, f"{symbol}, {name}", own, values, band=False, **LOOK[name] | {"linestyle": line})
    _say(out, every, numbers, found)
    label(shares, rf"onset $\phi_J$, N = {SHOWN}", r"share jammed at or below", loc="upper left")
    label(means, "number of particles $N$", r"difference of mean $\phi_J$", loc="best")
    label(widths, "number of particles $N$", "ratio of widths less 1", legend=False)
    label(modes, "number of particles $N$", "states of self-stress, floppy modes", loc="center right")
    for axes in (means, widths, modes):
        axes.set_xticks(SIZES, [f"{n}" for n in SIZES])
        axes.set_xticks([], minor=True)
    older = ", ".join(
        f"{n}" for n in SIZES if "protocol" not in found.get((FROM_DISKS, n), pd.DataFrame({"protocol": []}))
    )
    out.caption = caption(out.name, few=min(row[3] for row in every), most=max(row[3] for row in every), older=older)
    return out


def _say(
    out: Drawing,
    every: list[tuple[str, str, int, int, Interval]],
    numbers: Mapping[tuple[str, int], Interval],
    found: Mapping[tuple[str, int], pd.DataFrame],
) -> None:
    """Write values and both tables of a drawing."""
    rows = []
    for one, other, n, seeds, values in every:
        known = [k for k in range(len(WORDS)) if np.isfinite(values.value[k])]
        out.values |= {f"{one} less {other}, N = {n}: {WORDS[k]}": values[k] for k in known}
        rows.append([f"{one} less {other}", f"{n}", f"{seeds}"])
        for k, factor, digits in ((0, 1e4, 1), (1, 1.0, 2), (2, 1.0, 3)):
            found_here = scaled(values[k], factor)
            rows[-1] += [write_interval(found_here, digits), f"{equivalence_bound(found_here):.{digits}f}"]
    heads = ("starts", "N", "seeds", "mean φ_J (10⁻⁴)", "bound (10⁻⁴)", "ratio of widths − 1", "bound", "z", "bound")
    out.text.append(TextTable(heads, rows, heading="Differences at onset, and bounds of equivalence at 95 %"))
    rows = []
    for (name, n), values in sorted(numbers.items()):
        for part, what in enumerate(("mean phi_J", "width", "z", "z without stops", "(S - 1)/N", "F/N")):
            if np.isfinite(values.value[part]):
                out.values[f"{name}, N = {n}: {what}"] = values[part]
        cells = [write_interval(values[k], 4) if np.isfinite(values.value[k]) else "-" for k in range(6)]
        rows.append([name, f"{n}", f"{len(found[name, n])}", *cells])
    heads = ("start", "N", "packings", "mean φ_J", "width", "z", "z without stops", "(S − 1)/N", "F/N")
    out.text.append(TextTable(heads, rows, heading="Onsets by start"))


STUDY = Study("onset-starts", "Onset of droplets by start, and of disks", {}, draw_starts)
