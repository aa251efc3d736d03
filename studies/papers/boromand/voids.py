"""Draw voids in Boromand et al., fig 8: shares by number of sides, shape, area; and droplets of other parameters."""

from functools import cache
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.geometry.voids.voids import PLATEAU_BORDER
from jamlab.plotting import in_unit
from jamlab.plotting.palette import SIDE_COLOURS
from studies.ensemble_tables import ALL_LAW, EnsembleTables
from studies.ensembles import SHARE, Sample, bootstrap, mean_over_packings, select
from studies.panels import PAPER, Drawing, drawing, label, model_style, style
from studies.papers.boromand.conventions import SUBTRACTED, table_fit
from studies.papers.statements import caption, paper

N = 64  # of fig 8
SIDES = (3, 4, 5, 6)  # whose shares the paper gives
NEAR_ONSET = 0.845  # rho of the shares that it gives "near rho_J": its panel is over rho, rho_J is 0.842
LEAST = 2  # packings of a law that is drawn
PANELS: dict[str, tuple[str, float, float]] = {  # column -> name, what the paper has, half width of its band
    "void_090": (r"$\mathcal{A}_3$ at $\rho = 0.90$", paper("B8-A3-dense-dp"), 0.05),
    "void_098": (r"$\mathcal{A}_3$ at $\rho = 0.98$", paper("B8-A3-dense-dp"), 0.05),
    "rho_star": (r"$\rho^*$, where $z = 6$", 1.0, 0.005),
    "g": (in_unit(r"$G$ at $\Delta\rho = 0.15$", "ε/l²"), float(table_fit("DP(ρ)", "G")(0.15)), 0.02),
    "shape_factor": (r"mean $\mathcal{A}$ at $\rho = 0.99$", paper("B4-A-099-dp"), 0.005),
    "z_010": (r"$z$ at $\Delta\rho = 0.1$", float(SUBTRACTED + table_fit("DP(ρ)", "z")(0.1)), 0.02),
}


@cache
def void_sums(tables: EnsembleTables, model: str, onset: bool) -> tuple[Array, Array]:
    """Sum over voids: bins of rho, and (packings, bins, sides 0 to 7+, 3) numbers, areas and shape factors."""
    part = select(tables.void_counts, model=model, n=N)
    part = part[part["at_onset"].astype(bool) == onset]
    part = part.assign(rho=0.0) if onset else part
    held = part.groupby("rho")["seed"].nunique()
    return _sum_voids(part, np.sort(held.index[held >= SHARE * part["seed"].nunique()]))


def _sum_voids(part: pd.DataFrame, rho: Array) -> tuple[Array, Array]:
    seeds = np.sort(part["seed"].unique())
    part = part[part["rho"].isin(rho)]
    cube = np.zeros((len(seeds), len(rho), 8, 3))
    sides = np.minimum(part["sides"].to_numpy(dtype=int), 7)
    place = (np.searchsorted(seeds, part["seed"]), np.searchsorted(rho, part["rho"]), sides)
    np.add.at(cube, place, part[["voids", "area", "shape_factor"]].to_numpy(dtype=np.float64))
    return np.asarray(rho, dtype=np.float64), cube


def _divide(above: Array, below: Array) -> Array:
    return np.asarray(np.divide(above, below, out=np.full(above.shape, np.nan), where=below > 0))


def shares(cube: Array, *sides: int) -> Array:
    """Compute P_l (bins, sides), the share of the voids that have l sides."""
    voids = cube[..., 0].sum(axis=0)
    total = np.broadcast_to(voids.sum(axis=1, keepdims=True), (len(voids), len(sides)))
    return _divide(voids[:, list(sides)], total)


def triangle_share(total: Array) -> Array:
    """Compute P_3, the share of voids with three sides, of sums (..., sides, 3)."""
    return _divide(total[..., 3, 0], total[..., 0].sum(axis=-1))


def triangle_shape(total: Array) -> Array:
    """Compute the mean shape factor of voids with three sides, of sums (..., sides, 3)."""
    return _divide(total[..., 3, 2], total[..., 3, 0])


# numbers --------------------------------------------------------------------------------------------------------------


def of_model(tables: EnsembleTables, model: str, rims: float = 1.0) -> Sample:
    """Take bins of rho and the sums over voids of one model; of droplets also with rims of another width."""
    own = rims == 1
    rho, cube = void_sums(tables, model, onset=False) if own else of_rims(tables.read("droplet-rims"), rims)
    return Sample([cube], lambda drawn: (rho, drawn[0]))


def of_rims(rows: pd.DataFrame, width: float) -> tuple[Array, Array]:
    """Sum over voids that rims of another width bound, the same that `void_sums` gives."""
    part = select(rows, width=width)
    return _sum_voids(part, np.sort(part["rho"].unique()))


def shares_near(rho: Array, cube: Array, at: float = NEAR_ONSET) -> Array:
    """Interpolate P_3 to P_6 between the bins of rho."""
    return np.array([np.interp(at, rho, share) for share in shares(cube, *SIDES).T])


def beyond(rho: Array, cube: Array, of: str, low: float, high: float = np.inf) -> Array:
    """Compute the share or the shape factor of voids with three sides, of all voids between two rho."""
    return {"share": triangle_share, "shape": triangle_shape}[of](cube[:, (rho > low) & (rho < high)].sum(axis=(0, 1)))


