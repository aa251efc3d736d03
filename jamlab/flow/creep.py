"""Creep: load a packing at rest with a constant shear stress and follow its strain; compliance, rest or flow."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import check_number, checked
from jamlab.errors import InputError
from jamlab.flow.flow_run import SERIES, FlowRun
from jamlab.flow.overdamped_session import (
    LEAST_STRAIN,
    LEAST_TIME,
    SMALL_STRAIN_BACKGROUND,
    SMALL_STRAIN_TOLERANCE,
    End,
)
from jamlab.flow.run import Accuracy, TimedRun
from jamlab.packing.natural_units import natural_scales
from jamlab.packing.packing import Packing
from jamlab.plotting.drawable import drawn, in_unit
from jamlab.processes.progress import Progress
from jamlab.rheology.damping import ContactDamping, Damping

_RESTS, _FLOWS = 0.02, 0.9  # d ln strain/d ln time over the last half of the time, below and above
_LEFT = 0.02  # of the stress applied that drag may bear at rest
_YIELDED = 0.2  # strain below which a packing has not yielded, however fast it creeps


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class CreepRun(FlowRun):
    """Strain in time under a stress; rows and packings as in `FlowRun`.

    Attributes:
        applied: stress beside the residual one.
        residual: shear stress of the packing at rest, before.
        duration: time that was asked for.
    """

    columns: ClassVar[tuple[str, ...]] = (*SERIES, "compliance", "z_all", "energy_gap")

    applied: float
    residual: float
    duration: float

    @property
    def compliance(self) -> Array:
        """(m,) J(t) = strain over the stress applied."""
        return np.asarray(self.strain / self.applied)

    @property
    def final_rate(self) -> float:
        """Mean rate of strain over the last half of the time."""
        middle = self._middle
        return float((self.strain[-1] - self.strain[middle]) / (self.time[-1] - self.time[middle]))

    @property
    def slope(self) -> float:
        """d ln strain/d ln time over the last half of the time: 0 at rest, 1 in steady flow."""
        a, b = self.strain[self._middle], self.strain[-1]
        return float(np.log(b / a) / np.log(self.time[-1] / self.time[self._middle])) if a > 0 and b > 0 else 0.0

    @property
    def _middle(self) -> int:
        return int(np.searchsorted(self.time, 0.5 * self.time[-1]) - 1) or 1

    @property
    def state(self) -> Literal["rests", "creeps", "flows"]:
        """What the packing does at the end: it rests, it still creeps, or it flows steadily."""
        if self.slope < _RESTS and abs(self.viscous_stress[-1]) < _LEFT * abs(self.applied):
            return "rests"
        return "flows" if self.slope > _FLOWS and self.strain[-1] > _YIELDED else "creeps"

    @property
    def finished(self) -> bool:
        """Whether the packing has come to rest or flows steadily."""
        return self.state != "creeps"

    @property
    def summary(self) -> dict[str, float]:
        """Stress applied; last time and strain; mean rate and d ln strain/d ln time over the last half of the time."""
        last = {"time": float(self.time[-1]), "strain": float(self.strain[-1])}
        return {"stress": self.applied, **last, "rate": self.final_rate, "slope": self.slope}

    @drawn("Line2D")
    def plot(self, axes: Any, /, label: str = "", **style: Any) -> None:
        """Draw the compliance over time, on logarithmic axes.

        >>> ax = jamlab.creep(jamlab.pack(n=32, pressure=1e-2, seed=1), stress=1e-7, duration=10.0).plot()
        """
        per_unit = f"1/({self.unit})" if "/" in self.unit or " " in self.unit else f"1/{self.unit}"
        name = label or rf"$\sigma$ = {self.applied:g}: {self.state}"
        quantity = in_unit(r"compliance $J(t)$", per_unit if self.unit else "")
        self._draw(axes, self.time[1:], self.compliance[1:], name, quantity, **style)


LARGEST_STRESS, LONGEST = 1e3, 1e12  # in natural units, as in the papers


@checked
def creep(
    packing: Packing,
    stress: float,
    duration: float,
    damping: Damping | None = None,
    *,
    largest_strain: float = 10.0,
    tolerance: float = SMALL_STRAIN_TOLERANCE,
    background_drag: float = SMALL_STRAIN_BACKGROUND,
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
        path, progress: see `shear`.

    Raises:
        InputError: no particles touch, the fluid has no viscosity, or a value is out of range.
        ConvergenceError, StorageError: see `oscillate`.
    """
    law = damping or ContactDamping()
    check_creeping(law)
    scale = natural_scales(packing).stress
    check_number("stress", stress, LARGEST_STRESS * scale, LEAST_STRAIN * scale)
    check_number("duration", duration, LONGEST, LEAST_TIME)
    check_number("largest_strain", largest_strain, 1e4)
    accuracy = Accuracy(law, tolerance, background_drag)
    end = End(duration, f"a shorter duration than {duration:g}", largest_strain)
    with TimedRun(CreepRun, packing, accuracy, {"stress": stress}, end, path, progress, at_rest=True) as flow:
        before = flow.before
        residual = before.residual if before else flow.session.drive("rate 0", duration).elastic_stress
        flow.facts |= {"applied": stress, "residual": residual, "duration": duration}
        if flow.time < duration * (1 - 1e-12):
            flow.drive(flow.session.stress_drive(residual + stress), duration - flow.time)
        for state in flow.advance_log_spaced(duration):
            if abs(state.strain) > largest_strain:
                break
        return flow.finish()


def check_creeping(law: Damping) -> None:
    """Refuse a law under which a stress has no answer."""
    if not law.resists_shear:
        raise InputError(
            f"{law} does not resist shear, so the rate has no bound under a stress. Set eta_f > 0 or use ContactDamping"
        )
