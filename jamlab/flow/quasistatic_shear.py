"""Athermal quasi-static shear: small steps of strain, each to an energy minimum; the limit of a vanishing rate.

Between plastic events a packing follows one minimum, and stress is elastic. Where that minimum ends, the packing falls
into another one: stress drops and energy is released at once (Maloney & Lemaitre, Phys. Rev. E 74, 016118 (2006)).
"""

from __future__ import annotations

import time
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.checks import check_number, checked, is_number
from jamlab.engine.session import Session
from jamlab.errors import InputError
from jamlab.flow.flow_run import LIMIT, Remedy, describe_balance, energy_gap
from jamlab.flow.run_file import RunFile
from jamlab.flow.shear_run import ShearRun, StressDrops
from jamlab.geometry.contact_network import count_pressing
from jamlab.packing.deformation import sheared
from jamlab.packing.natural_units import Scales, natural_scales
from jamlab.packing.packing import Packing
from jamlab.packing.short_repr import short_repr
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line
from jamlab.plotting.palette import BLACK, BLUE, RED
from jamlab.processes.progress import Progress
from jamlab.protocols.compression import LARGEST_TOLERANCE, MOST_STATES
from jamlab.protocols.provenance import record
from jamlab.protocols.relaxation import check_tolerance, force_tolerance, relax


@dataclass(frozen=True)
class PlasticEvents:
    """Steps in which stress fell, m of them, and from which a step back does not lead back."""

    strain: Array  # (m,) at the end of the step
    stress_drop: Array  # (m,) stress before less that after
    released: Array  # (m,) energy lost per area: the work by the trapezoidal rule less the rise of the energy
    width: Array  # (m,) strain of the step: the event lies that much before `strain` at most

    __repr__ = short_repr

    def __len__(self) -> int:
        return len(self.strain)


