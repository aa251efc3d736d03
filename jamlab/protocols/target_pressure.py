"""Packings of disks at a target pressure, in the law and units of Baumgarten & Tighe."""

import time

import numpy as np

from jamlab.checks import check_bidisperse, check_number
from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError, InputError
from jamlab.mechanics.elasticity import compression_modulus, elastic_tensor, follow
from jamlab.packing.deformation import at_phi
from jamlab.packing.packing import Packing
from jamlab.packing.versions import versions
from jamlab.protocols.box_shear import minimizer
from jamlab.protocols.onset import Progress
from jamlab.protocols.provenance import record
from jamlab.protocols.random_start import random_disks
from jamlab.protocols.relaxation import Relaxed, quench

_PRESSURE_TOLERANCE = 1e-6  # relative
_PHI_START = 0.86  # safely jammed
_STIFFNESS = 0.5  # dp/dphi of a random packing, k: first guess of the secant
# force over pressure on the way to the target, and how near, |log(p/target)|, that must be before it is known better
_LADDER = ((3e-2, 2.0), (1e-2, 0.5), (1e-3, 0.1), (1e-4, 0.02))
_NEAR = 0.3  # relative distance to the target pressure that linear response may bridge
_LOOSE = 0.1  # of the target pressure: below, a packing counts as not jammed
_WALK = 100
_REFINEMENTS = 30
_LOWEST_PRESSURE = 1e-8  # 1e4 times the force tolerance


def pack(
    n: int,
    pressure: float,
    seed: int = 1,
    *,
    ensemble: str = "fixed-box",
    ranks: int = 1,
    progress: Progress | None = None,
) -> Packing:
    """An SP packing at a target pressure, units "k" (stiffness k, mean diameter d).

    Random disks are quenched above onset and decompressed, with forces first relaxed to a few per cent of the pressure
    only and further the nearer that comes to the target. Then states are relaxed to the end, and phi follows from the
    bulk modulus until p = (S_xx + S_yy)/2 meets the target.

    Args:
        n: even number of disks.
        pressure: target, k; from 1e-8 to 0.3.
        seed: of the random start.
        ensemble: "fixed-box" or "shear-stabilized", the box sheared until no shear stress is left.
        ranks: MPI ranks for first-order minimisation; pays from about 10 000 disks.
        progress: called with the stage and phi after each minimisation.

    Returns:
        Packing with p met to 1e-6 relative and largest force below 1e-12; `provenance["pressure"]` holds the value.

    Raises:
        InputError: a value that no run can start from.
        ConvergenceError: the pressure was not met.
    """
    check_number("pressure", pressure, 0.3)
    if pressure < _LOWEST_PRESSURE:
        raise InputError(f"pressure = {pressure}: below {_LOWEST_PRESSURE:g} k the force tolerance is no longer small")
    check_bidisperse(n, seed, _PHI_START)
    relax_state = minimizer(ensemble)
    began = time.perf_counter()
    with Session(random_disks(n, seed, phi=_PHI_START + 2 * pressure, units="k"), ranks=ranks) as session:
        packing = _walk(session, pressure, progress)
        rise = pressure
        near = False
        for _ in range(_REFINEMENTS):
            session.load(packing)
            found = relax_state(session, near=near, least_pressure=_LOOSE * pressure)
            packing, reached = session.packing(), found.evaluation.pressure
            if progress is not None:
                progress("pressure", packing.phi)
            if found.converged and abs(reached / pressure - 1) <= _PRESSURE_TOLERANCE:
                return _finished(packing, found, seed, ensemble, time.perf_counter() - began)
            near = abs(reached / pressure - 1) < _NEAR
            if reached < _LOOSE * pressure:
                packing, rise = at_phi(packing, packing.phi + rise), 2 * rise
            else:
                packing, rise = _nearer(packing, reached, pressure), pressure
    raise ConvergenceError(
        f"pressure {pressure:g} not met with n = {n}, seed = {seed}: the search ended at {reached:g}; try another seed"
    )


def _walk(session: Session, pressure: float, progress: Progress | None) -> Packing:
    """Quench and decompress until the pressure is near the target, known better and better on the way."""
    slope, rise, level = _STIFFNESS, pressure, 0
    before: tuple[float, float] | None = None
    for _ in range(_WALK):
        noise, wanted = _LADDER[level]
        state = quench(session, noise, floor=_LOOSE * pressure)
        packing, reached = session.packing(), state.pressure
        if progress is not None:
            progress("pressure", packing.phi)
        if abs(np.log(max(reached, _LOOSE * pressure) / pressure)) <= wanted:
            level += 1
            if level == len(_LADDER):
                return packing
            continue
        if reached < _LOOSE * pressure:  # too far down, or it found a denser basin: up again by growing steps
            phi, rise, before, level = packing.phi + rise, 2 * rise, None, 0
        else:
            if before is not None and packing.phi != before[0]:
                slope = min(max((reached - before[1]) / (packing.phi - before[0]), 0.2), 0.6)
            before = (packing.phi, reached)
            rise = pressure
            # p ~ phi - phi_J: never aim at less than a fifth of the pressure in one go
            phi = packing.phi + max(pressure - reached, -0.8 * reached) / slope
        session.load(at_phi(packing, phi))
    raise ConvergenceError(
        f"pressure {pressure:g} not met with n = {packing.n}: the walk ended at {reached:g}; try another seed"
    )


def _nearer(packing: Packing, reached: float, pressure: float) -> Packing:
    """The packing at the phi that its bulk modulus promises the target pressure for."""
    try:
        modulus = compression_modulus(elastic_tensor(packing).relaxed, reached)
    except ConvergenceError:  # not at a stable minimum
        modulus = _STIFFNESS * packing.phi
    change = max(pressure - reached, -0.7 * reached) / max(modulus, 0.1 * _STIFFNESS)
    return follow(packing, packing.phi * (1 + change))


def _finished(packing: Packing, found: Relaxed, seed: int, ensemble: str, wall_time: float) -> Packing:
    return record(
        packing,
        found,
        protocol="pressure",
        ensemble=ensemble,
        seed=seed,
        pressure=found.evaluation.pressure,
        wall_time=wall_time,
        **versions(),
    )
