"""States of quasi-static shear, and what the curve of stress over strain says of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from jamlab.arguments.choices import Direction
from jamlab.arrays import Array, ArrayLike, Indices
from jamlab.flow.flow_run import SERIES, energy_gap
from jamlab.flow.limit_cycle import LimitCycle, ShearCycles, moved_between, pair_events
from jamlab.flow.plastic_events import PlasticEvents
from jamlab.flow.report import describe_balance
from jamlab.flow.shear import ShearRun, StressDrops
from jamlab.flow.shear_jamming import ShearJamming
from jamlab.packing.natural_units import natural_scales
from jamlab.packing.packing import Packing
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line
from jamlab.plotting.palette import BLACK, BLUE, GREY, RED


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


def noise_of_stress(force_tolerance: float, force: ArrayLike) -> Array:
    """Stress that is no more than noise where forces up to `force` are left, or up to the tolerance; natural units."""
    return QUASISTATIC.noise * np.maximum(force_tolerance, force)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class QuasistaticShear(ShearRun):
    """States of `quasistatic_shear`, m of them with the start; rows and packings as in `FlowRun`, without drag. There
    is no time: `time`, `rate`, `viscous_stress` and `dissipation` are 0, `damping` and `tolerance` None. `work` is the
    integral of the stress, `dissipated` what of it is not stored in `enthalpy`: what events release, and the error of
    the trapezoidal rule. Energies and work are over the area at the start.

    Attributes:
        turning_points: (t,) strains that the shear visits one after the other; (0,) if it only grows.
        kept_rows: (f,) row of each of the `frames`.
        cycle_rows: (c + 1,) rows at which c cycles begin and end; (0,) without.
        period: number of cycles after which the state at the end of the last one returned to that at the end of an
            earlier one; 0 if it did not.
        return_distance: largest distance between the two, see `LimitCycle`; nan without.
        inner_rows: (b,) rows within steps, on the sides of bracketed events; means leave them out.
        event_displacements: (k, n, 2) displacement of the particles by each event of a shear that turns back, between
            two minima at one strain, without rattlers; (0, n, 2) of other shears.
    """

    series: ClassVar[tuple[str, ...]] = (*SERIES, "converged", "max_force", "area", "event")
    columns: ClassVar[tuple[str, ...]] = (*series, "z_all", "energy_gap", "enthalpy", "dilation")
    _apart = ("wall_stress", "event_displacements")

    converged: NDArray[np.bool_]  # (m,) whether the minimisation met `force_tolerance`
    max_force: Array  # (m,) residual force
    area: Array  # (m,) of the cell
    event: NDArray[np.bool_]  # (m,) whether the step to this state is a plastic event
    direction: Direction = "simple"  # see `quasistatic_shear`
    force_tolerance: float  # largest residual force asked for, in natural units
    held_pressure: float | None = None  # at which the area is free; None: the area stays
    turning_points: Array = field(default_factory=lambda: np.zeros(0))
    kept_rows: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    cycle_rows: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    period: int = 0
    return_distance: float = float("nan")
    event_width: float | None = None  # strain to which events are bracketed; None: to a step
    inner_rows: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    event_displacements: Array = field(default_factory=lambda: np.zeros((0, 0, 2)))
    until_jammed: bool = False  # whether the shear was to end at the first state that is jammed
    jammed: bool = False  # whether it did

    @property
    def frame_rows(self) -> Indices:
        """(f,) row of each of the `frames`."""
        return self.kept_rows if len(self.kept_rows) else super().frame_rows  # of older files, in which strain grows

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
        """Plastic events, with the packings on both sides where `event_width` was given."""
        k = np.flatnonzero(self.event)
        step, fall, lost = (values[k] - values[k - 1] for values in (self.strain, self.stress, self.dissipated))
        before: tuple[Packing, ...] = ()
        after: tuple[Packing, ...] = ()
        if self.event_width is not None:
            place = {row: number for number, row in enumerate(self.frame_rows.tolist())}
            before, after = (tuple(self.frames[place[row]] for row in rows) for rows in ((k - 1).tolist(), k.tolist()))
        energy, units = lost * float(self.area[0]), self.packing.unit_names
        own = "ε" if self.packing.units == "eps" else f"{units.stress} {units.length}²"
        return PlasticEvents(self.strain[k], -np.sign(step) * fall, lost, np.abs(step), energy, before, after, own)

    @property
    def drops(self) -> StressDrops:
        """Stress drops of the events in which stress fell, at the strain where each begins."""
        events = self.events
        begin, fell = self.strain[np.flatnonzero(self.event) - 1], events.stress_drop > self.least_stress
        return StressDrops(begin[fell], events.stress_drop[fell])

    @property
    def cycles(self) -> ShearCycles:
        """Cycles of a shear that turns back, with the displacement of every particle in each."""
        ends = [self.frames[int(np.flatnonzero(self.frame_rows == row)[0])] for row in self.cycle_rows]
        moved = [moved_between(*pair) for pair in pairwise(ends)]
        seen = np.cumsum(self.event)[self.cycle_rows]
        return ShearCycles(
            cycle=np.arange(1, len(moved) + 1),
            displacement=np.array([each.lengths.mean() for each in moved]),
            largest=np.array([each.lengths.max() for each in moved]),
            displacements=np.array([each.particles for each in moved]).reshape(-1, self.packing.n, 2),
            dissipated=np.diff(self.dissipated[self.cycle_rows]),
            events=np.diff(seen),
            unit=self.packing.unit_names.length,
            period=self.period,
        )

    @property
    def limit_cycle(self) -> LimitCycle | None:
        """Part that repeats, with its hysterons; None if no state has returned."""
        if not self.period:
            return None
        begin, end = self.cycle_rows[[-1 - self.period, -1]]
        rows = np.flatnonzero(self.event)
        within = (rows > begin) & (rows <= end)
        k = rows[within]
        hysterons = pair_events(self.strain[k], self.strain[k] - self.strain[k - 1], self.event_displacements[within])
        return LimitCycle(
            period=self.period,
            cycles_before=len(self.cycle_rows) - 1 - self.period,
            distance=self.return_distance,
            dissipated=float(self.dissipated[end] - self.dissipated[begin]),
            events=len(k),
            rows=np.array([begin, end]),
            hysterons=hysterons,
        )

    @property
    def _inner(self) -> Indices:
        return self.inner_rows

    @property
    def _first_part(self) -> tuple[float, float]:
        if not len(self.turning_points):
            return super()._first_part
        return float(self.turning_points[0]), abs(float(self.turning_points[0]))

    @property
    def _last_part(self) -> float:
        turns = np.flatnonzero(np.diff(np.sign(np.diff(self.strain)))) + 1
        return float(self.path[turns[-1]]) if len(turns) else 0.0

    @property
    def jamming(self) -> ShearJamming | None:
        """Where a shear until the packing jams ended; None if it did not jam."""
        if not self.until_jammed or not self.jammed:
            return None
        before, after = self.strain[-2:]
        return ShearJamming(float(before), float(after), float(self.path[-1]), float(self.pressure[-1]), self.packing)

    @property
    def state(self) -> Any:
        """As of `ShearRun`; whether a shear until the packing jams did jam it, and whether cycles are periodic."""
        if self.until_jammed and self.finished and not self.period:
            return "jammed" if self.jammed else "never jammed"
        if len(self.cycle_rows) > 1 and self.finished:
            return "periodic" if self.period else "not periodic"
        return super().state

    @property
    def finished(self) -> bool:
        """Whether the strain asked for is reached, or the shear repeats, or it has jammed the packing."""
        return bool(self.period) or self.jammed or super().finished

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
        whole: dict[str, Any] = {"cycles": len(self.cycle_rows) - 1} if len(self.cycle_rows) > 1 else {}
        if (limit := self.limit_cycle) is not None:
            whole |= {"period": limit.period, "cycles_before": limit.cycles_before, "hysterons": len(limit.hysterons)}
        if (found := self.jamming) is not None:
            whole |= {"jams above": found.strain_below}
        return {"direction": self.direction} | held | super().summary | events | whole

    @property
    def energy_gap(self) -> Array:
        """(m,) work that is neither stored nor released by a detected event: the error of steps that are too long.
        0 if errors of the stress within `stress_noise` explain it."""
        if self.until_jammed:  # its last state alone bears stress
            return np.zeros_like(self.strain)
        released = np.where(self.event, np.diff(self.dissipated, prepend=0.0), 0.0)
        gap = energy_gap(self.work, np.cumsum(released), self.enthalpy)
        unseen = np.cumsum(self.stress_noise * np.abs(np.diff(self.strain, prepend=self.strain[0])))
        return np.where(np.abs(gap) > unseen, gap, 0.0)

    @property
    def least_stress(self) -> float:
        """Uncertainty of the stress from residual forces up to `force_tolerance`."""
        return float(noise_of_stress(self.force_tolerance, 0.0) * natural_scales(self.packing).stress)

    @property
    def stress_noise(self) -> Array:
        """(m,) uncertainty of the stress from the residual forces of a minimum; a smaller drop is no event."""
        scales = natural_scales(self.packing)
        return noise_of_stress(self.force_tolerance, self.max_force / scales.force) * scales.stress

    @property
    def energy_tolerance(self) -> float:
        """From which on steps are too long."""
        return QUASISTATIC.limit

    @property
    def remedy(self) -> dict[str, float]:
        """Half the step: events are released within steps that are too long."""
        return {"strain_step": 0.5 * float(np.abs(np.diff(self.strain)).max(initial=0.0))}

    @drawn('Line2D, such as color="k"')
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw stress over strain; plastic events are the steep falls, with a mark where the stress ends up. Of a shear
        that repeats the limit cycle is drawn, and what was before it in grey."""
        along = self.direction if isinstance(self.direction, str) else f"{np.degrees(self.direction):.4g}°"
        plain = {"color": BLUE, "linewidth": 1.2, "label": f"minima, {along} shear"}
        first = 0
        if (limit := self.limit_cycle) is not None:
            first = int(limit.rows[0])
            label = f"transient, {limit.cycles_before} cycle{'s' * (limit.cycles_before != 1)}"
            axes.plot(self.strain[: first + 1], self.stress[: first + 1], color=GREY, linewidth=0.9, label=label)
            plain["label"] = f"limit cycle of period {limit.period}"
        axes.plot(self.strain[first:], self.stress[first:], **merged_line(plain, style))
        ends = np.flatnonzero(self.event)
        ends = ends[ends > first]
        if len(ends):
            label = f"{len(ends)} plastic event{'s' * (len(ends) > 1)}"
            axes.plot(self.strain[ends], self.stress[ends], "v", color=RED, markersize=4, label=label)
        if not self.converged.all():
            missed = ~self.converged
            label = f"not converged: {missed.sum()}"
            axes.plot(self.strain[missed], self.stress[missed], "x", color=BLACK, markersize=6, label=label)
        label_axes(axes, r"strain $\gamma$", in_unit(r"shear stress $\sigma$", self.unit))
        axes.locator_params(axis="x", nbins=5)  # strains of both signs, and small ones, are wide
        legend = axes.legend(
            *axes.get_legend_handles_labels(), title="" if self.balanced else describe_balance(self), fontsize=LEGEND,
            ncols=3 - bool(first), title_fontsize=LEGEND, loc="lower center", bbox_to_anchor=(0.5, 1.0),
        )  # fmt: skip  # above: curves fill the axes
        legend.get_title().set_color(RED)
