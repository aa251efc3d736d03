"""Stress relaxation: strain a packing at rest by a step and follow its stress."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import check_number, checked
from jamlab.errors import InputError
from jamlab.flow.flow_run import FlowRun, Progress, check_touching, draw_in_time, finish_in_time, shortly
from jamlab.flow.recording import Recording
from jamlab.flow.run_file import RunFile
from jamlab.packing.packing import Packing
from jamlab.plotting.drawable import drawn, in_unit
from jamlab.rheology.damping import ContactDamping, Damping

if TYPE_CHECKING:
    pass

_RESTS = 1e-3  # relative fall of the modulus over the last half of the time


@dataclass(frozen=True, eq=False, repr=False)
class StressRelaxation(FlowRun):
    """Stress in time after a step of strain; rows and packings as in `FlowRun`, times from the middle of the step.

    >>> g = jamlab.relax_stress(jamlab.pack(n=32, pressure=1e-2, seed=1), strain=1e-6, duration=10.0)
    >>> len(g.time) == len(g.modulus), g.step_strain
    (True, 1e-06)

    Attributes:
        step_strain: of the step.
        step_time: that the step took; the modulus at a time t knows of it by (step_time/t)^2/24 only.
        residual: shear stress of the packing at rest, before.
        duration: time that was asked for.
    """

    step_strain: float
    step_time: float
    residual: float
    duration: float

    @property
    def modulus(self) -> Array:
        """(m,) G(t) = (stress - residual)/strain."""
        return np.asarray((self.stress - self.residual) / self.step_strain)

    @property
    def reached(self) -> str:
        """What the run has reached, in words."""
        g = self.modulus
        change = abs(float(np.interp(0.5 * self.time[-1], self.time, g)) - g[-1]) / abs(g[-1])
        if change < _RESTS:
            return f"relaxed to G = {g[-1]:.4g}"
        return f"NOT RELAXED: G = {g[-1]:.4g} has changed by {change:.1g} over the last half of the time"

    def __repr__(self) -> str:
        return f"StressRelaxation(strain={self.step_strain:g}, {self.describe()}; {self.verdict})"

    @drawn("Line2D")
    def plot(self, axes: Any, /, label: str = "", **style: Any) -> None:
        """Draw the relaxation modulus over time, on logarithmic axes.

        >>> ax = jamlab.relax_stress(jamlab.pack(n=32, pressure=1e-2, seed=1), strain=1e-6, duration=10.0).plot()
        """
        name = label or rf"$\gamma$ = {self.step_strain:g}: {shortly(self.reached)}"
        draw_in_time(axes, self.time, self.modulus, name, **style)
        finish_in_time(axes, in_unit(r"relaxation modulus $G(t)$", self.unit), self.imbalance)


TOLERANCE = 1e-3
LONGEST = 1e12
STEP_TIME = 1e-2  # tau_1; no contact relaxes in less than tau_1
_STEPS = 20  # at least, of the ramp


@checked
def relax_stress(
    packing: Packing,
    strain: float,
    duration: float,
    damping: Damping | None = None,
    *,
    step_time: float = STEP_TIME,
    tolerance: float = TOLERANCE,
    background: float = 0.0,
    out: str | Path | None = None,
    progress: Progress | None = None,
) -> StressRelaxation:
    """Shear a packing at rest by a step of strain, and hold it; without inertia.

    The step is a ramp that is short against all relaxation: no step of contact damping is affine, since drag, which
    rules it, pushes particles aside. Rows lie evenly in the logarithm of time, from the end of the step on.

    >>> g = jamlab.relax_stress(jamlab.pack(n=32, pressure=1e-2, seed=1), strain=1e-6, duration=10.0)
    >>> bool(g.modulus[-1] < g.modulus[0])
    True

    Args:
        packing: SP or DP at a minimum.
        strain: of the step.
        duration: time, tau_1.
        damping: see `shear`.
        step_time: of the ramp, tau_1.
        tolerance: see `shear`.
        background: see `shear`.
        out: see `shear`.
        progress: called after each row.

    Raises:
        InputError: particles that do not touch, or a value out of range.
        ConvergenceError: see `shear`.
        StorageError: `out` cannot be written.
    """
    law = damping or ContactDamping()
    check_number("strain", strain, 1.0)
    check_number("duration", duration, LONGEST)
    check_number("step_time", step_time, duration)
    if not step_time < duration:
        raise InputError(f"duration = {duration:g}: must be longer than step_time = {step_time:g}")
    check_touching(packing)
    task = {"strain": strain, "step_time": step_time, "tolerance": tolerance, "background": background}
    file = RunFile(out, StressRelaxation, packing, law, task)
    with Recording(packing, law, tolerance, background, file.before) as flow:
        if file.before is None:
            residual = flow.session.drive("rate 0", duration).elastic_stress
            flow.drive(f"rate {strain / step_time:.17g}", step_time, longest=step_time / _STEPS)
            flow.advance()
            flow.begin_again(time=0.5 * step_time)
        else:
            residual = file.before.residual

        def result() -> StressRelaxation:
            asked = {"step_strain": strain, "step_time": step_time, "duration": duration}
            return StressRelaxation(**flow.content() | asked, residual=residual)

        done = flow.rows[-1].time if flow.rows else 0.5 * step_time
        if done < duration * (1 - 1e-12):
            flow.drive("rate 0", duration - done)
            if packing.model == "dp" and file.before is None:
                flow.advance(1)
                # velocities of droplets, and with them viscous stress, are known from the first step on
                del flow.rows[0]
        for state in flow.advance_log_spaced(duration):
            file.save(result)
            if progress is not None:
                progress(f"time {state.time:.3g}", state.time / duration)
        found = result()
    file.save(lambda: found, now=True)
    return found
