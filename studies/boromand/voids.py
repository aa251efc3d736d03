"""Draw the voids in Boromand et al., fig 8."""

from collections.abc import Callable

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import InputError, StorageError
from jamlab.geometry.voids.voids import PLATEAU_BORDER
from jamlab.plotting.palette import SIDE_COLOURS
from jamlab.statistics.bootstrap import Interval
from studies import published_numbers as published
from studies.claims import Kind, write_interval, write_list
from studies.ensemble_tables import EnsembleTables, at_onset_by_law, of_usual_size
from studies.ensembles import SHARE, Varied, bootstrap, has, nearest_size, part_of, unmeasured, vary_bootstrap
from studies.panels import PAPER, Drawing, drawing, label, model_style

NEAR_ONSET = 0.845  # rho of the shares that the paper gives "near rho_J": its panel is over rho, rho_J is 0.842
Statistic = Callable[[Array], float]


def figure_8(tables: EnsembleTables) -> Drawing:
    """Voids: share with l sides, shape factor of those with three, mean areas."""
    counts = tables.void_counts
    out, (a, b, c) = drawing("boromand-8", 1, 3, 4.8, 4.0)
    sides, summed, first = tuple(published.VOID_SHARES), {}, {}
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
        start = part[part["onset"].astype(bool)]
        first[model] = _sum_voids(start.assign(rho=0.0))[1] if len(start) else None
        _claim_voids(out, model, how=f"N = {n}", first=first[model], x=x, cube=cube)
        if model == "sp":
            _claim_dense_disks(out, f"N = {n}", x, cube)
        else:
            _claim_dense_droplets(out, f"N = {n}", x, cube, first[model], _shapes_of_laws(out, tables))
        summed[model] = (x, cube)
    _claim_more_triangles(out, summed)
    _claim_same_at_onset(out, summed, [first.get(model) for model in ("sp", "dp")], _share_by_vertices(out, tables))
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
        table = of_usual_size(tables.droplet_voids)
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


def _claim_voids(out: Drawing, model: str, *, how: str, first: Array | None, x: Array, cube: Array) -> None:
    """Claim shares near onset, and the shape of voids between three disks at onset."""
    big = model.upper()
    near = int(np.abs(x - NEAR_ONSET).argmin())

    def shares(drawn: list[Array], rho: float = float(x[near])) -> Array:
        """Interpolate P_l between the bins of rho."""
        return np.array([np.interp(rho, x, share) for share in _share(drawn[0], tuple(published.VOID_SHARES)).T])

    varied = vary_bootstrap([cube], shares, *({"rho": float(x[near]) + step} for step in (-0.005, 0.005)))
    sides = float((cube[:, near, :, 0].sum(axis=0) @ np.arange(8)) / cube[:, near, :, 0].sum())
    out.keep(f"mean number of sides of voids, {big}", [sides], rho=[x[near]])
    for k, (side, paper) in enumerate(published.VOID_SHARES.items()):
        words = {"how": f"{how}, states in the bin of rho around {x[near]:.3f}; {sides:.2f} sides on average"}
        words |= {"cause": _neighbours(out, f"P_{side}, {big}", side, x, cube), "shown_by": "boromand-8 a"}
        found, every = part_of(varied, k)
        out.claim(f"P_{side} near rho_J, {big}", found, paper, family=every, **words)
    if first is None:
        return
    at_onset = bootstrap([first], lambda g: _share(g[0], tuple(published.VOID_SHARES))[0])
    for k, side in enumerate(published.VOID_SHARES):
        out.keep(f"P_{side} at onset, {big}", at_onset[k])
    if model == "sp":
        shape, text = _pool(first, _triangle_shape), "A of 3-sided voids at onset, SP"
        how = f"{how}, states at onset; between three touching disks of these sizes it is 4.871 to 4.875"
        out.claim(text, shape, published.PLATEAU_SHAPE, kind=Kind.IDENTITY, how=how)


