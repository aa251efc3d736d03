"""Charts of minimisers of disks and of droplets, LAMMPS' own and jamlab's, by the force that is left."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from jamlab.engine.session import Session
from jamlab.errors import EngineError
from jamlab.estimates.ensemble_way import bring_on, default_way
from jamlab.packing.packing import Packing
from jamlab.protocols.onset import jam
from jamlab.protocols.random_start import random_disks
from jamlab.protocols.relaxation import force_tolerance, relax
from jamlab.studies.cost.chart import Chart, Trial
from jamlab.studies.table import shortest

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
_RHO = (0.88, 0.95)
_DROPLETS = 8
_KICK = 0.003  # mean diameters: far more than any force tolerance leaves, less than half a rim
_STYLES = ("fire", "cg")  # with the settings of the decks, minimize.fire and minimize.cg
_DROPLET_STEPS = 20_000  # bound
_DROPLET_TOLERANCES = (1e-3, 1e-4, 1e-6, 1e-8, 1e-10)
_DROPLET_ROUNDING = 1e-14  # of a sum of forces: distances err by 1e-16, and the stiffness of a rim is 1/delta^2


def measure_disks(seed: int) -> Iterator[Trial]:
    """Measure every minimiser at every tolerance, from the loosest until one is not met within the steps."""
    for n, phi, place in _PANELS:
        with Session(random_disks(n, seed, phi=phi)) as session:
            session.minimize(1e-6, style="fire", steps=_BEFORE)
            start = session.packing()
        panel = f"N = {n}, φ = {phi:g}" + (f", {place}" if place else "")
        for name in _SETTINGS if n == 64 else _LARGE:
            yield from _measure_lammps(panel, start, name)
        with Session(start) as session:
            for tolerance in _TOLERANCES:
                seconds, left = shortest(partial(_relax, session, start, tolerance), runs=2, budget=0.05)
                default = tolerance == force_tolerance("sp")
                yield Trial(panel, "jamlab relax", f"{tolerance:g}", seconds, left, _ROUNDING, default)


def _measure_lammps(panel: str, start: Packing, name: str) -> Iterator[Trial]:
    with Session(start) as session:
        for line in _SETTINGS[name]:
            session.command(line)
        descend, why = partial(_descend, session, start), f", by {_STEPS} steps or its line search"
        yield from _until_missed(panel, name, _TOLERANCES, descend, _ROUNDING, why=why, runs=2, budget=0.05)


def _until_missed(
    panel: str,
    name: str,
    tolerances: Sequence[float],
    descend: Callable[[float], float],
    rounding: float,
    usual: float | None = None,
    why: str = "",
    **timing: Any,
) -> Iterator[Trial]:
    """Measure a minimiser at every tolerance, from the loosest until one is not met."""
    note = ""
    for tolerance in tolerances:
        seconds = left = float("nan")
        if not note:
            try:
                seconds, left = shortest(partial(descend, tolerance), **timing)
                note = "" if left <= tolerance else f"ends at {left:.1g}{why}"
            except EngineError as error:
                note = str(error).splitlines()[0]
        numbers = (seconds, float("nan") if note else left, rounding)
        yield Trial(panel, name, f"{tolerance:g}", *numbers, tolerance == usual, note)


def _descend(session: Session, start: Packing, tolerance: float) -> float:
    session.load(start)
    # LAMMPS compares components, jamlab norms
    session.command(f"minimize 0.0 {0.5 * tolerance:.17g} {_STEPS} {10 * _STEPS}")
    return session.evaluate().max_force


def _relax(session: Session, start: Packing, tolerance: float) -> float:
    session.load(start)
    return relax(session, tolerance).evaluation.max_force


DISKS = Chart(
    "disk-minimisers",
    "Minimisers of disks",
    "largest force left, ε/d",
    "force tolerance",
    "no force at all, to the rounding of a sum of forces, 1e-16; all start from one random start after 30 steps of "
    "FIRE, and end where their basin takes them. What ends above its tolerance counts as failed",
    measure_disks,
)


def measure_droplets(seed: int) -> Iterator[Trial]:
    """Measure at both packing fractions, from the loosest tolerance until one is not met."""
    onset = jam("sp", _DROPLETS, seed)
    for rho in _RHO:
        found = bring_on(default_way(_DROPLETS), onset, rho)
        kicks = _KICK * np.random.default_rng(seed).standard_normal(found.positions.shape)
        start = found.with_state(positions=found.positions + kicks)
        with Session(start) as session:
            for style in (*_STYLES, "jamlab relax"):
                usual = force_tolerance("dp") if style == "jamlab relax" else None
                way = (_DROPLET_TOLERANCES, partial(_descend_droplets, session, start, style), _DROPLET_ROUNDING, usual)
                yield from _until_missed(f"ρ = {rho}", style, *way, runs=1)


def _descend_droplets(session: Session, start: Packing, style: str, tolerance: float) -> float:
    session.load(start, anew=True)
    if style in _STYLES:
        return session.minimize(tolerance, style=style, steps=_DROPLET_STEPS).max_force
    return relax(session, tolerance).evaluation.max_force


DROPLETS = Chart(
    "droplet-minimisers",
    f"Minimisers of {_DROPLETS} droplets",
    "largest force left, ε/d",
    "force tolerance",
    "no force at all, to the rounding of a sum of forces, 1e-14; all start from one minimum whose vertices are moved "
    "by 0.003 diameters. What ends above its tolerance, after 20 000 steps or where its line search finds no way down, "
    "counts as failed",
    measure_droplets,
)
