"""Compare minimisers, LAMMPS' own and jamlab's, from one half-relaxed start by the force that is left."""

import numpy as np

from jamlab.benchmarks.cpu_time import shortest
from jamlab.benchmarks.speed_accuracy.trial import Topic, Trial
from jamlab.engine.session import Session
from jamlab.errors import EngineError
from jamlab.packing.packing import Packing
from jamlab.protocols.random_start import random_disks
from jamlab.protocols.relaxation import force_tolerance, relax

_SETTINGS = {  # name -> LAMMPS commands; the time step is that of jamlab's FIRE, LAMMPS' own is meant for other units
    "fire, jamlab": ("timestep 0.1", "min_style fire", "min_modify norm max dmax 0.1 tmax 4"),
    "fire, LAMMPS": ("timestep 0.1", "min_style fire", "min_modify norm max dmax 0.1 tmax 10"),
    "cg, line search on energy": ("min_style cg", "min_modify norm max line quadratic dmax 0.1"),
    "cg, line search on force": ("min_style cg", "min_modify norm max line forcezero dmax 0.1"),
    "hftn": ("min_style hftn", "min_modify norm two dmax 0.1"),
    "quickmin": ("timestep 0.1", "min_style quickmin", "min_modify norm max dmax 0.1"),
    "sd": ("min_style sd", "min_modify norm max line forcezero dmax 0.1"),
}
_PHI = {"near onset, phi = 0.85": 0.85, "far from onset, phi = 1.0": 1.0}
_STEPS = {64: 20_000, 1024: 4_000, 8192: 1_000}  # bound by size, so that slow minimisers end too
_QUICKEST = 4  # the first of _SETTINGS; large packings are left to them
_TOLERANCES = (1e-4, 1e-8, 1e-12)


def measure_trials(quick: bool) -> list[Trial]:
    """Measure every minimiser at three tolerances; steps are bounded, so that slow ones end above their tolerance."""
    found = []
    for n in (64, 1024) if quick else (64, 1024, 8192):
        for place, phi in _PHI.items():
            start = _half_relax(n, phi)
            tolerances = _TOLERANCES[-1:] if quick or n > 1024 else _TOLERANCES
            for tolerance in tolerances:
                panel = f"N = {n}, {place}"
                names = list(_SETTINGS)[: None if n == 64 or (n == 1024 and not quick) else _QUICKEST]
                found += [_measure_lammps(panel, start, name, tolerance) for name in names]
                found.append(_measure_jamlab(panel, start, tolerance))
    return found


def _half_relax(n: int, phi: float) -> Packing:
    """Relax random disks by a few hundred steps of FIRE."""
    with Session(random_disks(n, 1, phi=phi)) as session:
        session.minimize(1e-6, style="fire", steps=300)
        return session.packing()


def _measure_lammps(panel: str, start: Packing, name: str, tolerance: float) -> Trial:
    steps = _STEPS[len(start.positions)]
    with Session(start) as session:
        for line in _SETTINGS[name]:
            session.command(line)

        def run() -> float:
            session.load(start)
            # LAMMPS compares components, jamlab norms
            session.command(f"minimize 0.0 {0.5 * tolerance:.17g} {steps} {10 * steps}")
            return session.evaluate().max_force

        try:
            seconds, left = shortest(run, runs=3, budget=0.3)
        except EngineError as error:
            return Trial(panel, name, f"{tolerance:g}", float("nan"), float("nan"), note=str(error))
    return Trial(panel, name, f"{tolerance:g}", seconds, left, note=_note(left, tolerance))


def _measure_jamlab(panel: str, start: Packing, tolerance: float) -> Trial:
    with Session(start) as session:

        def run() -> float:
            session.load(start)
            return relax(session, tolerance).evaluation.max_force

        seconds, left = shortest(run, runs=3, budget=0.3)
    default = tolerance == force_tolerance("sp")
    return Trial(panel, "jamlab relax", f"{tolerance:g}", seconds, left, default, _note(left, tolerance))


def _note(left: float, tolerance: float) -> str:
    return "" if np.isfinite(left) and left <= tolerance else f"stopped above {tolerance:g}"


TOPIC = Topic(
    "Minimisers of disks",
    "largest force left, eps/d",
    "0; one random start after 300 steps of FIRE; labels are tolerances",
    measure_trials,
)
