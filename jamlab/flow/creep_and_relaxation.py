"""Creep and stress relaxation: load a packing at rest with a stress and follow its strain, or strain it by a step, or
stop a flow, and follow its stress."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal, TypeVar

import numpy as np

from jamlab.arguments.table import argument
from jamlab.arrays import Array
from jamlab.checks import check_number, checked
from jamlab.errors import InputError, named
from jamlab.flow.flow_run import SERIES, FlowRun
from jamlab.flow.oscillate import Oscillation
from jamlab.flow.overdamped_session import (
    SMALL_STRAIN_BACKGROUND,
    SMALL_STRAIN_TOLERANCE,
    End,
    check_flow_tolerance,
)
from jamlab.flow.run import TimedRun
from jamlab.flow.shear import ShearRun
from jamlab.packing.natural_units import natural_scales
from jamlab.packing.packing import Packing
from jamlab.plotting.drawable import drawn, in_unit
from jamlab.processes.progress import Progress
from jamlab.rheology.damping import ContactDamping
from jamlab.rheology.drag_law import DragLaw


@dataclass(frozen=True)
class Verdicts:
    """From where on a creep or a relaxation rests, creeps or flows."""

    # d ln strain/d ln time over the last half of the time, below and above
    arrested: float = 0.02
    flows: float = 0.9
    left: float = 0.02  # of the stress applied that drag may bear at rest
    yielded: float = 0.2  # strain below which a packing has not yielded, however fast it creeps
    relaxed: float = 1e-3  # relative fall of the modulus over the last half of the time
    nothing: float = 1e-3  # of the largest modulus, below which falls are compared with this one: it relaxes to nothing
    rounding: float = 1e-9  # of the pressure, the same: over `relaxed` of it a stress has no digits


VERDICTS = Verdicts()


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class CreepRun(FlowRun):
    """Strain in time under a stress; rows and packings as in `FlowRun`.

    Attributes:
        applied_stress: shear stress in addition to the residual stress.
        residual_stress: shear stress of the packing at rest, before the creep.
        duration: time that was asked for.
    """

    columns: ClassVar[tuple[str, ...]] = (*SERIES, "compliance", "z_all", "energy_gap")
    numbers: ClassVar[tuple[str, ...]] = (*FlowRun.numbers, "final_rate", "slope")
    answer: ClassVar[str] = "strain"

    applied_stress: float
    residual_stress: float
    duration: float

    @property
    def compliance(self) -> Array:
        """(m,) J(t) = strain over the stress applied."""
        return np.asarray(self.strain / self.applied_stress)

    @property
    def final_rate(self) -> float:
        """Mean rate of strain over the last half of the time; nan of fewer than three rows."""
        middle = self._middle
        if middle is None:
            return float("nan")
        return float((self.strain[-1] - self.strain[middle]) / (self.time[-1] - self.time[middle]))

    @property
    def slope(self) -> float:
        """d ln strain/d ln time over the last half of the time: 0 at rest, 1 in steady flow; nan of fewer than three
        rows, and where the strain is not positive, as of a packing of negative G that moves against the stress."""
        middle = self._middle
        if middle is None or min(self.strain[middle], self.strain[-1]) <= 0:
            return float("nan")
        return float(np.log(self.strain[-1] / self.strain[middle]) / np.log(self.time[-1] / self.time[middle]))

    @property
    def _middle(self) -> int | None:
        """The last row of the first half of the time, after that at time 0; None where it is the last of all."""
        middle = max(1, int(np.searchsorted(self.time, 0.5 * self.time[-1]) - 1))
        return middle if middle < len(self.time) - 1 else None

    @property
    def state(self) -> Literal["rests", "creeps", "flows"]:
        """What the packing does at the end: it rests, it still creeps, or it flows steadily."""
        if self.slope < VERDICTS.arrested and abs(self.viscous_stress[-1]) < VERDICTS.left * abs(self.applied_stress):
            return "rests"
        return "flows" if self.slope > VERDICTS.flows and self.strain[-1] > VERDICTS.yielded else "creeps"

    @property
    def finished(self) -> bool:
        """Whether the packing has come to rest or flows steadily."""
        return self.state != "creeps"

    @property
    def summary(self) -> dict[str, float]:
        """Stress applied; last time and strain; mean rate and d ln strain/d ln time over the last half of the time."""
        last = {"time": float(self.time[-1]), "strain": float(self.strain[-1])}
        return {"stress": self.applied_stress, **last, "rate": self.final_rate, "slope": self.slope}

    @drawn("Line2D")
    def plot(self, axes: Any, /, label: str = "", **style: Any) -> None:
        """Draw the compliance over time, on logarithmic axes."""
        per_unit = f"1/({self.unit})" if "/" in self.unit or " " in self.unit else f"1/{self.unit}"
        name = label or rf"$\sigma$ = {self.applied_stress:g}: {self.state}"
        quantity = in_unit(r"compliance $J(t)$", per_unit if self.unit else "")
        self._draw(axes, self.time[1:], self.compliance[1:], name, quantity, **style)


@dataclass(frozen=True)
class Ramp:
    """Ramp of stress relaxation."""

    steps: int = 20  # at least, of the ramp


RAMP = Ramp()


@checked
def creep(
    packing: Packing,
    stress: float,
    duration: float,
    damping: DragLaw | None = None,
    *,
    largest_strain: float = 10.0,
    tolerance: float = SMALL_STRAIN_TOLERANCE,
    background_drag: float = SMALL_STRAIN_BACKGROUND,
    trajectory_error: bool = False,
    path: str | Path | None = None,
    progress: Progress | None = None,
) -> CreepRun:
    """Simulate overdamped creep under a constant shear stress.

    The shear rate is an additional unknown of the force balance, b u + c rate = A (stress - elastic stress), where (b,
    c) is the last row of the drag matrix B (see `dynamical_matrices`). For Stokes drag b = 0 and c = A eta_F. Rows are
    spaced evenly in log time.

    >>> k = jamlab.creep(jamlab.pack(n=32, pressure=1e-2, seed=1), stress=1e-7, duration=10.0)
    >>> bool(np.all(np.diff(k.compliance) > 0))
    True

    Args:
        packing: SP or DP at a minimum.
        stress: applied stress in addition to the residual stress of the packing, in its stress unit; positive.
        duration: simulated time, tau_1.
        damping: `ContactDamping` (default, beta = 1), linear or a power law, or `StokesDrag` with eta_f > 0.
        largest_strain: strain at which the simulation stops early, default 10.
        tolerance, background_drag: see `oscillate`.
        trajectory_error: True: repeat the run at a tenth of the tolerance and return the difference, see `shear`.
        path, progress: see `shear`.

    Raises:
        InputError: no particles touch, the fluid has no viscosity, or a value is out of range.
        ConvergenceError, StorageError: see `oscillate`.
    """
    law = damping or ContactDamping()
    if not law.resists_shear(packing):
        raise InputError(
            f"{law} does not resist shear, so the rate has no bound under a stress. Set eta_f > 0 or use ContactDamping"
        )
    line, unit = argument("stress"), natural_scales(packing).stress
    if not line.admits(stress / unit):
        raise InputError(
            f"stress = {stress:g}: must be {line.allowed()} in units of {unit:g} {packing.unit_names.stress}"
        )
    check_flow_tolerance(tolerance, trajectory_error)
    accuracy, end = (tolerance, background_drag), _end(duration, largest_strain)
    with TimedRun(CreepRun, packing, law, accuracy, {"stress": stress}, end, path, progress, at_rest=True) as flow:
        before = flow.before
        residual = before.residual_stress if before else flow.session.drive("rate 0", duration).elastic_stress
        flow.facts |= {"applied_stress": stress, "residual_stress": residual, "duration": duration}
        flow.warn_beyond("time", flow.time, duration)
        if flow.time < duration * (1 - 1e-12):
            flow.drive(flow.session.stress_drive(residual + stress), duration - flow.time)
        for state in flow.advance_log_spaced(duration):
            if abs(state.strain) > largest_strain:
                break
        if trajectory_error:
            same: dict[str, Any] = {"largest_strain": largest_strain, "background_drag": background_drag}
            flow.measure_trajectory_error(
                lambda finer, told: creep(packing, stress, duration, damping, tolerance=finer, progress=told, **same)
            )
        return flow.finish()


def _end(duration: float, strain: float = np.inf) -> End:
    return End(duration, f"a shorter duration than {duration:g}", strain)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class StoppedFlow(FlowRun):
    """Stress in time at fixed strain; rows and packings as in `FlowRun`.

    Attributes:
        residual_stress: elastic shear stress at the start (before the strain step, if there is one).
        duration: time that was asked for.
    """

    numbers: ClassVar[tuple[str, ...]] = (*FlowRun.numbers, "change")

    residual_stress: float
    duration: float

    @property
    def _relaxing(self) -> tuple[Array, float, str]:
        """(m,) what relaxes, the strain that it is over, and its name."""
        return self.stress, 1.0, r"$\sigma$"

    @property
    def change(self) -> float:
        """Change of what relaxes over the last half of the time, over its last value, or 1e-3 of its largest."""
        g, strain, _ = self._relaxing
        rounding = VERDICTS.rounding * float(np.abs(self.pressure).max()) / abs(strain)
        scale = max(abs(float(g[-1])), VERDICTS.nothing * float(np.abs(g).max()), rounding)
        return abs(float(np.interp(0.5 * self.time[-1], self.time, g) - g[-1])) / (scale or 1.0)

    @property
    def finished(self) -> bool:
        """Whether the stress has relaxed: over the last half of the time it changes by less than 1e-3 of its last
        value, or 1e-6 of its largest."""
        return self.change < VERDICTS.relaxed

    @property
    def state(self) -> Literal["relaxed", "relaxing"]:
        """Whether the stress has relaxed."""
        return "relaxed" if self.finished else "relaxing"

    @property
    def summary(self) -> dict[str, float]:
        """Last time, stress and the change over the last half of the time."""
        return {"time": float(self.time[-1]), "stress": float(self.stress[-1]), "change": self.change}

    @drawn("Line2D")
    def plot(self, axes: Any, /, label: str = "", **style: Any) -> None:
        """Draw what relaxes, the stress or the relaxation modulus, over time, on logarithmic axes."""
        values, strain, name = self._relaxing
        own = self.state if strain == 1.0 else rf"$\gamma$ = {strain:g}: {self.state}"
        self._draw(axes, self.time, values, label or own, in_unit(name, self.unit), **style)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class StressRelaxation(StoppedFlow):
    """Stress in time after a step of strain; rows and packings as in `FlowRun`, times from the middle of the step.

    Attributes:
        applied_strain: strain of the step.
        step_time: that the step took; the modulus at a time t knows of it by (step_time/t)^2/24 only.
    """

    columns: ClassVar[tuple[str, ...]] = (*SERIES, "modulus", "z_all", "energy_gap")

    applied_strain: float
    step_time: float

    @property
    def modulus(self) -> Array:
        """(m,) G(t) = (stress - residual)/strain."""
        return np.asarray((self.stress - self.residual_stress) / self.applied_strain)

    @property
    def _relaxing(self) -> tuple[Array, float, str]:
        return self.modulus, self.applied_strain, r"relaxation modulus $G(t)$"

    @property
    def summary(self) -> dict[str, float]:
        """Strain of the step, last time and modulus, and its change over the last half of the time."""
        last = {"time": float(self.time[-1]), "modulus": float(self.modulus[-1])}
        return {"strain": self.applied_strain, **last, "change": self.change}


@checked
def relax_stress(
    packing: Packing,
    strain: float,
    duration: float,
    damping: DragLaw | None = None,
    *,
    step_time: float = 1e-2,  # tau_1; no contact relaxes in less than tau_1
    tolerance: float = SMALL_STRAIN_TOLERANCE,
    background_drag: float = SMALL_STRAIN_BACKGROUND,
    trajectory_error: bool = False,
    path: str | Path | None = None,
    progress: Progress | None = None,
) -> StressRelaxation:
    """Shear a packing at rest by a strain step, and keep the strain (overdamped).

    The step is a ramp that is short compared with all relaxation times. Rows are spaced evenly in log time from the end
    of the step.

    >>> g = jamlab.relax_stress(jamlab.pack(n=32, pressure=1e-2, seed=1), strain=1e-6, duration=10.0)
    >>> bool(g.modulus[-1] < g.modulus[0])
    True

    Args:
        packing: SP or DP at a minimum.
        strain: strain of the step, of either sign.
        duration: simulated time, tau_1.
        damping: see `shear`.
        step_time: duration of the ramp, tau_1.
        tolerance, background_drag: see `oscillate`.
        trajectory_error: True: repeat the run at a tenth of the tolerance and return the difference, see `shear`.
        path, progress: see `shear`.

    Raises:
        InputError, ConvergenceError, StorageError: see `oscillate`.
    """
    if abs(strain) < (least := argument("strain").least or 0.0):
        raise InputError(f"{named('strain', strain)}: must be {least:g} to 1 in magnitude; or use stop_flow")
    check_flow_tolerance(tolerance, trajectory_error)
    check_number("step_time", step_time, duration)
    if not step_time < duration:
        raise InputError(f"{named('duration', duration, 'g')}: must be longer than step_time = {step_time:g}")
    task, accuracy, end = {"strain": strain, "step_time": step_time}, (tolerance, background_drag), _end(duration)
    with TimedRun(StressRelaxation, packing, damping, accuracy, task, end, path, progress, at_rest=True) as flow:
        flow.facts |= {"applied_strain": strain, "step_time": step_time}
        if flow.before is None:
            flow.facts["residual_stress"] = flow.session.drive("rate 0", duration).elastic_stress
            flow.drive(f"rate {strain / step_time:.17g}", step_time, longest=step_time / RAMP.steps)
            flow.advance()
            flow.begin_again(time=0.5 * step_time)
        _wait(flow, duration)
        if trajectory_error:
            same: dict[str, Any] = {"step_time": step_time, "background_drag": background_drag}
            flow.measure_trajectory_error(
                lambda finer, told: relax_stress(
                    packing, strain, duration, damping, tolerance=finer, progress=told, **same
                )
            )
        return flow.finish()


@checked
def stop_flow(
    flow: ShearRun | Oscillation | CreepRun | StoppedFlow | Packing,
    duration: float,
    damping: DragLaw | None = None,
    *,
    tolerance: float = SMALL_STRAIN_TOLERANCE,
    background_drag: float = SMALL_STRAIN_BACKGROUND,
    trajectory_error: bool = False,
    path: str | Path | None = None,
    progress: Progress | None = None,
) -> StoppedFlow:
    """Stop a flow at its present strain, and follow how its stress relaxes.

    >>> r = jamlab.shear(jamlab.pack(n=32, pressure=1e-2, seed=1), rate=1e-2, strain=0.05, rows=5)
    >>> s = jamlab.stop_flow(r, duration=100.0)
    >>> bool(abs(s.stress[-1]) < abs(s.stress[0]))
    True

    Args:
        flow: result of a flow (its last state is used), or a packing in any state.
        duration: simulated time, tau_1.
        damping: default: the drag law of the flow; for a packing `ContactDamping()`.
        tolerance, background_drag: see `oscillate`.
        trajectory_error: True: repeat the run at a tenth of the tolerance and return the difference, see `shear`.
        path, progress: see `shear`.

    Raises:
        InputError, ConvergenceError, StorageError: see `shear`.
    """
    check_flow_tolerance(tolerance, trajectory_error)
    packing, law = (flow, damping) if isinstance(flow, Packing) else (flow.packing, damping or flow.damping)
    accuracy, task = (tolerance, background_drag), {"strain": 0}
    with TimedRun(StoppedFlow, packing, law, accuracy, task, _end(duration), path, progress) as run:
        if run.before is None:
            run.facts["residual_stress"] = run.session.drive("rate 0", duration).elastic_stress
        _wait(run, duration)
        if trajectory_error:
            how: dict[str, Any] = {"damping": law, "background_drag": background_drag}
            run.measure_trajectory_error(
                lambda finer, told: stop_flow(packing, duration, tolerance=finer, progress=told, **how)
            )
        return run.finish()


S = TypeVar("S", bound=StoppedFlow)


def _wait(flow: TimedRun[S], duration: float) -> None:
    """Hold the strain until the end."""
    flow.warn_beyond("time", flow.time, duration)
    flow.facts["duration"] = duration
    if flow.before:
        flow.facts["residual_stress"] = flow.before.residual_stress
    if flow.time < duration * (1 - 1e-12):
        flow.drive("rate 0", duration - flow.time)
        if flow.before is None and flow.frames[0].kind.carrier == "outlines":
            flow.advance(1)
            # velocities of droplets, and with them viscous stress, are known from the first step on
            del flow.rows[0]
    for _ in flow.advance_log_spaced(duration):
        pass
