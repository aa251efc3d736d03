"""Measure how far simpler models of flow are off: linear spectrum, equivalent damping, linear drag at another rate.

Five kinds of packings: a few on a grid of conditions make the table; many, with linear drag alone, say how often one
rearranges early, which a few cannot; others, at random conditions, check what is promised; others say how much worse
errors are where sliding is damped less or more than approach, and others again check that.
"""

import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from jamlab.errors import ConvergenceError, InputError
from jamlab.estimates.flow_errors import (
    BACKGROUND,
    CALIBRATE,
    CHECK,
    COLUMNS,
    MANY,
    SIZE,
    SLIDING,
    SLIDING_BETAS,
    SLIDING_CHECK,
    STOKES,
    Flow,
    FlowErrors,
    mean_overlap,
    read_errors,
)
from jamlab.flow.flow_curve import flow_curve
from jamlab.flow.oscillate import oscillate
from jamlab.packing.packing import Packing
from jamlab.protocols.target_pressure import pack
from jamlab.rheology.complex_modulus import complex_modulus
from jamlab.rheology.damping import ContactDamping, Damping, StokesDrag
from jamlab.rheology.nonlinear_drag import modulus_at_strain
from jamlab.studies.table import measure_table

N = SIZE
PRESSURES = (1e-2, 3e-3)
LAWS = (STOKES, 0.5, 0.66667, 1.0)  # in the digits of the table, so that more packings add to its conditions
DRAGS = (3e-3, 3e-2, 0.3, 3.0)
LEAST_DRAG = 3e-2  # of power laws: below, equivalent damping is no use, and runs take minutes
AMPLITUDES = (1e-3, 0.03, 0.3, 3.0)  # over the mean overlap
RATES = (1e-2, 1e-1)
SEEDS = {  # of packings, by part; of many, the second largest error is the one that 95 % stay below
    CALIBRATE: tuple(range(1, 6)),
    MANY: tuple(range(201, 240)),
    CHECK: tuple(range(101, 131)),
    SLIDING: tuple(range(301, 401)),
    SLIDING_CHECK: tuple(range(401, 461)),
}
SMALL_AMPLITUDES = (0.001, 0.01, 0.03, 0.1, 0.3)  # of many packings
_CASES = 5  # random conditions on each of them
TOLERANCE, CYCLES = 5e-3, 6  # of the runs that count as true
_STRAIN = 3.0  # of the averages of steady flow


def damping(alpha: float, beta: float = 1.0) -> Damping:
    """Drag of a row of the table."""
    return StokesDrag(eta_f=0.0) if alpha == STOKES else ContactDamping(beta, alpha=alpha)


def measure_errors(out: Path, parts: dict[str, tuple[int, ...]] | None = None, **how: Any) -> FlowErrors:
    """Measure the table and save it after every packing; goes on from a file with a part. `how`: of `measure_table`."""
    tasks = {
        f"{part}, seed {seed}": partial(_rows, part, seed)
        for part, seeds in (SEEDS if parts is None else parts).items()
        for seed in seeds
    }
    facts = {"background": BACKGROUND, "strain": _STRAIN, "tolerance": TOLERANCE, "cycles": CYCLES}
    measure_table(out, COLUMNS, tasks, facts, **how)
    return read_errors(out)


def _rows(part: str, seed: int) -> Iterator[dict[str, Any]]:
    """Rows of a packing, one for every condition that has an answer."""
    packing, flows = _PARTS[part](seed)
    linear: dict[float, float] = {}  # stress at a rate, which every alpha is compared with
    for flow in flows:
        began = time.process_time()
        try:
            error, scatter = _oscillation(packing, flow) if flow.kind == "oscillation" else _flow(packing, flow, linear)
        except (ConvergenceError, InputError):  # no answer, or a frequency that no run reaches
            continue
        facts = {"part": part, "seed": seed, "n": packing.n, "pressure": mean_overlap(packing)}
        yield flow._asdict() | facts | {"error": error, "scatter": scatter, "seconds": time.process_time() - began}


def _grid(seed: int) -> tuple[Packing, list[Flow]]:
    packing = pack(N, PRESSURES[seed % len(PRESSURES)], seed)
    small = [Flow("oscillation", a, w, x) for a in LAWS for w in _drags(a) for x in AMPLITUDES]
    return packing, small + [Flow("flow", a, r, 1.0) for a in LAWS[1:] for r in RATES]


