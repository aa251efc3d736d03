"""The strains that a quasi-static shear goes to one after the other: to turning points, as many times as asked for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from jamlab.checks import check_number, check_range
from jamlab.errors import InputError, named
from jamlab.protocols.compression import MOST_STATES


@dataclass(frozen=True)
class Target:
    """A strain to go to."""

    strain: float
    path: float  # accumulated strain, both directions added
    step: float  # from the one before, positive
    keep: bool  # whether its packing is kept
    ends_cycle: bool


@dataclass(frozen=True)
class StrainPath:
    """From strain 0 to turning points, which are repeated; steps of a leg are equal, and at most `strain_step`. A cycle
    begins and ends at the last turning point: the first one where the path is at that strain for the first time."""

    points: tuple[float, ...]
    strain_step: float
    repeats: int = 1
    snapshot_every: float | None = None

    @property
    def turns(self) -> bool:
        """Whether there are several turning points."""
        return len(self.points) > 1

    @property
    def length(self) -> float:
        """Accumulated strain, both directions added."""
        again = np.abs(np.diff([self.points[-1], *self.points])).sum()
        return float(np.abs(np.diff([0.0, *self.points])).sum() + (self.repeats - 1) * again)

    @property
    def step(self) -> float:
        """Step of the first leg, with its sign."""
        return self.points[0] / self._steps(self.points[0])

    def targets(self) -> Iterator[Target]:
        """All strains, in order."""
        path, back = 0.0, self.points[-1] == 0  # whether the path has been at the last turning point
        for begin, end, last in self._legs():
            count, length = self._steps(end - begin), abs(end - begin)
            cycle = self.turns and (last or (not back and end == self.points[-1]))
            back = back or cycle
            for k in range(1, count + 1):
                ends, before, there = cycle and k == count, path + length * (k - 1) / count, path + length * k / count
                keep = ends or self._kept(there) > self._kept(before)
                strain = end if k == count else begin + (end - begin) * k / count
                yield Target(strain, there, length / count, keep, ends)
            path += length

    def _legs(self) -> Iterator[tuple[float, float, bool]]:
        """Begin and end of each leg, and whether the turning points have then been visited once more."""
        for number in range(self.repeats):
            legs = pairwise([self.points[-1] if number else 0.0, *self.points])
            for k, (begin, end) in enumerate(legs, start=1):
                if begin != end:  # the first turning point may be the last one, too
                    yield begin, end, k == len(self.points)

    def _steps(self, leg: float) -> int:
        return int(np.ceil(abs(leg) / self.strain_step - 1e-9))

    def _kept(self, path: float) -> int:
        return 0 if self.snapshot_every is None else int(path / self.snapshot_every + 1e-9)


def strain_path(
    strain: float | Sequence[float], strain_step: float, cycles: int | None, snapshot_every: float | None
) -> StrainPath:
    """Read the path of a quasi-static shear; arguments as of `jamlab.quasistatic_shear`."""
    points = tuple(float(each) for each in (strain if isinstance(strain, Sequence | np.ndarray) else [strain]))
    if not points:
        raise InputError("strain = []: give a strain, or turning points such as [0.05, -0.05, 0.05]")
    for k, (before, point) in enumerate(pairwise((0.0, *points))):
        check_range("strain", point, "quasistatic_shear")
        if point == before:
            where = f"strain[{k}] = {point:g}" if len(points) > 1 else named("strain", point)
            raise InputError(
                f"{where}: must be other than {f'strain[{k - 1}], the turning point before' if k else '0'}"
            )
    if cycles is not None and len(points) < 2:
        raise InputError(f"cycles = {cycles}: one strain is no cycle; give turning points, strain=[{points[0]:g}, 0]")
    legs = np.abs(np.diff([0.0, *points]))
    check_number("strain_step", strain_step, float(legs.max()), float(legs.sum()) / MOST_STATES)
    if snapshot_every is not None:
        check_number("snapshot_every", snapshot_every, float(legs.sum()))
        if snapshot_every < strain_step:
            raise InputError(
                f"{named('snapshot_every', snapshot_every, 'g')}: closer than strain_step = {strain_step:g}"
            )
    return StrainPath(points, strain_step, cycles or 1, snapshot_every)
