"""Maps of failure of disks: FIRE, overdamped steps, force tolerance, pressure, strain."""

from functools import partial

import numpy as np

from jamlab.benchmarks.failure_maps.verdict import Map, Run, judged, refusal
from jamlab.engine.session import Session
from jamlab.errors import EngineError
from jamlab.geometry.contact_network import contacts
from jamlab.mechanics.elasticity import elastic_tensor
from jamlab.packing.deformation import deformed, simple_shear
from jamlab.packing.packing import Packing
from jamlab.protocols.compression import compress
from jamlab.protocols.moduli import shear_modulus
from jamlab.protocols.onset import jam
from jamlab.protocols.random_start import random_disks
from jamlab.protocols.relaxation import force_tolerance, relax
from jamlab.protocols.target_pressure import pack

_JOLT = 0.02
_STEPS = 10_000


def jolted(n: int, phi: float, seed: int = 1) -> tuple[Packing, float]:
    """A minimum whose disks were moved a little, and the energy of the minimum."""
    with Session(random_disks(n, seed, phi=phi)) as session:
        energy = relax(session).evaluation.energy
        packing = session.packing()
    moves = _JOLT * np.random.default_rng(seed).standard_normal(packing.positions.shape)
    return packing.with_state(positions=packing.positions + moves), energy


def fire(start: Packing, minimum: float, timestep: float, dmax: float) -> tuple[str, str]:
    """Verdict of LAMMPS FIRE with jamlab's settings but for the time step and the longest move."""
    tolerance = force_tolerance("sp")
    with Session(start) as session:
        before = session.evaluate().energy
        for line in (f"timestep {timestep}", "min_style fire", f"min_modify norm max dmax {dmax} tmax 4"):
            session.command(line)
        try:
            session.command(f"minimize 0.0 {0.5 * tolerance:g} {_STEPS} {10 * _STEPS}")
            end = session.evaluate()
        except EngineError as error:
            return "blew up", str(error).splitlines()[0]
    return judged(end.max_force, tolerance, end.energy, before, minimum), f"max force {end.max_force:.1g}"


def _timesteps(quick: bool) -> list[Run]:
    runs = []
    for phi in (0.87, 1.0) if quick else (0.86, 0.88, 0.92, 1.0, 1.1):
        start, minimum = jolted(64, phi)
        for timestep in (0.1, 1.0, 4.0) if quick else (0.01, 0.03, 0.1, 0.3, 1.0, 2.0, 4.0):
            runs.append(Run(phi, timestep, *fire(start, minimum, timestep, 0.1)))
    return runs


def _longest_moves(quick: bool) -> list[Run]:
    runs = []
    for n in (32, 128) if quick else (16, 64, 256, 1024):
        start, minimum = jolted(n, 0.9)
        for dmax in (1e-3, 0.1, 10.0) if quick else (1e-3, 1e-2, 0.03, 0.1, 0.3, 1.0, 10.0):
            runs.append(Run(n, dmax, *fire(start, minimum, 0.1, dmax)))
    return runs


def overdamped(start: Packing, minimum: float, timestep: float, steps: int) -> tuple[str, str]:
    """Verdict of x -> x + f dt, Stokes drag of one, down to forces of 1e-8."""
    tolerance = 1e-8
    with Session(start) as session:
        x = start.positions
        before, forces = session.forces_at(x)
        energy = before
        for _ in range(steps):
            x = x + timestep * forces
            energy, forces = session.forces_at(x)
            left = float(np.hypot(*forces.T).max())
            if left <= tolerance or energy > 10 * before:
                break
    return judged(left, tolerance, energy, before, minimum), f"max force {left:.1g}"


def _overdamped(quick: bool) -> list[Run]:
    runs = []
    for phi in (0.9, 1.1) if quick else (0.88, 0.9, 0.95, 1.0, 1.1):
        start, minimum = jolted(32, phi)
        for timestep in (0.1, 2.0) if quick else (0.03, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0):
            steps = 2000 if quick else 10_000
            runs.append(Run(phi, timestep, *overdamped(start, minimum, timestep, steps)))
    return runs