def _drags(alpha: float) -> tuple[float, ...]:
    return DRAGS if alpha in (STOKES, 1.0) else tuple(w for w in DRAGS if w >= LEAST_DRAG)


def _small(seed: int) -> tuple[Packing, list[Flow]]:
    """One of many packings, at strains at which few rearrange; of linear drag, whose error else is small there."""
    packing = pack(N * (1 + seed % 2), _between(PRESSURES, np.random.default_rng(seed)), seed)
    return packing, [Flow("oscillation", 1.0, w, x) for w in DRAGS for x in SMALL_AMPLITUDES]


def _between(values: tuple[float, ...], chance: np.random.Generator) -> float:
    return float(np.exp(chance.uniform(np.log(min(values)), np.log(max(values)))))


def _random(seed: int) -> tuple[Packing, list[Flow]]:
    """Another packing, of another size and pressure, and conditions anywhere within the grid."""
    chance = np.random.default_rng(seed)

    def between(values: tuple[float, ...]) -> float:
        return _between(values, chance)

    packing = pack(int(chance.choice([64, 128, 256])), between(PRESSURES), seed)
    found = []
    for k in range(_CASES):
        alpha = float(chance.choice([STOKES, 1.0, chance.uniform(0.5, 1.0), chance.uniform(0.5, 1.0)]))
        found.append(Flow("oscillation", alpha, between(_drags(alpha)), between(AMPLITUDES)))
        if k == 0 and packing.n == N:
            found.append(Flow("flow", chance.uniform(0.5, 0.9), between(RATES), 1.0))
    return packing, found


def _sliding(seed: int) -> tuple[Packing, list[Flow]]:
    """Another packing, whose contacts damp sliding less or more than approach, at conditions anywhere in the grid."""
    chance = np.random.default_rng(seed)
    packing, beta = pack(N, _between(PRESSURES, chance), seed), SLIDING_BETAS[seed % len(SLIDING_BETAS)]
    found = [Flow("flow", chance.uniform(0.5, 0.9), _between(RATES, chance), 1.0, beta)]
    for _ in range(_CASES):
        alpha = float(chance.choice([1.0, chance.uniform(0.5, 1.0)]))
        drag, amplitude = _between(_drags(alpha), chance), _between(AMPLITUDES, chance)
        found.append(Flow("oscillation", alpha, drag, amplitude, beta))
    return packing, found


def _oscillation(packing: Packing, wanted: Flow) -> tuple[float, float]:
    """Relative error of G* without running, and the number of cycles that running took."""
    law = damping(wanted.alpha, wanted.beta)
    amplitude = wanted.amplitude * mean_overlap(packing)
    alpha = wanted.alpha or 1.0
    omega = (wanted.drag * amplitude ** (1.0 - alpha)) ** (1.0 / alpha)
    run = oscillate(packing, omega, amplitude, law, tolerance=TOLERANCE, cycles=CYCLES)
    true = complex(run.storage, run.loss)
    if law.at_contacts:
        simple = modulus_at_strain(packing, omega, amplitude, law)
    else:
        spectrum = complex_modulus(packing, [omega], law)
        simple = complex(spectrum.storage[0], spectrum.loss[0])
    return abs(simple - true) / abs(true), run.cycles


_FLOW: dict[str, Any] = {"strain": _STRAIN, "background": BACKGROUND}


def _flow(packing: Packing, wanted: Flow, linear: dict[float, float]) -> tuple[float, float]:
    """Relative error of linear drag at the rate to the power alpha; and of the mean at unit strain."""
    if wanted.drag not in linear:
        linear[wanted.drag] = float(flow_curve(packing, [wanted.drag], damping(1.0, wanted.beta), **_FLOW).stress[0])
    law = damping(wanted.alpha, wanted.beta)
    curve = flow_curve(packing, [wanted.drag ** (1.0 / wanted.alpha)], law, **_FLOW)
    error = 0.0 if wanted.alpha == 1.0 else abs(linear[wanted.drag] / curve.stress[0] - 1.0)
    return float(error), float(curve.stress_error[0] / curve.stress[0] * np.sqrt(_STRAIN))


_PARTS: dict[str, Callable[[int], tuple[Packing, list[Flow]]]] = {
    CALIBRATE: _grid,
    MANY: _small,
    CHECK: _random,
    SLIDING: _sliding,
    SLIDING_CHECK: _sliding,
}
