"""The walk of quasi-static shear: from one energy minimum to the next, and which of its steps are plastic events."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from jamlab.arguments.choices import HeldPressure
from jamlab.arrays import Array
from jamlab.engine.session import Session
from jamlab.errors import InputError
from jamlab.flow.limit_cycle import earlier_state, plastic_displacements
from jamlab.flow.quasistatic_run import QUASISTATIC, QuasistaticShear, noise_of_stress
from jamlab.flow.run import Run
from jamlab.flow.strain_path import StrainPath
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.walls import wall_stress
from jamlab.packing.deformation import deformed
from jamlab.packing.natural_units import natural_scales
from jamlab.packing.packing import Packing
from jamlab.packing.shear_direction import ShearDirection
from jamlab.processes.progress import Progress
from jamlab.protocols.box_relaxation import Ensemble
from jamlab.protocols.relaxation import relax_session, usual_force_tolerance
from jamlab.protocols.saddles import record, relax_off_saddles


class Minimum(SimpleNamespace):
    """One state on the way, a row of `QuasistaticShear`: its `series` by name, and of an event its `displacements`."""


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
        self._kept: list[int] = []  # rows of the frames
        self.turns = False  # whether the shear turns back
        self.facts |= {"cycle_rows": np.zeros(0, dtype=np.int64), "period": 0, "jammed": False}
        largest = usual_force_tolerance(packing.model) if force_tolerance is None else force_tolerance
        self.facts |= {"background_drag": 0.0, "tolerance": None, "iterations": 0, "shear_rate": 0.0}
        self.facts["force_tolerance"] = largest
        self._now = self._scales.to_natural(self._started)
        self.session = Session(self._now)
        self._pressure: float | None = None if isinstance(pressure, str) else pressure
        if self.before:
            self._pressure = self.before.held_pressure
            self._resume(self.before)
        else:
            if pressure == "constant":
                found = relax_session(self.session, force_tolerance, near=True)
                if not packing.law.range and contacts(self.session.packing()).unjammed:
                    raise InputError('pressure = "constant": the packing is unjammed, give a pressure as a number')
                self._pressure = self._scales.stress * found.evaluation.pressure
            self.add(self._relax(0.0, None), keep=True)
        self.facts["held_pressure"] = self._pressure

    def _resume(self, before: QuasistaticShear) -> None:
        """Take over what the file holds."""
        self.rows = [Minimum(**row) for row in self.rows_before()]
        self._on_walls, self._kept = list(before.wall_stress), before.frame_rows.tolist()
        events = [row for row in self.rows if row.event]
        for row, moved in zip(events, before.event_displacements, strict=False):
            row.displacements = moved
        for name in ("cycle_rows", "period", "return_distance", "jammed"):
            self.facts[name] = getattr(before, name)

    def packing(self) -> Packing:
        """The packing at the last minimum."""
        return self._scales.from_natural(self._now)

    def result(self) -> QuasistaticShear:
        """All states so far."""
        self.facts["wall_stress"] = np.array(self._on_walls).reshape(-1, 2, 2)
        if self.turns:
            moved = [row.displacements for row in self.rows if row.event]
            self.facts["event_displacements"] = np.array(moved).reshape(-1, self._now.n, 2)
        self.facts["kept_rows"] = np.array([*self._kept, *([len(self.rows) - 1] * (not self._last_is_kept()))])
        return super().result()

    def _last_is_kept(self) -> bool:
        return self._kept[-1] == len(self.rows) - 1

    def add(self, row: Minimum, *, keep: bool = False) -> None:
        """Add a row, with the stress on walls."""
        super().add(row, keep=keep)
        self._on_walls.append(wall_stress(self._now) * self._scales.stress)
        if keep:
            self._kept.append(len(self.rows) - 1)

    def end_cycle(self) -> None:
        """Count a cycle that ends here, at a packing that is kept, and look whether it was there before."""
        rows = [*self.facts["cycle_rows"], len(self.rows) - 1]
        ends = [self.frames[self._kept.index(row)] for row in rows]
        states = [self.rows[row] for row in rows]
        noise = self._noise(*states) ** 2 / self._scales.stress  # of contacts that bear it
        period, distance = earlier_state(ends, np.array([state.energy for state in states]), noise)
        self.facts |= {"cycle_rows": np.array(rows), "period": period, "return_distance": distance}

    def follow(self, route: StrainPath, least: float | None) -> None:
        """Go along a path, to its end, to where it repeats, or, if `least` is the shortest step on the way there, to
        where the packing jams."""
        self.turns = route.turns
        self.facts["turning_points"] = np.array(route.points if route.turns else [])
        if route.turns and route.points[-1] == 0 and not self.before:
            self.end_cycle()  # the first one begins at once
        done = float(np.abs(np.diff([row.strain for row in self.rows])).sum())
        self.warn_beyond("strain", done, route.length)
        for target in route.targets():
            if self.facts["period"] or self.facts["jammed"]:
                return
            if target.path < done + 0.5 * target.step:
                continue  # done by the run before
            if least is None:
                self.go_to(target.strain, keep=target.keep)
            else:
                self.go_until_jammed(target.strain, least, keep=target.keep)
            if target.ends_cycle and not self.facts["jammed"]:
                self.end_cycle()
            self.report(target.path / route.length, f"strain {target.strain:.3g}")

    def go_to(self, strain: float, *, keep: bool = False) -> None:
        """Take one step, and judge whether it is a plastic event."""
        before, start = self.rows[-1], self._now
        after = self._step(strain, strain - before.strain, before)
        after.event = self._is_event(start, before, after)
        self.add(after, keep=keep)

    def go_until_jammed(self, strain: float, least: float, *, keep: bool = False) -> None:
        """Go to a strain, or to where the packing jams on the way. A step that jams is taken back and halved, until it
        is as short as `least`; the shear goes on by such steps where smaller ones do not jam."""
        step = strain - self.rows[-1].strain
        while not self.facts["jammed"] and self.rows[-1].strain != strain:
            before, start = self.rows[-1], self._now
            last = abs(strain - before.strain) <= abs(step) * (1 + 1e-9)
            after = self._step(strain if last else before.strain + step, step, before)
            jammed = self.is_jammed(after)
            if jammed and abs(step) > least:
                self._now, step = start, 0.5 * step
                continue
            self.facts["jammed"] = jammed
            self.add(after, keep=keep and last)

    def is_jammed(self, state: Minimum) -> bool:
        """Whether the packing, which is at a state, is jammed: its pressure is no residue of the minimisation."""
        return state.pressure > self._noise(state) and not contacts(self._now).unjammed

    def _is_event(self, start: Packing, before: Minimum, after: Minimum) -> bool:
        """Whether a step from a packing is an event: stress falls or energy is lost, and the step back does not lead
        back; how far it then ends up from there is what the event displaced. The packing stays at the state after."""
        noise, lost = self._noise(before, after), after.dissipated - before.dissipated
        seen = QUASISTATIC.limit * abs(after.work - before.work) + noise * abs(after.strain - before.strain)
        if _drop(before, after) <= noise and lost <= seen:
            return False
        reached = self._now
        back = self._leads_back(before, after)
        if self.turns and not back:
            after.displacements = plastic_displacements(start, self._now) * self._scales.length
        self._now = reached
        return not back

    def _noise(self, *states: Minimum) -> float:
        """Uncertainty of the stress from the residual forces of some minima."""
        force = max(state.max_force for state in states) / self._scales.force
        return float(noise_of_stress(self.facts["force_tolerance"], force) * self._scales.stress)

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
        # the upper wall moves by strain times the height at the start, so that it comes back where the strain does
        tall = self._share(self._now.area * self._scales.length**2) if self._now.frame.has_walls else 1.0
        gradient = self._shearing.at(before.strain).gradient(step / tall)
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
            here, there = (share, self._share(before.area)) if not packing.frame.has_walls else (1.0, 1.0)
            mean = 0.5 * (stress * here + before.stress * there)
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


def _drop(before: Minimum, after: Minimum) -> float:
    """Fall of the stress along the step, whichever way it goes."""
    return float(np.sign(after.strain - before.strain) * (before.stress - after.stress))
