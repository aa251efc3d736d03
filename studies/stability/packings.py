"""Maps where making a packing fails: minimisers, pressures, two sizes, onset, quasi-static compression, droplets."""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from scipy import linalg

from jamlab.engine.deck_defaults import defaults
from jamlab.engine.session import Session
from jamlab.errors import EngineError
from jamlab.mechanics.stiffness import hessian
from jamlab.packing.packing import Packing
from jamlab.protocols.compression import compress
from jamlab.protocols.decompression import LEAST_NOISE
from jamlab.protocols.droplets_from_disks import droplets_from_disks
from jamlab.protocols.moduli import shear_modulus
from jamlab.protocols.onset import jam
from jamlab.protocols.random_start import droplet_params, random_disks
from jamlab.protocols.relaxation import relax_session, usual_force_tolerance
from jamlab.protocols.size_distributions import SIZE_LIMITS
from jamlab.protocols.target_pressure import pack
from studies.stability.map import Map, Trial, balanced, judge_descent, worst_of
from studies.stability.plain_physics import plain_forces, plain_packing_fraction, plain_pressure, plain_shear_modulus

FORCE = usual_force_tolerance("sp")
GAMMA, KA = (float(defaults("dp")[name]) for name in ("gamma", "ka"))
_SAME_ENERGY = 1e-4  # relative: states of a sweep meet their packing fraction to 1e-6 only
_SAME_MODULUS = 1e-6  # of the affine modulus: two ways to sum the same second derivatives
_FINEST = 1e-3  # step of rho, half of the least in the map: no step is compared with itself
_COVERED = 2e-4  # error of rho that the plain union of outlines leaves room for
_JOLT = {"sp": 0.02, "dp": 2e-3}  # small diameters, l: descent leads back to the same minimum
_STEPS = 10_000  # after which FIRE counts as stalled
_LOOSE = 1e-4  # kinks of their contacts keep FIRE on droplets above the tolerance of a minimum

packed = lru_cache(maxsize=64)(pack)  # a row of a map asks for its packings again and again
_onset = lru_cache(maxsize=64)(jam)


@lru_cache(maxsize=64)
def swept(n: int, rho: float, seed: int, step: float = 0.02) -> Packing:
    """Disks compressed from onset to a true packing fraction."""
    *_, packing = compress(_onset(n, "sp", seed), rho, step)
    return packing


# minimisers -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Jolted:
    """A packing whose sites were moved a little, the minimum where they were, and the energy there."""

    start: Packing
    minimum: Packing
    energy: float


def jolt(start: Packing, seed: int) -> Jolted:
    """Relax a packing and move its sites at random."""
    with Session(start) as session:
        found = relax_session(session)
        minimum = session.packing()
    moves = _JOLT[start.model] * np.random.default_rng(seed).standard_normal(minimum.positions.shape)
    return Jolted(minimum.with_state(positions=minimum.positions + moves), minimum, found.evaluation.energy)


@lru_cache(maxsize=16)
def disks(n: int, seed: int) -> Jolted:
    """Disks beside their minimum."""
    return jolt(random_disks(n, seed, phi=0.9), seed)


@lru_cache(maxsize=64)
def droplets(ka: float, seed: int) -> Jolted:
    """Four droplets of an area stiffness beside their minimum."""
    return jolt(droplets_from_disks(swept(4, 0.88, seed), law={"ka": ka}), seed)


def try_fire(timestep: float, ka: float, seed: int) -> Trial:
    """FIRE of plain LAMMPS decks on droplets with another time step, to the force that it can reach, in any minimum."""
    jolted = droplets(ka, seed)
    with Session(jolted.start) as session:
        before = session.evaluate().energy
        try:
            session.use_minimizer("fire")
            session.command(f"timestep {timestep}")
            session.command("min_modify dmax 0.1")
            session.command(f"minimize 0.0 {0.5 * _LOOSE:g} {_STEPS} {10 * _STEPS}")
            if len(session.self_crossings()):
                raise EngineError("a droplet folds over itself")
        except EngineError as error:
            return Trial("diverged", str(error).splitlines()[0])
        end = session.evaluate()
        verdict = judge_descent(end.max_force, _LOOSE, end.energy, before, jolted.energy)
        if verdict == "diverged":
            return Trial(verdict, f"energy {end.energy:.1g}")
        found = balanced(verdict, session.packing(), _LOOSE)
    return replace(found, verdict="converged") if verdict == "another minimum" else found


