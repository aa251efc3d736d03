"""A study of droplets with a preferred shape: onset of jamming against the shape factor of the droplets."""

from functools import partial
from typing import Any

import numpy as np

from jamlab.errors import JamlabError
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.geometry.particle_shape import shape_factors
from jamlab.protocols.onset import jam
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import mean_over_packings
from studies.panels import PAPER, Drawing, drawing, label, scale, style
from studies.papers.statements import caption
from studies.study import Study
from studies.tables import Task

N, SEEDS = 16, 20
INDICES = (3.55, 3.65, 3.7, 3.75, 3.8, 3.85)
LAW = {"gamma": 0.0, "kl": 5.0, "kappa": 0.02}  # deformable particles: edges have rest lengths, and no line tension
# Boromand et al., Phys. Rev. Lett. 121, 248003 (2018): confluent from this shape factor p^2/(4 pi a) on
CONFLUENT, FRACTION = 1.16, 0.99


def measure_onset(index: float, seed: int) -> list[dict[str, Any]]:
    """Jam one random start of droplets that prefer a shape index."""
    row: dict[str, Any] = {"p0": index, "seed": seed, "found": 0.0, "rho": np.nan, "shape": np.nan, "z": np.nan}
    row |= {"shape_of_polygons": np.nan, "rattlers": np.nan}
    try:
        packing = jam(N, "dp", seed=seed, law={**LAW, "p0": index}, start="from-disks")
    except JamlabError:
        return [row]
    network = contacts(packing)
    row |= {"found": float(packing.converged), "rho": packing_fraction(packing), "z": network.z}
    row |= {"shape": float(shape_factors(packing, rim=True).mean()), "rattlers": float(network.rattlers.mean())}
    return [row | {"shape_of_polygons": float(shape_factors(packing, rim=False).mean())}]


def _tasks() -> dict[str, Task]:
    pairs = [(index, seed) for seed in range(1, SEEDS + 1) for index in INDICES]
    return {f"{index:g} {seed}": partial(measure_onset, index, seed) for index, seed in pairs}


def draw_onsets(tables: EnsembleTables) -> Drawing:
    """Draw onset and contact number against the shape factor of the polygons."""
    rows = tables.read("preferred-shape")
    jammed = rows[rows["found"] == 1]
    out, axes = drawing("preferred-shape", 1, 2, 4.6, 3.8)
    scale(*axes, x="linear", y="linear")
    groups = [jammed[jammed["p0"] == index] for index in INDICES]
    shapes = np.array([each["shape_of_polygons"].mean() for each in groups])
    out.curve(axes[0], "confluent, Boromand et al. 2018", [CONFLUENT] * 2, [0.8, FRACTION], **PAPER)
    for panel, column, title in zip(axes, ("rho", "z"), (r"onset $\rho_J$", "contact number $z_J$"), strict=True):
        mean = mean_over_packings([each[column].to_numpy(dtype=float) for each in groups])
        out.curve(panel, f"N = {N}", shapes, mean, band=False, **style(0))
        out.values |= {f"{column}, p0 = {index:g}": mean[k] for k, index in enumerate(INDICES)}
        label(panel, r"shape factor $\mathcal{A}$ of the polygons", title, loc="best")
    found = rows.groupby("p0")["found"].agg(["sum", "size"])
    out.caption = caption(out.name, n=N, made=int(found["size"].min()), found=int(found["sum"].min()))
    return out


STUDY = Study(
    "preferred-shape",
    "Droplets with a preferred shape: onset of jamming against their shape factor",
    _tasks(),
    draw_onsets,
)
