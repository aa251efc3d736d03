"""Draw what holds droplets at onset: why pairs in contact scatter around 2N' - 1, and what does not."""

from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.studies.beyond.rows import say
from jamlab.studies.droplet_tables import counts_at_onset
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.ensembles import bootstrap, groups_by, sampled_sizes
from jamlab.studies.panels import FIT, Drawing, drawing, label, size_style, style

SHARES = {"free": "motions left free", "second": "contacts beyond one a pair", "extra": r"pairs beyond $2N' - 1$"}


def droplet_contacts(tables: EnsembleTables) -> Drawing:
    """Contacts of droplets at onset: pairs, contacts of vertices, states of self-stress and motions left free."""
    table = counts_at_onset(tables.onset)
    n = sampled_sizes(table, "dp")
    out, (pairs, stresses, more, shares) = drawing("beyond-droplet-contacts", 2, 2, 4.7, 3.8)
    for size in n:
        rows, look = table[table["n"] == size], size_style(size) | {"linestyle": "-"}
        for axes, column in ((pairs, "beyond"), (stresses, "self_stresses")):
            share = rows[column].value_counts(normalize=True).sort_index()
            out.curve(axes, f"N = {size} ({len(rows)})", share.index, share.to_numpy(), **look)
    label(pairs, r"pairs in contact beyond $2N' - 1$", "share of packings", loc="upper right")
    label(stresses, "states of self-stress S", "share of packings", loc="upper right")
    for axes in (pairs, stresses):
        axes.set_ylim(0, 1.35 * axes.get_ylim()[1])
    one = _of_each_size(table, n, "one")
    told, said = _draw_more(out, more, table, n), _draw_shares(out, shares, table, n)
    least = int(table["self_stresses"].min())
    out.caption = (
        f"Droplets at onset, taken as rigid, {_counts(table, n)}: (a) pairs in contact, which scatter around the 2N' - "
        f"1 of disks; (b) states of self-stress of contacts of vertices with edges, {least} or more in every packing, "
        f"just one in {one}; (c) mean of those beyond one: {told}; (d) for each droplet that bears load, N = {n[-1]}: "
        f"{', '.join(said)}. Contacts are 3N' - 2 - F + S, with F motions left free and S states of self-stress, a "
        "count that fixes neither; disks have F = 0 and S = 1. What states beyond one consist of: "
        "docs/explanation/beyond_the_papers.md."
    )
    return out


def _counts(table: pd.DataFrame, n: list[int]) -> str:
    """How many packings there are of each size."""
    return ", ".join(f"{int((table['n'] == m).sum())} packings of N = {m}" for m in n)


def _of_each_size(table: pd.DataFrame, n: list[int], column: str, digits: int = 2) -> str:
    """Means of a column with their intervals, size by size."""
    mean = bootstrap(groups_by(table, "n", column, n), lambda g: [v.mean() for v in g])
    return ", ".join(f"{say(mean[k], digits)} of N = {m}" for k, m in enumerate(n))


def _draw_more(out: Drawing, axes: Any, table: pd.DataFrame, n: list[int]) -> str:
    """Mean number of states of self-stress beyond one against N, beside one that is proportional to N; in words."""
    mean = bootstrap(groups_by(table, "n", "more", n), lambda g: [v.mean() for v in g])
    out.curve(axes, "mean", n, mean.value, mean.low, mean.high, band=False, linestyle="none", label=None, **style(1))
    ends = np.array([0, n[-1]])
    out.curve(axes, "as many a droplet", ends, ends * mean.value[-1] / n[-1], label=f"as many a droplet as N = {n[-1]}",
              **FIT)  # fmt: skip
    label(axes, "N", r"mean of $S - 1$", loc="upper left")
    axes.set_ylim(0, None)
    axes.set_xlim(0, None)
    each = _of_each_size(table, n, "more_each", 3)
    return f"{_of_each_size(table, n, 'more')}; a droplet {each}"


def _draw_shares(out: Drawing, axes: Any, table: pd.DataFrame, n: list[int]) -> list[str]:
    """Numbers for each droplet against N; words on those of the largest size."""
    said = []
    for k, (column, words) in enumerate(SHARES.items()):
        groups: list[Array] = groups_by(table, "n", column, n)
        mean = bootstrap(groups, lambda g: [v.mean() for v in g])
        ends = (mean.value, mean.low, mean.high)
        out.curve(axes, words.replace("$", ""), n, *ends, band=False, label=words, **style(k))
        said.append(f"{words.replace('$', '')} {say(mean[-1], 3)}")
    axes.set_xscale("log", base=2)
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.55 * (high - low))
    label(axes, "N", "for each droplet that bears load", loc="upper left")
    axes.set_xticks(n, list(map(str, n)))
    axes.minorticks_off()
    return said
