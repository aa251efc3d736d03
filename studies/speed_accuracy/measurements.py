"""Charts of what is measured of a packing: shear modulus, true packing fraction, G*(omega), start-up of shear."""

import operator
import time
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from jamlab.arrays import Array, Complex
from jamlab.engine.deck_defaults import defaults
from jamlab.engine.installation import start_lammps
from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError
from jamlab.estimates.ways import bring_on, default_way
from jamlab.flow.overdamped_session import OverdampedSession, background_drag, solver_residual
from jamlab.flow.shear import TOLERANCE, shear
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.geometry.vertex_contacts import touching_disks
from jamlab.geometry.voids.voids import voids
from jamlab.mechanics.elasticity import AVERAGING_ANGLES, modulus_along
from jamlab.mechanics.force_network import force_network
from jamlab.mechanics.stiffness import stiffness
from jamlab.models.models import MODELS
from jamlab.packing.neighbors import moves_home
from jamlab.packing.packing import Packing
from jamlab.protocols.moduli import shear_modulus
from jamlab.protocols.onset import jam
from jamlab.protocols.random_start import random_disks
from jamlab.protocols.relaxation import force_tolerance, relax
from jamlab.protocols.target_pressure import pack
from jamlab.rheology.complex_modulus import ComplexModulus, complex_modulus
from jamlab.rheology.damping import ContactDamping, Damping, StokesDrag
from jamlab.rheology.equation_of_motion import equation_of_motion
from jamlab.rheology.reduced_model import SETTINGS
from studies.campaigns.observables import APPROXIMATE
from studies.speed_accuracy.chart import Chart, Panel, Trial

_N, _DROPLETS = 64, 8
_PRESSURES = (1e-2, 1e-4)
_RHO = 0.92
_STRAINS = (1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3)
_TOLERANCES = {"sp": (1e-6, 1e-8, 1e-10, 1e-12, 1e-13), "dp": (1e-6, 1e-8, 1e-10, 1e-12)}
_TIGHT = {"sp": (1e-13, 1e-14), "dp": (1e-11, 1e-12)}  # of the packing that the reference is taken from, ten apart
_MOVES = 0.1  # of the pressure: contacts stay


def measure_moduli(seed: int) -> Iterator[Trial]:
    """Measure disks at two pressures, and droplets."""
    for pressure in _PRESSURES:
        packing = pack(_N, pressure, seed, ensemble="shear-stabilized")
        yield from _measure_packing(f"{_N} disks, p = {pressure:g} k", packing, _MOVES * pressure, seed)
    droplets = bring_on(default_way(_DROPLETS), jam("sp", _DROPLETS, seed), _RHO)
    yield from _measure_packing(f"{_DROPLETS} droplets, ρ = {_RHO}", droplets, 1e-5, seed)


def _measure_packing(name: str, packing: Packing, moves: float, seed: int) -> Iterator[Trial]:
    start = packing.with_state(
        positions=packing.positions + moves * np.random.default_rng(seed).standard_normal(packing.positions.shape)
    )
    usual = force_tolerance(packing.model)
    loose, tight = (dense_modulus(_relax(start, tolerance)) for tolerance in _TIGHT[packing.model])
    panel = Panel(name, tight, max(0.1 * abs(loose / tight - 1), 1e-15), _relative, {"runs": 2, "budget": 0.05})
    for tolerance in _TOLERANCES[packing.model]:
        run = partial(_modulus, start, tolerance)
        yield panel.trial("linear response", f"force {tolerance:g}", run, tolerance == usual)
    yield panel.trial("affine", "", partial(_modulus, start, usual, "affine"))
    first = float(defaults("strain")["strain" if packing.model == "sp" else "strain_droplets"])
    for strain in sorted({*_STRAINS, first}):
        run = partial(_modulus, start, usual, "finite-strain", strain)
        yield panel.trial("finite strain", f"strain {strain:g}", run)


def _relative(found: float, exact: float) -> float:
    return found / exact - 1


def _modulus(start: Packing, force: float, method: str = "linear-response", strain: float | None = None) -> float:
    return float(shear_modulus(_relax(start, force), method, average=True, strain=strain))


def dense_modulus(packing: Packing) -> float:
    """G, mean over directions, by the pseudo-inverse of the dense Hessian: shares no solver with `elastic_tensor`."""
    network = force_network(packing)
    k = stiffness(network.packing)
    right = k.ue.reshape(-1, 4)
    values, modes = np.linalg.eigh(k.uu.toarray())
    stiff = np.argsort(values)[2:]  # but for the two translations
    response = modes[:, stiff] @ ((modes[:, stiff].T @ right) / values[stiff, None])
    tensor = (k.ee - (response.T @ right).reshape(2, 2, 2, 2)) / packing.area
    return float(modulus_along(tensor, AVERAGING_ANGLES).mean())


