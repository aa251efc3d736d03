"""Draw what holds droplets at onset: why pairs in contact scatter around 2N' - 1, and what does not."""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from jamlab.errors import InputError
from jamlab.figures.papers.beyond_rows import say
from jamlab.figures.papers.ensembles import bootstrap, groups_by, sampled_sizes
from jamlab.figures.papers.panels import Drawing, drawing, label, size_style, style
from jamlab.figures.papers.tables import COUNTS, EnsembleTables

Array = NDArray[np.float64]

SHARES = {"free": "motions left free", "flats": "pairs that share two contacts", "extra": r"pairs beyond $2N' - 1$"}


def droplet_contacts(tables: EnsembleTables) -> Drawing:
    """Contacts of droplets at onset: pairs, contacts of vertices, states of self-stress and motions left free."""
    table = counts_at_onset(tables.onset)
    n = sampled_sizes(table, "dp")
    out, (pairs, stresses, shares) = drawing("beyond-droplet-contacts", 1, 3, 4.4, 3.9)
    for size in n:
        rows, look = table[table["n"] == size], size_style(size) | {"linestyle": "-"}
        for axes, column in ((pairs, "beyond"), (stresses, "self_stresses")):
            share = rows[column].value_counts(normalize=True).sort_index()
            out.curve(axes, f"N = {size} ({len(rows)})", share.index, share.to_numpy(), **look)
    label(pairs, r"pairs in contact beyond $2N' - 1$", "share of packings", loc="upper left")
    label(stresses, "states of self-stress", "share of packings", loc="upper right")
    for axes in (pairs, stresses):
        axes.set_ylim(0, 1.35 * axes.get_ylim()[1])
    said = _draw_shares(out, shares, table, n)
    one = bootstrap([(table["self_stresses"] == 1).to_numpy(dtype=np.float64)], lambda g: g[0].mean())
    least = int(table["self_stresses"].min())
    out.caption = (
        f"Droplets at onset, taken as rigid, {len(table)} packings: (a) pairs in contact, which scatter around the "
        f"2N' - 1 of disks; (b) states of self-stress of the contacts of vertices with edges, {least} or more in every "
        f"packing, one in {say(one)} of them; (c) for each droplet that bears load, N = {n[-1]}: {', '.join(said)}. "
        "Contacts of vertices are 3N' - 2, less the motions left free, and the states of self-stress."
    )
    return out


def counts_at_onset(onset: pd.DataFrame) -> pd.DataFrame:
    """Rows of droplets with the counts of `held_motions`; beyond, flats, free, extra: see the figure.

    Raises:
        InputError: there are none.
    """
    rows = onset[onset["model"] == "dp"]
    if not set(COUNTS) <= set(rows.columns) or rows[list(COUNTS)].dropna().empty:
        raise InputError(
            "the table onset has no counts of contacts: add 'jamlab.mechanics.held_motions:count_motions' to the "
            "observables of the campaign, or use the reference data"
        )
    rows = rows.dropna(subset=list(COUNTS))
    rows = rows[rows["load_bearing"] > 0]
    held, beyond = rows["load_bearing"], rows["pairs"] - (2 * rows["load_bearing"] - 1)
    return rows.assign(
        beyond=beyond,
        extra=beyond / held,
        free=rows["free_motions"] / held,
        flats=(rows["site_contacts"] - rows["pairs"]) / held,
    )


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
