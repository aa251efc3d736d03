"""A study of cyclic quasi-static shear: which packings of disks end in a limit cycle, how soon, and of what period."""

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

PARTICLES, SEEDS, CYCLES, STEPS = 32, 20, 15, 6  # steps of a quarter of a cycle
PRESSURE, AMPLITUDES = 1e-2, (0.03, 0.06, 0.11, 0.16)  # at constant area


def measure_cycles(amplitude: float, seed: int) -> list[dict[str, Any]]:
    """Shear one packing cyclically until a state returns, or for so many cycles."""
    turns = [amplitude, -amplitude, amplitude]
    run = quasistatic_shear(pack(PARTICLES, PRESSURE, seed), turns, amplitude / STEPS, cycles=CYCLES)
    found, limit = run.cycles, run.limit_cycle
    row: dict[str, Any] = {"amplitude": amplitude, "seed": seed, "cycles": len(found)}
    row |= {"period": run.period, "first": found.displacement[0], "last": found.displacement[-1]}
    row |= {"missed": int((~run.converged).sum())}
    if limit is None:
        return [row]
    row |= {"transient": limit.cycles_before, "distance": limit.distance, "events": limit.events / limit.period}
    row |= {"hysterons": len(limit.hysterons) / limit.period, "dissipated": limit.dissipated / limit.period}
    return [row]


def _tasks() -> dict[str, Task]:
    pairs = [(a, seed) for seed in range(1, SEEDS + 1) for a in AMPLITUDES]
    return {f"{a:g} {seed}": partial(measure_cycles, a, seed) for a, seed in pairs}


def draw_cycles(tables: EnsembleTables) -> Drawing:
    """Draw the share of packings that repeat and their transients over the amplitude, and their periods."""
    rows = tables.read("limit-cycles")
    out, axes = drawing("limit-cycles", 2, 2, 4.6, 3.6)
    scale(axes[0], axes[1], axes[3], x="linear", y="linear")
    scale(axes[2], x="linear")
    groups = [rows[rows["amplitude"] == a] for a in AMPLITUDES]
    periodic = [(each["period"] > 0).to_numpy().astype(np.float64) for each in groups]
    out.curve(axes[0], f"within {CYCLES} cycles", AMPLITUDES, mean_over_packings(periodic), band=False, **style(0))
    axes[0].set_ylim(0, 1.05)
    found = mean_over_packings(periodic)
    out.values[f"share that repeats, amplitude {AMPLITUDES[-1]:g}"] = Interval(
        found.value[-1], found.low[-1], found.high[-1]
    )
    whole = [each[each["period"] > 0] for each in groups]
    kept = [k for k, each in enumerate(whole) if len(each) >= 5]
    places = [AMPLITUDES[k] for k in kept]
    for k, (column, name) in enumerate((("transient", "before the limit cycle"), ("period", "its period"))):
        found = mean_over_packings([whole[j][column].to_numpy(dtype=float) for j in kept])
        out.curve(axes[1], name, places, found, band=False, **style(k))
    for k, (column, name) in enumerate(
        (("events", "steps with an event"), ("hysterons", "pairs that undo each other"))
    ):
        found = mean_over_packings([whole[j][column].to_numpy(dtype=float) for j in kept])
        out.curve(axes[3], name, places, found, band=False, **style(k))
    for k, column in enumerate(("first", "last")):
        found = mean_over_packings([each[column].to_numpy() for each in groups])
        out.curve(axes[2], f"{column} cycle", AMPLITUDES, found, band=False, **style(k))
    limits = rows[rows["period"] > 0]
    longer = mean_over_packings([(limits["period"] > 1).to_numpy().astype(np.float64)])
    out.values["share of limit cycles of period above 1"] = Interval(longer.value[0], longer.low[0], longer.high[0])
    titles = ("share that repeats", "cycles", in_unit("displacement a cycle", "d"), "number a cycle")
    for part, title in zip(axes, titles, strict=True):
        label(part, r"amplitude $\gamma_0$", title, loc="best")
    numbers = {"n": PARTICLES, "p": PRESSURE, "made": rows.groupby("amplitude")["seed"].nunique().min()}
    out.caption = caption(
        out.name, **numbers, steps=STEPS, most=CYCLES, off=rows["distance"].max(), missed=int(rows["missed"].max())
    )
    return out


STUDY = Study("limit-cycles", "Limit cycles of packings under cyclic shear", _tasks(), draw_cycles)