def _tolerances(quick: bool) -> list[Run]:
    runs = []
    for n in (32, 128) if quick else (16, 64, 256, 1024):
        start, minimum = jolted(n, 0.9)
        for tolerance in (1e-12, 1e-16) if quick else (1e-10, 1e-12, 1e-13, 1e-14, 1e-15, 1e-16, 1e-17):
            with Session(start) as session:
                before = session.evaluate().energy
                found = relax(session, tolerance)
            end = found.evaluation
            verdict = judged(end.max_force, tolerance, end.energy, before, minimum)
            runs.append(Run(n, tolerance, verdict, f"max force {end.max_force:.1g}"))
    return runs


def at_pressure(n: int, pressure: float, prestress: bool) -> tuple[str, str]:
    """Verdict of a packing at a pressure and of its stiffness: unstable ones are refused."""
    packing = pack(n, pressure, 1)
    elastic_tensor(packing, prestress=prestress)
    return "converged", f"max force {packing.max_force:.1g}"


def _pressures(quick: bool) -> list[Run]:
    runs = []
    for n in (16, 64) if quick else (16, 32, 64, 128, 256):
        for p in (1e-2, 1e-9) if quick else (1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 0.5):
            runs.append(refusal(n, p, partial(at_pressure, n, p, True)))
    return runs


def strained(packing: Packing, strain: float) -> tuple[str, str]:
    """Verdict of one finite strain: other contacts on its two sides mean another basin."""
    shear_modulus(packing)  # refuses what is not jammed
    minima = []
    for s in (0.5 * strain, -0.5 * strain):
        with Session(deformed(packing, simple_shear(s, 0.0))[0]) as session:
            found = relax(session, 2e-14, near=True)
            minima.append(session.packing())
        if not found.converged:
            return "stalled", f"max force {found.evaluation.max_force:.1g}"
    one, two = ({tuple(pair) for pair in contacts(p).pairs.tolist()} for p in minima)
    return ("converged" if one == two else "wrong basin"), f"{len(one ^ two)} contacts differ"


def _strains(quick: bool) -> list[Run]:
    onset = jam("sp", 32 if quick else 64, 1, ensemble="shear-stabilized")
    runs = []
    for above in (1e-4, 1e-2) if quick else (1e-5, 1e-4, 1e-3, 1e-2, 0.1):
        *_, packing = compress(onset, onset.phi + above, above, by="phi")
        for strain in (1e-8, 1e-3) if quick else np.logspace(-9, -2, 8):
            runs.append(refusal(above, float(strain), partial(strained, packing, float(strain))))
    return runs


MAPS = {
    "fire-timestep": Map(
        "FIRE: time step against packing fraction, N = 64",
        "phi",
        "time step",
        _timesteps,
        "jamlab's minimize.fire takes 0.1, and lets it grow to 0.4.",
        (None, 0.1),
    ),
    "fire-dmax": Map(
        "FIRE: longest move against N, phi = 0.9",
        "N",
        "dmax, d",
        _longest_moves,
        "Short moves stall; long ones are cut by the time step before they do harm.",
        (None, 0.1),
    ),
    "overdamped": Map(
        "Overdamped steps: time step against packing fraction, N = 32",
        "phi",
        "time step over drag",
        _overdamped,
        "Stable below 2 over the largest eigenvalue of the Hessian, which grows with the number of contacts.",
    ),
    "force-tolerance": Map(
        "Force tolerance that relax meets, phi = 0.9",
        "N",
        "largest force asked for",
        _tolerances,
        "The floor is the rounding of sums of forces; `converged` is False below it.",
        (None, force_tolerance("sp")),
    ),
    "pressure": Map(
        "Packings at a pressure, with pre-stress",
        "N",
        "pressure, k",
        _pressures,
        "Refused: below 1e-8 k, above 0.3 k, and where negative modes leave no modulus.",
    ),
    "strain": Map(
        "Finite strain against distance from onset",
        "phi - phi_J",
        "strain",
        _strains,
        "Contacts change at strains that shrink towards onset; shear_modulus halves its strain until none does.",
        (None, 1e-6),
    ),
}