def of_both(tables: EnsembleTables, rho: float = np.nan) -> Sample:
    """Take the sums over voids of disks and of droplets at onset, or in the bins nearest to a rho."""
    found = [void_sums(tables, model, np.isnan(rho)) for model in ("sp", "dp")]
    if np.isnan(rho):
        return Sample([cube for _, cube in found])
    return Sample([cube[:, [int(np.abs(bins - rho).argmin())]] for bins, cube in found])


def less(groups: list[Array], sides: int = 3) -> float:
    """Subtract P_3 of disks from P_3 of droplets."""
    return float(shares(groups[1], sides)[0, 0] - shares(groups[0], sides)[0, 0])


def traded(groups: list[Array]) -> float:
    """Divide the fall of P_4 by the rise of P_3, from disks to droplets."""
    rise = less(groups)
    return -less(groups, 4) / rise if rise else float("nan")


def in_shared_bins(tables: EnsembleTables) -> Sample:
    """Take the bins of rho that both models have, and their sums over voids."""
    (x, sp), (u, dp) = (void_sums(tables, model, onset=False) for model in ("sp", "dp"))
    rho = np.intersect1d(x, u)
    return Sample([sp[:, np.isin(x, rho)], dp[:, np.isin(u, rho)]], lambda drawn: (rho, *drawn))


def departs(rho: Array, sp: Array, dp: Array, by: float = 0.02) -> float:
    """Find rho from which P_3 of droplets exceeds P_3 of disks by 0.02, in bins of 0.01."""
    excess = shares(dp, 3)[:, 0] - shares(sp, 3)[:, 0]
    same = np.flatnonzero(excess[rho < 0.95] <= by)
    k = same[-1] if len(same) else -1
    return float(np.interp(by, excess[k : k + 2], rho[k : k + 2])) if 0 <= k < len(rho) - 1 else float("nan")


# drawing --------------------------------------------------------------------------------------------------------------


def figure_8(tables: EnsembleTables) -> Drawing:
    """Voids: share with l sides, shape factor of those with three, mean areas."""
    out, (a, b, c) = drawing("boromand-8", 1, 3, 4.8, 4.0)
    for model in ("sp", "dp"):
        rho, cube = void_sums(tables, model, onset=False)
        share = bootstrap([cube], lambda g: shares(g[0], *SIDES))
        marks: dict[str, Any] = {"linestyle": "none" if model == "sp" else "-", "marker": "v" if model == "sp" else "D"}
        for k, sides in enumerate(SIDES):
            colour = {"color": SIDE_COLOURS[sides] if sides != 5 else "#C9A800"}
            out.curve(a, f"{model.upper()}, {sides} sides", rho, share[:, k], **marks | colour)
        mean = bootstrap([cube], lambda g: _shape_and_area(g[0].sum(axis=0)))
        for k, axes in enumerate((b, c)):
            out.curve(axes, f"{model.upper()}, N = {N}", rho, mean[:, k], **model_style(model, linestyle="-"))
    border = f"paper: Plateau border, {paper('B8-A3-dense-dp')}"
    out.curve(b, border, [0.83, 1.0], [PLATEAU_BORDER] * 2, **PAPER)
    a.set_ylim(-0.02, 1.35)
    c.set_yscale("log")
    fraction = r"true packing fraction $\rho$"
    below: dict[str, Any] = {"loc": "upper right", "bbox_to_anchor": (1.0, 0.93)}
    label(a, fraction, r"share $P_l$ of voids with $l$ sides", ncols=2)
    label(b, fraction, r"shape factor $\mathcal{A}$ of 3-sided voids", **below)
    label(c, fraction, r"mean void area / particle area")
    return out


def _shape_and_area(total: Array) -> Array:
    """Compute means (bins, 2): shape factor of voids with three sides, area of all."""
    return np.column_stack([triangle_shape(total), _divide(total[..., 1].sum(axis=-1), total[..., 0].sum(axis=-1))])


def droplet_laws(tables: EnsembleTables) -> Drawing:
    """Voids, confluence, modulus and shape of droplets for every set of parameters, beside what the paper prints."""
    table = tables.droplet_laws
    table = table[(table["n"] == N) & table["void_090"].notna()]
    table = table.assign(ratio=table["gamma"] * table["delta"] / table["eps"])
    kinds = table[["delta", "nv_small"]].drop_duplicates().sort_values(["nv_small", "delta"])
    out, axes = drawing("boromand-8-laws", 2, 3, 4.4, 3.6)
    for part, (column, (name, value, half)) in zip(axes, PANELS.items(), strict=True):
        part.set_xscale("log")
        part.axhspan(value - half, value + half, color="#DCE9F5", zorder=0)
        for k, (delta, vertices) in enumerate(kinds.to_numpy()):
            rows = table[(table["delta"] == delta) & (table["nv_small"] == vertices)].dropna(subset=[column])
            groups = [(ratio, v.to_numpy()) for ratio, v in rows.groupby("ratio")[column] if len(v) >= LEAST]
            look: dict[str, Any] = style(k) | {"linestyle": "-" if vertices == 12 else "--"}
            text = rf"$\delta = {delta:g}$, {vertices:.0f} vertices"
            found = mean_over_packings([v for _, v in groups]) if groups else np.empty(0)
            out.curve(part, text, [ratio for ratio, _ in groups], found, band=False, **look)
        label(part, r"$\gamma\delta/\epsilon$, tension over stiffness of rims", name, legend=False)
    out.legend_above(axes[0])
    packings = table.groupby(list(ALL_LAW)).size().loc[lambda count: count >= LEAST]
    out.caption = caption(out.name, n=N, sets=len(packings), least=packings.min(), most=packings.max())
    return out
