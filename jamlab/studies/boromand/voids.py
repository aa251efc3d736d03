"""Draw the voids in Boromand et al., fig 8."""

from collections.abc import Callable
from functools import partial

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import InputError, StorageError
from jamlab.geometry.voids.voids import PLATEAU_BORDER
from jamlab.plotting.palette import SIDE_COLOURS
from jamlab.statistics import published_numbers as published
from jamlab.statistics.bootstrap import Interval
from jamlab.studies.claims import Kind, vary
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.ensembles import SHARE, bootstrap, has, nearest_size
from jamlab.studies.panels import PAPER, Drawing, drawing, label, model_style

NEAR_ONSET = 0.845  # rho of the shares that the paper gives "near rho_J": its panel is over rho, rho_J is 0.842
Statistic = Callable[[Array], float]


def figure_8(tables: EnsembleTables) -> Drawing:
    """Voids: share with l sides, shape factor of those with three, mean areas."""
    counts = tables.void_counts
    out, (a, b, c) = drawing("boromand-8", 1, 3, 4.8, 4.0)
    sides, summed = tuple(published.VOID_SHARES), {}
    for model in ("sp", "dp"):
        if not has(counts, model):
            continue
        n = nearest_size(counts, model, 64)
        part = counts[(counts["model"] == model) & (counts["n"] == n)]
        x, cube = _sum_voids(part[~part["onset"].astype(bool)])
        share = bootstrap([cube], lambda g: _share(g[0], sides))
        look = (
            {"linestyle": "none", "marker": "v"}
            if model == "sp"
            else {"linestyle": "-", "marker": "D", "markersize": 3}
        )
        for k, side in enumerate(sides):
            name = f"{model.upper()}, {side} sides"
            colour = {"color": SIDE_COLOURS[side] if side != 5 else "#C9A800"}
            out.curve(a, name, x, share[:, k], **look | colour)
        mean = bootstrap([cube], lambda g: _means(g[0]))
        name = f"{model.upper()}, N = {n}"
        for k, axes in enumerate((b, c)):
            out.curve(axes, name, x, mean[:, k], **model_style(model, linestyle="-"))
        _claim_voids(out, model, n, part, x, cube, _shapes_of_laws(out, tables) if model == "dp" else "")
        summed[model] = (x, cube)
    _claim_more_triangles(out, summed)
    out.curve(b, f"paper: Plateau border, {published.PLATEAU_SHAPE.value}", [0.83, 1.0], [PLATEAU_BORDER] * 2, **PAPER)
    label(a, r"true packing fraction $\rho$", r"share $P_l$ of voids with $l$ sides", ncols=2)
    a.set_ylim(-0.02, 1.35)
    label(
        b,
        r"true packing fraction $\rho$",
        r"shape factor $\mathcal{A}$ of 3-sided voids",
        loc="upper right",
        bbox_to_anchor=(1.0, 0.93),
    )
    c.set_yscale("log")
    label(c, r"true packing fraction $\rho$", r"mean void area / particle area")
    out.caption = (
        "Voids that do not percolate; rattlers count as particles. Snapshots: boromand-8-voids. Panel c is not in the "
        "paper."
    )
    return out


def _sum_voids(part: pd.DataFrame) -> tuple[Array, Array]:
    """Sum over voids: bins of rho, and (packings, bins, sides 0 to 7+, 3) numbers, areas and shape factors."""
    seeds = np.sort(part["seed"].unique())
    held = part.groupby("rho")["seed"].nunique()
    rho = np.sort(held.index[held >= SHARE * len(seeds)])
    part = part[part["rho"].isin(rho)]
    cube = np.zeros((len(seeds), len(rho), 8, 3))
    place = (
        np.searchsorted(seeds, part["seed"]),
        np.searchsorted(rho, part["rho"]),
        np.minimum(part["sides"].to_numpy(dtype=int), 7),
    )
    np.add.at(cube, place, part[["voids", "area", "shape"]].to_numpy(dtype=np.float64))
    return np.asarray(rho, dtype=np.float64), cube


def _divide(above: Array, below: Array) -> Array:
    return np.asarray(np.divide(above, below, out=np.full(above.shape, np.nan), where=below > 0))


