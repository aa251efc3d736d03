"""A study of outlines of droplets: shape factor of voids between three by the width of the rims that bound them."""

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.geometry.voids.voids import PLATEAU_BORDER, voids
from jamlab.packing.packing import Packing
from jamlab.protocols.compression import compress
from jamlab.protocols.onset import jam
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import bootstrap
from studies.panels import PAPER, Drawing, drawing, label, style
from studies.papers.boromand.voids import N, of_rims, triangle_shape
from studies.papers.statements import caption, paper
from studies.study import Study

SEEDS = range(1, 21)
FRACTIONS = (0.975, 0.985)  # centres of two bins of rho where the paper has voids with three sides alone
WIDTHS = (0.96, 0.98, 1.0, 1.02, 1.04)  # of rims that bound a void, over those that repel


def measure_rims(seed: int) -> Iterator[dict[str, Any]]:
    """Count voids of one packing by sides, with the sums of areas and shape factors, for each width of rims."""
    left = list(FRACTIONS)
    for state in compress(jam(N, "dp", seed), FRACTIONS[-1] + 1e-3):
        if left and packing_fraction(state) > left[0] - 1e-4:
            rho = left.pop(0)
            for width in WIDTHS:
                for row in _by_sides(state, width):
                    yield {"seed": seed, "rho": rho, "width": width, **row}


def _by_sides(packing: Packing, width: float) -> Iterator[dict[str, Any]]:
    found = voids(packing.with_state(params={**packing.params, "delta": width * packing.params["delta"]}))
    for sides in np.unique(found.sides):
        of = found.sides == sides
        sums = {"area": found.area[of].sum(), "shape_factor": found.shape_factor[of].sum()}
        yield {"sides": int(sides), "voids": int(of.sum()), **sums}


def draw_rims(tables: EnsembleTables) -> Drawing:
    """Draw the mean shape factor of voids with three sides against the width of rims, at each packing fraction."""
    rows = tables.read("droplet-rims")
    out, (axes,) = drawing("droplet-rims", 1, 1, 5.4, 4.2)
    for k, rho in enumerate(FRACTIONS):
        cubes = [of_rims(rows[rows["rho"] == rho], width)[1] for width in WIDTHS]
        mean = bootstrap(cubes, lambda drawn: np.array([triangle_shape(cube.sum(axis=(0, 1))) for cube in drawn]))
        out.curve(axes, rf"$\rho = {rho:g}$", WIDTHS, mean, band=False, **style(k))
        out.values |= {f"A, rho = {rho:g}, rims of {w:g}": mean[j] for j, w in enumerate(WIDTHS)}
    border = f"paper: Plateau border, {paper('B8-A3-dense-dp')}"
    out.curve(axes, border, [WIDTHS[0], WIDTHS[-1]], [PLATEAU_BORDER] * 2, **PAPER)
    label(axes, r"width of rims that bound voids / $\delta$", r"shape factor $\mathcal{A}$ of 3-sided voids")
    out.caption = caption(out.name, n=N, packings=rows["seed"].nunique())
    return out


STUDY = Study(
    "droplet-rims",
    "Outlines of droplets: shape factor of voids between three, by the width of the rims that bound them",
    {f"{seed}": partial(measure_rims, seed) for seed in SEEDS},
    draw_rims,
)
