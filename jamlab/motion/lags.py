"""Motion of every particle along a run, without the affine motion of the box, and pairs of states that lie apart.

Between one state and the next a particle moves by the affine motion of the box and by a rest; rests add up. Unlike the
motion between two states far apart, their sum holds no shear of what has moved across the flow.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from jamlab.arrays import Array, Indices
from jamlab.errors import InputError
from jamlab.motion.between_states import Run, between_states, flow_between, states_of
from jamlab.packing.packing import Packing
from jamlab.plotting.drawable import in_unit

_EVEN = 0.01  # of the interval between states, by which others may differ from it
_PER_DECADE = 10  # lags


@dataclass(frozen=True)
class Lags:
    """Motion of particles along a run, and lags between its states."""

    moved: Array  # (states, n, 2) without the affine motion, since the first state
    lag: Indices  # (l,) number of states, evenly in their logarithm
    strain: Array  # (l,) accumulated strain between states that far apart, 0 where states carry none
    time: Array  # (l,) time between them, 0 where they carry none
    origins: Indices  # (l,) how many first states there are
    packing: Packing  # the first state

    def displacements(self) -> Iterator[Array]:
        """(origins, n, 2) for each lag."""
        for lag, origins in zip(self.lag, self.origins, strict=True):
            yield self.moved[lag : lag + origins] - self.moved[:origins]


def lags_of(run: Run | Iterable[Packing], particles: Any) -> Lags:
    """Motion of some particles of a run, by default of all that are free."""
    states = states_of(run, "run")
    chosen = _chosen(states[0], particles)
    steps = [between_states(*pair).displacements[chosen] for pair in pairwise(states)]
    moved = np.concatenate([np.zeros((1, len(chosen), 2)), np.cumsum(steps, axis=0)])
    flowed = np.array([flow_between(*pair) for pair in pairwise(states)])
    strain, time = np.cumsum(np.abs(flowed), axis=0).T
    clock = next((each for each in (time, strain) if (np.diff(each, prepend=0.0) > 0).all()), None)
    intervals = np.ones(len(steps)) if clock is None else np.diff(clock, prepend=0.0)
    even = np.abs(intervals / intervals[0] - 1) < _EVEN
    if even[:-1].all() and not even[-1] and intervals[-1] < intervals[0]:
        last = len(steps)  # what is left at the end of a run
    else:
        last = len(steps) + 1
    many = bool(even[: last - 1].all())
    furthest = last - 1
    count = int(np.ceil(_PER_DECADE * np.log10(max(furthest, 1)))) + 1
    lag = np.unique(np.rint(np.geomspace(1, furthest, count)).astype(np.int64))
    origins = last - lag if many else np.ones(len(lag), dtype=np.int64)
    return Lags(moved, lag, strain[lag - 1], time[lag - 1], origins, states[0])


def _chosen(packing: Packing, particles: Any) -> Indices:
    """Numbers of the particles that are followed."""
    if particles is None:
        return np.flatnonzero(packing.frame.free)
    given = np.asarray(particles)
    if given.dtype == bool and given.shape == (packing.n,):
        given = np.flatnonzero(given)
    if given.ndim != 1 or not len(given) or given.dtype.kind not in "iu":
        raise InputError(f"particles has the shape {given.shape}: give {packing.n} truth values, or numbers")
    if given.min() < 0 or given.max() >= packing.n:
        raise InputError(f"particles from {given.min()} to {given.max()}: must be from 0 to {packing.n - 1}")
    if len(np.unique(given)) < len(given):
        raise InputError("particles names one twice: give each number once, or it counts twice")
    return given.astype(np.int64)


def axis_of(lags: Any) -> tuple[Array, str]:
    """What a result is drawn over: strain, time or the number of states, and the label."""
    if (np.diff(lags.strain, prepend=0.0) > 0).all():
        return lags.strain, r"strain $\Delta\gamma$"
    if (lags.time > 0).all():
        return lags.time, in_unit(r"time $\Delta t$", r"$\tau_1$")
    return lags.lag, "states apart"
