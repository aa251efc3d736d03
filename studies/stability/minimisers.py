"""Maps where minimisers fail: FIRE of plain decks on disks and droplets, conjugate gradients, `relax`."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy import linalg

from jamlab.engine.deck_defaults import defaults
from jamlab.engine.session import Evaluation, Session
from jamlab.errors import EngineError
from jamlab.mechanics.stiffness import hessian
from jamlab.packing.deformation import at_phi
from jamlab.packing.packing import Packing
from jamlab.protocols.droplets_from_disks import to_polygons
from jamlab.protocols.random_start import random_disks
from jamlab.protocols.relaxation import force_tolerance, relax
from jamlab.protocols.solver_settings import SOLVERS
from studies.stability.map import Axis, Map, Trial, balanced, judge_descent, linear_axis, log_axis
from studies.stability.packings import swept

_JOLT, _JOLT_DROPLETS = 0.02, 2e-3  # small diameters, l: meant to leave the minimum, not its basin
_STEPS = 10_000  # after which a method counts as stalled
_FORCE = force_tolerance("sp")
_LOOSE = 1e-4  # kinks of their contacts keep FIRE above the tolerance of a minimum
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


def jolt(start: Packing, seed: int, length: float = _JOLT) -> Jolted:
    """Relax a packing and move its sites, by `length` on average."""
    with Session(start) as session:
        found = relax(session)
        minimum = session.packing()
    moves = length * np.random.default_rng(seed).standard_normal(minimum.positions.shape)
    return Jolted(minimum.with_state(positions=minimum.positions + moves), minimum, found.evaluation.energy)


@lru_cache(maxsize=16)
def disks(n: int, phi: float, seed: int = 1) -> Jolted:
    """Disks beside their minimum."""
    return jolt(random_disks(n, seed, phi=phi), seed)


@lru_cache(maxsize=16)
def rattlers(count: int, seed: int) -> Jolted:
    """24 disks, some of which are so small that they rattle."""
    start = random_disks(24, seed, phi=1.0)
    assert start.diameters is not None
    diameters = start.diameters.copy()
    diameters[np.random.default_rng(seed).permutation(24)[:count]] *= _SHRUNK
    return jolt(at_phi(start.with_state(diameters=diameters), 0.92), seed)


@lru_cache(maxsize=64)
def droplets(ka: float, seed: int) -> Jolted:
    """Four droplets of an area stiffness beside their minimum."""
    return jolt(to_polygons(swept(4, 0.88, seed), ka=ka), seed, _JOLT_DROPLETS)


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


def try_fire(jolted: Jolted, timestep: float, dmax: float = 0.1, tolerance: float = _FORCE) -> Trial:
    """FIRE of plain LAMMPS decks with another time step and another longest move."""

    def descend(session: Session) -> Evaluation:
        session.use_minimizer("fire")
        session.command(f"timestep {timestep}")
        session.command(f"min_modify dmax {dmax}")
        session.command(f"minimize 0.0 {0.5 * tolerance:g} {_STEPS} {10 * _STEPS}")
        if jolted.start.offsets is not None and len(session.self_crossings()):
            raise EngineError("a droplet folds over itself")
        return session.evaluate()

    return try_descent(jolted, tolerance, descend)


def try_loose_fire(jolted: Jolted, timestep: float) -> Trial:
    """The same of droplets, to the force that it can reach, in any basin."""
    trial = try_fire(jolted, timestep, tolerance=_LOOSE)
    return replace(trial, verdict="converged") if trial.verdict == "another basin" else trial


def try_gradients(jolted: Jolted, steps: float) -> Trial:
    """Conjugate gradients alone, so many steps at most."""
    return try_descent(jolted, _FORCE, lambda session: session.minimize(_FORCE, style="cg", steps=int(steps)))


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


def steps_of_gradients(jolted: Jolted) -> float:
    """Bound of conjugate gradients on a quadratic energy: sqrt(kappa)/2 ln(2/error), zero modes left out."""
    stiff = jolted.stiffnesses
    kappa = stiff[-1] / stiff[stiff > 1e-8 * stiff[-1]][0]
    return float(0.5 * np.sqrt(kappa) * np.log(2 * _JOLT / _FORCE))


def way_over_steps(jolted: Jolted) -> float:
    """Longest move from the start to the minimum, in as many equal steps as there may be."""
    return float(np.hypot(*(jolted.start.positions - jolted.minimum.positions).T).max() / _STEPS)


MAPS = (
    Map(
        *("fire-timestep", log_axis(0.02, 20.0, 0.1), linear_axis(0.85, 1.18), 8),
        lambda timestep, phi, seed: try_fire(disks(16, phi, seed), timestep),
        lambda phi, seed: 2 / np.sqrt(disks(16, phi, seed).stiffnesses[-1]),
    ),
    Map(
        *("fire-dmax", log_axis(1e-8, 1e3, 0.1), Axis((8, 10, 12, 16, 20, 24, 32, 40, 48, 64, 80, 96)), 4),
        lambda dmax, n, seed: try_fire(disks(n, 0.9, seed), 0.1, dmax),
        lambda n, seed: way_over_steps(disks(n, 0.9, seed)),
    ),
    Map(
        "gradients-rattlers",
        log_axis(10, SOLVERS.relaxation.cg_steps * 2, SOLVERS.relaxation.cg_steps),
        *(Axis(tuple(range(12)), logarithmic=False), 6),
        lambda steps, count, seed: try_gradients(rattlers(count, seed), steps),
        lambda count, seed: steps_of_gradients(rattlers(count, seed)),
    ),
    Map(
        *("large-n", log_axis(1e-17, 1e-6, _FORCE), Axis((8, 12, 16, 24, 32, 48, 64, 96, 128, 256, 512, 1024)), 1),
        lambda tolerance, n, seed: try_tolerance(disks(n, 0.9, seed), tolerance),
        lambda n, seed: np.spacing(disks(n, 0.9, seed).minimum.box.max()),
    ),
    Map(
        *("droplet-timestep", log_axis(1e-3, 10.0, 0.1), log_axis(3.0, 3e5, float(defaults("dp")["ka"])), 3),
        lambda timestep, ka, seed: try_loose_fire(droplets(ka, seed), timestep),
        lambda ka, seed: 2 / np.sqrt(droplets(ka, seed).stiffnesses[-1]),
    ),
)
