"""Draw the contacts that are missing below confluence in Boromand et al.: figs 7 and 9."""

from typing import Any

import numpy as np
import pandas as pd

from studies.ensemble_tables import EnsembleTables
from studies.ensembles import Sample, groups_by, log_places, size_law
from studies.panels import PAPER, Drawing, drawing, label, model_style, scale
from studies.papers.boromand.conventions import (
    BELOW,
    COMPRESSED,
    FRACTIONS,
    LARGEST,
    SUBTRACTED,
    Curve,
    curve,
    curves,
    draw_sizes,
    halves,
    mean,
    power,
    table_fit,
)
from studies.papers.statements import caption, paper, statistic

CONFLUENT = (3e-3, 0.1)  # rho* - rho between which the exponent is fitted
NEAR_UNITY = (5e-3, 0.1)  # 1 - rho, likewise
BY_SIZE: dict[str, Any] = {"x": "to_confluence", "y": "missing"}
MISSING = BY_SIZE | {"places": BELOW}
LEFT: dict[str, Any] = {"x": "left", "y": "missing", "places": log_places(5e-3, 0.13, 8)}


def size_exponent(*drawn: Curve, model: str, scaled_distance: float = 1.0) -> float:
    """Fit the exponent of (z_conf - z) N in N where (rho* - rho) N = 1; nearest to rho* it is 2 at every N."""
    n = COMPRESSED[model]
    values = [m * np.interp(scaled_distance / m, x, y) for m, (x, y) in zip(n, drawn, strict=True)]
    return float(np.polyfit(np.log(n), np.log(values), 1)[0])


def at_confluence(tables: EnsembleTables, model: str, n: tuple[int, ...], by: str = "z = 6") -> Sample:
    """Take distances from onset of the first states of packings with z >= 6, or of rho = 1: a group a size."""
    if by == "z = 6":
        return Sample(groups_by(first_full(tables, model), "n", "d_rho", n))
    return Sample([1 - tables.at_onset(model, m)["rho"].to_numpy() for m in n])


def first_full(tables: EnsembleTables, model: str) -> pd.DataFrame:
    """Find the first states of packings with z >= 6."""
    full = tables.states[(tables.states["model"] == model) & (tables.states["z"] >= 6)]
    return full.groupby(["n", "seed"], as_index=False)[["rho", "d_rho"]].min()


for _model, _n in COMPRESSED.items():
    _kinds, _scaled = [(_model, n) for n in _n], [{"scaled_distance": x} for x in (0.25, 2.0, 4.0)]
    statistic(f"B7-collapse-{_model}", sample=curves, kinds=_kinds, model=_model, variants=_scaled, **MISSING)(
        size_exponent
    )
    _others = [{"n": (n,)} for n in _n[1:]] + [{"n": (n,), "by": "rho = 1"} for n in _n]
    statistic(f"B9-confluence-{_model}", sample=at_confluence, model=_model, n=(32,), variants=_others)(mean)
for _id, _m, _what, _window, _more in (
    ("B7-exponent-dp", LARGEST["dp"], MISSING, CONFLUENT, [{"places": log_places(*CONFLUENT, 10)}]),
    ("B9-exponent-dp", 64, LEFT, NEAR_UNITY, []),
):
    _of: dict[str, Any] = {"model": "dp", "n": _m, "low": _window[0], "high": _window[1], **_what}
    statistic(_id, sample=curve, variants=[*halves(*_window), *_more], **_of)(power)


def left_at_confluence(tables: EnsembleTables) -> Sample:
    """Take 1 - rho* of droplets, a group a size."""
    return Sample([1 - rho for rho in groups_by(first_full(tables, "dp"), "n", "rho", COMPRESSED["dp"])])


@statistic("B9-limit-dp", sample=left_at_confluence, variants=({"without": 0}, {"without": 2}))
def limit_of_confluence(groups: list[Any], without: int = -1) -> float:
    """Extend 1 - rho* linearly in 1/N to large packings."""
    kept = [k for k in range(len(groups)) if k != without]
    return size_law([COMPRESSED["dp"][k] for k in kept], [groups[k] for k in kept])[0]


def figure_7(tables: EnsembleTables) -> Drawing:
    """z_conf - z against rho* - rho, and both times N."""
    out, axes = drawing("boromand-7", 2, 2, 5.0, 3.9)
    states, reached = tables.states, []
    for model, plain, times_n in (("sp", axes[0], axes[1]), ("dp", axes[2], axes[3])):
        scale(plain, times_n)
        draw_sizes(out, plain, tables, model, **BY_SIZE)
        draw_sizes(out, times_n, tables, model, power=1, **BY_SIZE)
        rows = states[states["model"] == model]
        for n in COMPRESSED[model]:
            seeds = [part.loc[part["n"] == n, "seed"].nunique() for part in (rows[rows["missing"].notna()], rows)]
            reached.append(f"{seeds[0]} of {seeds[1]} {model.upper()} of N = {n}")
        if model == "sp":
            limit = paper("B7-last-contact")
            out.curve(times_n, f"paper: limit {limit:g}", [1e-3, 30], [limit, limit], **PAPER)
        else:
            out.slope(plain, paper("B7-exponent-dp"), (3e-3, 1e-1), 0.02)
        part = paper("B5-z-parts" if model == "dp" else "B5-eq13-ends")
        plain.axvline(rows["rho_star"].mean() - part, color="#777777", linestyle="-.", linewidth=0.9)
        name = model.upper()
        label(plain, rf"{name}: $\rho^* - \rho$", r"$z_{conf} - z$", loc="upper left")
        label(times_n, rf"{name}: $(\rho^* - \rho)\,N$", r"$(z_{conf} - z)\,N$", loc="upper left")
    out.caption = caption(out.name, reached=", ".join(reached))
    return out


def figure_9(tables: EnsembleTables) -> Drawing:
    """Contacts and shape of droplets, which the paper lays over its experiments, and how contacts go to 6."""
    out, (a, b, c) = drawing("boromand-9", 1, 3, 4.6, 4.0)
    scale(c)
    look, name = model_style("dp", linestyle="-"), "DP, N = 64"
    out.curve(a, name, *tables.curve("dp", 64, "rho", "z", FRACTIONS).band, **look)
    onset, fit = paper("BT-rhoJ-dp"), table_fit("DP(ρ)", "z")
    rho = np.linspace(onset + 1e-4, 1.0, 60)
    out.curve(a, "paper: fit of table 1", rho, SUBTRACTED + fit(rho - onset), **PAPER)
    a.axhline(6.0, color="#777777", linewidth=0.9, linestyle=":")
    x, y = tables.curve("dp", 64, "rho", "shape", FRACTIONS).band
    out.curve(b, name, y.value - 1, x, **look)
    out.curve(c, name, *tables.curve("dp", 64, **LEFT).band, **look)
    out.slope(c, paper("B9-exponent-dp"), (8e-3, 0.03), 0.2)
    label(a, r"true packing fraction $\rho$", "coordination z", loc="upper left")
    label(b, r"shape factor $\mathcal{A} - 1$", r"true packing fraction $\rho$", loc="lower right")
    label(c, r"$1 - \rho$", r"$z_{conf} - z$", loc="upper left")
    return out
