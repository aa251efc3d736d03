"""Start-up of shear: massless disks along the tolerance of a step, and disks with inertia along their mass."""

import time
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from jamlab.errors import ConvergenceError
from jamlab.flow.overdamped_session import OverdampedSession
from jamlab.flow.shear import TOLERANCE, shear
from jamlab.packing.packing import Packing
from jamlab.protocols.target_pressure import pack
from jamlab.rheology.damping import ContactDamping
from jamlab.studies.cost.disks_with_inertia import start_up
from jamlab.studies.cost.topic import Topic, Trial

_N, _PRESSURE = 32, 1e-2
_RATES = (1e-2, 1e-3)
_STRAIN, _ROWS = 0.02, 10
_TOLERANCES = (1e-1, 3e-2, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
_FINEST = 1e-9  # tolerance of the reference
_LONGEST = {1e-2: (1e-2, 3e-3), 1e-3: (0.1, 0.03)}  # step of the check and of the reference, tau_1, by rate
_MASSES = {1e-2: (1.0, 0.3, 0.1, 0.03, 0.01), 1e-3: (1.0, 0.3, 0.1)}  # k tau_1^2; smaller ones take minutes


def measure(seed: int) -> Iterator[Trial]:
    """Measure both rates; without background drag, which disks with inertia have not."""
    packing = pack(_N, _PRESSURE, seed, ensemble="shear-stabilized")
    for rate in _RATES:
        panel = f"rate {rate:g}/τ₁"
        try:
            check, exact = (_in_short_steps(packing, rate, longest) for longest in _LONGEST[rate])
        except ConvergenceError:
            continue  # drag is singular for this packing without background
        unsure = _distance(check, exact)
        for tolerance in _TOLERANCES:
            stress, seconds = _massless(packing, rate, tolerance)
            off = _distance(stress, exact)
            yield Trial(panel, "massless", f"tolerance {tolerance:g}", seconds, off, unsure, tolerance == TOLERANCE)
        strains = _STRAIN * np.arange(1, _ROWS + 1) / _ROWS
        for mass in _MASSES[rate]:
            stress, seconds = start_up(packing, rate, strains, mass)
            yield Trial(panel, "small inertia", f"mass {mass:g}", seconds, _distance(stress, exact), unsure)


def _massless(packing: Packing, rate: float, tolerance: float) -> tuple[NDArray[np.float64], float]:
    began = time.process_time()
    run = shear(packing, rate, _STRAIN, rows=_ROWS, tolerance=tolerance, background=0.0)
    return run.stress[1:], time.process_time() - began


def _in_short_steps(packing: Packing, rate: float, longest: float) -> NDArray[np.float64]:
    """The stress in steps that are short everywhere, not only where the tolerance asks for it: a new contact is a jump
    of velocities, where the shortest step decides."""
    with OverdampedSession(packing, ContactDamping(), _FINEST, 0.0) as session:
        session.drive(f"rate {rate:.17g}", _STRAIN / _ROWS / rate, longest=longest)
        return np.array([session.advance().stress for _ in range(_ROWS)])


def _distance(stress: NDArray[np.float64], exact: NDArray[np.float64]) -> float:
    """Root of the mean square of a difference (m,), over that of the stress."""
    return float(np.sqrt(((stress - exact) ** 2).mean() / (exact**2).mean()))


TOPIC = Topic(
    f"Start-up of shear of {_N} disks to a strain of {_STRAIN:g}",
    "relative error of the stress",
    "tolerance: relative error of velocities in a step; mass of a disk in k τ₁²",
    "massless disks at a tolerance of 1e-9 in steps of at most 0.003 τ₁ (rate 0.01) and 0.03 τ₁ (0.001), its error by "
    "steps three times as long. Costs of small inertia are without the start of LAMMPS",
    measure,
)
