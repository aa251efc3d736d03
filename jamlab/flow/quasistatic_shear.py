"""Athermal quasi-static shear: small steps of strain, each to an energy minimum; the limit of a vanishing rate.

Between plastic events a packing follows one minimum, and stress is elastic. Where that minimum ends, the packing falls
into another one: stress drops and energy is released at once (Maloney & Lemaitre, Phys. Rev. E 74, 016118 (2006)).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from jamlab.arguments.choices import Direction, HeldPressure
from jamlab.arrays import Array, ArrayLike
from jamlab.checks import check_number, checked, is_number
from jamlab.engine.session import Session
from jamlab.errors import InputError, named
from jamlab.flow.flow_run import SERIES, energy_gap
from jamlab.flow.report import describe_balance
from jamlab.flow.run import Run
from jamlab.flow.shear import ShearRun, StressDrops
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.walls import wall_stress, walled
from jamlab.packing.deformation import deformed
from jamlab.packing.natural_units import natural_scales
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.packing.shear_direction import ShearDirection, shear_direction
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line
from jamlab.plotting.palette import BLACK, BLUE, RED
from jamlab.processes.progress import Progress
from jamlab.protocols.box_relaxation import Ensemble
from jamlab.protocols.compression import MOST_STATES
from jamlab.protocols.relaxation import relax_session, usual_force_tolerance
from jamlab.protocols.saddles import record, relax_off_saddles


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


@dataclass(frozen=True)
class PlasticEvents(Result):
    """Plastic events: m steps in which stress fell or energy was lost, and which a step back does not undo."""

    _rows = ("strain", "stress_drop", "released", "width")

    strain: Array  # (m,) at the end of the step
    stress_drop: Array  # (m,) stress before less that after; negative where it rose by more than it fell
    released: Array  # (m,) energy lost per area: the work by the trapezoidal rule less the rise of the energy
    width: Array  # (m,) strain of the step: the event lies that much before `strain` at most

    def __len__(self) -> int:
        return len(self.strain)


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
        return float(_stress_noise(self.force_tolerance, 0.0) * natural_scales(self.packing).stress)

    @property
    def stress_noise(self) -> Array:
        """(m,) uncertainty of the stress from the residual forces of a minimum; a smaller drop is no event."""
        scales = natural_scales(self.packing)
        return _stress_noise(self.force_tolerance, self.max_force / scales.force) * scales.stress

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


class Minimum(SimpleNamespace):
    """One state on the way, a row of `QuasistaticShear`: its `series` by name."""


@dataclass(frozen=True)
class Shearing:
    """A direction of shear as it stands in boxes whose first vector is turned along x."""

    first: Array  # (2,) first vector of the box before
    direction: ShearDirection

    @property
    def along_x(self) -> bool:
        """Whether the first vector of the box stays as it is."""
        return not (self.direction.generator @ self.first).any()

    def at(self, strain: float) -> ShearDirection:
        """The direction as it stands in the box after a strain."""
        along = self.direction.gradient(strain) @ self.first
        along = along / np.hypot(*along)
        return self.direction.turned(np.array([along, [-along[1], along[0]]]))


class Walk(Run[QuasistaticShear]):
    """Minima one after the other, and the events between them. The session is in natural units of the packing; rows,
    frames and events are in units of the packing itself."""

    def __init__(
        self,
        packing: Packing,
        shearing: Shearing,
        force_tolerance: float | None,
        pressure: HeldPressure | None,
        task: dict[str, Any],
        path: str | Path | None,
        progress: Progress | None,
    ) -> None:
        super().__init__(QuasistaticShear, packing, None, task | {"force_tolerance": force_tolerance}, path, progress)
        self._scales, self._shearing, self._tolerance = natural_scales(packing), shearing, force_tolerance
        self._on_walls: list[Array] = []
        largest = usual_force_tolerance(packing.model) if force_tolerance is None else force_tolerance
        self.facts |= {"background_drag": 0.0, "tolerance": None, "iterations": 0, "shear_rate": 0.0}
        self.facts["force_tolerance"] = largest
        self._now = self._scales.to_natural(self._started)
        self.session = Session(self._now)
        self._pressure: float | None = None if isinstance(pressure, str) else pressure
        if self.before:
            self._pressure = self.before.held_pressure
            self.rows = [Minimum(**row) for row in self.rows_before()]
            self._on_walls = list(self.before.wall_stress)
        else:
            if pressure == "constant":
                found = relax_session(self.session, force_tolerance, near=True)
                if not packing.law.range and contacts(self.session.packing()).unjammed:
                    raise InputError('pressure = "constant": the packing is unjammed, give a pressure as a number')
                self._pressure = self._scales.stress * found.evaluation.pressure
            self.add(self._relax(0.0, None), keep=True)
        self.facts["held_pressure"] = self._pressure

    def packing(self) -> Packing:
        """The packing at the last minimum."""
        return self._scales.from_natural(self._now)

    def result(self) -> QuasistaticShear:
        """All states so far."""
        self.facts["wall_stress"] = np.array(self._on_walls).reshape(-1, 2, 2)
        return super().result()

    def add(self, row: Minimum, *, keep: bool = False) -> None:
        """Add a row, with the stress on walls."""
        super().add(row, keep=keep)
        self._on_walls.append(wall_stress(self._now) * self._scales.stress)

    def go_to(self, strain: float, *, keep: bool = False) -> None:
        """Take one step; it is an event where stress falls or energy is lost, and the step back does not lead back."""
        before = self.rows[-1]
        after = self._step(strain, strain - before.strain, before)
        noise, lost = self._noise(before, after), after.dissipated - before.dissipated
        seen = QUASISTATIC.limit * abs(after.work - before.work) + noise * abs(strain - before.strain)
        if _drop(before, after) > noise or lost > seen:
            reached = self._now
            after.event = not self._leads_back(before, after)
            self._now = reached
        self.add(after, keep=keep)

    def _noise(self, *states: Minimum) -> float:
        """Uncertainty of the stress from the residual forces of some minima."""
        force = max(state.max_force for state in states) / self._scales.force
        return float(_stress_noise(self.facts["force_tolerance"], force) * self._scales.stress)

    def _leads_back(self, before: Minimum, after: Minimum) -> bool:
        """Whether the step back ends where it came from, in stress and energy: stress falls before an instability, too,
        and the trapezoidal rule loses energy where contacts form."""
        back = self._step(before.strain, before.strain - after.strain, after)
        noise, lost = self._noise(before, after, back), after.dissipated - before.dissipated
        held = (self._pressure or 0.0) * (self._share(back.area) - self._share(before.area))
        least = noise * abs(after.strain - before.strain)
        stress, energy = back.stress - before.stress, back.energy + held - before.energy
        return bool(
            abs(stress) < max(QUASISTATIC.reversible * abs(_drop(before, after)), noise)
            and abs(energy) < max(QUASISTATIC.reversible * abs(lost), least)
        )

    def _step(self, strain: float, step: float, before: Minimum) -> Minimum:
        """Strain the packing by a step, to a strain in all, and relax."""
        gradient = self._shearing.at(before.strain).gradient(step)
        self.session.load(_flipped(deformed(self._now, gradient)[0]))
        return self._relax(strain, before)

    def _relax(self, strain: float, before: Minimum | None) -> Minimum:
        pressure = None if self._pressure is None else self._pressure / self._scales.stress
        found = relax_off_saddles(self.session, self._tolerance, near=True, ensemble=Ensemble(pressure=pressure))
        self._steps += 1
        reached, packing = found.evaluation, self.session.packing(ensemble="fixed-box")
        self._now = record(self.session, packing, found, protocol="quasistatic_shear", flow_strain=strain)
        unit, direction = self._scales.stress, self._shearing.at(strain)
        along, across = np.einsum("ai,ij,aj->a", direction.axes, reached.stress, direction.axes)
        area = packing.area * self._scales.length**2
        share = self._share(area)
        stress, energy = direction.conjugate(reached.stress) * unit, reached.energy / packing.area * unit * share
        work = dissipated = 0.0
        if before:  # the integral of the stress by the trapezoidal rule, and what of it is not stored
            mean = 0.5 * (stress * share + before.stress * self._share(before.area))
            work = before.work + mean * (strain - before.strain)
            stored = energy - self.rows[0].energy + (self._pressure or 0.0) * (share - 1.0)
            dissipated = work - stored
        still = dict.fromkeys(("time", "rate", "viscous_stress", "dissipation"), 0.0)
        moved = {"strain": strain, "work": work, "dissipated": dissipated, "area": area, "event": False}
        stresses = {"stress": stress, "elastic_stress": stress, "pressure": reached.pressure * unit}
        return Minimum(
            **still | moved | stresses,
            normal_stress_difference=float(across - along) * unit,
            energy=energy,
            contacts=float(len(packing.kind.pairs(packing).i)),
            converged=self._now.converged,
            max_force=reached.max_force * self._scales.force,
        )

    def _share(self, area: float) -> float:
        """An area over the area of the first state; 1 where it stays."""
        return area / self.rows[0].area if self.rows and self._pressure is not None else 1.0


def _flipped(packing: Packing) -> Packing:
    """The same lattice, with the second vector that leans least."""
    if abs(packing.box[1, 0]) <= QUASISTATIC.lean * packing.box[0, 0]:
        return packing
    box = packing.box.copy()
    box[1] -= np.round(box[1, 0] / box[0, 0]) * box[0]
    return packing.with_state(box=box)


def _stress_noise(force_tolerance: float, force: ArrayLike) -> Array:
    """Stress that is no more than noise where forces up to `force` are left, or up to the tolerance; natural units."""
    return QUASISTATIC.noise * np.maximum(force_tolerance, force)


def _drop(before: Minimum, after: Minimum) -> float:
    """Fall of the stress along the shear, whichever way it goes."""
    return float(np.sign(after.strain) * (before.stress - after.stress))


_HIGHEST_PRESSURE = 1.0  # that may be held, stiffness of a contact


@checked
def quasistatic_shear(
    packing: Packing,
    strain: float,
    strain_step: float = 1e-3,
    *,
    direction: Direction = "simple",
    walls: bool | None = None,
    pressure: HeldPressure | None = None,
    snapshot_every: float | None = None,
    force_tolerance: float | None = None,
    path: str | Path | None = None,
    progress: Progress | None = None,
) -> QuasistaticShear:
    """Shear a packing quasi-statically, with an energy minimum after every strain step, at fixed area or pressure.

    Each step moves box and positions affinely, x -> x + strain_step y, and relaxes. A box tilted by more than 0.55 of
    its width is replaced by an equivalent box, so the strain is unlimited. The initial packing is relaxed too. For
    other directions, packings are rotated so that the first box vector stays along x.

    >>> r = jamlab.quasistatic_shear(jamlab.pack(n=32, pressure=1e-2, seed=1), strain=0.01, strain_step=2e-3)
    >>> r.strain.round(6), bool(r.converged.all())
    (array([0.   , 0.002, 0.004, 0.006, 0.008, 0.01 ]), True)

    Args:
        packing: SP or DP.
        strain: total strain of either sign, up to 1000 for "simple", up to 1 for other directions.
        strain_step: largest strain step, at most 0.1. Events in which stress rises, and less than 2 % of the work of
            the step is lost, are not detected.
        direction: "simple": along x; an angle in radians: simple shear in that direction; "pure": extension along x,
            compression along y. `stress` is conjugate to the strain. Between walls only "simple".
        walls: see `shear`.
        pressure: "constant" (initial pressure) or a number in the packing's unit of stress: every state minimises the
            enthalpy over the area too, and meets the pressure to 1e-9 of itself or 3e-15 of the stiffness of a contact;
            that of sticky disks, which may vanish, to 1e-9 of the mean contact force over the mean size. A packing of
            repulsive particles that unjams is compressed until it jams, and then decompressed. Between walls the
            pressure is the normal stress on them, at constant width. Default: constant area.
        snapshot_every: strain between stored packings. Default: only the first and the last.
        force_tolerance: largest residual force in natural units, as in `compress`.
        path, progress: see `shear`.

    Returns:
        All states. `converged` is False for states that missed the force tolerance; the shear continues from them.
    """
    packing = walled(packing, walls)
    shearing = Shearing(packing.box[0], shear_direction(packing, direction))
    whole = abs(strain)
    if whole == 0:
        raise InputError(f"{named('strain', strain)}: must be other than 0")
    if whole > 1 and not shearing.along_x:
        raise InputError(f"{named('strain', strain)}: must be at most 1 in magnitude for direction {direction!r}")
    check_number("strain_step", strain_step, whole, whole / MOST_STATES)
    if snapshot_every is not None:
        check_number("snapshot_every", snapshot_every, whole)
        if snapshot_every < strain_step:
            raise InputError(
                f"{named('snapshot_every', snapshot_every, 'g')}: closer than strain_step = {strain_step:g}"
            )
    _check_pressure(packing, pressure)
    count = int(np.ceil(whole / strain_step - 1e-9))
    task: dict[str, Any] = {"strain_step": strain / count}
    task |= {} if shearing.along_x else {"direction": direction}
    task |= {} if pressure is None else {"pressure": pressure}

    def kept(k: int) -> int:
        return int(whole * k / count / snapshot_every + 1e-9) if snapshot_every is not None else 0

    with Walk(packing, shearing, force_tolerance, pressure, task, path, progress) as walk:
        walk.facts |= {"strain_asked": whole, "direction": direction}
        walk.warn_beyond("strain", abs(walk.rows[-1].strain), whole)
        for k in range(1, count + 1):
            reached = strain * k / count
            if abs(reached) < abs(walk.rows[-1].strain) + 0.5 * whole / count:
                continue  # done by the run before
            walk.go_to(reached, keep=kept(k) > kept(k - 1))
            walk.report(k / count, f"strain {reached:.3g}")
        return walk.finish()


def _check_pressure(packing: Packing, pressure: HeldPressure | None) -> None:
    """Refuse what is no pressure that the packing can be held at."""
    if pressure is None or pressure == "constant":
        return
    largest = _HIGHEST_PRESSURE * natural_scales(packing).stress  # beyond, particles pass through each other
    known = not isinstance(pressure, str) and is_number(pressure) and abs(pressure) <= largest
    if not known or (pressure <= 0 and not packing.law.range):
        raise InputError(
            f'pressure = {pressure!r}: give "constant", or a number of at most {largest:g} '
            f"{packing.unit_names.stress}, positive for repulsive particles"
        )
