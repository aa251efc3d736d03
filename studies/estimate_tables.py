"""Measure the tables behind `choose`, `scene`, `estimate` and `choose_flow`: ways to make packings, simpler flows.

Of flow there are five kinds of packings: a few on a grid of conditions make the table; many, with linear drag alone,
say how often one rearranges early, which a few cannot; others, at random conditions, check what is promised; others say
how much worse errors are where sliding is damped less or more than approach, and others again check that.
"""

import json
import lzma
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from jamlab.engine.deck_defaults import defaults
from jamlab.errors import ConvergenceError, InputError, JamlabError
from jamlab.estimates import ways
from jamlab.estimates.flow_errors import BACKGROUND, SIZE, SLIDING_BETAS, STOKES, Flow, mean_overlap
from jamlab.estimates.ways import ONSET, QUANTITIES, EnsembleWay, N
from jamlab.flow.flow_curve import flow_curve
from jamlab.flow.oscillate import oscillate
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.packing.packing import Packing
from jamlab.protocols.target_pressure import pack
from jamlab.rheology.complex_modulus import ComplexModulus, complex_modulus
from jamlab.rheology.damping import ContactDamping, Damping, StokesDrag
from jamlab.rheology.nonlinear_drag import NonlinearModulus, nonlinear_modulus
from jamlab.storage.atomic_file import atomic_file
from studies.flow_errors import Part, read_runs
from studies.papers.statements import paper
from studies.tables import Task, measure

LEVELS = (0.84, 0.85, 0.86, 0.88, 0.90, 0.92, 0.94, 0.96, 0.98)  # rho: from the onsets to confluence
FEW_VERTICES = (8, 11)
OTHER_FORM = "segment/smooth"  # the third, "segment", has no minima to end in
LOOSE = 1e-6  # largest force: 1e-8 saves a third of what it saves, 1e-5 no more
SEEDS = range(20_001, 20_201)  # none that a test, a campaign or `jamlab.estimate` uses
_RARE = 4  # one in so many seeds has fewer vertices, another form, looser minima and fewer particles: these save less

Groups = Callable[[int], Sequence[Sequence[EnsembleWay]]]


def groups(seed: int) -> list[tuple[EnsembleWay, ...]]:
    """Ways to make packings of one seed: the first of a group is made by itself, and carries the others. Droplets from
    the start take most of the time, and stand for one seed in two."""
    nv, rare = ways.default_vertices(), seed % _RARE == 1
    carried = [EnsembleWay("carried", N, nv)]
    if rare:
        carried += [EnsembleWay("carried", N, FEW_VERTICES), EnsembleWay("carried", N, nv, OTHER_FORM)]
    found: list[tuple[EnsembleWay, ...]] = [(EnsembleWay("disks", N), *carried)]
    if seed % 2:
        found.append((EnsembleWay("droplets", N, nv),))
    if rare:
        found.append((EnsembleWay("disks", N, tolerance=LOOSE), EnsembleWay("carried", N, nv, tolerance=LOOSE)))
        found += [(EnsembleWay("disks", 32), EnsembleWay("carried", 32, nv)), (EnsembleWay("droplets", 32, nv),)]
    return found


def make_table(
    out: Path, seeds: range = SEEDS, *, groups: Groups = groups, levels: Sequence[float] = LEVELS, **how: Any
) -> ways.Ways:
    """Measure the table seed by seed, and write it; a run goes on where it stopped. Levels of rho ascend; those of
    droplets carried beyond 0.88 must hold 0.88. `how`: see `measure`."""
    law = {k: v for k, v in defaults("dp").items() if k != "longest_edge"}
    facts = {"seconds": "CPU time of one core from the random start to rho", "step": ways.STEP, "parameters": law}
    tasks = {f"seed {seed}": partial(_rows, seed, groups(seed), levels) for seed in seeds}
    _measure(out, tasks, facts, **how)
    return ways.read_ways(out)


def _measure(out: Path, tasks: Mapping[str, Task], facts: Mapping[str, Any], **how: Any) -> None:
    """Measure a table into a CSV file beside, from which a run resumes, and pack it as `jamlab.estimates` reads it,
    below a first line of what all rows share."""
    path = measure(out.parent, out.name.partition(".")[0], tasks, **how)
    with atomic_file(out) as temporary:
        first = f"# {json.dumps({'facts': dict(facts)})}\n".encode()
        temporary.write_bytes(lzma.compress(first + path.read_bytes()))


