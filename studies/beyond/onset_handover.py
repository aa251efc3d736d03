"""A study of why droplets that take the place of disks jam higher: other disks around them, and disks alone."""

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.engine.deck_defaults import numbers
from jamlab.errors import ConvergenceError
from jamlab.models.droplets import free_area
from jamlab.packing.packing import Packing
from jamlab.protocols.makings import making_of
from jamlab.protocols.of_droplets import carried_up
from jamlab.protocols.onset import onset_above
from jamlab.protocols.onset_search import OnsetWork
from jamlab.protocols.random_start import droplet_cell, droplet_params, free_diameters, place_droplets, random_disks
from jamlab.statistics.confidence import Interval
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import bootstrap, select
from studies.panels import Drawing, drawing, label, style, write_interval
from studies.papers.statements import caption
from studies.study import Study

N, BLOCK, SEEDS = 32, 10, 300
CIRCUMSCRIBED = 0.0  # in place of a width


@dataclass(frozen=True)
class Way:
    """How particles come to 0.80."""

    model: str
    wider: float  # diameter of the disks over that of disks of the same area as the particles
    step: float  # of phi beyond `phi_near`
    words: str
    seeds: int = SEEDS


WAYS = {
    "fine": Way("dp", CIRCUMSCRIBED, 2e-3, "droplets, circumscribed disks, steps of 0.002"),
    "equal": Way("dp", 1.0, 1e-2, "droplets, disks of their area", 200),
    "wider": Way("dp", 1.04, 1e-2, "droplets, disks 4 % wider than of equal area", 150),
    "disks": Way("sp", 1.0116, 1e-2, "disks, in the place of disks 1.2 % wider", 200),
}


def measure_onsets(name: str, first: int) -> list[dict[str, Any]]:
    """Measure the onsets of ten random starts."""
    seeds = range(first, first + BLOCK)
    return [{"way": name, "seed": seed, **_onset(WAYS[name], seed)} for seed in seeds]


def _onset(way: Way, seed: int) -> dict[str, float]:
    loose = _droplets(way, seed) if way.model == "dp" else _disks(way, seed)
    found = {"phi_J": np.nan, "reached": loose.phi}
    try:
        work = OnsetWork(making_of(way.model).way, None)
        found["phi_J"] = onset_above(loose, numbers("onset")["search_step"], False, "fixed-box", None, 1, work).phi
    except ConvergenceError:
        pass
    return found


def _fractions(step: float) -> Array:
    low, near, high, usual = (
        numbers("onset")[name] for name in ("phi_start", "phi_near", "phi_carried", "search_step")
    )
    coarse = np.linspace(low, high, round((high - low) / usual) + 1)
    if step == usual:
        return coarse
    coarse = coarse[coarse < near + 1e-9]
    return np.concatenate([coarse, np.arange(coarse[-1] + step, high + 1e-9, step)])


def _carried(holders: Packing, step: float) -> Packing:
    loose = carried_up(holders, _fractions(step))
    assert loose is not None
    return loose


def _droplets(way: Way, seed: int) -> Packing:
    nv, params = droplet_params(N)
    disks = random_disks(N, seed, phi=numbers("onset")["phi_start"])
    scale = droplet_cell(nv, params, numbers("onset")["phi_start"]) / disks.box[0, 0]
    wide = way.wider * np.sqrt(4 / np.pi * free_area(nv, params)) if way.wider else free_diameters(nv, params)
    holders = disks.with_state(box=disks.box * scale, positions=disks.positions * scale, diameters=wide)
    loose = _carried(holders, way.step)
    return place_droplets(loose.positions, loose.box, nv, params, seed)


def _disks(way: Way, seed: int) -> Packing:
    disks = random_disks(N, seed, phi=numbers("onset")["phi_start"])
    loose = _carried(disks.with_state(diameters=way.wider * disks.disk_diameters), way.step)
    return loose.with_state(diameters=disks.disk_diameters)


def differences(rows: pd.DataFrame, usual: pd.DataFrame) -> Interval:
    """Difference of the mean onset from that of other packings of the same seeds."""
    pairs = rows.set_index("seed")["phi_J"].dropna().to_frame("one").join(usual.set_index("seed")["phi_J"], how="inner")
    return bootstrap([pairs.to_numpy(dtype=np.float64)], lambda g: (g[0][:, 0] - g[0][:, 1]).mean())


def draw_handover(tables: EnsembleTables) -> Drawing:
    """Onset of droplets that other disks carried to 0.80, and of disks that were wider on the way."""
    rows, onset = tables.read("onset-handover"), tables.onset
    out, (axes,) = drawing("onset-handover", 1, 1, 7.2, 3.4)
    names = [name for name in WAYS if (rows["way"] == name).any()]
    for k, name in enumerate(names):
        own, model = select(rows, way=name), WAYS[name].model
        usual = select(onset, model=model, n=N)
        found = differences(own, usual)
        out.values[f"{name} less {'disks' if model == 'sp' else 'from-disks'}"] = found
        out.curve(axes, name, [1e3 * float(found.value)], [len(names) - k], label=None, **style(k))
        axes.plot(1e3 * np.array([found.low, found.high]), [len(names) - k] * 2, color=style(k)["color"])
        reached = own["reached"] > own["reached"].max() - 1e-3
        for arrived, part in ((True, own[reached]), (False, own[~reached])):
            if len(part) >= 30:
                out.values[f"{name}, {'to 0.80' if arrived else 'disks jam before'}"] = differences(part, usual)
        text = (
            f"{WAYS[name].words}: {write_interval(Interval(found.value * 1e3, found.low * 1e3, found.high * 1e3), 1)}"
        )
        axes.annotate(
            text,
            (1e3 * float(found.value), len(names) - k),
            (0, 7),
            textcoords="offset points",
            ha="center",
            fontsize=9,
        )
    axes.axvline(0.0, color="#777777", linewidth=0.9, linestyle=":")
    axes.set_yticks([])
    axes.set_ylim(0.5, len(names) + 0.8)
    axes.margins(x=0.9)
    label(
        axes, r"difference of mean $\phi_J$ from usual hand-over (disks: from usual disks), $10^{-3}$", "", legend=False
    )
    made = [f"{(rows['way'] == name).sum()}" for name in names]
    out.caption = caption(out.name, n=N, made=", ".join(made))
    return out


STUDY = Study(
    "onset-handover",
    "Onset of droplets by the disks whose place they take",
    {f"{name} {s}": partial(measure_onsets, name, s) for name, w in WAYS.items() for s in range(1, w.seeds + 1, BLOCK)},
    draw_handover,
)
