"""Record a flow while it runs: rows, packings on the way, effort; and go on from the last state of an earlier run."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any, Self

import numpy as np

from jamlab.flow.flow_run import FlowRun
from jamlab.flow.overdamped_session import FlowState, Length, OverdampedSession
from jamlab.packing.packing import Packing
from jamlab.rheology.damping import Damping

SERIES = (  # of a row that a result keeps
    *("time", "strain", "rate", "stress", "elastic_stress", "viscous_stress", "pressure"),
    *("normal_stress_difference", "dissipation", "energy", "work", "dissipated", "contacts"),
)
_SPACING = 0.05  # steps between rows that are evenly spaced in log time, over the steps so far


class Recording:
    """A flow as far as it has come. `packing`: SP or DP, where it starts; `damping, tolerance, background`: see
    `OverdampedSession`; `before`: a part of the same flow, to go on from; `length`: of the whole."""

    def __init__(
        self,
        packing: Packing,
        damping: Damping,
        tolerance: float,
        background: float,
        before: FlowRun | None,
        length: Length,
    ) -> None:
        self._how = {"damping": damping, "background": background, "tolerance": tolerance}
        self._unit = packing.unit_names.stress
        self._began = time.perf_counter() - (before.seconds if before else 0.0)
        self._steps = before.steps if before else 0
        self.rows: list[FlowState] = _rows(before) if before else []
        self._before = self.rows[-1] if self.rows else None
        self._frames = list(before.frames) if before else []
        start = before.packing if before else packing
        self.session = OverdampedSession(start, damping, tolerance, background, length=length)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.session.close()

    def drive(self, drive: str, interval: float, *, longest: float = 0.0) -> None:
        """Start or go on; see `OverdampedSession.drive`."""
        before = self.rows[-1] if self.rows else self._before
        state = self.session.drive(drive, interval, longest=longest, before=before)
        if not self.rows:
            self.rows.append(state)
            self._keep()

    def advance(self, steps: int | None = None, *, keep: bool = False) -> FlowState:
        """Go on to the end of the interval, or by so many steps; keep the packing there if asked for."""
        self.rows.append(self.session.advance(steps))
        if keep:
            self._keep()
        return self.rows[-1]

    def advance_log_spaced(self, end: float) -> Iterator[FlowState]:
        """Go on to a time, where the interval ends; rows lie evenly in the logarithm of the number of steps."""
        while self.rows[-1].time < end * (1 - 1e-12):
            yield self.advance(max(1, int(_SPACING * (self._steps + self.session.steps()))))

    @property
    def path(self) -> float:
        """Strain so far, to and fro counted alike."""
        return float(np.abs(np.diff([row.strain for row in self.rows])).sum())

    def begin_again(self, time: float) -> None:
        """Let the next drive go on from here, and forget the rows so far; the present time is `time` from now on."""
        self._before = self.rows[-1]._replace(time=time)  # rows that are forgotten
        self.rows = []

    def content(self) -> dict[str, Any]:
        """Entries of a `FlowRun`; the last packing is that of the last row."""
        frames = list(self._frames)
        if frames[-1].provenance["flow_time"] != self.rows[-1].time:
            frames.append(self._frame())
        return {
            **{name: np.array([getattr(row, name) for row in self.rows]) for name in SERIES},
            **self._how,
            "frames": tuple(frames),
            "steps": self._steps + self.session.steps(),
            "iterations": int(self.rows[-1].iterations),
            "unsettled": int(self.rows[-1].unsettled),
            "seconds": time.perf_counter() - self._began,
            "unit": self._unit,
        }

    def _keep(self) -> None:
        self._frames.append(self._frame())

    def _frame(self) -> Packing:
        state = self.rows[-1]
        entries = {f"flow_{name}": getattr(state, name) for name in ("time", "strain", "rate")}
        return self.session.packing().with_state(provenance=entries)


def _rows(before: FlowRun) -> list[FlowState]:
    """Rows of an earlier run; of what is counted only the sum is kept, with the last one."""
    columns = {name: getattr(before, name) for name in SERIES}
    empty = dict.fromkeys(FlowState._fields, 0.0)
    rows = [
        FlowState(**(empty | {name: float(values[k]) for name, values in columns.items()}))
        for k in range(len(before.time))
    ]
    rows[-1] = rows[-1]._replace(iterations=float(before.iterations), unsettled=float(before.unsettled))
    return rows
