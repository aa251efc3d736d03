"""Charts of flow: start-up of shear without inertia and with little, steps of droplets, the solver of velocities."""

import time
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.engine.installation import start_lammps
from jamlab.errors import ConvergenceError
from jamlab.estimates.ways import bring_on, default_way
from jamlab.flow.overdamped_session import OverdampedSession, background_drag, solver_residual
from jamlab.flow.shear import TOLERANCE, shear
from jamlab.geometry.vertex_contacts import touching_disks
from jamlab.packing.neighbors import moves_home
from jamlab.packing.packing import Packing
from jamlab.protocols.onset import jam
from jamlab.protocols.target_pressure import pack
from jamlab.rheology.damping import ContactDamping, Damping, StokesDrag
from studies.speed_accuracy.chart import Chart, Panel, Trial
from studies.speed_accuracy.moduli import DROPLETS, RHO

STEP = 0.02  # over the mass, in units of tau_1: 0.1 diverges


def start_up(packing: Packing, rate: float, strains: Array, mass: float) -> tuple[Array, float]:
    """(m,) shear stress at strains (m,), and seconds of CPU; units "k" with k = tau = 1. Drag per velocity is k tau =
    meff gamma with meff = mass/2, and the friction limit is out of reach."""
    lmp = start_lammps()
    assert packing.diameters is not None
    sizes, kinds = np.unique(packing.diameters, return_inverse=True)
    (lx, _), (xy, ly) = packing.box
    gamma = 2.0 / mass
    dt = STEP * mass
    lines = [
        *["units lj", "dimension 2", "newton off", "atom_style sphere", "atom_modify map array", "comm_modify vel yes"],
        f"region cell prism 0 {lx:.17g} 0 {ly:.17g} -0.5 0.5 {xy:.17g} 0 0",
        f"create_box {len(sizes)} cell",
    ]
    lmp.commands_list(lines)
    inside = packing.positions + moves_home(packing.positions, packing.box)
    x = np.column_stack([inside, np.zeros(packing.n)])
    lmp.create_atoms(packing.n, list(range(1, packing.n + 1)), [int(k) + 1 for k in kinds], x.ravel().tolist())
    for k, size in enumerate(sizes):
        lmp.command(f"set type {k + 1} diameter {size:.17g} mass {mass:.17g}")
    lines = [
        f"pair_style gran/hooke 1.0 0.0 {gamma:.17g} {gamma:.17g} 1e4 1",
        *["pair_coeff * *", "neighbor 0.1 bin", "neigh_modify every 1 delay 0 check yes"],
        *["fix move all nve/sphere disc", "fix flat all enforce2d", f"timestep {dt:.17g}"],
        f"velocity all ramp vx 0 {rate * ly:.17g} y 0 {ly:.17g}",
        f"fix lean all deform 1 xy erate {rate:.17g} remap v flip no",
        "thermo 1000000",
    ]
    lmp.commands_list(lines)
    stresses, done, seconds = [], 0, 0.0
    for strain in strains:
        steps = round(strain / rate / dt)
        clock = time.process_time()
        lmp.command(f"run {steps - done} post no")
        seconds += time.process_time() - clock
        done = steps
        stresses.append(_stress(lmp, packing, rate))
    lmp.close()
    return np.array(stresses), seconds


def _stress(lmp: Any, packing: Packing, rate: float) -> float:
    """Stress over contacts, conjugate to the strain: T_x r_y with the tension T that acts on the first disk."""
    x, v, spin = (np.array(lmp.gather_atoms(name, 1, 3)).reshape(-1, 3) for name in ("x", "v", "omega"))
    _, _, xy, *_ = lmp.extract_box()
    box = np.array([packing.box[0], [xy, packing.box[1, 1]]])
    x, v, spin = x[:, :2], v[:, :2], spin[:, 2]
    beside = v - rate * np.column_stack([x[:, 1], np.zeros(packing.n)])
    assert packing.diameters is not None
    total = 0.0
    pairs = touching_disks(packing.with_state(positions=x, box=box))
    for i, j, r in zip(pairs.i, pairs.j, pairs.r, strict=True):
        distance, radii = np.hypot(*r), 0.5 * packing.diameters[[i, j]]
        normal = r / distance
        tangent = np.array([-normal[1], normal[0]])
        relative = beside[j] - beside[i] + [rate * r[1], 0.0]
        approach, slide = relative @ normal, relative @ tangent - radii @ spin[[i, j]]
        tension = (approach - (radii.sum() - distance)) * normal + slide * tangent
        total += tension[0] * r[1]
    return total / packing.area


_FLOWING, _PRESSURE = 32, 1e-2
_RATES = (1e-2, 1e-3)
_STRAIN, _ROWS = 0.02, 10
_STEP_ERRORS = (1e-1, 3e-2, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
_FINEST = 1e-9  # tolerance of the reference
_LONGEST = {1e-2: (1e-2, 3e-3), 1e-3: (0.1, 0.03)}  # step of the check and of the reference, tau_1, by rate
_MASSES = {1e-2: (1.0, 0.3, 0.1, 0.03, 0.01), 1e-3: (1.0, 0.3, 0.1)}  # k tau_1^2; smaller ones take minutes
_SOLVER_RATES = {"dp": (0.1, 0.01), "sp": (0.01,)}
_SOLVER_STRAIN = 0.05
_SOLVER_TOLERANCES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
_RESIDUALS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10)
_PAIR = (1e-8, 1e-9)  # tolerances of the check and of the reference
_TIGHTEST = (1e-12, 1e-13)  # residuals of the check and of the reference where only the residual is charted