def try_tolerance(tolerance: float, n: int, seed: int) -> Trial:
    """`relax` down to a tolerance."""
    jolted = disks(n, seed)
    with Session(jolted.start) as session:
        before = session.evaluate().energy
        found = relax_session(session, tolerance)
        end, packing = found.evaluation, session.packing()
    verdict = judge_descent(end.max_force, tolerance, end.energy, before, jolted.energy)
    if found.converged != (end.max_force <= tolerance):
        return Trial("converged", "converged contradicts max_force", np.inf, tolerance)
    return balanced(verdict, packing, tolerance)


def longest_step(ka: float, seed: int) -> float:
    """2 over the largest frequency at the minimum; masses are 1."""
    return float(2 / np.sqrt(linalg.eigvalsh(hessian(droplets(ka, seed).minimum).toarray())[-1]))


# protocols of disks ---------------------------------------------------------------------------------------------------


def try_pressure(pressure: float, n: int, seed: int, **sizes: Any) -> Trial:
    """A packing at a pressure, its forces, pressure and shear modulus; `sizes` as in `pack`."""
    packing = pack(n, pressure, seed, **sizes)  # refuses what did not converge
    return worst_of(
        balanced("converged", packing, FORCE),
        Trial("converged", "pressure", abs(plain_pressure(packing) / pressure - 1), 1e-6),
        modulus_trial(packing, shear_modulus(packing, direction="simple")),
    )


def modulus_trial(packing: Packing, modulus: float) -> Trial:
    """Compare a shear modulus with the modulus of the plain Hessian."""
    try:
        plain = plain_shear_modulus(packing)
    except np.linalg.LinAlgError as error:
        return Trial("converged", f"G = {modulus:.3g}, but {error}", np.inf)
    scale = abs(shear_modulus(packing, "affine", direction="simple"))
    return Trial("converged", f"G = {modulus:.3g}", abs(modulus - plain) / scale, _SAME_MODULUS)


def try_onset(tolerance: float, n: int, seed: int) -> Trial:
    """A packing at onset: forces, and the contact energy per disk within its window."""
    packing = jam(n, "sp", seed, force_tolerance=tolerance)
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
    packing, finest = swept(12, rho, seed, step), swept(12, rho, seed, _FINEST)
    if not (packing.converged and packing.on_target):
        return Trial("stalled", f"max force {packing.max_force:.1g}, on target: {packing.on_target}")
    same = abs(plain_forces(packing)[0] / plain_forces(finest)[0] - 1) < _SAME_ENERGY
    verdict = "converged" if same else "another minimum"
    return worst_of(
        balanced(verdict, packing, FORCE), Trial(verdict, "rho", abs(plain_packing_fraction(packing) - rho), 2e-4)
    )


# droplets from disks --------------------------------------------------------------------------------------------------


def try_hand_over(rho: float, gamma: float, seed: int, ka: float = KA) -> Trial:
    """Droplets with other parameters in the place of jammed disks: forces, and what they cover."""
    packing = droplets_from_disks(swept(4, rho, seed), law={"gamma": gamma, "ka": ka})
    if not packing.converged:
        return Trial("stalled", f"max force {packing.max_force:.1g}")
    handed = packing.provenance["handover"]
    verdict = "converged" if handed["continuous"] else "another minimum"
    return worst_of(
        balanced(verdict, packing, usual_force_tolerance("dp"), stiffness=max(1.0, ka + gamma)),
        Trial(verdict, "rho", abs(plain_packing_fraction(packing) - handed["rho"]), _COVERED),
    )


def collapse(ka: float, seed: int = 1) -> float:
    """Line tension at which a free small droplet shrinks to a point, gamma = 2 ka (a0/3)^(3/2)/sqrt(c)."""
    nv, params = droplet_params(2)
    c = nv[0] * np.tan(np.pi / nv[0])
    return float(2 * ka * (params["a0"][0] / 3) ** 1.5 / np.sqrt(c))


MAPS = (
    Map("droplet-timestep", try_fire, longest_step, (0.1, KA)),
    Map("large-n", try_tolerance, lambda n, seed: float(np.spacing(disks(n, seed).minimum.box.max())), (FORCE, None)),
    Map("pressure", try_pressure, lambda *_: FORCE / LEAST_NOISE),
    Map(
        "polydisperse",
        lambda ratio, large, seed: try_pressure(1e-2, 24, seed, size_ratio=ratio, fraction_large=large),
        lambda *_: SIZE_LIMITS.largest_ratio,
        (1.4, 0.5),
    ),
    Map(
        "onset-tolerance",
        try_onset,
        lambda *_: float(np.sqrt(2 * float(defaults("onset")["u_contact"]))),
        (FORCE, None),
    ),
    Map("sweep-step", try_step),
    Map("droplet-elasticity", lambda gamma, ka, seed: try_hand_over(0.88, gamma, seed, ka), collapse, (GAMMA, KA)),
    Map("droplet-density", try_hand_over, defaults=(None, GAMMA)),
)
