"""Calibrate the droplets' force law, which Boromand et al. do not print, against their tables 1 and 2.

Each of gamma, ka and delta is halved and doubled in turn, and the number of vertices is doubled; each time the same
seeds are compressed from onset to rho = 0.99, and observables are read off at fixed distances from onset. For the fit,
every observable is a sum of parabolas, one in log2 of each parameter through its three points.
"""

from collections.abc import Mapping
from contextlib import suppress
from functools import partial
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.optimize import minimize

from jamlab.arrays import Array
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import ConvergenceError, InputError
from jamlab.measure import measure
from jamlab.protocols.compression import compress
from jamlab.protocols.onset import jam
from studies.ensemble_tables import EnsembleTables
from studies.html_page import TextTable
from studies.panels import Drawing, drawing, label, style
from studies.papers.boromand.conventions import table_fit
from studies.papers.statements import paper
from studies.study import Study

FITTED = ("gamma", "ka", "delta")
N, SEEDS, CONFLUENCE = 32, 8, 0.99
CENTRE = {name: float(defaults("dp")[name]) for name in FITTED}
LAWS: dict[str, dict[str, Any]] = {"centre": CENTRE} | {
    f"{name} {side}": CENTRE | {name: factor * CENTRE[name]}
    for name in FITTED
    for side, factor in (("halved", 0.5), ("doubled", 2.0))
}
LAWS["vertices doubled"] = CENTRE | {name: 2 * defaults("dp")[name] for name in ("nv_small", "nv_large")}


class Target(NamedTuple):
    """Value of an observable in Boromand et al., and the deviation that counts as one unit of misfit."""

    value: float
    tolerance: float


TARGETS: Mapping[str, Target] = {
    **{f"z({d:g})": Target(float(paper("BT-zJ-dp") + table_fit("DP(ρ)", "z")(d)), 0.1) for d in (0.05, 0.1)},
    **{f"g({d:g})": Target(g := float(table_fit("DP(ρ)", "G")(d)), 0.1 * g) for d in (0.05, 0.1, 0.15)},
    "shape": Target(paper("B4-A-confluence-dp"), 0.01),
    "area lost": Target(0.0, 0.01),  # fig 11 c: constant
}


def measure_law(name: str, seed: int) -> list[dict[str, Any]]:
    """Observables of one packing with one law; nan where a state is unstable, or the sweep ends before confluence."""
    states = [jam("dp", N, seed, **LAWS[name])]
    with suppress(ConvergenceError):  # where the sweep ends
        for state in compress(states[0], CONFLUENCE, 0.01, nearest=1e-3):
            states.append(state)
    rows = [measure(state, ("rho", "z", "g", "shape", "area")) for state in states]
    return [{"law": name, "seed": seed, **read_off(pd.DataFrame(rows))}]


def read_off(states: pd.DataFrame) -> dict[str, float]:
    """Observables of the states of one sweep: z and g at distances from onset, shape and lost area at confluence."""
    found, last = {"rho_J": float(states["rho"].iloc[0])}, states.iloc[-1]
    for name in TARGETS:
        if "(" in name:
            column, distance = name[0], float(name[2:-1])
            known = states[np.isfinite(states[column])]
            x, y = known["rho"] - found["rho_J"], known[column]
            found[name] = float(np.interp(distance, x, y, left=np.nan, right=np.nan)) if len(known) > 2 else np.nan
    confluent = last["rho"] > CONFLUENCE - 0.002
    ends = {"shape": last["shape"], "area lost": 1 - last["area"] / states["area"].iloc[0]}
    return found | (ends if confluent else dict.fromkeys(ends, np.nan))


def fit(means: pd.DataFrame) -> tuple[dict[str, float], Array]:
    """Find gamma, ka and delta within a factor of 2 of the centre that bring the mean observables (laws, observables)
    closest to `TARGETS`, and the observables there."""
    names, (target, tolerance) = list(TARGETS), np.array(list(TARGETS.values())).T
    values = means.reindex([law for law in LAWS if "vertices" not in law])[names].to_numpy(dtype=np.float64)
    if not np.isfinite(values).all():
        row, column = np.argwhere(~np.isfinite(values))[0]
        raise InputError(f"{names[column]} of law {list(LAWS)[row]!r} was not measured: run all seeds")
    at_centre, halved, doubled = values[0], values[1::2], values[2::2]  # x = 0, -1 and 1 in log2 of each parameter
    slope, bend = 0.5 * (doubled - halved), 0.5 * (doubled + halved) - at_centre

    def predict(x: Array) -> Array:
        return np.asarray(at_centre + x @ slope + x**2 @ bend)

    def misfit(x: Array) -> float:
        return float(np.mean(((predict(x) - target) / tolerance) ** 2))

    # the sum of squares may have several minima: start at the centre and half-way to each corner
    starts = [np.zeros(3), *(0.5 * np.array(list(product((-1, 1), repeat=3))))]
    best = min((minimize(misfit, x, bounds=[(-1, 1)] * 3) for x in starts), key=lambda found: found.fun).x
    return {name: CENTRE[name] * 2**x for name, x in zip(FITTED, best, strict=True)}, predict(best)


def draw_calibration(tables: EnsembleTables) -> Drawing:
    """Draw what every law changes, in tolerances, beside the law that comes closest to the paper."""
    means = tables.read("droplet-calibration").groupby("law").mean(numeric_only=True)
    law, predicted = fit(means)
    out, (axes,) = drawing("droplet-calibration", 1, 1, 8.0, 4.5)
    places = np.arange(len(TARGETS))
    target, tolerance = np.array(list(TARGETS.values())).T
    for k, (name, row) in enumerate(means.iterrows()):
        off = (row[list(TARGETS)].to_numpy(dtype=np.float64) - target) / tolerance
        out.curve(axes, str(name), places, off, linestyle="none", **style(k))
    out.curve(axes, "fit", places, (predicted - target) / tolerance, color="black")
    axes.set_xticks(places, list(TARGETS))
    label(axes, "observable", "deviation from the paper, tolerances", loc="best", ncols=3)
    for name, value in law.items():
        out.keep(name, value)
    out.text = [TextTable(["law", *means], [[str(name), *(f"{v:.4g}" for v in row)] for name, row in means.iterrows()])]
    out.caption = f"{N} droplets, {SEEDS} seeds; parameters halved and doubled in turn."
    return out


STUDY = Study(
    "droplet-calibration",
    "Line tension, stiffness and rim of droplets that meet tables 1 and 2 of Boromand et al.",
    {f"{law}, seed {seed}": partial(measure_law, law, seed) for seed in range(1, SEEDS + 1) for law in LAWS},
    draw_calibration,
)
