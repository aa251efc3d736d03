"""Packings of disks at a target pressure, in the law and units of Baumgarten & Tighe."""

import time

from jamlab.deformation import at_phi
from jamlab.engine import Session
from jamlab.errors import ConvergenceError, InputError
from jamlab.packing import Packing
from jamlab.protocol import Progress, record, versions
from jamlab.relaxation import Relaxed, relax
from jamlab.start import check_bidisperse, check_number, random_disks

_PRESSURE_TOLERANCE = 1e-6  # relative
_PHI_START = 0.86  # safely jammed
_BULK_MODULUS = 0.4  # dp/dphi of a random packing, k: first guess of the secant
_SEARCHES = 60
_LOWEST_PRESSURE = 1e-8  # 1e4 times the force tolerance


def pack(n: int, pressure: float, seed: int = 1, *, progress: Progress | None = None) -> Packing:
    """An SP packing at a target pressure, units "k" (stiffness k, mean diameter d).

    Random disks are quenched above onset; then phi is moved until p = (S_xx + S_yy)/2 meets the target.

    Args:
        n: even number of disks.
        pressure: target, k; from 1e-8 to 0.3.
        seed: of the random start.
        progress: called with the stage and phi after each minimisation.

    Returns:
        Packing with p met to 1e-6 relative; `provenance["pressure"]` holds the value reached.

    Raises:
        InputError: a value that no run can start from.
        ConvergenceError: the pressure was not met.
    """
    check_number("pressure", pressure, 0.3)
    if pressure < _LOWEST_PRESSURE:
        raise InputError(f"pressure = {pressure}: below {_LOWEST_PRESSURE:g} k the force tolerance is no longer small")
    check_bidisperse(n, seed, _PHI_START)
    began = time.perf_counter()
    phi = _PHI_START + 2 * pressure
    packing = random_disks(n, seed, phi=phi, units="k")
    slope = _BULK_MODULUS
    previous: tuple[float, float] | None = None
    with Session(packing) as session:
        for _ in range(_SEARCHES):
            session.load(at_phi(packing, phi))
            found = relax(session)
            packing = session.packing()
            reached = found.evaluation.pressure
            if progress is not None:
                progress("pressure", phi)
            if abs(reached / pressure - 1) <= _PRESSURE_TOLERANCE:
                return _finished(packing, found, seed, time.perf_counter() - began)
            if previous is not None and reached > 0 and phi != previous[0]:
                secant = (reached - previous[1]) / (phi - previous[0])
                slope = secant if secant > 0.05 else _BULK_MODULUS
            previous = (phi, reached)
            # far above the target stay jammed: p ~ phi - phi_J, so at most halve the distance to onset in one go
            phi += max((pressure - reached) / slope, -0.7 * reached / slope) if reached > 0 else 0.3 * pressure / slope
    raise ConvergenceError(
        f"pressure {pressure:g} not met with n = {n}, seed = {seed}: the search ended at {reached:g}; try another seed"
    )


def _finished(packing: Packing, found: Relaxed, seed: int, wall_time: float) -> Packing:
    return record(
        packing,
        found,
        protocol="pressure",
        ensemble="fixed square box",
        seed=seed,
        pressure=found.evaluation.pressure,
        wall_time=wall_time,
        **versions(),
    )
