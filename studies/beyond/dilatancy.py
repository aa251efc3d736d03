"""A study of shear at constant pressure: how a packing of disks dilates, and the stress ratio at which it yields."""

from functools import partial
from typing import Any

import numpy as np

from jamlab.flow.quasistatic_shear import quasistatic_shear
from jamlab.plotting import in_unit
from jamlab.protocols.target_pressure import pack
from jamlab.statistics.confidence import Interval
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import mean_over_packings
from studies.panels import Drawing, drawing, label, scale, style
from studies.papers.statements import caption
from studies.study import Study
from studies.tables import Task

PARTICLES, STRAIN, STEP, ROWS = 64, 0.4, 1e-2, 20
PRESSURES = (1e-3, 3e-3, 1e-2)
STEADY = 0.2  # strain from which on means are taken
SEEDS, BLOCK = 20, 2  # packings of a pressure, and of one task


def measure_dilatancy(pressure: float, first: int) -> list[dict[str, Any]]:
    """Shear packings at their pressure: strain, growth of the area, stress over pressure and z_all on the way."""
    rows = []
    for seed in range(first, first + BLOCK):
        run = quasistatic_shear(pack(PARTICLES, pressure, seed), STRAIN, STEP, pressure="constant")
        off = float(np.abs(run.pressure / pressure - 1).max())
        for k in np.linspace(0, len(run.strain) - 1, ROWS + 1).round().astype(int):
            row = {"strain": run.strain[k], "dilation": run.dilation[k], "ratio": run.stress[k] / pressure}
            row |= {"z_all": run.z_all[k], "phi": run.frames[0].phi / (1 + run.dilation[k])}
            rows.append({"pressure": pressure, "seed": seed, **row, "off": off, "missed": int((~run.converged).sum())})
    return rows


def _tasks() -> dict[str, Task]:
    starts = range(1, SEEDS + 1, BLOCK)
    return {f"{p:g} {first}": partial(measure_dilatancy, p, first) for first in starts for p in PRESSURES}


def draw_dilatancy(tables: EnsembleTables) -> Drawing:
    """Draw dilation and stress ratio over strain, and the steady stress ratio and packing fraction over pressure."""
    rows = tables.read("dilatancy")
    out, axes = drawing("dilatancy", 1, 4, 4.3, 3.6)
    scale(axes[2], axes[3], y="linear")
    steady: dict[str, list[Any]] = {"ratio": [], "phi": []}
    for k, pressure in enumerate(PRESSURES):
        table = rows[rows["pressure"] == pressure]
        for axis, column in zip(axes, ("dilation", "ratio"), strict=False):
            wide = table.pivot_table(index="seed", columns="strain", values=column)
            out.curve(axis, f"p = {pressure:g}", wide.columns, mean_over_packings(list(wide.to_numpy().T)), **style(k))
        for column, means in steady.items():
            means.append(table[table["strain"] >= STEADY].groupby("seed")[column].mean().to_numpy())
    for axis, (column, means) in zip(axes[2:], steady.items(), strict=True):
        found = mean_over_packings(means)
        out.curve(axis, f"strain above {STEADY:g}", PRESSURES, found, band=False, **style(0))
        for k, pressure in enumerate(PRESSURES):
            out.values[f"steady {column}, p = {pressure:g}"] = Interval(found.value[k], found.low[k], found.high[k])
    label(axes[0], r"strain $\gamma$", r"dilation $A/A_0 - 1$", loc="best")
    label(axes[1], r"strain $\gamma$", r"stress ratio $\sigma/p$", loc="best")
    label(axes[2], in_unit("pressure $p$", "k"), r"steady $\sigma/p$", loc="best")
    label(axes[3], in_unit("pressure $p$", "k"), r"steady $\phi$", loc="best")
    numbers = {"n": PARTICLES, "made": rows.groupby("pressure")["seed"].nunique().min(), "step": STEP}
    out.caption = caption(out.name, **numbers, off=rows["off"].max(), missed=int(rows["missed"].max()))
    return out


STUDY = Study("dilatancy", "Dilatancy and yield at constant pressure", _tasks(), draw_dilatancy)
