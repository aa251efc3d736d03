"""Start-up of shear along what solves it: the tolerance of a step of droplets, the residual of conjugate gradients."""

import time
from collections.abc import Iterator
from contextlib import nullcontext
from typing import Any
from unittest import mock

import numpy as np

from jamlab.arrays import Array
from jamlab.estimates.ensemble_way import bring_on, default_way
from jamlab.flow import overdamped_session
from jamlab.flow.overdamped_session import background_drag, solver_residual
from jamlab.flow.shear import TOLERANCE, shear
from jamlab.packing.packing import Packing
from jamlab.protocols.onset import jam
from jamlab.protocols.target_pressure import pack
from jamlab.rheology.damping import ContactDamping, Damping, StokesDrag
from jamlab.studies.cost.topic import Topic, Trial

_DROPLETS, _RHO = 8, 0.92
_DISKS, _PRESSURE = 32, 1e-2
_RATES = {"dp": (0.1, 0.01), "sp": (0.01,)}
_STRAIN, _ROWS = 0.05, 10
_TOLERANCES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
_RESIDUALS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10)
_FINEST = (1e-8, 1e-9)  # tolerances of the check and of the reference
_TIGHTEST = (1e-12, 1e-13)  # residuals of the check and of the reference where only the residual is charted


def measure(seed: int) -> Iterator[Trial]:
    """Measure droplets in Stokes drag along both dials, disks with contact drag along the residual."""
    droplets = bring_on(default_way(_DROPLETS), jam("sp", _DROPLETS, seed), _RHO)
    disks = pack(_DISKS, _PRESSURE, seed, ensemble="shear-stabilized")
    for rate in _RATES["dp"]:
        panel = f"{_DROPLETS} droplets, rate {rate:g}/τ₁"
        yield from _along_tolerance(panel, droplets, rate, StokesDrag())
        yield from _along_residual(f"{panel}, solver", droplets, rate, StokesDrag())
    for rate in _RATES["sp"]:
        panel = f"{_DISKS} disks, rate {rate:g}/τ₁, solver"
        yield from _along_residual(panel, disks, rate, ContactDamping())
        yield from _along_residual(f"{panel} and steps", disks, rate, ContactDamping(), against_steps=True)


def _along_tolerance(panel: str, packing: Packing, rate: float, law: Damping) -> Iterator[Trial]:
    check, exact = (_start_up(packing, rate, law, tolerance)[0] for tolerance in _FINEST)
    unsure = _distance(check, exact)
    for tolerance in _TOLERANCES:
        stress, seconds = _start_up(packing, rate, law, tolerance)
        off = _distance(stress, exact)
        yield Trial(panel, "tolerance of a step", f"{tolerance:g}", seconds, off, unsure, tolerance == TOLERANCE)


def _along_residual(
    panel: str, packing: Packing, rate: float, law: Damping, *, against_steps: bool = False
) -> Iterator[Trial]:
    """At the default tolerance of a step, against the tightest residual: what the solver adds to the error of steps.

    Against the finest steps as well it is what a user gets: where contacts rearrange, steps decide.
    """
    usual = float(f"{solver_residual(law, TOLERANCE, background_drag(packing, law, None)):g}")
    tolerances = _FINEST if against_steps else (TOLERANCE, TOLERANCE)
    finest = zip(tolerances, _TIGHTEST, strict=True)
    check, exact = (_start_up(packing, rate, law, tolerance, residual)[0] for tolerance, residual in finest)
    unsure = _distance(check, exact)
    for residual in sorted({*_RESIDUALS, usual}, reverse=True):
        stress, seconds = _start_up(packing, rate, law, TOLERANCE, residual)
        off = _distance(stress, exact)
        yield Trial(panel, "residual of the solver", f"{residual:g}", seconds, off, unsure, residual == usual)


def _start_up(
    packing: Packing, rate: float, law: Damping, tolerance: float, residual: float | None = None
) -> tuple[Array, float]:
    """(m,) shear stress, and CPU seconds; by default the residual follows the tolerance."""
    fixed: Any = nullcontext()
    if residual is not None:
        fixed = mock.patch.object(overdamped_session, "solver_residual", lambda *_: residual)
    began = time.process_time()
    with fixed:
        run = shear(packing, rate, _STRAIN, law, rows=_ROWS, tolerance=tolerance)
    return run.stress[1:], time.process_time() - began


def _distance(stress: Array, exact: Array) -> float:
    """Root of the mean square of a difference (m,), over that of the stress."""
    return float(np.sqrt(((stress - exact) ** 2).mean() / (exact**2).mean()))


TOPIC = Topic(
    f"Start-up of shear to a strain of {_STRAIN:g}: steps of droplets, and the solver of velocities",
    "relative error of the stress",
    "tolerance: relative error of velocities in a step; residual of conjugate gradients over the driving force, at the "
    "default tolerance",
    f"droplets at a tolerance of {_FINEST[1]:g}, its error by one of {_FINEST[0]:g}; along the residual the same steps "
    f"with one of {_TIGHTEST[1]:g}, or, for solver and steps, those of a tolerance of {_FINEST[1]:g}. Droplets at "
    f"ρ = {_RHO} in Stokes drag, whose solver is preconditioned by a factorisation; disks at p = {_PRESSURE:g} k with "
    "contact drag",
    measure,
)
