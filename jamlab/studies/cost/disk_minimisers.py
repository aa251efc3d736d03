"""Minimisers of disks, LAMMPS' own and jamlab's, from one half-relaxed start, by the force that is left."""

from collections.abc import Iterator
from functools import partial

from jamlab.engine.session import Session
from jamlab.errors import EngineError
from jamlab.packing.packing import Packing
from jamlab.protocols.random_start import random_disks
from jamlab.protocols.relaxation import force_tolerance, relax
from jamlab.studies.cost.topic import Topic, Trial
from jamlab.studies.cpu_time import shortest

_SETTINGS = {  # name -> LAMMPS commands; the time step is that of jamlab's FIRE, LAMMPS' own is meant for other units
    "fire, jamlab": ("timestep 0.1", "min_style fire", "min_modify norm max dmax 0.1 tmax 4"),
    "fire, LAMMPS": ("timestep 0.1", "min_style fire", "min_modify norm max dmax 0.1 tmax 10"),
    "cg, energy": ("min_style cg", "min_modify norm max line quadratic dmax 0.1"),
    "cg, force": ("min_style cg", "min_modify norm max line forcezero dmax 0.1"),
    "hftn": ("min_style hftn", "min_modify norm two dmax 0.1"),
    "quickmin": ("timestep 0.1", "min_style quickmin", "min_modify norm max dmax 0.1"),
    "sd": ("min_style sd", "min_modify norm max line forcezero dmax 0.1"),
}
_PANELS = ((64, 0.85, "near onset"), (64, 1.0, "far from onset"), (1024, 0.87, ""), (1024, 1.0, "far from onset"))
_LARGE = ("fire, jamlab", "cg, energy", "cg, force")  # large packings are left to the quickest
_STEPS = 5000  # bound, so that slow minimisers end too
_BEFORE = 30  # steps of FIRE that take the worst overlaps out of the random start
_TOLERANCES = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
_ROUNDING = 1e-16  # of a sum of forces of order 0.1


def measure(seed: int) -> Iterator[Trial]:
    """Measure every minimiser at every tolerance, from the loosest until one is not met within the steps."""
    for n, phi, place in _PANELS:
        start = _half_relax(n, phi, seed)
        panel = f"N = {n}, φ = {phi:g}" + (f", {place}" if place else "")
        for name in _SETTINGS if n == 64 else _LARGE:
            yield from _measure_lammps(panel, start, name)
        with Session(start) as session:
            for tolerance in _TOLERANCES:
                seconds, left = shortest(partial(_relax, session, start, tolerance), runs=2, budget=0.05)
                default = tolerance == force_tolerance("sp")
                yield Trial(panel, "jamlab relax", f"{tolerance:g}", seconds, left, _ROUNDING, default)


def _half_relax(n: int, phi: float, seed: int) -> Packing:
    """Relax random disks by a few steps of FIRE."""
    with Session(random_disks(n, seed, phi=phi)) as session:
        session.minimize(1e-6, style="fire", steps=_BEFORE)
        return session.packing()


def _measure_lammps(panel: str, start: Packing, name: str) -> Iterator[Trial]:
    with Session(start) as session:
        for line in _SETTINGS[name]:
            session.command(line)
        note = ""
        for tolerance in _TOLERANCES:
            seconds = left = float("nan")
            if not note:
                try:
                    seconds, left = shortest(partial(_descend, session, start, tolerance), runs=2, budget=0.05)
                    note = "" if left <= tolerance else f"ends at {left:.1g}, by {_STEPS} steps or its line search"
                except EngineError as error:
                    note = str(error)
            yield Trial(panel, name, f"{tolerance:g}", seconds, float("nan") if note else left, _ROUNDING, note=note)


def _descend(session: Session, start: Packing, tolerance: float) -> float:
    session.load(start)
    # LAMMPS compares components, jamlab norms
    session.command(f"minimize 0.0 {0.5 * tolerance:.17g} {_STEPS} {10 * _STEPS}")
    return session.evaluate().max_force


def _relax(session: Session, start: Packing, tolerance: float) -> float:
    session.load(start)
    return relax(session, tolerance).evaluation.max_force


TOPIC = Topic(
    "Minimisers of disks",
    "largest force left, ε/d",
    "force tolerance",
    "no force at all, to the rounding of a sum of forces, 1e-16; all start from one random start after 30 steps of "
    "FIRE, and end where their basin takes them. What ends above its tolerance counts as failed",
    measure,
)
