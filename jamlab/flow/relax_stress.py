"""Stress relaxation: strain a packing at rest by a step and follow its stress."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import check_number, checked, is_number
from jamlab.errors import InputError
from jamlab.flow.flow_run import REST, FlowRun, check_touching, draw_in_time, finish_in_time
from jamlab.flow.overdamped_session import (
    LEAST_STRAIN,
    LEAST_TIME,
    SMALL_STRAIN_BACKGROUND,
    SMALL_STRAIN_TOLERANCE,
    Length,
)
from jamlab.flow.recording import Recording
from jamlab.flow.run_file import RunFile
from jamlab.mechanics.force_network import check_at_rest
from jamlab.packing.packing import Packing
from jamlab.plotting.drawable import drawn, in_unit
from jamlab.processes.progress import Progress
from jamlab.rheology.damping import ContactDamping, Damping

_RESTS = 1e-3  # relative fall of the modulus over the last half of the time
_NOTHING = 1e-3  # of the largest modulus, below which falls are compared with this one: it relaxes to nothing
_ROUNDING = 1e-9  # of the pressure, the same: over _RESTS of it a stress has no digits


@dataclass(frozen=True, eq=False, repr=False)
class StressRelaxation(FlowRun):
    """Stress in time after a step of strain; rows and packings as in `FlowRun`, times from the middle of the step.

    >>> g = jamlab.relax_stress(jamlab.pack(n=32, pressure=1e-2, seed=1), strain=1e-6, duration=10.0)
    >>> len(g.time) == len(g.modulus), g.step_strain
    (True, 1e-06)

    Attributes:
        step_strain: of the step.
        step_time: that the step took; the modulus at a time t knows of it by (step_time/t)^2/24 only.
        residual: elastic shear stress before the step; of a flow that is stopped, its elastic stress then.
        duration: time that was asked for.
    """

    step_strain: float
    step_time: float
    residual: float
    duration: float

    @property
    def modulus(self) -> Array:
        """(m,) G(t) = (stress - residual)/strain.

        Raises:
            InputError: no step of strain was made: what relaxes is `stress` itself.
        """
        if not self.step_strain:
            raise InputError("strain = 0: there is no modulus without a step of strain; look at `stress`")
        return np.asarray((self.stress - self.residual) / self.step_strain)

    @property
    def _relaxing(self) -> Array:
        return self.modulus if self.step_strain else self.stress

    @property
    def _change(self) -> float:
        g = self._relaxing
        rounding = _ROUNDING * float(np.abs(self.pressure).max()) / abs(self.step_strain or 1.0)
        scale = max(abs(float(g[-1])), _NOTHING * float(np.abs(g).max()), rounding)
        return abs(float(np.interp(0.5 * self.time[-1], self.time, g) - g[-1])) / (scale or 1.0)

    @property
    def finished(self) -> bool:
        """Whether the stress has relaxed: over the last half of the time it changes by less than 1e-3 of its last
        value, or 1e-6 of its largest."""
        return self._change < _RESTS

    @property
    def _left(self) -> str:
        return f"{'G' if self.step_strain else 'a stress'} = {self._relaxing[-1]:.4g}"

    @property
    def outcome(self) -> str:
        """Whether the stress has relaxed, as short as a legend needs it."""
        return f"relaxed to {self._left}" if self.finished else "NOT RELAXED"

    @property
    def reached(self) -> str:
        """What the run has reached, in words."""
        change = f": {self._left} has changed by {self._change:.1g} over the last half of the time"
        return self.outcome + ("" if self.finished else change)

    def __repr__(self) -> str:
        return f"StressRelaxation(strain={self.step_strain:g}, {self.describe()}; {self.conclusion})"

    @drawn("Line2D")
    def plot(self, axes: Any, /, label: str = "", **style: Any) -> None:
        """Draw the relaxation modulus over time, on logarithmic axes; without a step of strain, the stress.

        >>> ax = jamlab.relax_stress(jamlab.pack(n=32, pressure=1e-2, seed=1), strain=1e-6, duration=10.0).plot()
        """
        name = label or rf"$\gamma$ = {self.step_strain:g}: {self.outcome}"
        values, what = (self.modulus, r"relaxation modulus $G(t)$") if self.step_strain else (self.stress, r"$\sigma$")
        draw_in_time(axes, self.time, values, name, **style)
        finish_in_time(axes, in_unit(what, self.unit), self)


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
    tolerance: float = SMALL_STRAIN_TOLERANCE,
    background: float = SMALL_STRAIN_BACKGROUND,
    out: str | Path | None = None,
    progress: Progress | None = None,
) -> StressRelaxation:
    """Shear a packing at rest by a step of strain, and hold it, or stop a flow; without inertia.

    The step is a ramp that is short against all relaxation: no step of contact damping is affine, since drag, which
    rules it, pushes particles aside. Rows lie evenly in the logarithm of time, from the end of the step on.

    >>> g = jamlab.relax_stress(jamlab.pack(n=32, pressure=1e-2, seed=1), strain=1e-6, duration=10.0)
    >>> bool(g.modulus[-1] < g.modulus[0])
    True
    >>> r = jamlab.shear(jamlab.pack(n=32, pressure=1e-2, seed=1), rate=1e-2, strain=0.05, rows=5)
    >>> s = jamlab.relax_stress(r.packing, strain=0, duration=100.0)
    >>> bool(abs(s.stress[-1]) < abs(s.stress[0]))
    True

    Args:
        packing: SP or DP: at a minimum, or, with strain 0, in any state.
        strain: of the step, of either sign; 0: what flows is stopped and held, and `stress` relaxes.
        duration: time, tau_1.
        damping: see `shear`.
        step_time: of the ramp, tau_1.
        tolerance: relative error of velocities in a step, from 1e-9 to 0.1, default 1e-3; see `shear`.
        background: drag of every particle against the affine flow, over k tau_1, default 0: a small strain then costs
            what contacts cost, as in `complex_modulus`. Give droplets whose contacts change 1e-2; see `shear`.
        out: see `shear`.
        progress: called after each row with the share of the work that is done, and in words.

    Raises:
        InputError: particles that do not touch, or a value out of range.
        ConvergenceError: the packing is not at rest, and a step is asked for; or see `shear`.
        StorageError: `out` cannot be written.
    """
    law = damping or ContactDamping()
    if not (is_number(strain) and (strain == 0 or LEAST_STRAIN <= abs(strain) <= 1.0)):
        raise InputError(
            f"strain = {strain!r}: must be a number from {LEAST_STRAIN:g} to 1 or its negative; 0 stops a flow"
        )
    check_number("duration", duration, LONGEST, LEAST_TIME)
    check_number("step_time", step_time, duration)
    if not step_time < duration:
        raise InputError(f"duration = {duration:g}: must be longer than step_time = {step_time:g}")
    if strain:
        check_at_rest(packing, REST)
        check_touching(packing)
    task = {"strain": strain, "step_time": step_time, "tolerance": tolerance, "background": background}
    file = RunFile(out, StressRelaxation, packing, law, task, progress)
    shorter = f"a shorter duration than {duration:g}"
    with Recording(packing, law, tolerance, background, file.before, Length(duration, shorter)) as flow:
        if file.before is None:
            residual = flow.session.drive("rate 0", duration).elastic_stress
            if strain:
                flow.drive(f"rate {strain / step_time:.17g}", step_time, longest=step_time / _STEPS)
                flow.advance()
                flow.begin_again(time=0.5 * step_time)
        else:
            residual = file.before.residual

        def result() -> StressRelaxation:
            asked = {"step_strain": strain, "step_time": step_time, "duration": duration}
            return StressRelaxation(**flow.content() | asked, residual=residual)

        done = flow.rows[-1].time if flow.rows else 0.5 * step_time if strain else 0.0
        if done < duration * (1 - 1e-12):
            flow.drive("rate 0", duration - done)
            if packing.model == "dp" and file.before is None:
                flow.advance(1)
                # velocities of droplets, and with them viscous stress, are known from the first step on
                del flow.rows[0]
        for state in flow.advance_log_spaced(duration):
            file.report(result, state.time / duration, f"time {state.time:.3g}")
        return file.finish(result)
