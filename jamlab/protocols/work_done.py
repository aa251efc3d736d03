"""Estimate which share of the work is done from the packing fractions that a search or a sweep reaches."""

import numpy as np

from jamlab.processes.progress import Progress, no_progress

# packing fractions, and the share of the time to onset spent below them: minimisation slows down as contacts form
_WAY = {
    "sp": ((0.2, 0.83, 0.84, 0.85), (0.0, 0.05, 0.3, 0.9)),
    "dp": ((0.2, 0.80, 0.82, 0.826, 0.835), (0.0, 0.05, 0.21, 0.55, 0.75)),
}
_SEARCH = {"sp": 0.003, "dp": 0.05}  # part of what is left that one more minimisation near onset takes
_MET = 0.9999  # of the way to the end, which a sweep meets to its tolerance


class OnsetWork:
    """Reports how far a search for jamming onset is; the share never falls. `model`: "sp" or "dp"; `progress`: where to
    report to."""

    def __init__(self, model: str, progress: Progress | None) -> None:
        self._model, self._tell, self._share = model, progress or no_progress, 0.0

    def reached(self, phi: float) -> None:
        """Report a minimum at a packing fraction."""
        share = float(np.interp(phi, *_WAY[self._model]))
        self._share = max(self._share, share, self._share + _SEARCH[self._model] * (1 - self._share))
        self._tell(self._share, f"onset {phi:.4f}")


class SweepWork:
    """Reports how far a sweep is: states far above onset take less time than those near it. `start, to`: first and last
    packing fraction; `progress`: where to report to."""

    def __init__(self, start: float, to: float, progress: Progress | None) -> None:
        self._start, self._way, self._tell = start, abs(to - start), progress or no_progress

    def reached(self, value: float) -> None:
        """Report a state at a packing fraction."""
        part = min(1.0, abs(value - self._start) / self._way) if self._way else 1.0
        self._tell(float(np.sqrt(part)) if part < _MET else 1.0, f"compress {value:.4f}")