def _claim_dense_disks(out: Drawing, how: str, x: Array, cube: Array) -> None:
    """Claim that some voids of dense disks have more than three sides, and the shape of those with three."""
    for text, statistic, paper in (
        ("P_3 below rho = 1, SP", _triangle_share, published.DENSE_DISK_TRIANGLES),
        ("A of 3-sided voids, rho > 0.98, SP", _triangle_shape, published.DENSE_DISK_TRIANGLES_SHAPE),
    ):
        found, every = _beyond(x, cube, statistic, 0.98, {"beyond": 0.97}, {"beyond": 0.99})
        out.claim(text, found, paper, family=every, how=f"{how}, rho > 0.98", shown_by="boromand-8 a and b")


def _beyond(x: Array, cube: Array, statistic: Statistic, rho: float, *choices: dict[str, float]) -> Varied:
    """Compute a statistic of all voids beyond a rho, with its interval, and between others."""

    def between(drawn: list[Array], beyond: float = rho, up_to: float = np.inf) -> float:
        return statistic(drawn[0][:, (x > beyond) & (x < up_to)].sum(axis=(0, 1)))

    return vary_bootstrap([cube], between, *choices)


def _share_by_vertices(out: Drawing, tables: EnsembleTables) -> str:
    """Keep P_3 at onset of droplets of the largest size with more vertices, and write it; "" where none is known."""
    try:
        rows = tables.droplet_voids
    except (InputError, StorageError, KeyError):
        return ""
    said = []
    for n, law, part in at_onset_by_law(rows):
        sums = part[["three", "voids"]].to_numpy(dtype=np.float64)
        share = bootstrap([sums], lambda g: g[0][:, 0].sum() / g[0][:, 1].sum())
        found = out.keep(f"P_3 at onset, DP, N = {n:g}, {law}", share)
        said.append(f"{write_interval(found, 3)} with {law} at N = {n:g}")
    return f"it is {', '.join(said)}" if said else ""


def _claim_same_at_onset(
    out: Drawing, summed: dict[str, tuple[Array, Array]], first: list[Array | None], by_vertices: str
) -> None:
    """Claim that shares at onset are those of the other model, and that triangles of droplets come from squares."""
    (apart, near), (rise, later), cause = unmeasured(), unmeasured(), by_vertices
    if len(summed) == 2:
        (x, sp), (u, dp) = (summed[model] for model in ("sp", "dp"))

        def less(groups: list[Array], side: int = 3) -> float:
            return float(_share(groups[1], (side,))[0, 0] - _share(groups[0], (side,))[0, 0])

        def at(rho: float, groups: list[Array]) -> list[Array]:
            return [cube[:, [int(np.abs(bins - rho).argmin())]] for bins, cube in zip((x, u), groups, strict=True)]

        def traded(groups: list[Array], rho: float = 0.925) -> float:
            there = at(rho, groups)
            rise = less(there)
            return -less(there, 4) / rise if rise else float("nan")

        known = [cube for cube in first if cube is not None]
        if len(known) == 2:
            apart = bootstrap(known, less)
            shares = write_list([_share(cube, (3,))[0, 0] for cube in known], ".3f")
            cause = f"disks and droplets have {shares}" + (f"; {by_vertices}" if by_vertices else "")
        near = {f"rho = {NEAR_ONSET:g}": bootstrap(at(NEAR_ONSET, [sp, dp]), less)}
        rise, later = vary_bootstrap([sp, dp], traded, {"rho": 0.905}, {"rho": 0.945})
    words = {"how": "states at onset", "cause": cause, "shown_by": "boromand-8 a, beyond-droplet-voids"}
    out.claim("P_3 at onset, DP less SP", apart, published.SAME_VOIDS, family=near, **words)
    text, words = "fall of P_4 over rise of P_3, DP less SP", {"how": "bin of rho at 0.925", "shown_by": "boromand-8 a"}
    out.claim(text, rise, published.TRIANGLES_FOR_SQUARES, family=later, **words)


