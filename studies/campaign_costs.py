"""Measure what the pieces of a campaign cost: the table from which `jamlab campaign plan` estimates."""

import json
import platform
import time
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from jamlab.campaign.cost import PRESSURES, making_pieces, measuring_pieces
from jamlab.campaign.file import STATES, check_campaign
from jamlab.campaign.states import make_states
from jamlab.campaign.tasks import Parameters, batches
from jamlab.measure import numbers_of
from jamlab.storage.atomic_file import atomic_file
from studies.tables import Task, commit, measure

SEED, SEEDS, FEW = 70_001, 3, 256  # of each piece: means over three packings; from so many disks on, one
STABLE = 'ensemble = "shear-stabilized"\n'
STEPS = {
    "sp": 'compress = { by = "phi", to = 1.24, step = 0.04 }',
    "dp": 'compress = { by = "rho", to = 0.99, step = 0.03 }',
}

# keys of sweeps whose packings are timed -> sizes; of several pieces the last is timed beside the others
MAKING: dict[tuple[str, str], tuple[int, ...]] = {
    ("sp", "onset = true"): (32, 128, 512),
    ("sp", STEPS["sp"]): (32, 128, 512),
    ("sp", "phi = [0.86]"): (64, 256),
    **{("sp", f"pressures = [{p:g}]"): (64, 512, 4096) for p in PRESSURES},
    ("sp", f"{STABLE}onset = true"): (32, 128),
    ("sp", STABLE + STEPS["sp"]): (32, 128),
    **{("sp", f"{STABLE}pressures = [{p:g}]"): (64, 512) for p in PRESSURES},
    ("dp", "onset = true"): (16, 64, 128, 256),
    ("dp", STEPS["dp"]): (16, 64, 128),
}
_WAYS = "damping = { contact = [1.0], stokes = [1.0] }\n"
_OMEGA = "{ lowest = 1e-8, highest = 1e3, points = 56 }"
_SHEAR = 'observables = ["quasistatic_shear", "plastic_events", "cyclic_shear"]\n'
_SHEAR += "quasistatic_shear = { strain = 1.0, discard = 0.1, strain_step = 2e-2 }\n"
_SHEAR += "plastic_events = { strain = 0.02 }\ncyclic_shear = { amplitudes = [0.02], cycles = 5 }"
_FLOW = 'observables = ["flow", "oscillation"]\nflow = { rates = [1e-3, 1e-2, 1e-1], strain = 1.0, discard = 0.1 }\n'
_FLOW += "oscillation = { omega = [3e-3, 3e-1], amplitudes = [1e-4, 1e-2, 1e-1], cycles = 2 }"

# what is measured, of packings that are cheap to make -> sizes
MEASURING: dict[tuple[str, str], tuple[int, ...]] = {
    ("sp", 'pressures = [1e-3]\nobservables = ["states", "voids", "order", "quasistatic"]'): (64, 512, 4096),
    ("sp", f'pressures = [1e-3]\nobservables = ["spectra"]\n{_WAYS}omega = {_OMEGA}'): (64, 512, 4096),
    ("sp", 'pressures = [1e-3]\nobservables = ["correlation"]\ncorrelation_omega = [1e-6, 1e-3, 1.0]'): (
        64,
        512,
        4096,
    ),
    ("sp", f"pressures = [1e-2]\n{_SHEAR}"): (32, 128),
    ("sp", f"pressures = [1e-2]\n{_FLOW}"): (32, 128),
    ("dp", 'onset = true\nobservables = ["states", "voids", "order"]'): (16, 64),
    ("dp", f'onset = true\nobservables = ["modes"]\n{_WAYS}'): (8, 24),
}


def _parameters(model: str, n: int, seed: int, keys: str) -> Parameters:
    text = f'name = "costs"\n[[sweep]]\nname = "one"\nmodel = "{model}"\nn = {n}\nseeds = [{seed}]\n{keys}\n'
    (batch,) = batches(check_campaign(text, "costs"))
    return batch.parameters


def _seeds(n: int) -> range:
    return range(SEED, SEED + (SEEDS if n < FEW else 1))


def _seconds(run: Any) -> tuple[float, Any]:
    began = time.process_time()
    found = run()
    return time.process_time() - began, found


def time_making(model: str, n: int, keys: str) -> Iterator[dict[str, Any]]:
    """Time the packings of a sweep; of a compression, a state beyond onset."""
    for seed in _seeds(n):
        parameters = _parameters(model, n, seed, keys)
        name, before = making_pieces(parameters)[-1].name, 0.0
        if parameters.compress is not None:
            first = parameters.model_copy(update={"compress": None})
            before, _ = _seconds(partial(make_states, first))
        seconds, states = _seconds(partial(make_states, parameters))
        count = len(states.packings) - (parameters.compress is not None)
        yield {"piece": name, "n": n, "seconds": max(seconds - before, 0.0) / max(count, 1)}


def time_measuring(model: str, n: int, keys: str) -> Iterator[dict[str, Any]]:
    """Time what is measured of the packings of a sweep, table by table."""
    for seed in _seeds(n):
        parameters = _parameters(model, n, seed, keys)
        states = make_states(parameters)
        if f'"{STATES}"' in keys:
            seconds, _ = _seconds(partial(numbers_of, states.packings))
            yield {"piece": f"{model} {STATES}", "n": n, "seconds": seconds}
        count = len(states.packings)
        known = {name: np.zeros(count) for name in ("rho", "phi", "pressure", "state", "target_pressure", "rho_J")}
        for piece in measuring_pieces(parameters)[1:]:
            observable = parameters.observables[piece.name.partition(" ")[2]]
            seconds, _ = _seconds(partial(observable.measure, states, known))
            yield {"piece": piece.name, "n": n, "seconds": seconds / piece.times / count}


def tasks() -> dict[str, Task]:
    """Everything that is timed, the smallest sizes first."""
    kinds: list[tuple[Any, Mapping[tuple[str, str], tuple[int, ...]]]] = [
        (time_making, MAKING),
        (time_measuring, MEASURING),
    ]
    return {
        f"{model} {n}: {' '.join(keys.split())}": partial(how, model, n, keys)
        for rank in range(4)
        for how, table in kinds
        for (model, keys), sizes in table.items()
        if rank < len(sizes)
        for n in [sizes[rank]]
    }


def make_costs(out: Path, **how: Any) -> None:
    """Measure the table piece by piece into a CSV file beside, from which a run resumes, and write its means."""
    path = measure(out.parent, f"{out.stem}-single", tasks(), **how)
    rows = pd.read_csv(path).dropna(subset=["piece"])
    means = rows.groupby(["piece", "n"], sort=False)["seconds"].mean().reset_index()
    facts = {"commit": commit(), "date": datetime.now(UTC).date().isoformat(), "machine": platform.machine()}
    with atomic_file(out) as temporary:
        body = means.to_csv(index=False, float_format="%.3g", lineterminator="\n")
        temporary.write_text(f"# {json.dumps(facts)}\n{body}", encoding="utf-8")
