"""Map where disks fail: FIRE, overdamped steps, force tolerance, pressure, strain."""

from functools import partial

import numpy as np

from jamlab.benchmarks.failure_maps.verdict import Map, Outcome, attempt, judge
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

_JOLT = 0.02  # small diameters: meant to leave the minimum, not its basin
_STEPS = 10_000  # after which FIRE counts as stalled


def jolt_minimum(n: int, phi: float, seed: int = 1) -> tuple[Packing, float]:
    """Find a minimum and move its disks a little; returns the moved disks and the energy of the minimum."""
    with Session(random_disks(n, seed, phi=phi)) as session:
        energy = relax(session).evaluation.energy
        packing = session.packing()
    moves = _JOLT * np.random.default_rng(seed).standard_normal(packing.positions.shape)
    return packing.with_state(positions=packing.positions + moves), energy


def try_fire(start: Packing, minimum: float, timestep: float, dmax: float) -> tuple[str, str]:
    """Judge LAMMPS FIRE with jamlab's settings, except for the time step and the longest move."""
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
    return judge(end.max_force, tolerance, end.energy, before, minimum), f"max force {end.max_force:.1g}"


def _vary_timestep(quick: bool) -> list[Outcome]:
    runs = []
    for phi in (0.87, 1.0) if quick else (0.86, 0.88, 0.92, 1.0, 1.1):
        start, minimum = jolt_minimum(64, phi)
        for timestep in (0.1, 1.0, 4.0) if quick else (0.01, 0.03, 0.1, 0.3, 1.0, 2.0, 4.0):
            runs.append(Outcome(phi, timestep, *try_fire(start, minimum, timestep, 0.1)))
    return runs


def _vary_longest_move(quick: bool) -> list[Outcome]:
    runs = []
    for n in (32, 128) if quick else (16, 64, 256, 1024):
        start, minimum = jolt_minimum(n, 0.9)
        for dmax in (1e-3, 0.1, 10.0) if quick else (1e-3, 1e-2, 0.03, 0.1, 0.3, 1.0, 10.0):
            runs.append(Outcome(n, dmax, *try_fire(start, minimum, 0.1, dmax)))
    return runs


def try_overdamped_steps(start: Packing, minimum: float, timestep: float, steps: int) -> tuple[str, str]:
    """Judge steps x -> x + f dt, Stokes drag of 1, down to forces of 1e-8."""
    tolerance = 1e-8  # looser than that of relax: such steps converge slowly
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
    return judge(left, tolerance, energy, before, minimum), f"max force {left:.1g}"


def _vary_overdamped_step(quick: bool) -> list[Outcome]:
    runs = []
    for phi in (0.9, 1.1) if quick else (0.88, 0.9, 0.95, 1.0, 1.1):
        start, minimum = jolt_minimum(32, phi)
        for timestep in (0.1, 2.0) if quick else (0.03, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0):
            steps = 2000 if quick else 10_000
            runs.append(Outcome(phi, timestep, *try_overdamped_steps(start, minimum, timestep, steps)))
    return runs


def _vary_tolerance(quick: bool) -> list[Outcome]:
    runs = []
    for n in (32, 128) if quick else (16, 64, 256, 1024):
        start, minimum = jolt_minimum(n, 0.9)
        for tolerance in (1e-12, 1e-16) if quick else (1e-10, 1e-12, 1e-13, 1e-14, 1e-15, 1e-16, 1e-17):
            with Session(start) as session:
                before = session.evaluate().energy
                found = relax(session, tolerance)
            end = found.evaluation
            verdict = judge(end.max_force, tolerance, end.energy, before, minimum)
            runs.append(Outcome(n, tolerance, verdict, f"max force {end.max_force:.1g}"))
    return runs


def try_pressure(n: int, pressure: float, prestress: bool) -> tuple[str, str]:
    """Judge a packing at a pressure and its stiffness; unstable packings are refused."""
    packing = pack(n, pressure, 1)
    elastic_tensor(packing, prestress=prestress)
    return "converged", f"max force {packing.max_force:.1g}"


def _vary_pressure(quick: bool) -> list[Outcome]:
    runs = []
    for n in (16, 64) if quick else (16, 32, 64, 128, 256):
        for p in (1e-2, 1e-9) if quick else (1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 0.5):
            runs.append(attempt(n, p, partial(try_pressure, n, p, True)))
    return runs


def try_strain(packing: Packing, strain: float) -> tuple[str, str]:
    """Judge one finite strain: contacts that differ between its two sides mean another basin."""
    shear_modulus(packing)  # raises if the packing is not jammed
    minima = []
    for s in (0.5 * strain, -0.5 * strain):
        with Session(deformed(packing, simple_shear(s, 0.0))[0]) as session:
            found = relax(session, 2e-14, near=True)
            minima.append(session.packing())
        if not found.converged:
            return "stalled", f"max force {found.evaluation.max_force:.1g}"
    one, two = ({tuple(pair) for pair in contacts(p).pairs.tolist()} for p in minima)
    return ("converged" if one == two else "wrong basin"), f"{len(one ^ two)} contacts differ"


def _vary_strain(quick: bool) -> list[Outcome]:
    onset = jam("sp", 32 if quick else 64, 1, ensemble="shear-stabilized")
    runs = []
    for above in (1e-4, 1e-2) if quick else (1e-5, 1e-4, 1e-3, 1e-2, 0.1):
        *_, packing = compress(onset, onset.phi + above, above, by="phi")
        for strain in (1e-8, 1e-3) if quick else np.logspace(-9, -2, 8):
            runs.append(attempt(above, float(strain), partial(try_strain, packing, float(strain))))
    return runs


MAPS = {
    "fire-timestep": Map(
        "FIRE: time step against packing fraction, N = 64",
        "phi",
        "time step",
        _vary_timestep,
        "jamlab's minimize.fire takes 0.1, and lets it grow to 0.4.",
        (None, 0.1),
    ),
    "fire-dmax": Map(
        "FIRE: longest move against N, phi = 0.9",
        "N",
        "dmax, d",
        _vary_longest_move,
        "Short moves stall; long ones are cut by the time step before they do harm.",
        (None, 0.1),
    ),
    "overdamped": Map(
        "Overdamped steps: time step against packing fraction, N = 32",
        "phi",
        "time step over drag",
        _vary_overdamped_step,
        "Stable below 2 over the largest eigenvalue of the Hessian, which grows with the number of contacts.",
    ),
    "force-tolerance": Map(
        "Force tolerance that relax meets, phi = 0.9",
        "N",
        "largest force asked for",
        _vary_tolerance,
        "The floor is the rounding of sums of forces; `converged` is False below it.",
        (None, force_tolerance("sp")),
    ),
    "pressure": Map(
        "Packings at a pressure, with pre-stress",
        "N",
        "pressure, k",
        _vary_pressure,
        "Refused: below 1e-8 k, above 0.3 k, and where negative modes leave no modulus.",
    ),
    "strain": Map(
        "Finite strain against distance from onset",
        "phi - phi_J",
        "strain",
        _vary_strain,
        "Contacts change at strains that shrink towards onset; shear_modulus halves its strain until none does.",
        (None, 1e-6),
    ),
}
