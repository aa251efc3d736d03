"""Chart of overdamped start-up of shear: tolerance of a step, and residual of the solver of velocities."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from jamlab.arrays import Array
from jamlab.estimates.ways import bring_on, default_way
from jamlab.flow.overdamped_session import OverdampedSession, default_background, solver_residual
from jamlab.flow.shear import TOLERANCE
from jamlab.packing.packing import Packing
from jamlab.protocols.onset import jam
from jamlab.protocols.target_pressure import pack
from jamlab.rheology.damping import ContactDamping, StokesDrag
from jamlab.rheology.drag_law import DragLaw
from studies.speed_accuracy.chart import Chart, Panel, Trial
from studies.speed_accuracy.moduli import DROPLETS, RHO

_DISKS, _PRESSURE = 32, 1e-2
_RATE = 0.01
_STRAIN, _ROWS = 0.05, 10
_TOLERANCES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
_RESIDUALS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10)
_FINEST = (1e-8, 1e-9)  # tolerances of the check and of the reference
_TIGHTEST = (1e-12, 1e-13)  # the same of residuals


def start_up(seed: int) -> Iterator[Trial]:
    """Measure droplets in Stokes drag and disks with contact drag."""
    droplets = bring_on(default_way(DROPLETS), jam(DROPLETS, "sp", seed), RHO)
    disks = pack(_DISKS, _PRESSURE, seed, ensemble="shear-stabilized")
    for name, packing, law in (("droplets", droplets, StokesDrag()), ("disks", disks, ContactDamping())):
        run = partial(_stress, packing, law)
        usual = float(f"{solver_residual(law, TOLERANCE, default_background(packing, law, None)):g}")
        for dial, values, default, references in (
            ("tolerance", _TOLERANCES, TOLERANCE, [(value, None) for value in _FINEST]),
            ("residual", sorted({*_RESIDUALS, usual}, reverse=True), usual, [(TOLERANCE, v) for v in _TIGHTEST]),
        ):
            check, exact = (run(*reference) for reference in references)
            panel = Panel(f"{packing.n} {name}, {dial}", exact, _distance(check, exact), _distance, {"runs": 1})
            for value in values:
                dials = (value,) if dial == "tolerance" else (TOLERANCE, value)
                yield panel.trial(name, f"{value:g}", partial(run, *dials), value == default)


def _stress(packing: Packing, law: DragLaw, tolerance: float, residual: float | None = None) -> Array:
    """(m,) shear stress; by default the residual follows the tolerance."""
    background = default_background(packing, law, None)
    with OverdampedSession(packing, law, tolerance, background, residual=residual) as session:
        session.drive(f"rate {_RATE:.17g}", _STRAIN / _ROWS / _RATE)
        return np.array([session.advance().stress for _ in range(_ROWS)])


def _distance(stress: Array, exact: Array) -> float:
    """Root mean square of a difference (m,), relative to the root mean square of the stress."""
    return float(np.sqrt(((stress - exact) ** 2).mean() / (exact**2).mean()))


CHARTS = (Chart("flow-steps", start_up),)
