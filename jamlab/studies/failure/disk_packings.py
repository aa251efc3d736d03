"""Maps where packings of disks fail: pressures, polydispersity, the search for onset, quasi-static sweeps."""

from dataclasses import replace
from functools import lru_cache
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
from jamlab.studies.failure.map import Axis, Map, Trial, balanced, linear_axis, log_axis, worst_of
from jamlab.studies.failure.plain_physics import (
    plain_forces,
    plain_packing_fraction,
    plain_pressure,
    plain_shear_modulus,
)

_SAME_ENERGY = 1e-4  # relative: states of a sweep meet their packing fraction to 1e-6 only
_SAME_MODULUS = 1e-6  # of the affine modulus: two ways to sum the same second derivatives


def try_pressure(n: int, pressure: float, seed: int, **how: Any) -> Trial:
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


def try_onset(n: int, tolerance: float, seed: int) -> Trial:
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


def try_step(rho: float, seed: int, step: float) -> Trial:
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


_STEPS = log_axis("step in ρ", 2e-3, 0.2)
_FINEST = 0.5 * float(_STEPS.values[0])  # no step of the map is compared with itself
_PRESSURES = (3e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.05, 0.1, 0.2, 0.3, 0.5)
_CHECK = (
    "Forces, pressure and the shear modulus anew, over all pairs and images, with a dense Hessian by complex steps."
)

_AT_PRESSURE = Map(
    "pressure",
    "Packings at a pressure, and their shear modulus",
    Axis("pressure, k", _PRESSURES),
    Axis("N", (4, 6, 8, 10, 12, 16, 20, 24, 32, 40, 48, 64)),
    2,
    lambda n, seed: (n, seed),
    lambda start, pressure: try_pressure(start[0], pressure, start[1]),
    "Refused: pressures out of reach of the force tolerance, unstable packings in a box that cannot shear, and "
    "searches that end in a basin without the pressure.",
    _CHECK,
    (lambda start: force_tolerance("sp") / LEAST_NOISE, "force tolerance over $10^{-4}$"),
)
MAPS = (
    _AT_PRESSURE,
    replace(
        _AT_PRESSURE,
        name="pressure-sheared",
        title="Packings at a pressure in a box that shears until no shear stress is left",
        seeds=3,
        attempt=lambda start, pressure: try_pressure(start[0], pressure, start[1], ensemble="shear-stabilized"),
        meaning="Refused besides: searches of few disks near onset that end without the pressure; another seed may "
        "meet it.",
    ),
    Map(
        "polydisperse",
        "Two sizes: ratio against share of the large ones, N = 24, p = 10⁻² k",
        log_axis("large over small diameter", 1.0, 11.0, 1.4),
        linear_axis("number share of the large disks", 1 / 24, 23 / 24, 0.5),
        2,
        lambda large, seed: (large, seed),
        lambda start, ratio: try_pressure(24, 1e-2, start[1], ratio=ratio, large=start[0]),
        "Few large disks among many small ones leave most of them rattling; beyond a ratio of 10 jamlab refuses.",
        _CHECK,
        (lambda start: LARGEST_RATIO, "largest ratio that is taken"),
    ),
    Map(
        "onset",
        "Search for onset: force tolerance against N",
        log_axis("largest force asked for, ε/d", 1e-16, 1e-6, force_tolerance("sp")),
        Axis("N", (4, 6, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40)),
        2,
        lambda n, seed: (n, seed),
        lambda start, tolerance: try_onset(start[0], tolerance, start[1]),
        "Contacts at onset press with 1e-8 and more; a force left must stay far below, so jamlab refuses above "
        "1e-9, and below what rounding leaves.",
        "Forces and contact energy anew, over all pairs and images; the energy must lie in its window.",
        (
            lambda start: float(np.sqrt(2 * float(defaults("onset")["u_contact"]))),
            "contact force at onset, $\\sqrt{2u}$",
        ),
    ),
    Map(
        "sweep-step",
        "Quasi-static compression in one go: step against packing fraction, N = 12",
        _STEPS,
        linear_axis("true packing fraction ρ", 0.85, 0.999),
        2,
        lambda rho, seed: (rho, seed),
        lambda start, step: try_step(start[0], start[1], step),
        "Long steps jump to other minima, which are minima all the same; near confluence ρ is missed.",
        "Forces anew; ρ anew as the area of a union of polygons.",
    ),
)
