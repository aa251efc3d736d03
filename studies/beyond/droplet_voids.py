"""Draw the shape of voids between three droplets, by vertices and stiffness of rims, beside voids of equal disks."""

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.geometry.voids.voids import PLATEAU_BORDER
from jamlab.statistics.confidence import Interval
from studies.ensemble_tables import DEFAULT_LAW, LAW, PACKING, EnsembleTables
from studies.ensembles import FEWEST, bootstrap
from studies.panels import FIT, PAPER, Drawing, drawing, label, scale, style
from studies.papers.statements import caption, paper

FRACTIONS = np.array([0.84, 0.86, 0.88, 0.90, 0.92, 0.94, 0.96, 0.98])
SUMS = ["shape_of_three", "three"]  # columns whose ratio is the mean shape factor
OVERLAPS = np.geomspace(1e-8, 1e-1, 22)  # edges of bins in the overlap area of droplets over the area of the cell


def droplet_voids(tables: EnsembleTables) -> Drawing:
    """Shape factor of voids between three droplets, by vertices and stiffness, over packing fraction and overlap."""
    table = tables.droplet_voids
    packings = table.drop_duplicates(PACKING).groupby(["eps", "nv_small", "gamma"], as_index=False).size()
    laws = packings.loc[packings["size"] >= FEWEST, LAW].to_numpy(dtype=np.float64)
    if not len(laws):
        raise InputError(
            f"the table droplet_voids has no law with {FEWEST} packings: run the campaign beyond_the_papers"
        )
    out, (by_rho, by_overlap) = drawing("beyond-droplet-voids", 1, 2, 6.0, 4.4)
    scale(by_overlap, y="linear")
    for k, law in enumerate(laws):
        rows = table[np.all([np.isclose(table[name], value) for name, value in zip(LAW, law, strict=True)], axis=0)]
        stiff = (
            "" if np.isclose(law[1], DEFAULT_LAW["eps"]) else f", rims {law[1] / DEFAULT_LAW['eps']:g} times as stiff"
        )
        name = f"{law[2]:.0f}, {round(17 / 12 * law[2]):.0f} vertices{stiff}"
        mean = mean_shapes(sums_at_fractions(rows))
        out.curve(by_rho, name, FRACTIONS, mean, **style(k))
        over = mean_shapes(sums_by_overlap(rows[rows["overlap"] > 0]))
        places = np.sqrt(OVERLAPS[1:] * OVERLAPS[:-1])
        out.curve(by_overlap, name, places, over, **style(k))
        onset = rows[rows["state"] == 0].sort_values("seed")[SUMS].to_numpy(dtype=np.float64)
        out.values[f"{name}, at onset"] = mean_shapes(onset[:, None])[0]
        out.values |= {
            f"{name}, rho = {rho:g}": mean[k] for k, rho in enumerate(FRACTIONS) if np.isfinite(mean.value[k])
        }
    overlap, shape = three_disks(np.geomspace(2e-6, 0.06, 60))
    out.curve(by_overlap, "three equal disks", overlap, shape, **FIT)
    for axes, ends in ((by_rho, (0.83, 0.99)), (by_overlap, (OVERLAPS[0], OVERLAPS[-1]))):
        out.curve(axes, f"paper: Plateau border, {paper('B8-A3-dense-dp')}", ends, [PLATEAU_BORDER] * 2, **PAPER)
    shape_name = r"shape factor $\mathcal{A}$ of 3-sided voids"
    label(by_rho, r"true packing fraction $\rho$", shape_name, legend=False)
    label(by_overlap, "area that droplets share / area of the cell", shape_name, legend=False)
    out.legend_above(by_overlap, ncols=3)
    out.caption = caption(out.name, n=int(table["n"].iloc[0]))
    return out


def sums_at_fractions(rows: pd.DataFrame) -> Array:
    """Interpolate (packings, places, 2) `SUMS` between states at the `FRACTIONS`; 0 beyond them."""
    ordered = [part.sort_values("rho") for _, part in rows.groupby("seed")]
    return np.array(
        [
            np.column_stack([np.interp(FRACTIONS, part["rho"], part[name], left=0, right=0) for name in SUMS])
            for part in ordered
        ]
    )


def sums_by_overlap(rows: pd.DataFrame) -> Array:
    """Sum (packings, bins, 2) `SUMS` of each packing over its states in the bins between `OVERLAPS`."""
    place = np.searchsorted(OVERLAPS, rows["overlap"].to_numpy(dtype=np.float64)) - 1
    kept = (place >= 0) & (place < len(OVERLAPS) - 1)
    seeds, who = np.unique(rows["seed"].to_numpy()[kept], return_inverse=True)
    sums = np.zeros((len(seeds), len(OVERLAPS) - 1, 2))
    np.add.at(sums, (who, place[kept]), rows.loc[kept, SUMS].to_numpy(dtype=np.float64))
    return sums


def mean_shapes(sums: Array) -> Interval:
    """Compute mean shape factors of voids with three sides, with intervals; nan where too few packings have any."""
    few = (sums[:, :, 1] > 0).sum(axis=0) < FEWEST

    def mean(groups: list[Array]) -> Array:
        total = groups[0].sum(axis=0)
        value = np.divide(total[:, 0], total[:, 1], out=np.full(len(total), np.nan), where=total[:, 1] > 0)
        return np.where(few, np.nan, value)

    return bootstrap([sums], mean)


def three_disks(overlap: ArrayLike) -> tuple[Array, Array]:
    """Compute phi - rho and the shape factor of voids in a triangular lattice of equal disks; an overlap (m,) of two
    disks over their diameter lies below 1 - sqrt(3)/2, where voids close."""
    r = 1 - np.asarray(overlap, dtype=np.float64)
    half = np.arccos(r)  # angle from the line of centres to a corner of the lens
    arc = np.pi / 3 - 2 * half
    area = np.sqrt(3) / 4 * r**2 - 3 * arc / 8 - 0.75 * r * np.sin(half)
    cell = np.sqrt(3) / 2 * r**2
    return np.pi / 4 / cell - (1 - 2 * area / cell), (1.5 * arc) ** 2 / (4 * np.pi * area)


FIGURES = {"beyond-droplet-voids": droplet_voids}
