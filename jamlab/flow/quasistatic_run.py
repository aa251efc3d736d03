"""States of quasi-static shear, and what the curve of stress over strain says of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from jamlab.arguments.choices import Direction
from jamlab.arrays import Array, ArrayLike
from jamlab.flow.flow_run import SERIES, energy_gap
from jamlab.flow.plastic_events import PlasticEvents
from jamlab.flow.report import describe_balance
from jamlab.flow.shear import ShearRun, StressDrops
from jamlab.packing.natural_units import natural_scales
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line
from jamlab.plotting.palette import BLACK, BLUE, RED


@dataclass(frozen=True)
class QuasistaticEvents:
    """From where on a change of stress is an event of quasi-static shear, and its steps."""

    limit: float = 0.02  # imbalance from which on a result is doubtful, and a step is tried backwards
    lean: float = 0.55  # tilt over width at which the box flips; above 1/2, so as not to flip back
    # stress that forces of 1 may hide, mean size 1: 0.1 and less were seen where nothing bears stress
    noise: float = 10.0
    # part of a fall of stress or energy that a step back may miss: noise, or hysteresis within the step
    reversible: float = 0.1


QUASISTATIC = QuasistaticEvents()


def stress_noise(force_tolerance: float, force: ArrayLike) -> Array:
    """Stress that is no more than noise where forces up to `force` are left, or up to the tolerance; natural units."""
    return QUASISTATIC.noise * np.maximum(force_tolerance, force)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class QuasistaticShear(ShearRun):
    """States of `quasistatic_shear`, m of them with the start; rows and packings as in `FlowRun`, without drag. There
    is no time: `time`, `rate`, `viscous_stress` and `dissipation` are 0, `damping` and `tolerance` None. `work` is the
    integral of the stress, `dissipated` what of it is not stored in `enthalpy`: what events release, and the error of
    the trapezoidal rule. Energies and work are over the area at the start.
    """

    series: ClassVar[tuple[str, ...]] = (*SERIES, "converged", "max_force", "area", "event")
    columns: ClassVar[tuple[str, ...]] = (*series, "z_all", "energy_gap", "enthalpy", "dilation")

    converged: NDArray[np.bool_]  # (m,) whether the minimisation met `force_tolerance`
    max_force: Array  # (m,) largest force left
    area: Array  # (m,) of the cell
    event: NDArray[np.bool_]  # (m,) whether the step to this state is a plastic event
    direction: Direction = "simple"  # see `quasistatic_shear`
    force_tolerance: float  # largest residual force asked for, in natural units
    held_pressure: float | None = None  # at which the area is free; None: the area stays

    @property
    def enthalpy(self) -> Array:
        """(m,) energy, and the work against the pressure that is held since the start."""
        held = 0.0 if self.held_pressure is None else self.held_pressure * self.dilation
        return np.asarray(self.energy + held)

    @property
    def dilation(self) -> Array:
        """(m,) growth of the area since the start, over the area there: dilatancy where the pressure is held."""
        return np.asarray(self.area / self.area[0] - 1)

    @property
    def events(self) -> PlasticEvents:
        """Plastic events."""
        k = np.flatnonzero(self.event)
        step, fall, lost = (values[k] - values[k - 1] for values in (self.strain, self.stress, self.dissipated))
        return PlasticEvents(self.strain[k], -np.sign(step) * fall, lost, np.abs(step))

    @property
    def drops(self) -> StressDrops:
        """Stress drops of the events in which stress fell, at the strain where each begins."""
        events = self.events
        begin, fell = events.strain - np.sign(events.strain) * events.width, events.stress_drop > self.least_stress
        return StressDrops(begin[fell], events.stress_drop[fell])

    @property
    def plastic_events(self) -> int:
        """Number of `events`."""
        return int(self.event.sum())

    @property
    def summary(self) -> dict[str, Any]:
        """Direction; entries of `ShearRun`; the number of events and of states that missed the force tolerance."""
        missed = int((~self.converged).sum())
        events = {"events": len(self.events)} | ({"NOT CONVERGED": missed} if missed else {})
        held = {} if self.held_pressure is None else {"pressure": self.held_pressure, "dilation": self.dilation[-1]}
        return {"direction": self.direction} | held | super().summary | events

    @property
    def energy_gap(self) -> Array:
        """(m,) work that is neither stored nor released by a detected event: the error of steps that are too long.
        0 if errors of the stress within `stress_noise` explain it."""
        released = np.where(self.event, np.diff(self.dissipated, prepend=0.0), 0.0)
        gap = energy_gap(self.work, np.cumsum(released), self.enthalpy)
        unseen = np.cumsum(self.stress_noise * np.abs(np.diff(self.strain, prepend=self.strain[0])))
        return np.where(np.abs(gap) > unseen, gap, 0.0)

    @property
    def least_stress(self) -> float:
        """Uncertainty of the stress from residual forces up to `force_tolerance`."""
        return float(stress_noise(self.force_tolerance, 0.0) * natural_scales(self.packing).stress)

    @property
    def stress_noise(self) -> Array:
        """(m,) uncertainty of the stress from the residual forces of a minimum; a smaller drop is no event."""
        scales = natural_scales(self.packing)
        return stress_noise(self.force_tolerance, self.max_force / scales.force) * scales.stress

    @property
    def energy_tolerance(self) -> float:
        """From which on steps are too long."""
        return QUASISTATIC.limit

    @property
    def remedy(self) -> dict[str, float]:
        """Half the step: events are released within steps that are too long."""
        return {"strain_step": 0.5 * float(np.abs(np.diff(self.strain[:2])).sum())}

    @drawn('Line2D, such as color="k"')
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw stress over strain; plastic events are the steep falls, with a mark where the stress ends up."""
        along = self.direction if isinstance(self.direction, str) else f"{np.degrees(self.direction):.4g}°"
        plain = {"color": BLUE, "linewidth": 1.2, "label": f"minima, {along} shear"}
        axes.plot(self.strain, self.stress, **merged_line(plain, style))
        ends = np.flatnonzero(self.event)
        if len(ends):
            label = f"{len(ends)} plastic event{'s' * (len(ends) > 1)}"
            axes.plot(self.strain[ends], self.stress[ends], "v", color=RED, markersize=4, label=label)
        if not self.converged.all():
            missed = ~self.converged
            label = f"not converged: {missed.sum()}"
            axes.plot(self.strain[missed], self.stress[missed], "x", color=BLACK, markersize=6, label=label)
        label_axes(axes, r"strain $\gamma$", in_unit(r"shear stress $\sigma$", self.unit))
        legend = axes.legend(
            *axes.get_legend_handles_labels(), title=describe_balance(self), fontsize=LEGEND, ncols=3,
            title_fontsize=LEGEND, loc="lower center", bbox_to_anchor=(0.5, 1.0),
        )  # fmt: skip  # above: curves fill the axes
        legend.get_title().set_color(BLACK if self.balanced else RED)
