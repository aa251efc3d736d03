"""Maps where making a packing of disks fails: pressures, two sizes, the search for onset, quasi-static compression."""

from functools import lru_cache, partial
from typing import Any

import numpy as np

from jamlab.engine.deck_defaults import defaults
from jamlab.packing.packing import Packing
from jamlab.protocols.compression import compress
from jamlab.protocols.moduli import shear_modulus
from jamlab.protocols.onset import jam
from jamlab.protocols.relaxation import force_tolerance
from jamlab.protocols.size_distributions import LARGEST_RATIO
from jamlab.protocols.target_pressure import LEAST_NOISE, pack
from studies.stability.map import Axis, Map, Trial, balanced, linear_axis, log_axis, worst_of
from studies.stability.plain_physics import plain_forces, plain_packing_fraction, plain_pressure, plain_shear_modulus

_SAME_ENERGY = 1e-4  # relative: states of a sweep meet their packing fraction to 1e-6 only
_SAME_MODULUS = 1e-6  # of the affine modulus: two ways to sum the same second derivatives
_STEPS = log_axis(2e-3, 0.2)  # of rho
_FINEST = 0.5 * float(_STEPS.values[0])  # no step of the map is compared with itself

packed = lru_cache(maxsize=64)(pack)  # a row of a map asks for its packings again and again
_onset = lru_cache(maxsize=64)(partial(jam, "sp"))


@lru_cache(maxsize=64)
def swept(n: int, rho: float, seed: int, step: float = 0.02) -> Packing:
    """Disks compressed from onset to a true packing fraction."""
    *_, packing = compress(_onset(n, seed), rho, step)
    return packing


def try_pressure(pressure: float, n: int, seed: int, **how: Any) -> Trial:
    """A packing at a pressure, its forces, pressure and shear modulus; `how` as in `pack`."""
    packing = pack(n, pressure, seed, **how)  # refuses what did not converge
    return worst_of(
        balanced("converged", packing, force_tolerance("sp")),
        Trial("converged", "pressure", abs(plain_pressure(packing) / pressure - 1), 1e-6),
        modulus_trial(packing, float(shear_modulus(packing))),
    )


def modulus_trial(
    packing: Packing, modulus: float, allowed: float = _SAME_MODULUS, verdict: str = "converged"
) -> Trial:
    """Compare a shear modulus with that of the plain Hessian."""
    try:
        plain = plain_shear_modulus(packing)
    except np.linalg.LinAlgError as error:
        return Trial(verdict, f"G = {modulus:.3g}, but {error}", np.inf, allowed)
    scale = abs(float(shear_modulus(packing, "affine")))
    return Trial(verdict, f"G = {modulus:.3g}", abs(modulus - plain) / scale, allowed)


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
    packing, finest = swept(12, rho, seed, step), swept(12, rho, seed, _FINEST)
    if not (packing.converged and packing.on_target):
        return Trial("stalled", f"max force {packing.max_force:.1g}, on target: {packing.on_target}")
    same = abs(plain_forces(packing)[0] / plain_forces(finest)[0] - 1) < _SAME_ENERGY
    verdict = "converged" if same else "another basin"
    return worst_of(
        balanced(verdict, packing, force_tolerance("sp")),
        Trial(verdict, "rho", abs(plain_packing_fraction(packing) - rho), 2e-4),
    )


_PRESSURES = Axis((3e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.05, 0.1, 0.2, 0.3, 0.5))
_SIZES = Axis((4, 6, 8, 10, 12, 16, 20, 24, 32, 40, 48, 64))
_FORCE = force_tolerance("sp")

MAPS = (
    Map("pressure", _PRESSURES, _SIZES, 2, try_pressure, lambda *_: _FORCE / LEAST_NOISE),
    Map(
        *("pressure-sheared", _PRESSURES, _SIZES, 3),
        partial(try_pressure, ensemble="shear-stabilized"),
        lambda *_: _FORCE / LEAST_NOISE,
    ),
    Map(
        *("polydisperse", log_axis(1.0, 11.0, 1.4), linear_axis(1 / 24, 23 / 24, 0.5), 2),
        lambda ratio, large, seed: try_pressure(1e-2, 24, seed, ratio=ratio, large=large),
        lambda *_: LARGEST_RATIO,
    ),
    Map(
        *("onset-tolerance", log_axis(1e-16, 1e-6, _FORCE), Axis((4, 6, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40)), 2),
        try_onset,
        lambda *_: float(np.sqrt(2 * float(defaults("onset")["u_contact"]))),
    ),
    Map("sweep-step", _STEPS, linear_axis(0.85, 0.999), 2, try_step),
)
