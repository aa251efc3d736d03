"""A study of a Couette cell: the velocity of disks between rough walls, and the stress on these, against the rate."""

from functools import partial
from typing import Any

import numpy as np

from jamlab.flow.quasistatic_shear import quasistatic_shear
from jamlab.flow.shear import shear
from jamlab.flow.velocity_profile import velocity_profile
from jamlab.geometry.walls import slab, with_walls
from jamlab.plotting import in_unit
from jamlab.protocols.target_pressure import pack
from jamlab.statistics.confidence import Interval
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import mean_over_packings
from studies.panels import Drawing, drawing, label, scale, style
from studies.papers.statements import caption
from studies.study import Study
from studies.tables import Task

PARTICLES, PRESSURE, STRAIN, STEP, KEPT = 512, 1e-2, 0.4, 1e-2, 0.1
RATES = (0.0, 1e-2, 1e-1)  # 0: quasi-static
PLACES = np.linspace(0.05, 0.95, 10)  # across the slab
SEEDS = 20


def measure_profile(rate: float, seed: int) -> list[dict[str, Any]]:
    """Shear a slab: velocity at some places across it, stress on either wall, and localisation, beyond strain 0.1."""
    walled = with_walls(pack(PARTICLES, PRESSURE, seed))
    if rate:
        run: Any = shear(walled, rate, STRAIN, rows=40, snapshot_every=KEPT)
    else:
        run = quasistatic_shear(walled, STRAIN, STEP, snapshot_every=KEPT)
    between, height = slab(walled), walled.box[1, 1]
    profile = velocity_profile(run.frames[1:])
    across = between.bottom + PLACES * (between.top - between.bottom)
    found = np.interp(across, profile.height * height, profile.velocity)
    lower, upper = run.wall_stress[run.strain >= KEPT - 1e-9, :, 0].mean(axis=0)
    facts = {"rate": rate, "seed": seed, "lower": lower, "upper": upper, "localisation": profile.localisation}
    facts["fraction"] = slab(run.packing).packing_fraction
    return [{**facts, "place": s, "velocity": v} for s, v in zip(PLACES, found, strict=True)]


def _tasks() -> dict[str, Task]:
    pairs = [(rate, seed) for seed in range(1, SEEDS + 1) for rate in RATES]
    return {f"{rate:g} {seed}": partial(measure_profile, rate, seed) for rate, seed in pairs}


def draw_profiles(tables: EnsembleTables) -> Drawing:
    """Draw velocity across the slab, and stress on the walls and localisation against the rate."""
    rows = tables.read("couette")
    out, axes = drawing("couette", 1, 3, 4.4, 3.6)
    scale(axes[0], axes[1], axes[2], x="linear", y="linear")
    single = rows.drop_duplicates(["rate", "seed"])
    names = [f"rate {rate:g}" if rate else "quasi-static" for rate in RATES]
    for k, rate in enumerate(RATES):
        wide = rows[rows["rate"] == rate].pivot_table(index="seed", columns="place", values="velocity")
        out.curve(axes[0], names[k], wide.columns, mean_over_packings(list(wide.to_numpy().T)), **style(k))
    for k, column in enumerate(("lower", "upper", "localisation")):
        found = mean_over_packings([single.loc[single["rate"] == rate, column].to_numpy() for rate in RATES])
        axis, places = axes[1 + (column == "localisation")], np.arange(len(RATES)) + 0.06 * (k % 2)
        out.curve(axis, column, places, found, band=False, linestyle="none", **style(k))
        axis.set_xticks(range(len(RATES)), names)
        for each, name in enumerate(names):
            out.values[f"{column}, {name}"] = Interval(found.value[each], found.low[each], found.high[each])
    label(axes[0], "place across the slab", "velocity over velocity of the upper edge", loc="best")
    label(axes[1], "", in_unit("shear stress on the wall", "k"), loc="best")
    label(axes[2], "", "localisation", loc="best")
    numbers = {"n": PARTICLES, "p": PRESSURE, "made": single.groupby("rate")["seed"].nunique().min(), "strain": STRAIN}
    out.caption = caption(out.name, **numbers, apart=float((single["lower"] / single["upper"] - 1).abs().max()))
    return out


STUDY = Study("couette", "A Couette cell: velocity profiles against the rate", _tasks(), draw_profiles)