def _claim_more_triangles(out: Drawing, summed: dict[str, tuple[Array, Array]]) -> None:
    """Claim the rho from which P_3 of droplets exceeds that of disks by 0.02."""
    found, every = unmeasured()
    if len(summed) == 2:
        rho = np.intersect1d(summed["sp"][0], summed["dp"][0])
        cubes = [summed[model][1][:, np.isin(summed[model][0], rho)] for model in ("sp", "dp")]

        def departs(groups: list[Array], by: float = 0.02) -> float:
            sp, dp = (_share(cube, (3,))[:, 0] for cube in groups)
            less = np.flatnonzero((dp - sp)[rho < 0.95] <= by)
            k = less[-1] if len(less) else -1
            ends = dp[k : k + 2] - sp[k : k + 2]
            return float(np.interp(by, ends, rho[k : k + 2])) if 0 <= k < len(rho) - 1 else float("nan")

        found, every = vary_bootstrap(cubes, departs, {"by": 0.01}, {"by": 0.03})
    words = {"how": "bins of 0.01 in rho, excess of 0.02", "shown_by": "boromand-8 a"}
    out.claim("rho from which P_3 of DP exceeds SP", found, published.MORE_TRIANGLES, family=every, **words)


def _neighbours(out: Drawing, name: str, side: int, x: Array, cube: Array) -> str:
    """Keep a share in the first bins of rho, between which a reading off the figure may lie."""
    shares = out.keep(name, [_share(cube[:, [k]], (side,))[0, 0] for k in range(min(3, len(x)))], rho=x[:3])
    return "it is " + ", ".join(f"{share:.3f} at rho = {rho:.3f}" for share, rho in zip(shares, x[:3], strict=True))


def _claim_dense_droplets(out: Drawing, how: str, x: Array, cube: Array, first: Array | None, by_law: str) -> None:
    """Claim that all voids of dense droplets have three sides, and the shape of Plateau borders."""
    some = np.flatnonzero(x > 0.96)
    shares = out.keep("P_3, DP", [_triangle_share(cube[:, k].sum(axis=0)) for k in some], rho=x[some])
    rises = ", ".join(f"{share:.3f} at {x[k]:.3f}" for k, share in zip(some, shares, strict=True))
    words = {"how": f"{how}; {rises}", "cause": f"P_3 = {rises}: some voids keep four sides"}
    start = published.TRIANGLES_FROM
    found, every = _beyond(x, cube, _triangle_share, start, {"beyond": 0.98}, {"up_to": start + 0.01})
    text, paper = "P_3 for rho > 0.97, DP", published.DENSE_DROPLET_TRIANGLES
    out.claim(text, found, paper, family=every, shown_by="boromand-8 a", **words)
    later = (0.86, 0.9, 0.94)
    shapes = [_triangle_shape(cube[:, np.abs(x - rho).argmin()].sum(axis=0)) for rho in later]
    at_onset = float("nan") if first is None else _triangle_shape(first.sum(axis=(0, 1)))
    out.keep("A of 3-sided voids at onset, DP", at_onset)
    out.keep("A of 3-sided voids, DP", shapes, rho=later)
    falls = ", ".join(f"{shape:.2f} at {rho:g}" for rho, shape in zip(later, shapes, strict=True))
    cause = f"{at_onset:.2f} at onset, where polygons just touch, and then {falls}{by_law}"
    words = {"how": how, "cause": cause, "shown_by": "boromand-8 b, beyond-droplet-voids"}
    found, every = _beyond(x, cube, _triangle_shape, start, *({"beyond": rho} for rho in (0.85, 0.9, 0.98)))
    out.claim("A of 3-sided voids, rho > 0.97, DP", found, published.PLATEAU_SHAPE, family=every, **words)


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
