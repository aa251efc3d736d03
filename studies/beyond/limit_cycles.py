"""A study of cyclic quasi-static shear: which packings of disks end in a limit cycle, how soon, and of what period."""

from functools import partial
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.flow.quasistatic_shear import quasistatic_shear
from jamlab.protocols.target_pressure import pack
from jamlab.statistics.confidence import Interval
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import bootstrap, mean_over_packings
from studies.panels import Drawing, drawing, label, scale, style
from studies.papers.statements import caption
from studies.study import Study
from studies.tables import Task

PARTICLES, SEEDS, CYCLES, STEPS = 32, 20, 15, 8  # steps of a quarter of a cycle
PRESSURE, AMPLITUDES = 1e-2, (0.03, 0.06, 0.09, 0.12, 0.16)  # at constant area
HELD, AMPLITUDE = (1e-2, 1e-3), 0.04  # pressures that are held
PUBLISHED = 0.11  # amplitude at which transients diverge: Regev et al., Nat. Commun. 6, 8805 (2015), figure 3


def measure_cycles(amplitude: float, pressure: float, held: bool, seed: int) -> list[dict[str, Any]]:
    """Shear one packing to and fro until it repeats, or for so many cycles."""
    how: dict[str, Any] = {"pressure": "constant"} if held else {}
    turns = [amplitude, -amplitude, amplitude]
    run = quasistatic_shear(pack(PARTICLES, pressure, seed), turns, amplitude / STEPS, cycles=CYCLES, **how)
    found, limit = run.cycles, run.limit_cycle
    row = {"held": int(held), "pressure": pressure, "amplitude": amplitude, "seed": seed, "cycles": len(found)}
    row |= {"period": run.period, "first": found.displacement[0], "last": found.displacement[-1]}
    row |= {"missed": int((~run.converged).sum())}
    if limit is None:
        return [row]
    row |= {"transient": limit.transient, "distance": limit.distance, "events": limit.events / limit.period}
    row |= {"hysterons": len(limit.hysterons) / limit.period, "dissipated": limit.dissipated / limit.period}
    return [row]


def _tasks() -> dict[str, Task]:
    seeds = range(1, SEEDS + 1)
    free = [(a, PRESSURE, False, seed) for seed in seeds for a in AMPLITUDES]
    held = [(AMPLITUDE, p, True, seed) for seed in seeds for p in HELD]
    return {f"{a:g} {p:g} {h:d} {seed}": partial(measure_cycles, a, p, h, seed) for a, p, h, seed in free + held}


def _half(groups: list[Array]) -> float:
    """Amplitude up to which half of the packings become periodic; nan if it is not crossed."""
    share = [float(np.mean(group)) for group in groups]
    beyond = np.flatnonzero(np.array(share) < 0.5)
    if not len(beyond) or beyond[0] == 0:
        return float("nan")
    k = int(beyond[0])
    return AMPLITUDES[k - 1] + (AMPLITUDES[k] - AMPLITUDES[k - 1]) * (share[k - 1] - 0.5) / (share[k - 1] - share[k])


def draw_cycles(tables: EnsembleTables) -> Drawing:
    """Draw the share of packings that repeat and their transients over the amplitude, and their periods."""
    rows = tables.read("limit-cycles")
    free, held = rows[rows["held"] == 0], rows[rows["held"] == 1]
    out, axes = drawing("limit-cycles", 1, 4, 4.3, 3.6)
    scale(axes[0], axes[1], axes[3], x="linear", y="linear")
    scale(axes[2], x="linear")
    groups = [free[free["amplitude"] == a] for a in AMPLITUDES]
    periodic = [(each["period"] > 0).to_numpy(dtype=float) for each in groups]
    out.curve(axes[0], f"within {CYCLES} cycles", AMPLITUDES, mean_over_packings(periodic), band=False, **style(0))
    axes[0].axvline(PUBLISHED, color="k", linestyle="--", linewidth=0.8, label="Regev et al. 2015")
    out.values["amplitude of a share of 1/2"] = bootstrap(periodic, _half)
    whole = [each[each["period"] > 0] for each in groups]
    kept = [k for k, each in enumerate(whole) if len(each) >= 5]
    places = [AMPLITUDES[k] for k in kept]
    for k, (column, name) in enumerate((("transient", "cycles before"), ("period", "period"))):
        found = mean_over_packings([whole[j][column].to_numpy(dtype=float) for j in kept])
        out.curve(axes[1], name, places, found, band=False, **style(k))
    for k, column in enumerate(("events", "hysterons")):
        found = mean_over_packings([whole[j][column].to_numpy(dtype=float) for j in kept])
        out.curve(axes[3], f"{column} a cycle", places, found, band=False, **style(k))
    for k, column in enumerate(("first", "last")):
        found = mean_over_packings([each[column].to_numpy() for each in groups])
        out.curve(axes[2], f"{column} cycle", AMPLITUDES, found, band=False, **style(k))
    for p in HELD:
        limits = held[(held["pressure"] == p) & (held["period"] > 0)]
        longer = mean_over_packings([(limits["period"] > 1).to_numpy(dtype=float)])
        out.values[f"share with period above 1, p = {p:g}"] = Interval(longer.value[0], longer.low[0], longer.high[0])
        every = mean_over_packings([(held.loc[held["pressure"] == p, "period"] > 0).to_numpy(dtype=float)])
        out.values[f"share that repeats, p = {p:g}"] = Interval(every.value[0], every.low[0], every.high[0])
    titles = ("share that repeats", "cycles", "displacement a cycle", "number")
    for part, title in zip(axes, titles, strict=True):
        label(part, r"amplitude $\gamma_0$", title, loc="best")
    numbers = {"n": PARTICLES, "p": PRESSURE, "made": free.groupby("amplitude")["seed"].nunique().min()}
    out.caption = caption(
        out.name, **numbers, most=CYCLES, off=rows["distance"].max(), missed=int(rows["missed"].max())
    )
    return out


STUDY = Study("limit-cycles", "Limit cycles of packings that are sheared to and fro", _tasks(), draw_cycles)