def measure_inertia(seed: int) -> Iterator[Trial]:
    """Measure both rates; without background drag, which disks with inertia have not."""
    packing = pack(_FLOWING, _PRESSURE, seed, ensemble="shear-stabilized")
    for rate in _RATES:
        try:
            check, exact = (_in_short_steps(packing, rate, longest) for longest in _LONGEST[rate])
        except ConvergenceError:
            continue  # drag is singular for this packing without background
        panel = Panel(f"rate {rate:g}/τ₁", exact, _distance(check, exact), _distance, {"runs": 1})
        for tolerance in _STEP_ERRORS:
            massless = partial(_massless, packing, rate, tolerance)
            yield panel.trial("massless", f"tolerance {tolerance:g}", massless, tolerance == TOLERANCE)
        strains = _STRAIN * np.arange(1, _ROWS + 1) / _ROWS
        for mass in _MASSES[rate]:
            stress, seconds = start_up(packing, rate, strains, mass)
            off = _distance(stress, exact)
            yield Trial(panel.name, "small inertia", f"mass {mass:g}", seconds, off, panel.reference_error)


def _massless(packing: Packing, rate: float, tolerance: float) -> Array:
    return shear(packing, rate, _STRAIN, rows=_ROWS, tolerance=tolerance, background=0.0).stress[1:]


def _in_short_steps(packing: Packing, rate: float, longest: float) -> Array:
    """The stress in steps that are short everywhere, not only where the tolerance asks for it: a new contact is a jump
    of velocities, where the shortest step decides."""
    with OverdampedSession(packing, ContactDamping(), _FINEST, 0.0) as session:
        session.drive(f"rate {rate:.17g}", _STRAIN / _ROWS / rate, longest=longest)
        return np.array([session.advance().stress for _ in range(_ROWS)])


def measure_solvers(seed: int) -> Iterator[Trial]:
    """Measure droplets in Stokes drag along both dials, disks with contact drag along the residual."""
    droplets = bring_on(default_way(DROPLETS), jam("sp", DROPLETS, seed), RHO)
    disks = pack(_FLOWING, _PRESSURE, seed, ensemble="shear-stabilized")
    for rate in _SOLVER_RATES["dp"]:
        panel = f"{DROPLETS} droplets, rate {rate:g}/τ₁"
        yield from _along_tolerance(panel, droplets, rate, StokesDrag())
        yield from _along_residual(f"{panel}, solver", droplets, rate, StokesDrag())
    for rate in _SOLVER_RATES["sp"]:
        panel = f"{_FLOWING} disks, rate {rate:g}/τ₁, solver"
        yield from _along_residual(panel, disks, rate, ContactDamping())
        yield from _along_residual(f"{panel} and steps", disks, rate, ContactDamping(), against_steps=True)


def _along_tolerance(name: str, packing: Packing, rate: float, law: Damping) -> Iterator[Trial]:
    start_up = partial(_start_up, packing, rate, law)
    check, exact = (start_up(tolerance) for tolerance in _PAIR)
    panel = Panel(name, exact, _distance(check, exact), _distance, {"runs": 1})
    for tolerance in _SOLVER_TOLERANCES:
        run = partial(start_up, tolerance)
        yield panel.trial("tolerance of a step", f"{tolerance:g}", run, tolerance == TOLERANCE)


def _along_residual(
    name: str, packing: Packing, rate: float, law: Damping, *, against_steps: bool = False
) -> Iterator[Trial]:
    """At the default tolerance of a step, against the tightest residual: what the solver adds to the error of steps.
    With `against_steps` against the finest steps, of which those of the default tolerance are the floor."""
    usual = float(f"{solver_residual(law, TOLERANCE, background_drag(packing, law, None)):g}")
    tolerances = _PAIR if against_steps else (TOLERANCE, TOLERANCE)
    start_up = partial(_start_up, packing, rate, law)
    check, exact = (start_up(*pair) for pair in zip(tolerances, _TIGHTEST, strict=True))
    panel = Panel(name, exact, _distance(check, exact), _distance, {"runs": 1})
    for residual in sorted({*_RESIDUALS, usual}, reverse=True):
        run = partial(start_up, TOLERANCE, residual)
        yield panel.trial("residual of the solver", f"{residual:g}", run, residual == usual)


def _start_up(packing: Packing, rate: float, law: Damping, tolerance: float, residual: float | None = None) -> Array:
    """(m,) shear stress; by default the residual follows the tolerance."""
    background = background_drag(packing, law, None)
    with OverdampedSession(packing, law, tolerance, background, residual=residual) as session:
        session.drive(f"rate {rate:.17g}", _SOLVER_STRAIN / _ROWS / rate)
        return np.array([session.advance().stress for _ in range(_ROWS)])


def _distance(stress: Array, exact: Array) -> float:
    """Root of the mean square of a difference (m,), over that of the stress."""
    return float(np.sqrt(((stress - exact) ** 2).mean() / (exact**2).mean()))


CHARTS = (Chart("flow-in-time", measure_inertia), Chart("flow-solvers", measure_solvers))