def _relax(start: Packing, tolerance: float | None = None) -> Packing:
    with Session(start) as session:
        relax(session, tolerance)
        return session.packing()


SHEAR_MODULUS = Chart(
    "shear-modulus",
    "Static shear modulus, with the minimisation before it",
    "relative error of G",
    "force: tolerance of the minimum, strain: the first one tried, which is halved while contacts change",
    "dense pseudo-inverse of the Hessian of the same packing, relaxed to 1e-14 (droplets 1e-12); its error is a tenth "
    "of what changes from ten times that force",
    measure_moduli,
)


_PHI = (0.86, 1.0, 1.2)
_DISKS = 64
_COUNTS = (100, 1000, 10_000, 100_000)  # random points
_ROUNDING = 1e-15  # of areas of order 1: what the two exact ways, which share no step, differ by at most


def measure_fractions(seed: int) -> Iterator[Trial]:
    """Measure all methods on one packing at three phi, against 1 minus the voids, which needs no overlap areas."""
    for phi in _PHI:
        packing = _relax(random_disks(_DISKS, seed, phi=phi))
        reference = 1.0 - float(voids(packing).area.sum()) / packing.area
        panel = Panel(f"φ = {phi:g}", reference, _ROUNDING, operator.sub, {"runs": 5, "budget": 0.1})
        exact_and_pairs = {name: partial(packing_fraction, method=name) for name in MODELS["sp"].fraction_methods}
        for method, fraction in (exact_and_pairs | APPROXIMATE).items():
            yield panel.trial(method, "", partial(fraction, packing), method == "exact")
        for count in _COUNTS:
            yield panel.trial("random points", f"{count}", partial(covered, packing, count, seed))


def covered(packing: Packing, count: int, seed: int) -> float:
    """Share of random points that lie inside a disk, in a box with right angles: error sqrt(rho (1 - rho)/count)."""
    assert packing.diameters is not None
    sides = packing.box.diagonal()
    points = np.random.default_rng(seed).uniform(size=(count, 2)) * sides
    inside = np.zeros(count, dtype=bool)
    for centre, diameter in zip(packing.positions, packing.diameters, strict=True):
        apart = points - centre
        apart -= sides * np.round(apart / sides)
        inside |= (apart**2).sum(axis=1) < 0.25 * diameter**2
    return float(inside.mean())


FRACTIONS = Chart(
    "packing-fraction",
    "True packing fraction of 64 disks",
    "error of ρ",
    "number of random points",
    "1 minus the area of the voids from their exact boundaries, known to rounding, 1e-15",
    measure_fractions,
    reason="exact asks first whether pairs are enough, which costs what pairs saves; pairs alone is wrong elsewhere",
)


_SPECTRUM_SIZES = (64, 256)
_SPECTRUM_PRESSURE = 1e-3
_OMEGA = np.geomspace(1e-8, 1e2, 31)
_SHIFT_TOLERANCES = (1e-1, 1e-3, 1e-5, 1e-7, 1e-9, 1e-11)
_KRYLOV_STEPS = sorted({1, 2, 5, 10, SETTINGS.steps})
_REFINEMENTS = 5


def measure_spectra(seed: int) -> Iterator[Trial]:
    """Measure contact damping at one pressure over ten decades of frequency."""
    for n in _SPECTRUM_SIZES:
        yield from measure_spectrum(f"N = {n}", pack(n, _SPECTRUM_PRESSURE, seed), ContactDamping())


def measure_droplets(seed: int) -> Iterator[Trial]:
    """Measure one packing with drag between vertices that touch and with drag of the fluid."""
    droplets = bring_on(default_way(_DROPLETS), jam("sp", _DROPLETS, seed), _RHO)
    yield from measure_spectrum("contact damping", droplets, ContactDamping())
    yield from measure_spectrum("Stokes drag", droplets, StokesDrag())


def measure_spectrum(name: str, packing: Packing, damping: Damping) -> Iterator[Trial]:
    """Measure every solver; nothing if the packing is unstable to shear, as it may be in a fixed box."""
    try:
        chosen = complex_modulus(packing, _OMEGA, damping).method
    except ConvergenceError:
        return
    exact, unsure = refined_modulus(packing, _OMEGA, damping)

    panel = Panel(name, exact, unsure, _off_both, {"runs": 2, "budget": 0.1})
    ways = [("dense", "dense", "", SETTINGS), ("direct", "direct", "", SETTINGS)]
    for tolerance in _SHIFT_TOLERANCES:
        settings = replace(SETTINGS, tolerance=tolerance, quiet=1)
        ways.append(("reduced", "reduced, tolerance", f"{tolerance:g}", settings))
    for steps in _KRYLOV_STEPS:
        ways.append(("reduced", "reduced, Krylov steps", f"{steps} steps", replace(SETTINGS, steps=steps)))
    for method, way, setting, settings in ways:
        run = partial(complex_modulus, packing, _OMEGA, damping, method=method, settings=settings)
        yield panel.trial(way, setting, run, method == chosen and setting in ("", f"{SETTINGS.steps} steps"))