@dataclass(frozen=True, eq=False, repr=False)
class QuasistaticShear(ShearRun):
    """States of `quasistatic_shear`, m of them with the start; rows and packings as in `FlowRun`, without drag. There
    is no time: `time`, `rate`, `viscous_stress` and `dissipation` are 0. `work` is the integral of the stress,
    `dissipated` what of it is not stored: what events release, and the error of the trapezoidal rule."""

    converged: NDArray[np.bool_]  # (m,) bool, whether the minimisation met its tolerance
    max_force: Array  # (m,) largest force left
    # event_strain, event_drop, event_released, event_width: (k,) see `PlasticEvents`
    event_strain: Array
    event_drop: Array
    event_released: Array
    event_width: Array

    @property
    def events(self) -> PlasticEvents:
        """Plastic events."""
        return PlasticEvents(self.event_strain, self.event_drop, self.event_released, self.event_width)

    @property
    def drops(self) -> StressDrops:
        """Stress drops of the events, at the strain where each begins."""
        return StressDrops(self.event_strain - np.sign(self.event_strain) * self.event_width, self.event_drop)

    def _ends(self) -> NDArray[np.int64]:
        """(k,) rows at the ends of the events."""
        return np.asarray(np.abs(self.strain).searchsorted(np.abs(self.event_strain)))

    @property
    def reached(self) -> str:
        """What the run has reached, in words."""
        missed = int((~self.converged).sum())
        return super().reached + (f"; {missed} of {len(self.converged)} states NOT CONVERGED" if missed else "")

    @property
    def energy_gap(self) -> Array:
        """(m,) work that is neither stored nor released by an event that was seen: error of steps that are too long."""
        released = np.zeros(len(self.strain))
        released[self._ends()] = self.event_released
        return energy_gap(self.work, np.cumsum(released), self.energy)

    @property
    def allowed_imbalance(self) -> float:
        """From which on steps are too long."""
        return LIMIT

    @property
    def remedy(self) -> Remedy:
        """Half the step."""
        return Remedy(step=0.5 * float(np.abs(np.diff(self.strain[:2])).sum()))

    def describe(self) -> str:
        """Say how it was run, and how well energy is balanced."""
        return f"quasi-static, largest force {self.tolerance:g}, {describe_balance(self.imbalance)}"

    def __repr__(self) -> str:
        return f"QuasistaticShear(strain={self.strain[-1]:.4g}, {self.describe()}; {self.conclusion})"

    @drawn('Line2D, such as color="k"')
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw stress over strain; plastic events are the steep falls, with a mark where the stress ends up.

        >>> ax = jamlab.shear(jamlab.pack(n=32, pressure=1e-2, seed=1), rate=0, strain=0.01, step=2e-3).plot()
        """
        plain = {"color": BLUE, "linewidth": 1.2, "label": "minima, quasi-static"}
        axes.plot(self.strain, self.stress, **merged_line(plain, style))
        ends = self._ends()
        if len(ends):
            label = f"{len(ends)} stress drop{'s' * (len(ends) > 1)}"
            axes.plot(self.strain[ends], self.stress[ends], "v", color=RED, markersize=4, label=label)
        if not self.converged.all():
            missed = ~self.converged
            label = f"not converged: {missed.sum()}"
            axes.plot(self.strain[missed], self.stress[missed], "x", color=BLACK, markersize=6, label=label)
        label_axes(axes, r"strain $\gamma$", in_unit(r"shear stress $\sigma$", self.unit))
        legend = axes.legend(
            *axes.get_legend_handles_labels(), title=describe_balance(self.imbalance), fontsize=LEGEND, ncols=3,
            title_fontsize=LEGEND, loc="lower center", bbox_to_anchor=(0.5, 1.0),
        )  # fmt: skip  # above: curves fill the axes
        legend.get_title().set_color(BLACK if self.balanced else RED)


LEAN = 0.55  # tilt over width at which the box flips; above 1/2, so as not to flip back
REVERSIBLE = 0.1  # part of a fall of stress that a step back may miss: noise of minima, or hysteresis within the step


@dataclass(frozen=True)
class Minimum:
    """One state on the way; stress and energy as in `QuasistaticShear`."""

    strain: float
    stress: float
    pressure: float
    normal_stress_difference: float
    energy: float
    contacts: float
    converged: bool
    max_force: float


@dataclass(frozen=True)
class Event:
    """One plastic event, as in `PlasticEvents`."""

    strain: float
    drop: float
    released: float
    width: float


class Walk:
    """Minima one after the other, the events between them, and the packing at the last, all in natural units."""

    def __init__(
        self,
        session: Session,
        scales: Scales,
        tolerance: float | None,
        shortest: float,
        before: QuasistaticShear | None,
    ) -> None:
        self._session, self._scales, self._tolerance, self._shortest = session, scales, tolerance, shortest
        self._began = time.perf_counter() - (before.seconds if before else 0.0)
        self._minima = before.steps if before else 0
        self.events: list[Event] = []
        if before is None:
            state, self.packing = self._relax(0.0)
            self.states, self._frames = [state], [self.packing]
            return
        self._frames = [scales.to_natural(packing) for packing in before.frames]
        self.packing = self._frames[-1]
        columns = {f.name: self._natural(before, f.name) for f in fields(Minimum)}
        self.states = [Minimum(**dict(zip(columns, row, strict=True))) for row in zip(*columns.values(), strict=True)]
        self.events = list(map(Event, *(self._natural(before, f"event_{f.name}") for f in fields(Event))))

    def _natural(self, before: QuasistaticShear, name: str) -> list[Any]:
        """A column of an earlier run in natural units."""
        column, unit = getattr(before, name), self._units().get(name)
        return list((column if unit is None else column / unit).tolist())

    def _units(self) -> dict[str, float]:
        """Natural units of the columns that have one, in those of the packing."""
        stresses = ("stress", "pressure", "normal_stress_difference", "energy", "event_drop", "event_released")
        return dict.fromkeys(stresses, self._scales.stress) | {"max_force": self._scales.force}

    def keep(self) -> None:
        """Keep the packing among the frames."""
        self._frames.append(self.packing)

    def result(self, strain: float) -> QuasistaticShear:
        """All states so far of a run to a strain, in units of the packing."""
        columns: dict[str, Any] = {f.name: np.array([getattr(s, f.name) for s in self.states]) for f in fields(Minimum)}
        events: dict[str, Any] = {
            f"event_{f.name}": np.array([getattr(e, f.name) for e in self.events]) for f in fields(Event)
        }
        for name, unit in self._units().items():
            part = events if name in events else columns
            part[name] = part[name] * unit
        stress, zero = columns["stress"], np.zeros(len(self.states))
        columns |= dict.fromkeys(("time", "rate", "viscous_stress", "dissipation"), zero)
        work = np.append(0.0, np.cumsum(0.5 * (stress[1:] + stress[:-1]) * np.diff(columns["strain"])))
        frames = self._frames if self._frames[-1] is self.packing else [*self._frames, self.packing]
        return QuasistaticShear(
            **columns,
            **events,
            elastic_stress=stress,
            work=work,
            dissipated=work - (columns["energy"] - columns["energy"][0]),
            frames=tuple(self._scales.from_natural(packing) for packing in frames),
            damping=None,
            background=0.0,
            tolerance=force_tolerance(self.packing.model) if self._tolerance is None else self._tolerance,
            steps=self._minima,
            iterations=0,
            seconds=time.perf_counter() - self._began,
            unit=self.packing.unit_names.stress,
            shear_rate=0.0,
            strain_asked=abs(strain),
        )

    def go_to(self, strain: float) -> None:
        """Take one step, or shorter and shorter ones up to an event on the way and long ones behind it."""
        before = self.states[-1]
        step = strain - before.strain
        after, packing = self._step(self.packing, strain, step)
        event = _drop(before, after) > 0 and not self._leads_back(before, after, packing)
        if event and abs(step) > self._shortest * (1 + 1e-9):
            self.go_to(before.strain + 0.5 * step)
            self.go_to(strain)
            return
        self.states.append(after)
        self.packing = packing
        if event:
            self.events.append(_event(before, after))

    def _leads_back(self, before: Minimum, after: Minimum, packing: Packing) -> bool:
        """Whether the step back ends where it came from: stress falls before an instability, too."""
        back, _ = self._step(packing, before.strain, before.strain - after.strain)
        return abs(back.stress - before.stress) < REVERSIBLE * _drop(before, after)

    def _step(self, packing: Packing, strain: float, step: float) -> tuple[Minimum, Packing]:
        """The minimum beyond a packing, and the packing there."""
        self._session.load(_flipped(sheared(packing, step)))
        return self._relax(strain)

    def _relax(self, strain: float) -> tuple[Minimum, Packing]:
        found = relax(self._session, self._tolerance, near=True)
        self._minima += 1
        packing = self._session.packing(ensemble="fixed-box")
        reached = found.evaluation
        recorded = record(packing, found, protocol="quasistatic_shear", flow_strain=strain)
        state = Minimum(
            strain=strain,
            stress=-float(reached.stress[0, 1]),
            pressure=reached.pressure,
            normal_stress_difference=float(reached.stress[1, 1] - reached.stress[0, 0]),
            energy=reached.energy / packing.area,
            contacts=float(count_pressing(packing)),
            converged=recorded.converged,
            max_force=reached.max_force,
        )
        return state, recorded


def _flipped(packing: Packing) -> Packing:
    """The same lattice, with the second vector that leans least."""
    if abs(packing.box[1, 0]) <= LEAN * packing.box[0, 0]:
        return packing
    box = packing.box.copy()
    box[1] -= np.round(box[1, 0] / box[0, 0]) * box[0]
    return packing.with_state(box=box)


def _drop(before: Minimum, after: Minimum) -> float:
    """Fall of the stress along the shear, whichever way it goes."""
    return float(np.sign(after.strain - before.strain) * (before.stress - after.stress))


def _event(before: Minimum, after: Minimum) -> Event:
    width = after.strain - before.strain
    work = 0.5 * (before.stress + after.stress) * width
    return Event(after.strain, _drop(before, after), work - (after.energy - before.energy), abs(width))


LARGEST_STRAIN, LARGEST_STEP = 1e3, 0.1


@checked
def quasistatic_shear(
    packing: Packing,
    strain: float,
    step: float = 1e-3,
    *,
    resolution: float | None = None,
    every: float | None = None,
    tolerance: float | None = None,
    out: str | Path | None = None,
    progress: Progress | None = None,
) -> QuasistaticShear:
    """Shear a packing at fixed area without rate: after every step of strain an energy minimum.

    A step moves box and positions affinely, x -> x + step y, and relaxes. The box flips to the same lattice with
    another tilt when it leans by more than 0.55 of its width, so that strain has no limit. The start is relaxed too.

    >>> r = jamlab.shear(jamlab.pack(n=32, pressure=1e-2, seed=1), rate=0, strain=0.01, step=2e-3)
    >>> r.strain.round(6), bool(r.converged.all())
    (array([0.   , 0.002, 0.004, 0.006, 0.008, 0.01 ]), True)

    Args:
        packing: SP or DP.
        strain: in all, up to 1000, of either sign.
        step: at most 0.1; equal steps that are no longer than this end at `strain`. An event whose stress drop is
            smaller than the elastic rise in a step is not seen.
        resolution: on an event go back and take half the step, again and again, until steps are no longer than this:
            strain and size of the drop are known that well. By default steps are not refined.
        every: strain between two packings that are kept; by default first and last are.
        tolerance: on the largest force in natural units of the packing, as in `compress`.
        out: HDF5 file of the run, see `jamlab.read_flow`; if it holds a part of the same run, go on from there.
        progress: called after each step with the share of the work that is done, and in words.

    Returns:
        All states. `converged` is False at those that missed the tolerance; the packing goes on from there.
    """
    if not (is_number(strain) and 0 < abs(strain) <= LARGEST_STRAIN):
        raise InputError(f"strain = {strain!r}: must be a number up to {LARGEST_STRAIN:g}, or its negative, and not 0")
    whole = abs(strain)
    check_number("step", step, min(LARGEST_STEP, whole), whole / MOST_STATES)
    if resolution is not None:
        check_number("resolution", resolution, step)
    if every is not None:
        check_number("every", every, whole)
        if every < step:
            raise InputError(f"every = {every:g}: frames cannot be closer than the step, {step:g}")
    check_tolerance(tolerance, LARGEST_TOLERANCE)
    count = int(np.ceil(whole / step - 1e-9))
    task = {"rate": 0, "step": strain / count, "resolution": resolution, "tolerance": tolerance}
    file = RunFile(out, QuasistaticShear, packing, None, task, progress)
    before = file.before
    scales = natural_scales(packing)
    with Session(scales.to_natural(before.packing if before else packing)) as session:
        walk = Walk(session, scales, tolerance, whole / count if resolution is None else resolution, before)

        def result() -> QuasistaticShear:
            return walk.result(strain)

        def kept(k: int) -> int:
            return int(whole * k / count / every + 1e-9) if every is not None else 0

        for k in range(1, count + 1):
            reached = strain * k / count
            if abs(reached) < abs(walk.states[-1].strain) + 0.5 * whole / count:
                continue  # done by the run before
            walk.go_to(reached)
            if kept(k) > kept(k - 1):
                walk.keep()
            file.report(result, k / count, f"strain {reached:.3g}")
        return file.finish(result)
