"""The way of quasi-static shear: minima one after the other, and a closer look where stress falls."""

from __future__ import annotations

import time
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from jamlab.engine.session import Session
from jamlab.flow.quasistatic_run import QuasistaticShear
from jamlab.geometry.contact_network import contacts
from jamlab.packing.deformation import sheared
from jamlab.packing.law_parameters import UNIT_OF_STRESS
from jamlab.packing.packing import Packing
from jamlab.protocols.provenance import record
from jamlab.protocols.relaxation import force_tolerance, relax

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
    """Minima one after the other, the events between them, and the packing at the last."""

    def __init__(
        self, session: Session, tolerance: float | None, shortest: float, before: QuasistaticShear | None
    ) -> None:
        self._session, self._tolerance, self._shortest = session, tolerance, shortest
        self._began = time.perf_counter() - (before.seconds if before else 0.0)
        self._minima = before.steps if before else 0
        self.events: list[Event] = []
        if before is None:
            state, self.packing = self._relax(0.0)
            self.states, self._frames = [state], [self.packing]
            return
        self.packing, self._frames = before.packing, list(before.frames)
        columns = {f.name: getattr(before, f.name).tolist() for f in fields(Minimum)}
        self.states = [Minimum(**dict(zip(columns, row, strict=True))) for row in zip(*columns.values(), strict=True)]
        self.events = list(map(Event, *(getattr(before, f"event_{f.name}").tolist() for f in fields(Event))))

    def keep(self) -> None:
        """Keep the packing among the frames."""
        self._frames.append(self.packing)

    def result(self, strain: float) -> QuasistaticShear:
        """All states so far of a run to a strain."""
        columns: dict[str, Any] = {f.name: np.array([getattr(s, f.name) for s in self.states]) for f in fields(Minimum)}
        events = {f"event_{f.name}": np.array([getattr(e, f.name) for e in self.events]) for f in fields(Event)}
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
            frames=tuple(frames),
            damping=None,
            background=0.0,
            tolerance=force_tolerance(self.packing.model) if self._tolerance is None else self._tolerance,
            steps=self._minima,
            iterations=0,
            seconds=time.perf_counter() - self._began,
            unit=UNIT_OF_STRESS[self.packing.model, self.packing.units],
            shear_rate=0.0,
            strain_asked=strain,
        )

    def go_to(self, strain: float) -> None:
        """Take one step, or shorter and shorter ones up to an event on the way and long ones behind it."""
        before = self.states[-1]
        step = strain - before.strain
        after, packing = self._step(self.packing, strain, step)
        event = after.stress < before.stress and not self._leads_back(before, after, packing)
        if event and step > self._shortest * (1 + 1e-9):
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
        return abs(back.stress - before.stress) < REVERSIBLE * (before.stress - after.stress)

    def _step(self, packing: Packing, strain: float, step: float) -> tuple[Minimum, Packing]:
        """The minimum beyond a packing, and the packing there."""
        self._session.load(_flipped(sheared(packing, step)))
        return self._relax(strain)

    def _relax(self, strain: float) -> tuple[Minimum, Packing]:
        found = relax(self._session, self._tolerance, near=True)
        self._minima += 1
        packing = self._session.packing(ensemble="fixed-box")
        reached = found.evaluation
        state = Minimum(
            strain=strain,
            stress=-float(reached.stress[0, 1]),
            pressure=reached.pressure,
            normal_stress_difference=float(reached.stress[1, 1] - reached.stress[0, 0]),
            energy=reached.energy / packing.area,
            contacts=float(contacts(packing).count),
            converged=found.converged,
            max_force=reached.max_force,
        )
        return state, record(packing, found, protocol="quasistatic_shear", flow_strain=strain)


def _flipped(packing: Packing) -> Packing:
    """The same lattice, with the second vector that leans least."""
    if abs(packing.box[1, 0]) <= LEAN * packing.box[0, 0]:
        return packing
    box = packing.box.copy()
    box[1] -= np.round(box[1, 0] / box[0, 0]) * box[0]
    return packing.with_state(box=box)


def _event(before: Minimum, after: Minimum) -> Event:
    width = after.strain - before.strain
    work = 0.5 * (before.stress + after.stress) * width
    return Event(after.strain, before.stress - after.stress, work - (after.energy - before.energy), width)
