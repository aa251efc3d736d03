"""Maps where disks fail: minimisers, pressures, polydispersity, the search for onset, quasi-static sweeps."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Any

import numpy as np
from scipy import linalg

from jamlab.engine.deck_defaults import defaults
from jamlab.engine.session import Evaluation, Session
from jamlab.errors import EngineError
from jamlab.mechanics.stiffness import hessian
from jamlab.packing.deformation import at_phi
from jamlab.packing.packing import Packing
from jamlab.protocols.compression import compress
from jamlab.protocols.moduli import shear_modulus
from jamlab.protocols.onset import jam
from jamlab.protocols.random_start import random_disks
from jamlab.protocols.relaxation import force_tolerance, relax
from jamlab.protocols.size_distributions import LARGEST_RATIO
from jamlab.protocols.solver_settings import SOLVERS
from jamlab.protocols.target_pressure import LEAST_NOISE, pack
from studies.stability.map import Axis, Map, Trial, balanced, judge_descent, linear_axis, log_axis, worst_of
from studies.stability.plain_physics import (
    plain_forces,
    plain_packing_fraction,
    plain_pressure,
    plain_shear_modulus,
)

_JOLT = 0.02  # small diameters: meant to leave the minimum, not its basin
_STEPS = 10_000  # after which a method counts as stalled
_LOOSE = 1e-8  # force asked of overdamped steps: they converge slowly
_SHRUNK = 0.3  # of its diameter: such a disk finds room in the gaps


@dataclass(frozen=True)
class Jolted:
    """A packing whose sites were moved a little, the minimum where they were, and the energy there."""

    start: Packing
    minimum: Packing
    energy: float

    @property
    def stiffnesses(self) -> np.ndarray:
        """Eigenvalues of the Hessian at the minimum, ascending; masses are 1."""
        return np.asarray(linalg.eigvalsh(hessian(self.minimum).toarray()))


packed = lru_cache(maxsize=64)(pack)  # a row of a map asks for its packings again and again


@lru_cache(maxsize=16)
def jolt_minimum(n: int, phi: float, seed: int = 1) -> Jolted:
    """Find a minimum and move its disks a little."""
    return jolt(random_disks(n, seed, phi=phi), seed)


def jolt(start: Packing, seed: int, length: float = _JOLT) -> Jolted:
    """Relax a packing and move its sites, by `length` on average."""
    with Session(start) as session:
        found = relax(session)
        minimum = session.packing()
    moves = length * np.random.default_rng(seed).standard_normal(minimum.positions.shape)
    return Jolted(minimum.with_state(positions=minimum.positions + moves), minimum, found.evaluation.energy)


def try_fire(jolted: Jolted, tolerance: float, timestep: float, dmax: float = 0.1) -> Trial:
    """FIRE of plain LAMMPS decks with another time step and another longest move."""

    def descend(session: Session) -> Evaluation:
        session.use_minimizer("fire")
        session.command(f"timestep {timestep}")
        session.command(f"min_modify dmax {dmax}")
        session.command(f"minimize 0.0 {0.5 * tolerance:g} {_STEPS} {10 * _STEPS}")
        if len(session.self_crossings()):
            raise EngineError("a droplet folds over itself")
        return session.evaluate()

    return try_descent(jolted, tolerance, descend)


def try_descent(jolted: Jolted, tolerance: float, descend: Callable[[Session], Evaluation]) -> Trial:
    """Descend from the start in some way, down to a tolerance."""
    with Session(jolted.start) as session:
        before = session.evaluate().energy
        try:
            end = descend(session)
        except EngineError as error:
            return Trial("blew up", str(error).splitlines()[0])
        verdict = judge_descent(end.max_force, tolerance, end.energy, before, jolted.energy)
        if verdict == "blew up":
            return Trial(verdict, f"energy {end.energy:.1g}")
        return balanced(verdict, session.packing(), tolerance)


def try_overdamped_steps(jolted: Jolted, timestep: float, steps: int = _STEPS) -> Trial:
    """Steps x -> x + f dt, Stokes drag of 1."""
    with Session(jolted.start) as session:
        x = jolted.start.positions
        before, forces = session.forces_at(x)
        energy, left = before, np.inf
        for _ in range(steps):
            x = x + timestep * forces
            try:
                energy, forces = session.forces_at(x)
            except EngineError as error:
                return Trial("blew up", str(error).splitlines()[0])
            left = float(np.hypot(*forces.T).max())
            if left <= _LOOSE or not energy < 10 * before:
                break
        verdict = judge_descent(left, _LOOSE, energy, before, jolted.energy)
        return Trial(verdict) if verdict == "blew up" else balanced(verdict, session.packing(), _LOOSE)


def try_gradients(jolted: Jolted, steps: float) -> Trial:
    """Conjugate gradients alone, so many steps at most."""
    tolerance = force_tolerance("sp")
    return try_descent(jolted, tolerance, lambda s: s.minimize(tolerance, style="cg", steps=int(steps)))


def try_tolerance(jolted: Jolted, tolerance: float) -> Trial:
    """`relax` down to a tolerance."""
    with Session(jolted.start) as session:
        before = session.evaluate().energy
        found = relax(session, tolerance)
        end, packing = found.evaluation, session.packing()
    verdict = judge_descent(end.max_force, tolerance, end.energy, before, jolted.energy)
    if found.converged != (end.max_force <= tolerance):
        return Trial("converged", "converged contradicts max_force", np.inf, tolerance)
    return balanced(verdict, packing, tolerance)


@lru_cache(maxsize=16)
def loosen(count: int, seed: int) -> Jolted:
    """24 disks, some of which are so small that they rattle."""
    start = random_disks(24, seed, phi=1.0)
    assert start.diameters is not None
    diameters = start.diameters.copy()
    diameters[np.random.default_rng(seed).permutation(24)[:count]] *= _SHRUNK
    return jolt(at_phi(start.with_state(diameters=diameters), 0.92), seed)


def steps_of_gradients(jolted: Jolted) -> float:
    """Bound of conjugate gradients on a quadratic energy: sqrt(kappa)/2 ln(2/error), zero modes left out."""
    stiff = jolted.stiffnesses
    kappa = stiff[-1] / stiff[stiff > 1e-8 * stiff[-1]][0]
    return float(0.5 * np.sqrt(kappa) * np.log(2 * _JOLT / force_tolerance("sp")))


def way_over_steps(jolted: Jolted) -> float:
    """Longest move from the start to the minimum, in as many equal steps as there may be."""
    return float(np.hypot(*(jolted.start.positions - jolted.minimum.positions).T).max() / _STEPS)


_CHECK = "Forces at the end computed anew from the force law, over all pairs and images."
_PHI = "packing fraction φ"

_MINIMISERS = (
    Map(
        "fire-timestep",
        "FIRE of plain LAMMPS decks: time step, N = 16",
        log_axis("time step, τ", 0.02, 20.0, 0.1),
        linear_axis(_PHI, 0.85, 1.18),
        8,
        lambda x, phi, seed: try_fire(jolt_minimum(16, phi, seed), force_tolerance("sp"), x),
        "FIRE shortens steps that lead uphill: just beyond the limit of a fixed step it ends in other minima, and "
        "farther on it blows up.",
        _CHECK,
        (lambda phi, seed: 2 / np.sqrt(jolt_minimum(16, phi, seed).stiffnesses[-1]), "$2/\\omega_{\\max}$"),
    ),
    Map(
        "fire-dmax",
        "FIRE of plain LAMMPS decks: longest move, φ = 0.9",
        log_axis("longest move in a step, mean diameter", 1e-8, 1e3, 0.1),
        Axis("N", (8, 10, 12, 16, 20, 24, 32, 40, 48, 64, 80, 96)),
        4,
        lambda x, n, seed: try_fire(jolt_minimum(n, 0.9, seed), force_tolerance("sp"), 0.1, x),
        "Short moves end before the minimum is met; long ones are cut by the time step before they do harm.",
        _CHECK,
        (lambda n, seed: way_over_steps(jolt_minimum(n, 0.9, seed)), "way to the minimum over 10 000 steps"),
    ),
    Map(
        "overdamped",
        "Overdamped steps of disks: time step, N = 16",
        log_axis("time step over drag, τ₁", 0.05, 2.0),
        linear_axis(_PHI, 0.85, 1.18),
        2,
        lambda x, phi, seed: try_overdamped_steps(jolt_minimum(16, phi, seed), x, 3000),
        "Explicit steps are stable below 2 over the largest eigenvalue of the Hessian.",
        _CHECK,
        (lambda phi, seed: 2 / jolt_minimum(16, phi, seed).stiffnesses[-1], "$2/\\lambda_{\\max}$"),
    ),
    Map(
        "gradients-rattlers",
        "Conjugate gradients alone: steps allowed against rattlers, N = 24",
        log_axis("steps allowed", 10, SOLVERS.relaxation.cg_steps * 2, SOLVERS.relaxation.cg_steps),
        Axis("small disks, of 24", tuple(range(12)), logarithmic=False),
        6,
        lambda steps, count, seed: try_gradients(loosen(count, seed), steps),
        "Rattlers that just touch and soft modes cost steps; `relax` lets FIRE and Newton steps follow.",
        _CHECK,
        (
            lambda count, seed: steps_of_gradients(loosen(count, seed)),
            "$\\frac{1}{2}\\sqrt{\\kappa}\\,\\ln(2/\\epsilon)$",
        ),
    ),
    Map(
        "large-n",
        "Minima of disks, large N: force tolerance, φ = 0.9",
        log_axis("largest force asked for, ε/d", 1e-17, 1e-6, force_tolerance("sp")),
        Axis("N", (8, 12, 16, 24, 32, 48, 64, 96, 128, 256, 512, 1024)),
        1,
        lambda tolerance, n, seed: try_tolerance(jolt_minimum(n, 0.9, seed), tolerance),
        "The floor is the rounding of positions and of sums of forces; `converged` is False below it.",
        _CHECK,
        (lambda n, seed: np.spacing(jolt_minimum(n, 0.9, seed).minimum.box.max()), "last digit of a position"),
    ),
)


_SAME_ENERGY = 1e-4  # relative: states of a sweep meet their packing fraction to 1e-6 only
_SAME_MODULUS = 1e-6  # of the affine modulus: two ways to sum the same second derivatives


def try_pressure(pressure: float, n: int, seed: int, **how: Any) -> Trial:
    """A packing at a pressure, its forces, pressure and shear modulus; `how` as in `pack`."""
    packing = pack(n, pressure, seed, **how)  # refuses what did not converge
    return worst_of(
        balanced("converged", packing, force_tolerance("sp")),
        Trial("converged", "pressure", abs(plain_pressure(packing) / pressure - 1), 1e-6),
        modulus_trial(packing, float(shear_modulus(packing))),
    )


def modulus_trial(packing: Packing, modulus: float, allowed: float = _SAME_MODULUS) -> Trial:
    """Compare a shear modulus with that of the plain Hessian."""
    try:
        plain = plain_shear_modulus(packing)
    except np.linalg.LinAlgError as error:
        return Trial("converged", f"G = {modulus:.3g}, but {error}", np.inf, allowed)
    scale = abs(float(shear_modulus(packing, "affine")))
    return Trial("converged", f"G = {modulus:.3g}", abs(modulus - plain) / scale, allowed)


def try_onset(tolerance: float, n: int, seed: int) -> Trial:
    """A packing at onset: forces, and the contact energy per disk within its window."""
    packing = jam("sp", n, seed, tolerance=tolerance)
    if not packing.converged:
        return Trial("stalled", f"max force {packing.max_force:.1g}")
    window = defaults("onset")
    energy = plain_forces(packing)[0] / n
    outside = max(energy / float(window["u_jammed"]), float(window["u_contact"]) / max(energy, 1e-300))
    return worst_of(
        balanced("converged", packing, tolerance),
        Trial("converged", f"contact energy per disk {energy:.2g}", outside, 1 + 1e-6),
    )


def try_step(step: float, rho: float, seed: int) -> Trial:
    """A sweep with steps of one length: its last state, and whether shorter steps end in another minimum."""
    packing, finest = _sweep(rho, seed, step), _sweep(rho, seed, _FINEST)
    if not (packing.converged and packing.on_target):
        return Trial("stalled", f"max force {packing.max_force:.1g}, on target: {packing.on_target}")
    same = abs(plain_forces(packing)[0] / plain_forces(finest)[0] - 1) < _SAME_ENERGY
    return worst_of(
        balanced("converged" if same else "another basin", packing, force_tolerance("sp")),
        Trial("converged" if same else "another basin", "rho", abs(plain_packing_fraction(packing) - rho), 2e-4),
    )


@lru_cache(maxsize=64)
def _sweep(rho: float, seed: int, step: float) -> Packing:
    *_, packing = compress(_onset(seed), rho, step)
    return packing


@lru_cache(maxsize=64)
def _onset(seed: int) -> Packing:
    return jam("sp", 12, seed)


_RHO_STEPS = log_axis("step in ρ", 2e-3, 0.2)
_FINEST = 0.5 * float(_RHO_STEPS.values[0])  # no step of the map is compared with itself
_PRESSURES = (3e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.05, 0.1, 0.2, 0.3, 0.5)
_WITH_MODULUS = (
    "Forces, pressure and the shear modulus anew, over all pairs and images, with a dense Hessian by complex steps."
)

_AT_PRESSURE = Map(
    "pressure",
    "Packings at a pressure, and their shear modulus",
    Axis("pressure, k", _PRESSURES),
    Axis("N", (4, 6, 8, 10, 12, 16, 20, 24, 32, 40, 48, 64)),
    2,
    try_pressure,
    "Refused: pressures out of reach of the force tolerance, unstable packings in a box that cannot shear, and "
    "searches that end in a basin without the pressure.",
    _WITH_MODULUS,
    (lambda *_: force_tolerance("sp") / LEAST_NOISE, "force tolerance over $10^{-4}$"),
)
MAPS = (
    *_MINIMISERS,
    _AT_PRESSURE,
    replace(
        _AT_PRESSURE,
        name="pressure-sheared",
        title="Packings at a pressure in a box that shears until no shear stress is left",
        seeds=3,
        attempt=partial(try_pressure, ensemble="shear-stabilized"),
        meaning="Refused besides: searches of few disks near onset that end without the pressure; another seed may "
        "meet it.",
    ),
    Map(
        "polydisperse",
        "Two sizes: ratio against share of the large ones, N = 24, p = 10⁻² k",
        log_axis("large over small diameter", 1.0, 11.0, 1.4),
        linear_axis("number share of the large disks", 1 / 24, 23 / 24, 0.5),
        2,
        lambda ratio, large, seed: try_pressure(1e-2, 24, seed, ratio=ratio, large=large),
        "Few large disks among many small ones leave most of them rattling; beyond a ratio of 10 jamlab refuses.",
        _WITH_MODULUS,
        (lambda *_: LARGEST_RATIO, "largest ratio that is taken"),
    ),
    Map(
        "onset-tolerance",
        "Search for onset: force tolerance against N",
        log_axis("largest force asked for, ε/d", 1e-16, 1e-6, force_tolerance("sp")),
        Axis("N", (4, 6, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40)),
        2,
        try_onset,
        "Contacts at onset press with 1e-8 and more; a force left must stay far below, so jamlab refuses above "
        "1e-9, and below what rounding leaves.",
        "Forces and contact energy anew, over all pairs and images; the energy must lie in its window.",
        (
            lambda *_: float(np.sqrt(2 * float(defaults("onset")["u_contact"]))),
            "contact force at onset, $\\sqrt{2u}$",
        ),
    ),
    Map(
        "sweep-step",
        "Quasi-static compression in one go: step against packing fraction, N = 12",
        _RHO_STEPS,
        linear_axis("true packing fraction ρ", 0.85, 0.999),
        2,
        try_step,
        "Long steps jump to other minima, which are minima all the same; near confluence ρ is missed.",
        "Forces anew; ρ anew as the area of a union of polygons.",
    ),
)
