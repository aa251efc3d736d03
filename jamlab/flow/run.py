"""The frame of every flow: rows and packings up to a result, from the start or from what a file holds of the same run.

`Run` holds what all flows share. `TimedRun` drives a packing in time; quasi-static shear has a `Run` of its own.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from typing import Any, Generic, NamedTuple, Self, TypeVar

import numpy as np

from jamlab.errors import InputError
from jamlab.flow.flow_run import FlowRun
from jamlab.flow.overdamped_session import ON_WALLS, End, FlowState, OverdampedSession
from jamlab.flow.run_file import FilePath, RunFile
from jamlab.geometry.contact_network import contacts
from jamlab.mechanics.force_network import check_at_rest
from jamlab.packing.packing import Packing
from jamlab.processes.progress import Progress
from jamlab.rheology.damping import Damping

R = TypeVar("R", bound=FlowRun)

REST = "give jamlab.relax(packing), or, to stop a flow, jamlab.stop_flow(packing, duration=...)"
_SPACING = 0.05  # steps between rows that are evenly spaced in log time, over the steps so far


class Accuracy(NamedTuple):
    """Drag law, relative error of velocities in a step, and drag beside the law's, over k tau_1."""

    damping: Damping
    tolerance: float
    background: float


class Run(Generic[R]):
    """A flow as far as it has come. `kind`: class of its result; `packing`: where it starts; `damping`: None for a run
    without time; `task`: what else makes it this run; `out, progress`: see `shear`. `facts` are those entries of the
    result that rows do not hold; whoever drives the run sets them."""

    def __init__(
        self,
        kind: type[R],
        packing: Packing,
        damping: Damping | None,
        task: Mapping[str, Any],
        out: FilePath | None,
        progress: Progress | None,
    ) -> None:
        self._file = RunFile(out, kind, packing, damping, dict(task), progress)
        self.before = self._file.before
        self.facts: dict[str, Any] = {"damping": damping, "unit": packing.unit_names.stress}
        self.rows: list[Any] = []
        self.frames: list[Packing] = list(self.before.frames) if self.before else []
        self._kind, self._started = kind, self.before.packing if self.before else packing
        self._steps = self.before.steps if self.before else 0
        self._began = time.perf_counter() - (self.before.seconds if self.before else 0.0)

    @property
    def steps(self) -> int:
        """Steps so far, including the steps in the file."""
        return self._steps

    def packing(self) -> Packing:
        """The packing as it is now."""
        raise NotImplementedError

    def rows_before(self) -> list[dict[str, Any]]:
        """Rows that the file holds, by name."""
        series = self._kind.series
        columns = [getattr(self.before, name).tolist() for name in series] if self.before else [[]]
        return [dict(zip(series, row, strict=True)) for row in zip(*columns, strict=True)]

    def add(self, row: Any, *, keep: bool = False) -> None:
        """Add a row, and keep the packing there if asked for."""
        self.rows.append(row)
        if keep:
            self.frames.append(self.packing())

    def result(self) -> R:
        """The run so far; the last packing is that of the last row."""
        columns = {name: np.array([getattr(row, name) for row in self.rows]) for name in self._kind.series}
        kept = self.frames[-1].provenance.get("flow_time", 0.0), self.frames[-1].provenance["flow_strain"]
        last = [] if kept == (self.rows[-1].time, self.rows[-1].strain) else [self.packing()]
        effort = {"steps": self.steps, "seconds": time.perf_counter() - self._began}
        return self._kind(**columns | effort | self.facts, frames=(*self.frames, *last))

    def report(self, share: float, words: str) -> None:
        """Bring the file up to date if it has not been for a while, and tell the share of the work that is done."""
        self._file.report(self.result, share, words)

    def finish(self) -> R:
        """Write the run as it ends, and give it."""
        return self._file.finish(self.result)


