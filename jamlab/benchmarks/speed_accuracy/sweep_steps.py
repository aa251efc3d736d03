"""Compare steps of the search for onset, and of a sweep above it."""

import time

import numpy as np

from jamlab.benchmarks.speed_accuracy.trial import Topic, Trial
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import ConvergenceError
from jamlab.measure import measure
from jamlab.packing.packing import Packing
from jamlab.protocols.compression import compress
from jamlab.protocols.onset import jam

_TO = 0.92


def measure_trials(quick: bool) -> list[Trial]:
    """Measure phi_J of the same seeds against the paper's steps of 1e-4; z and G of a sweep against steps of 5e-4."""
    return _measure_onsets(quick) + _measure_sweeps(quick)


def _measure_onsets(quick: bool) -> list[Trial]:
    n, seeds = (16, range(1, 3)) if quick else (32, range(1, 11))
    first = float(defaults("onset")["step"])
    ways = [("bisection", step) for step in (5e-2, first, 2e-3, 5e-4)]
    ways.append(("paper", 1e-3 if quick else float(defaults("onset")["step_paper"])))
    phi, seconds, failed = {}, {}, {}
    for way in ways:
        began = time.process_time()
        values = [_find_phi_j(n, seed, *way) for seed in seeds]
        seconds[way] = (time.process_time() - began) / len(seeds)
        phi[way], failed[way] = np.array(values), int(np.isnan(values).sum())
    reference = np.nanmean(phi[ways[-1]])
    spread = np.nanstd(phi[ways[-1]], ddof=1) / np.sqrt(len(seeds))
    found = []
    for way in ways[:-1]:
        error = abs(float(np.nanmean(phi[way]) - reference))
        note = f"{len(seeds)} seeds: the mean of the reference is known to {spread:.1g}"
        if failed[way]:
            note += f"; {failed[way]} without onset"
        found.append(Trial("mean phi_J", way[0], f"{way[1]:g}", seconds[way], error, way[1] == first, note))
    return found


def _find_phi_j(n: int, seed: int, search: str, step: float) -> float:
    try:
        return jam("sp", n, seed, search=search, step=step).phi
    except ConvergenceError:
        return float("nan")


def _measure_sweeps(quick: bool) -> list[Trial]:
    steps = (0.05, 0.01) if quick else (0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3)
    onsets = [
        jam("sp", 32 if quick else 64, seed, ensemble="shear-stabilized") for seed in ((1,) if quick else (1, 2, 3))
    ]
    references = [_sweep(onset, 2e-3 if quick else 5e-4)[1] for onset in onsets]
    found = []
    for step in steps:
        runs = [_sweep(onset, step) for onset in onsets]
        seconds = float(np.mean([took for took, _ in runs]))
        for name, key in (("z", "z"), ("G", "g")):
            off = [abs(row[key] - ref[key]) for (_, row), ref in zip(runs, references, strict=True)]
            scale = 1.0 if key == "z" else float(np.mean([ref[key] for ref in references]))
            panel = f"{name} at rho = {_TO}" + (", relative" if key == "g" else "")
            found.append(Trial(panel, "compress", f"{step:g}", seconds, float(np.mean(off)) / scale, step == 1e-3))
    return found


def _sweep(onset: Packing, step: float) -> tuple[float, dict[str, float]]:
    began = time.process_time()
    for packing in compress(onset, _TO, step):
        last = packing
    return time.process_time() - began, measure(last)


TOPIC = Topic(
    "Steps of compression",
    "mean error",
    "phi_J: search='paper', steps of 1e-4 all the way, same seeds; z, G: a sweep in steps of 5e-4 (quick: 2e-3)",
    measure_trials,
    "The default step of a sweep, 1e-3, is the spacing of the states wanted, not a matter of accuracy: where only the "
    "last state counts, larger steps do as well until the packing rearranges.",
)