def _share(cube: Array, sides: tuple[int, ...]) -> Array:
    """Compute P_l (bins, sides), the share of the voids that have l sides."""
    voids = cube[..., 0].sum(axis=0)
    total = np.broadcast_to(voids.sum(axis=1, keepdims=True), (len(voids), len(sides)))
    return _divide(voids[:, list(sides)], total)


def _means(cube: Array) -> Array:
    """Compute means (bins, 2): shape factor of voids with three sides, area of all."""
    total = cube.sum(axis=0)
    return np.column_stack(
        [_divide(total[:, 3, 2], total[:, 3, 0]), _divide(total[..., 1].sum(1), total[..., 0].sum(1))]
    )


def _shapes_of_laws(out: Drawing, tables: EnsembleTables) -> str:
    """Keep A of voids between three droplets of other vertices and stiffer rims, at onset and where rho > 0.97."""
    try:
        table = tables.droplet_voids
    except (InputError, StorageError, KeyError):
        return ""
    said = []
    for (eps, vertices), rows in table.groupby(["eps", "nv_small"]):
        ends = (rows[rows["state"] == 0], rows[rows["rho"] > published.TRIANGLES_FROM])
        shapes = [
            part["shape_of_three"].sum() / part["three"].sum() if part["three"].sum() else np.nan for part in ends
        ]
        name = f"{vertices:g} vertices, rims {eps:g} times as stiff"
        out.keep(f"A of 3-sided voids at onset and above 0.97, DP, {name}", shapes, k=(0, 1))
        said.append(f"{shapes[0]:.2f} and {shapes[1]:.2f} ({name})")
    return f"; facets lower it at onset, overlap beyond: at onset and above 0.97 it is {', '.join(said)}"


def _claim_voids(out: Drawing, model: str, n: int, part: pd.DataFrame, x: Array, cube: Array, by_law: str) -> None:
    """Claim shares near onset and shapes at onset, and those of voids with three sides in dense packings."""
    big, how = model.upper(), f"N = {n}"
    near = int(np.abs(x - NEAR_ONSET).argmin())
    share = bootstrap([cube[:, near]], lambda g: _share(g[0][:, None], tuple(published.VOID_SHARES))[0])
    sides = float((cube[:, near, :, 0].sum(axis=0) @ np.arange(8)) / cube[:, near, :, 0].sum())
    out.keep(f"mean number of sides of voids, {big}", [sides], rho=[x[near]])
    for k, (side, paper) in enumerate(published.VOID_SHARES.items()):
        every = vary(partial(_share_at, side, x, cube), *({"rho": x[near] + step} for step in (-0.005, 0.005)))
        words = {"how": f"{how}, states in the bin of rho around {x[near]:.3f}; {sides:.2f} sides on average"}
        words |= {"cause": _neighbours(out, f"P_{side}, {big}", side, x, cube), "shown_by": "boromand-8 a"}
        out.claim(f"P_{side} near rho_J, {big}", share[k], paper, Kind.MEASURED, every, **words)
    triangles = float("nan")
    if part["onset"].astype(bool).any():
        _, first = _sum_voids(part[part["onset"].astype(bool)].assign(rho=0.0))
        at_onset = bootstrap([first], lambda g: _share(g[0], tuple(published.VOID_SHARES))[0])
        for k, side in enumerate(published.VOID_SHARES):
            out.keep(f"P_{side} at onset, {big}", at_onset[k])
        triangles = _triangle_shape(first.sum(axis=(0, 1)))
        if model == "sp":
            shape, text = _pool(first, _triangle_shape), "A of 3-sided voids at onset, SP"
            words = {"how": f"{how}, states at onset; between three touching disks of these sizes it is 4.871 to 4.875"}
            out.claim(text, shape, published.PLATEAU_SHAPE, Kind.IDENTITY, **words)
    if model == "sp":
        words = {"how": f"{how}, rho > 0.98", "shown_by": "boromand-8 a"}
        share_of_three = _pool(cube[:, x > 0.98], _triangle_share)
        out.claim("P_3 below rho = 1, SP", share_of_three, published.DENSE_DISK_TRIANGLES, **words)
        dense = _pool(cube[:, x > 0.98], _triangle_shape)
        out.claim("A of 3-sided voids, rho > 0.98, SP", dense, published.DENSE_DISK_TRIANGLES_SHAPE, how=how)
    else:
        _claim_dense_droplets(out, how, x, cube, triangles, by_law)