def _rows(seed: int, groups: Sequence[Sequence[EnsembleWay]], levels: Sequence[float]) -> Iterator[dict[str, Any]]:
    """Rows of a seed: droplets are handed over to at every level up to 0.88, and compressed from there on."""
    for group in groups:
        first = _Chain(group[0], seed)
        carried: dict[EnsembleWay, _Chain] = {}
        for rho in levels:
            first.advance(rho)
            yield first.row(rho)
            for way in group[1:]:
                if rho <= paper("B5-z-parts"):
                    carried[way] = _Chain(way, seed, first)
                else:
                    carried[way].advance(rho)
                yield carried[way].row(rho)


class _Chain:
    """A packing on its way up, with the CPU time that it took; without one after a failure."""

    def __init__(self, way: EnsembleWay, seed: int, disks: "_Chain | None" = None) -> None:
        """Jam a packing, or hand over from disks above their onset."""
        self.way, self.seed = way, seed
        self.seconds: float = disks.seconds if disks else 0.0
        self.packing: Packing | None = None
        if disks is None:
            self._timed(lambda: ways.find_onset(way, seed))
            self.onset = packing_fraction(self.packing) if self.packing else float("nan")
            return
        self.onset, state = disks.onset, disks.packing
        if state is not None and packing_fraction(state) > self.onset + 1e-9:
            self._timed(lambda: ways.hand_over(way, state))

    def advance(self, rho: float) -> None:
        packing = self.packing
        if packing is not None and not (rho <= self.onset):
            self._timed(lambda: ways.bring_on(self.way, packing, rho))

    def row(self, rho: float) -> dict[str, Any]:
        found = dict.fromkeys(QUANTITIES, float("nan"))
        if self.packing is not None and rho > self.onset:
            found = ways.values_at(self.packing, QUANTITIES)
        way = asdict(self.way) | {"nv": None if self.way.nv is None else f"{self.way.nv[0]}/{self.way.nv[1]}"}
        onset = float(self.onset) if self.way.start != "carried" else None
        return {**way, "seed": self.seed, "rho": rho, **found, ONSET: onset, "seconds": self.seconds}

    def _timed(self, make: Callable[[], Packing]) -> None:
        began = time.process_time()
        try:
            self.packing = make()
        except JamlabError:
            self.packing = None
        self.seconds += time.process_time() - began


PRESSURES = (1e-2, 3e-3)
LAWS = (STOKES, 0.5, 0.66667, 1.0)  # in the digits of the table, so that more packings add to its conditions
DRAGS = (3e-3, 3e-2, 0.3, 3.0)
LEAST_DRAG = 3e-2  # of power laws: below, equivalent damping is no use, and runs take minutes
AMPLITUDES = (1e-3, 0.03, 0.3, 3.0)  # over the mean overlap
RATES = (1e-2, 1e-1)
FLOW_SEEDS = {  # of packings, by part; of many, the second largest error is the one that 95 % stay below
    Part.CALIBRATE: tuple(range(1, 6)),
    Part.MANY: tuple(range(201, 240)),
    Part.CHECK: tuple(range(101, 131)),
    Part.SLIDING: tuple(range(301, 401)),
    Part.SLIDING_CHECK: tuple(range(401, 461)),
}
SMALL_AMPLITUDES = (0.001, 0.01, 0.03, 0.1, 0.3)  # of many packings
_CASES = 5  # random conditions on each of them
TOLERANCE, CYCLES = 5e-3, 6  # of the runs that count as true
_STRAIN = 3.0  # of the averages of steady flow


def damping(alpha: float, beta: float = 1.0) -> Damping:
    """Drag of a row of the table."""
    return StokesDrag(eta_f=0.0) if alpha == STOKES else ContactDamping(beta, alpha=alpha)


