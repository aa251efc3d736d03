"""Estimate which share of the work is done from the packing fractions that a search or a sweep reaches."""

import numpy as np

from jamlab.processes.progress import Progress, no_progress

# packing fractions, and the share of the time to onset spent below them: minimisation slows down as contacts form
_WAY = {"sp": ((0.2, 0.83, 0.84, 0.85), (0.0, 0.05, 0.3, 0.9)), "dp": ((0.2, 0.80, 0.85), (0.0, 0.1, 0.9))}
_MET = 0.9999  # of the way to the end, which a sweep meets to its tolerance


class OnsetWork:
    """Reports how far a search for jamming onset is. The share of the work that is done is known on the way up, and
    rises; near onset nobody knows it, and the try is told instead. `model`: "sp" or "dp";
    `progress`: where to report to."""

    def __init__(self, model: str, progress: Progress | None) -> None:
        self._model, self._tell = model, progress or no_progress
        self._highest, self._near = 0.0, False
        self.attempt = 1  # to come down to onset

    def reached(self, phi: float) -> None:
        """Report a minimum at a packing fraction."""
        self._near = self._near or phi <= self._highest
        self._highest = max(self._highest, phi)
        if self._near:
            self._tell(float("nan"), f"near onset, {phi:.4f}, try {self.attempt}")
        else:
            self._tell(float(np.interp(phi, *_WAY[self._model])), f"onset {phi:.4f}")


class SweepWork:
    """Reports how far a sweep is: states far above onset take less time than those near it. `start, to`: first and last
    packing fraction; `progress`: where to report to."""

    def __init__(self, start: float, to: float, progress: Progress | None) -> None:
        self._start, self._way, self._tell = start, abs(to - start), progress or no_progress

    def reached(self, value: float) -> None:
        """Report a state at a packing fraction."""
        part = min(1.0, abs(value - self._start) / self._way) if self._way else 1.0
        self._tell(float(np.sqrt(part)) if part < _MET else 1.0, f"compress {value:.4f}")
