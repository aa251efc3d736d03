"""Draw the contacts that are missing below confluence in Boromand et al.: figs 7 and 9."""

from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import Sample, groups_by, log_places, scaled, size_law
from studies.panels import PAPER, Drawing, drawing, label, model_style, scale, size_style
from studies.papers.boromand.conventions import COMPRESSED, FRACTIONS, LARGEST, curve, curves, halves, power
from studies.papers.statements import caption, paper, statistic

CONFLUENT = (3e-3, 0.1)  # rho* - rho between which the exponent is fitted
NEAR_UNITY = (5e-3, 0.1)  # 1 - rho, likewise
PLACES = log_places(1e-6, 0.13, 4)
BELOW: dict[str, Any] = {"x": "to_confluence", "y": "missing"}


def of_sizes(tables: EnsembleTables, model: str) -> Sample:
    """Take the missing contacts of every size of the paper's, and their N."""
    n = COMPRESSED[model]
    groups, reduce = curves(tables, [(model, m) for m in n], places=PLACES, **BELOW)
    return Sample(groups, lambda drawn: (n, reduce(drawn)))


_SCALED = [{"scaled_distance": x} for x in (0.25, 2.0, 4.0)]


@statistic("B7-collapse-sp", sample=of_sizes, model="sp", variants=_SCALED)
@statistic("B7-collapse-dp", sample=of_sizes, model="dp", variants=_SCALED)
def size_exponent(n: tuple[int, ...], drawn: list[tuple[Array, Array]], scaled_distance: float = 1.0) -> float:
    """Fit the exponent of (z_conf - z) N in N where (rho* - rho) N = 1; nearest to rho* it is 2 at every N."""
    values = [m * np.interp(scaled_distance / m, x, y) for m, (x, y) in zip(n, drawn, strict=True)]
    return float(np.polyfit(np.log(n), np.log(values), 1)[0])


statistic(
    "B7-exponent-dp",
    sample=curve,
    model="dp",
    n=LARGEST["dp"],
    places=PLACES,
    low=CONFLUENT[0],
    high=CONFLUENT[1],
    variants=(*halves(*CONFLUENT), {"places": log_places(*CONFLUENT, 10)}),
    **BELOW,
)(power)
statistic(
    "B9-exponent-dp",
    sample=curve,
    model="dp",
    n=64,
    x="left",
    y="missing",
    places=log_places(5e-3, 0.13, 8),
    low=NEAR_UNITY[0],
    high=NEAR_UNITY[1],
    variants=halves(*NEAR_UNITY),
)(power)


def at_confluence(tables: EnsembleTables, model: str, n: tuple[int, ...], by: str = "z = 6") -> Sample:
    """Take the first states of packings with z >= 6, or those at onset for the distance to rho = 1: a group a size."""
    states = tables.states[tables.states["model"] == model]
    if by == "z = 6":
        full = states[states["z"] >= 6].groupby(["n", "seed"], as_index=False)[["d_rho"]].min()
        return Sample(groups_by(full, "n", "d_rho", n))
    return Sample([1 - tables.at_onset(model, m)["rho"].to_numpy() for m in n])


@statistic(
    "B9-confluence-sp",
    sample=at_confluence,
    model="sp",
    n=(32,),
    variants=[{"n": (m,)} for m in COMPRESSED["sp"][1:]] + [{"n": (m,), "by": "rho = 1"} for m in COMPRESSED["sp"]],
)
@statistic(
    "B9-confluence-dp",
    sample=at_confluence,
    model="dp",
    n=(32,),
    variants=[{"n": (m,)} for m in COMPRESSED["dp"][1:]] + [{"n": (m,), "by": "rho = 1"} for m in COMPRESSED["dp"]],
)
def mean(groups: list[Array]) -> float:
    """Average the distance from onset."""
    return float(groups[0].mean())


def left_at_confluence(tables: EnsembleTables) -> Sample:
    """Take 1 - rho* of droplets, a group a size."""
    full = tables.states[(tables.states["model"] == "dp") & (tables.states["z"] >= 6)]
    first = full.groupby(["n", "seed"], as_index=False)[["rho"]].min()
    return Sample([1 - rho for rho in groups_by(first, "n", "rho", COMPRESSED["dp"])])


@statistic("B9-limit-dp", sample=left_at_confluence, variants=({"without": 0}, {"without": 2}))
def limit_of_confluence(groups: list[Array], without: int = -1) -> float:
    """Extend 1 - rho* linearly in 1/N to large packings."""
    kept = [k for k in range(len(groups)) if k != without]
    return size_law([COMPRESSED["dp"][k] for k in kept], [groups[k] for k in kept])[0]


def figure_7(tables: EnsembleTables) -> Drawing:
    """z_conf - z against rho* - rho, and both times N."""
    out, axes = drawing("boromand-7", 2, 2, 5.0, 3.9)
    reached = []
    for model, plain, times_n in (("sp", axes[0], axes[1]), ("dp", axes[2], axes[3])):
        scale(plain, times_n)
        for n in COMPRESSED[model]:
            counts = _counts(tables.states, model, n)
            if not counts[0]:
                continue
            reached.append(f"{counts[0]} of {counts[1]} {model.upper()} of N = {n}")
            x, y = tables.curve(model, n, places=PLACES, **BELOW).band
            look = {"linestyle": "none"} | size_style(n)
            out.curve(plain, f"N = {n}", x, y, **look)
            out.curve(times_n, f"N = {n}", x * n, scaled(y, n), **look)
        if model == "sp":
            limit = paper("B7-last-contact")
            out.curve(times_n, f"paper: limit {limit:g}", [1e-3, 30], [limit, limit], **PAPER)
        else:
            out.slope(plain, paper("B7-exponent-dp"), (3e-3, 1e-1), 0.02)
        part = paper("B5-z-parts" if model == "dp" else "B5-eq13-ends")
        left = tables.states.loc[tables.states["model"] == model, "rho_star"].mean() - part
        plain.axvline(left, color="#777777", linestyle="-.", linewidth=0.9)
        name = model.upper()
        label(plain, rf"{name}: $\rho^* - \rho$", r"$z_{conf} - z$", loc="upper left")
        label(times_n, rf"{name}: $(\rho^* - \rho)\,N$", r"$(z_{conf} - z)\,N$", loc="upper left")
    out.caption = caption(out.name, reached=", ".join(reached))
    return out


def _counts(states: pd.DataFrame, model: str, n: int) -> tuple[int, int]:
    """Count the packings that have states below rho*, and all."""
    rows = states[(states["model"] == model) & (states["n"] == n)]
    return rows.loc[rows["missing"].notna(), "seed"].nunique(), rows["seed"].nunique()


def figure_9(tables: EnsembleTables) -> Drawing:
    """z(rho) and rho(A) of polygons, the curves that the paper lays over its experiments."""
    out, (a, b) = drawing("boromand-9", 1, 2, 5.0, 4.0)
    for model in ("sp", "dp"):
        look = model_style(model, linestyle="-")
        x, y = tables.curve(model, 64, "rho", "z", FRACTIONS).band
        out.curve(a, f"{model.upper()}, N = 64", x, y, **look)
        x, y = tables.curve(model, 64, "rho", "excess", FRACTIONS).band
        out.curve(b, f"{model.upper()}, N = 64", y.value, x, **look)
    label(a, r"true packing fraction $\rho$", "coordination z", loc="upper left")
    shape = r"$\mathcal{A} - 1$  (DP: $\mathcal{A} - \mathcal{A}_J$)"
    label(b, shape, r"true packing fraction $\rho$", loc="lower right")
    out.caption = caption(out.name)
    return out