class TimedRun(Run[R]):
    """A flow in time, by one session of LAMMPS; a context manager. `accuracy`: drag, tolerance and background; `end`:
    of the run, which is given up if it would never come there; `at_rest`: refuse a packing that is not, or in which
    nothing touches."""

    def __init__(
        self,
        kind: type[R],
        packing: Packing,
        accuracy: Accuracy,
        task: Mapping[str, Any],
        end: End,
        out: FilePath | None,
        progress: Progress | None,
        *,
        at_rest: bool = False,
    ) -> None:
        if at_rest:
            check_at_rest(packing, REST)
            if contacts(packing).unjammed:
                raise InputError(
                    f"no {packing.kind.particles} touch at phi = {packing.phi:.4g}: the packing is unjammed and "
                    "has no elastic stress. Use a jammed packing, or shear it at a finite rate"
                )
        law, tolerance, background = accuracy
        how = {"tolerance": tolerance, "background": background}
        super().__init__(kind, packing, law, {**task, **how}, out, progress)
        self.facts |= how
        empty = dict.fromkeys(FlowState._fields, 0.0)
        self.rows = [FlowState(**empty | row) for row in self.rows_before()]
        if self.before:  # of what is counted the file has the sum
            self.rows[-1] = self.rows[-1]._replace(
                iterations=float(self.before.iterations), ambiguous_contacts=float(self.before.ambiguous_contacts)
            )
        if self.before and packing.walls:
            kept = zip(self.rows, self.before.wall_stress.reshape(-1, 4).tolist(), strict=True)
            self.rows = [row._replace(**dict(zip(ON_WALLS, on_walls, strict=True))) for row, on_walls in kept]
        self._last = self.rows[-1] if self.rows else None
        self.session = OverdampedSession(self._started, law, tolerance, background, end=end)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.session.close()

    @property
    def steps(self) -> int:
        """Steps so far, including the steps in the file."""
        return self._steps + self.session.steps()

    @property
    def time(self) -> float:
        """Time that is reached."""
        return self.rows[-1].time if self.rows else self._last.time if self._last else 0.0

    @property
    def path(self) -> float:
        """Strain so far, to and fro counted alike."""
        return float(np.abs(np.diff([row.strain for row in self.rows])).sum())

    def drive(self, drive: str, interval: float, *, longest: float = 0.0) -> FlowState:
        """Drive the packing from its present state, see `OverdampedSession.drive`; the first state is the first row."""
        self._last = self.rows[-1] if self.rows else self._last
        state = self.session.drive(drive, interval, longest=longest, before=self._last)
        if not self.rows:
            self.add(state, keep=True)
        return state

    def advance(self, steps: int | None = None, *, keep: bool = False) -> FlowState:
        """Go on to the end of the interval, or by so many steps; keep the packing there if asked for."""
        state = self.session.advance(steps)
        self.add(state, keep=keep)
        return state

    def advance_log_spaced(self, end: float) -> Iterator[FlowState]:
        """Go on to a time, where the interval ends; rows lie evenly in the logarithm of the number of steps."""
        while self.rows[-1].time < end * (1 - 1e-12):
            state = self.advance(max(1, int(_SPACING * self.steps)))
            self.report(state.time / end, f"time {state.time:.3g}, strain {state.strain:.3g}")
            yield state

    def begin_again(self, time: float) -> None:
        """Let the next drive continue from here, and forget the rows so far; the present time is `time` from now on."""
        self._last = self.rows[-1]._replace(time=time)
        self.rows = []

    def packing(self) -> Packing:
        """The packing as it is now, with time, strain and rate in its provenance."""
        entries = {f"flow_{name}": getattr(self.rows[-1], name) for name in ("time", "strain", "rate")}
        return self.session.packing().with_state(provenance=entries)

    def result(self) -> R:
        """The run so far."""
        self.facts |= {name: int(getattr(self.rows[-1], name)) for name in ("iterations", "ambiguous_contacts")}
        if self._started.walls:
            on_walls = [[getattr(row, name) for name in ON_WALLS] for row in self.rows]
            self.facts["wall_stress"] = np.array(on_walls).reshape(-1, 2, 2)
        return super().result()