def _claim_more_triangles(out: Drawing, summed: dict[str, tuple[Array, Array]]) -> None:
    """Claim the rho from which P_3 of droplets exceeds that of disks by 0.02."""
    found, every = None, {}
    if len(summed) == 2:
        rho = np.intersect1d(summed["sp"][0], summed["dp"][0])
        cubes = [summed[model][1][:, np.isin(summed[model][0], rho)] for model in ("sp", "dp")]

        def departs(groups: list[Array], by: float = 0.02) -> float:
            sp, dp = (_share(cube, (3,))[:, 0] for cube in groups)
            less = np.flatnonzero((dp - sp)[rho < 0.95] <= by)
            k = less[-1] if len(less) else -1
            ends = dp[k : k + 2] - sp[k : k + 2]
            return float(np.interp(by, ends, rho[k : k + 2])) if 0 <= k < len(rho) - 1 else float("nan")

        found = bootstrap(cubes, departs)
        every = vary(lambda by: departs(cubes, by), {"by": 0.01}, {"by": 0.03})
    words = {"how": "bins of 0.01 in rho, excess of 0.02", "shown_by": "boromand-8 a"}
    out.claim("rho from which P_3 of DP exceeds SP", found, published.MORE_TRIANGLES, Kind.MEASURED, every, **words)


def _neighbours(out: Drawing, name: str, side: int, x: Array, cube: Array) -> str:
    """Keep a share in the first bins of rho, between which a reading off the figure may lie."""
    shares = out.keep(name, [_share(cube[:, [k]], (side,))[0, 0] for k in range(min(3, len(x)))], rho=x[:3])
    return "it is " + ", ".join(f"{share:.3f} at rho = {rho:.3f}" for share, rho in zip(shares, x[:3], strict=True))


def _share_at(side: int, x: Array, cube: Array, rho: float) -> float:
    """Interpolate P_l between the bins of rho."""
    return float(np.interp(rho, x, _share(cube, (side,))[:, 0]))


def _claim_dense_droplets(out: Drawing, how: str, x: Array, cube: Array, at_onset: float, by_law: str) -> None:
    """Claim that all voids of dense droplets have three sides, and the shape of Plateau borders."""
    dense = cube[:, x > published.TRIANGLES_FROM]
    some = np.flatnonzero(x > 0.96)
    shares = out.keep("P_3, DP", [_triangle_share(cube[:, k].sum(axis=0)) for k in some], rho=x[some])
    rises = ", ".join(f"{share:.3f} at {x[k]:.3f}" for k, share in zip(some, shares, strict=True))
    words = {
        "how": f"{how}; {rises}",
        "cause": f"P_3 = {rises}: some voids keep four sides",
        "shown_by": "boromand-8 a",
    }
    out.claim("P_3 for rho > 0.97, DP", _pool(dense, _triangle_share), published.DENSE_DROPLET_TRIANGLES, **words)
    later = (0.86, 0.9, 0.94)
    shapes = [_triangle_shape(cube[:, np.abs(x - rho).argmin()].sum(axis=0)) for rho in later]
    out.keep("A of 3-sided voids at onset, DP", at_onset)
    out.keep("A of 3-sided voids, DP", shapes, rho=later)
    falls = ", ".join(f"{shape:.2f} at {rho:g}" for rho, shape in zip(later, shapes, strict=True))
    cause = f"{at_onset:.2f} at onset, where polygons just touch, and then {falls}{by_law}"
    words = {"how": how, "cause": cause, "shown_by": "boromand-8 b, beyond-droplet-voids"}
    out.claim("A of 3-sided voids, rho > 0.97, DP", _pool(dense, _triangle_shape), published.PLATEAU_SHAPE, **words)


def _pool(cube: Array, statistic: Statistic) -> Interval | None:
    """Compute a statistic of the (sides, 3) sums over all packings and bins, with its interval; None without a bin."""
    if not cube.shape[1]:
        return None
    return bootstrap([cube], lambda g: statistic(g[0].sum(axis=(0, 1))))


def _triangle_share(total: Array) -> float:
    """Compute P_3, the share of voids with three sides."""
    return float(_divide(total[3, 0], total[:, 0].sum()))


def _triangle_shape(total: Array) -> float:
    """Compute the mean shape factor of voids with three sides."""
    return float(_divide(total[3, 2], total[3, 0]))
