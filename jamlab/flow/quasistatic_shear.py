"""Athermal quasi-static shear: small steps of strain, each to an energy minimum; the limit of a vanishing rate.

Between plastic events a packing follows one minimum, and stress is elastic. Where that minimum ends, the packing falls
into another one: stress drops and energy is released at once (Maloney & Lemaitre, Phys. Rev. E 74, 016118 (2006)).
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from jamlab.checks import check_number, checked
from jamlab.engine.session import Session
from jamlab.errors import InputError
from jamlab.packing.deformation import sheared
from jamlab.packing.law_parameters import UNIT_OF_STRESS
from jamlab.packing.packing import Packing
from jamlab.packing.short_repr import short_repr
from jamlab.plotting.axes import axes_for
from jamlab.protocols.compression import LARGEST_TOLERANCE
from jamlab.protocols.provenance import record
from jamlab.protocols.relaxation import Progress, check_tolerance, relax

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

LARGEST_STRAIN, LARGEST_STEP = 1e3, 0.1
LEAN = 0.55  # tilt over width at which the box flips; above 1/2, so as not to flip back
REVERSIBLE = 0.1  # part of a fall of stress that a step back may miss: noise of minima, or hysteresis within the step


@dataclass(frozen=True)
class PlasticEvents:
    """Steps in which stress fell, m of them, and from which a step back does not lead back.

    Attributes:
        strain: (m,) at the end of the step.
        stress_drop: (m,) stress before less that after.
        released: (m,) energy lost per area: the work by the trapezoidal rule less the rise of the energy.
        width: (m,) strain of the step: the event lies that much before `strain` at most.
    """

    strain: Array
    stress_drop: Array
    released: Array
    width: Array

    __repr__ = short_repr

    def __len__(self) -> int:
        return len(self.strain)


@dataclass(frozen=True)
class QuasistaticShear:
    """States of `quasistatic_shear`, m of them with the start, in the units of the packing.

    Attributes:
        strain: (m,) simple shear x -> x + strain y, from 0 on.
        stress: (m,) shear stress, conjugate to the strain: its integral is the work per area.
        pressure: (m,) positive in compression.
        normal_stress_difference: (m,) N1 = s_xx - s_yy of the stress s, positive in tension.
        energy: (m,) per area.
        converged: (m,) bool, whether the minimisation met its tolerance.
        max_force: (m,) largest force left.
        events: plastic events.
        frames: packings every so much strain, if they were asked for; the strain is in their provenance.
        packing: last state.
        unit: of stress, for labels.
    """

    strain: Array
    stress: Array
    pressure: Array
    normal_stress_difference: Array
    energy: Array
    converged: NDArray[np.bool_]
    max_force: Array
    events: PlasticEvents
    frames: tuple[Packing, ...]
    packing: Packing
    unit: str = ""

    __repr__ = short_repr

    def plot(self, ax: Any = None, **style: Any) -> Axes:
        """Draw stress over strain; plastic events are the steep falls, with a mark where the stress ends up.

        >>> ax = quasistatic_shear(jamlab.pack(n=64, pressure=1e-2, seed=1), strain=0.2).plot()

        Args:
            ax: matplotlib Axes; by default those of a new figure.
            style: of matplotlib's Line2D, such as color="k".

        Returns:
            The axes.

        Raises:
            InputError: `ax` is something else, or matplotlib refuses the style.
        """
        from jamlab.flow.quasistatic_shear_plot import draw_shear

        with axes_for(ax, style) as axes:
            draw_shear(axes, self, **style)
        return axes


@checked
def quasistatic_shear(
    packing: Packing,
    strain: float,
    step: float = 1e-3,
    *,
    resolution: float | None = None,
    every: float | None = None,
    tolerance: float | None = None,
    progress: Progress | None = None,
) -> QuasistaticShear:
    """Shear a packing at fixed area without rate: after every step of strain an energy minimum.

    A step moves box and positions affinely, x -> x + step y, and relaxes. The box flips to the same lattice with
    another tilt when it leans by more than 0.55 of its width, so that strain has no limit. The start is relaxed too.

    >>> r = quasistatic_shear(jamlab.pack(n=256, pressure=1e-2, seed=1), strain=0.5)
    >>> len(r.events), r.stress[r.strain > 0.3].mean()

    Args:
        packing: SP or DP.
        strain: in all, up to 1000.
        step: at most 0.1; equal steps that are no longer than this end at `strain`. An event whose stress drop is
            smaller than the elastic rise in a step is not seen.
        resolution: on an event go back and take half the step, again and again, until steps are no longer than this:
            strain and size of the drop are known that well. By default steps are not refined.
        every: strain between two frames kept; by default none is.
        tolerance: on the largest force, as in `compress`.
        progress: called with "shear" and the strain after each step.

    Returns:
        All states. `converged` is False at those that missed the tolerance; the packing goes on from there.

    Raises:
        InputError: a number out of range.
        EngineError: LAMMPS stops, as where edges of droplets outgrow the neighbour cutoff.
    """
    check_number("strain", strain, LARGEST_STRAIN)
    check_number("step", step, min(LARGEST_STEP, strain))
    if resolution is not None:
        check_number("resolution", resolution, step)
    if every is not None:
        check_number("every", every, strain)
        if every < step:
            raise InputError(f"every = {every:g}: frames cannot be closer than the step, {step:g}")
    check_tolerance(tolerance, LARGEST_TOLERANCE)
    count = int(np.ceil(strain / step - 1e-9))
    with Session(packing) as session:
        walk = _Walk(session, tolerance, strain / count if resolution is None else resolution)
        frames: list[Packing] = []
        for k in range(1, count + 1):
            walk.go_to(strain * k / count)
            if every is not None and int(strain * k / count / every + 1e-9) > len(frames):
                frames.append(walk.packing)
            if progress is not None:
                progress("shear", strain * k / count)
    return _gather(walk, tuple(frames))


@dataclass(frozen=True)
class _State:
    """One minimum; stress and energy as in `QuasistaticShear`."""

    strain: float
    stress: float
    pressure: float
    normal_stress_difference: float
    energy: float
    converged: bool
    max_force: float


class _Walk:
    """Minima one after the other, the events between them, and the packing at the last."""

    def __init__(self, session: Session, tolerance: float | None, shortest: float) -> None:
        self._session, self._tolerance, self._shortest = session, tolerance, shortest
        state, self.packing = self._relax(0.0)
        self.states = [state]
        self.events: list[tuple[_State, _State]] = []

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
            self.events.append((before, after))

    def _leads_back(self, before: _State, after: _State, packing: Packing) -> bool:
        """Whether the step back ends where it came from: stress falls before an instability, too."""
        back, _ = self._step(packing, before.strain, before.strain - after.strain)
        return abs(back.stress - before.stress) < REVERSIBLE * (before.stress - after.stress)

    def _step(self, packing: Packing, strain: float, step: float) -> tuple[_State, Packing]:
        """The minimum beyond a packing, and the packing there."""
        self._session.load(_flipped(sheared(packing, step)))
        return self._relax(strain)

    def _relax(self, strain: float) -> tuple[_State, Packing]:
        found = relax(self._session, self._tolerance, near=True)
        packing = self._session.packing(ensemble="fixed-box")
        reached = found.evaluation
        state = _State(
            strain=strain,
            stress=-float(reached.stress[0, 1]),
            pressure=reached.pressure,
            normal_stress_difference=float(reached.stress[1, 1] - reached.stress[0, 0]),
            energy=reached.energy / packing.area,
            converged=found.converged,
            max_force=reached.max_force,
        )
        return state, record(packing, found, protocol="quasistatic_shear", strain=strain)


def _flipped(packing: Packing) -> Packing:
    """The same lattice, with the second vector that leans least."""
    if abs(packing.box[1, 0]) <= LEAN * packing.box[0, 0]:
        return packing
    box = packing.box.copy()
    box[1] -= np.round(box[1, 0] / box[0, 0]) * box[0]
    return packing.with_state(box=box)


def _released(before: _State, after: _State) -> float:
    """Work less the gain of energy, per area."""
    work = 0.5 * (before.stress + after.stress) * (after.strain - before.strain)
    return work - (after.energy - before.energy)


def _gather(walk: _Walk, frames: tuple[Packing, ...]) -> QuasistaticShear:
    columns = {f.name: np.array([getattr(state, f.name) for state in walk.states]) for f in fields(_State)}
    events = PlasticEvents(
        strain=np.array([after.strain for _, after in walk.events]),
        stress_drop=np.array([before.stress - after.stress for before, after in walk.events]),
        released=np.array([_released(before, after) for before, after in walk.events]),
        width=np.array([after.strain - before.strain for before, after in walk.events]),
    )
    packing = walk.packing
    unit = UNIT_OF_STRESS[packing.model, packing.units]
    return QuasistaticShear(**columns, events=events, frames=frames, packing=packing, unit=unit)