def _off_both(s: ComplexModulus, exact: Complex) -> float:
    """Largest relative error of G' or G''."""
    return max(float(np.abs(a / b - 1).max()) for a, b in ((s.storage, exact.real), (s.loss, exact.imag)))


def refined_modulus(packing: Packing, omega: NDArray[np.float64], damping: Damping) -> tuple[Complex, float]:
    """(m,) G* by a sparse LU for each frequency, refined with residuals and sums of 64-bit mantissa, and its error. The
    error is that of the equation, r^T r' / A with what the last refinement leaves, and of the last refinement."""
    network = force_network(packing)
    motion = equation_of_motion(network, damping)
    k, b = (m.toarray().astype(np.longdouble) for m in (motion.k_qq, motion.b_qq))
    corner = motion.k_gg, motion.b_gg
    values, unsure = [], 0.0
    for w in omega:
        column = motion.k_qg.astype(np.longdouble) + 1j * np.longdouble(w) * motion.b_qg
        matrix = k + 1j * np.longdouble(w) * b
        solver = splu((motion.k_qq + 1j * w * motion.b_qq).tocsc())
        q = np.zeros_like(column)
        modulus = []
        for _ in range(_REFINEMENTS):
            q = q + solver.solve((-column - matrix @ q).astype(np.complex128))
            modulus.append((corner[0] + 1j * np.longdouble(w) * corner[1] + column @ q) / motion.area)
        last, before = modulus[-1], modulus[-2]
        gaps = (abs(part(last) - part(before)) / abs(part(last)) for part in (np.real, np.imag))
        unsure = max(unsure, 1e-17, *map(float, gaps))
        values.append(complex(last))
    return np.array(values), unsure


SPECTRUM = Chart(
    "spectrum",
    "Complex shear modulus at 31 frequencies over ten decades",
    "largest relative error of G' or G''",
    "tolerance at which shifts end, one quiet update; or Krylov steps at a shift",
    "a sparse factorisation for each frequency, refined with numbers of 64 bits of mantissa until it stands",
    measure_spectra,
)
DROPLET_SPECTRUM = replace(
    SPECTRUM,
    name="droplet-spectrum",
    title=f"Complex shear modulus of {_DROPLETS} droplets at ρ = {_RHO}, 31 frequencies over ten decades",
    measure=measure_droplets,
)


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


INERTIA = Chart(
    "flow-in-time",
    f"Start-up of shear of {_FLOWING} disks to a strain of {_STRAIN:g}",
    "relative error of the stress",
    "tolerance: relative error of velocities in a step; mass of a disk in k τ₁²",
    "massless disks at a tolerance of 1e-9 in steps of at most 0.003 τ₁ (rate 0.01) and 0.03 τ₁ (0.001), its error by "
    "steps three times as long. Costs of small inertia are without the start of LAMMPS",
    measure_inertia,
)


def measure_solvers(seed: int) -> Iterator[Trial]:
    """Measure droplets in Stokes drag along both dials, disks with contact drag along the residual."""
    droplets = bring_on(default_way(_DROPLETS), jam("sp", _DROPLETS, seed), _RHO)
    disks = pack(_FLOWING, _PRESSURE, seed, ensemble="shear-stabilized")
    for rate in _SOLVER_RATES["dp"]:
        panel = f"{_DROPLETS} droplets, rate {rate:g}/τ₁"
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


SOLVERS = Chart(
    "flow-solvers",
    f"Start-up of shear to a strain of {_SOLVER_STRAIN:g}: steps of droplets, and the solver of velocities",
    "relative error of the stress",
    "tolerance: relative error of velocities in a step; residual of conjugate gradients over the driving force, at the "
    "default tolerance",
    f"droplets at a tolerance of {_PAIR[1]:g}, its error by one of {_PAIR[0]:g}; along the residual the same steps "
    f"with one of {_TIGHTEST[1]:g}, or, for solver and steps, those of a tolerance of {_PAIR[1]:g}. Droplets at "
    f"ρ = {_RHO} in Stokes drag, whose solver is preconditioned by a factorisation; disks at p = {_PRESSURE:g} k with "
    "contact drag",
    measure_solvers,
)
