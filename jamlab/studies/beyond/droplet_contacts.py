"""Draw what holds droplets at onset: why pairs in contact scatter around 2N' - 1, and what does not."""

from typing import Any

import numpy as np
import pandas as pd

from jamlab.statistics.bootstrap import Interval
from jamlab.studies.claims import write_interval
from jamlab.studies.droplet_tables import counts_at_onset
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.ensembles import groups_by, mean_over_packings, sampled_sizes
from jamlab.studies.panels import FIT, Drawing, drawing, label, size_style, style

# column -> legend, and name of its mean
SHARES = {
    "free": ("motions left free", "motions left free"),
    "second": ("contacts beyond one a pair", "contacts beyond one a pair"),
    "extra": (r"pairs beyond $2N' - 1$", r"pairs beyond 2N' - 1"),
}


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

    def means(name: str, column: str) -> Interval:
        found: Interval = out.keep(name, mean_over_packings(groups_by(table, "n", column, n)), N=n)
        return found

    one, beyond, each = means("share with S = 1", "one"), means("S - 1", "more"), means("S - 1 a droplet", "more_each")
    _draw_more(out, more, n, beyond)
    last = _draw_shares(out, shares, table, n)
    counts = ", ".join(f"{int((table['n'] == m).sum())} packings of N = {m}" for m in n)
    out.caption = (
        f"Droplets at onset, taken as rigid, {counts}: (a) pairs in contact, which scatter around the 2N' - "
        "1 of disks; (b) states of self-stress of contacts of vertices with edges, "
        f"{int(table['self_stresses'].min())} or more in every packing, just one in {_of_sizes(one, n)}; (c) mean of "
        f"those beyond one: {_of_sizes(beyond, n)}; a droplet {_of_sizes(each, n, 3)}; (d) for each droplet that bears "
        f"load, N = {n[-1]}: {last}. Contacts are 3N' - 2 - F + S, with F motions left free and S states of "
        "self-stress, a count that fixes neither; disks have F = 0 and S = 1. What states beyond one consist of: "
        "docs/explanation/beyond_the_papers.md."
    )
    return out


def _of_sizes(mean: Interval, n: list[int], digits: int = 2) -> str:
    """Write means with their intervals, size by size."""
    return ", ".join(f"{write_interval(mean[k], digits)} of N = {m}" for k, m in enumerate(n))


def _draw_more(out: Drawing, axes: Any, n: list[int], mean: Interval) -> None:
    """Draw the mean number of states of self-stress beyond one against N, beside one that is proportional to N."""
    out.curve(axes, "mean", n, mean, band=False, linestyle="none", label=None, **style(1))
    ends, text = np.array([0, n[-1]]), f"as many a droplet as N = {n[-1]}"
    out.curve(axes, "as many a droplet", ends, ends * mean.value[-1] / n[-1], label=text, **FIT)
    label(axes, "N", r"mean of $S - 1$", loc="upper left")
    axes.set_ylim(0, None)
    axes.set_xlim(0, None)


def _draw_shares(out: Drawing, axes: Any, table: pd.DataFrame, n: list[int]) -> str:
    """Draw numbers for each droplet against N, keep them, and write those of the largest size."""
    for k, (column, (legend, name)) in enumerate(SHARES.items()):
        mean = out.keep(f"{name}, a droplet", mean_over_packings(groups_by(table, "n", column, n)), N=n)
        out.curve(axes, name, n, mean, band=False, label=legend, **style(k))
    axes.set_xscale("log", base=2)
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.55 * (high - low))
    label(axes, "N", "for each droplet that bears load", loc="upper left")
    axes.set_xticks(n, list(map(str, n)))
    axes.minorticks_off()
    return ", ".join(f"{name} {out.write(f'{name}, a droplet, N = {n[-1]}', 3)}" for _, name in SHARES.values())