def measure_errors(out: Path, parts: dict[Part, tuple[int, ...]] | None = None, **how: Any) -> pd.DataFrame:
    """Measure the table and save it after every packing; goes on where it stopped. `how`: of `measure`."""
    tasks = {
        f"{part}, seed {seed}": partial(_rows_of_part, part, seed)
        for part, seeds in (FLOW_SEEDS if parts is None else parts).items()
        for seed in seeds
    }
    facts = {"background": BACKGROUND, "strain": _STRAIN, "tolerance": TOLERANCE, "cycles": CYCLES}
    _measure(out, tasks, facts, **how)
    return read_runs(out)


def _rows_of_part(part: str, seed: int) -> Iterator[dict[str, Any]]:
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
    packing = pack(SIZE, PRESSURES[seed % len(PRESSURES)], seed)
    small = [Flow("oscillation", a, w, x) for a in LAWS for w in _drags(a) for x in AMPLITUDES]
    return packing, small + [Flow("flow", a, r, 1.0) for a in LAWS[1:] for r in RATES]


def _drags(alpha: float) -> tuple[float, ...]:
    return DRAGS if alpha in (STOKES, 1.0) else tuple(w for w in DRAGS if w >= LEAST_DRAG)


def _small(seed: int) -> tuple[Packing, list[Flow]]:
    """One of many packings, at strains at which few rearrange; of linear drag, whose error else is small there."""
    packing = pack(SIZE * (1 + seed % 2), _between(PRESSURES, np.random.default_rng(seed)), seed)
    return packing, [Flow("oscillation", 1.0, w, x) for w in DRAGS for x in SMALL_AMPLITUDES]


def _between(values: tuple[float, ...], chance: np.random.Generator) -> float:
    return float(np.exp(chance.uniform(np.log(min(values)), np.log(max(values)))))


def _random(seed: int) -> tuple[Packing, list[Flow]]:
    """Another packing, of another size and pressure, and conditions anywhere within the grid."""
    chance = np.random.default_rng(seed)
    between = partial(_between, chance=chance)
    packing = pack(int(chance.choice([64, 128, 256])), between(PRESSURES), seed)
    found = []
    for k in range(_CASES):
        alpha = float(chance.choice([STOKES, 1.0, chance.uniform(0.5, 1.0), chance.uniform(0.5, 1.0)]))
        found.append(Flow("oscillation", alpha, between(_drags(alpha)), between(AMPLITUDES)))
        if k == 0 and packing.n == SIZE:
            found.append(Flow("flow", chance.uniform(0.5, 0.9), between(RATES), 1.0))
    return packing, found


def _sliding(seed: int) -> tuple[Packing, list[Flow]]:
    """Another packing, whose contacts damp sliding less or more than approach, at conditions anywhere in the grid."""
    chance = np.random.default_rng(seed)
    packing, beta = pack(SIZE, _between(PRESSURES, chance), seed), SLIDING_BETAS[seed % len(SLIDING_BETAS)]
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
    found: NonlinearModulus | ComplexModulus = (
        nonlinear_modulus(packing, [omega], damping=law, strain=amplitude)
        if law.at_contacts
        else complex_modulus(packing, [omega], law)
    )
    simple = complex(found.storage[0], found.loss[0])
    return abs(simple - true) / abs(true), run.cycles


_FLOW: dict[str, Any] = {"strain": _STRAIN, "background": BACKGROUND}


def _flow(packing: Packing, wanted: Flow, linear: dict[float, float]) -> tuple[float, float]:
    """Relative error of linear drag at the rate to the power alpha; and of the mean at unit strain."""
    if wanted.drag not in linear:
        linear[wanted.drag] = float(flow_curve(packing, [wanted.drag], damping(1.0, wanted.beta), **_FLOW).stress[0])
    law = damping(wanted.alpha, wanted.beta)
    curve = flow_curve(packing, [wanted.drag ** (1.0 / wanted.alpha)], law, **_FLOW)
    error = 0.0 if wanted.alpha == 1.0 else abs(linear[wanted.drag] / curve.stress[0] - 1.0)
    return float(error), float(curve.stress_stderr[0] / curve.stress[0] * np.sqrt(_STRAIN))


_Plan = Callable[[int], tuple[Packing, list[Flow]]]  # function of a seed
_PARTS: dict[str, _Plan] = dict(zip(Part, (_grid, _small, _random, _sliding, _sliding), strict=True))
