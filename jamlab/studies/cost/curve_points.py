"""Make the points of curves of cost against error from many packings, and find those that no other point beats."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

SLACK = 1.25  # costs within this ratio are the same: what repeated runs on a busy machine differ by
ALIKE = 1.25  # errors within this ratio are the same: means over twenty packings
BETTER = 100.0  # times, that a reference must be known than what is compared with it
BAND = (0.1, 0.9)  # quantiles


@dataclass(frozen=True)
class Point:
    """One setting of one method, over many packings.

    Attributes:
        panel, method, setting: as in `Trial`.
        seconds: median CPU time on one core: what other programs do to a busy machine would carry a mean.
        error: mean of the magnitudes.
        low, high: 10 and 90 % quantiles of the magnitudes.
        floor: errors below are not told from 0: 100 times the error of the reference, or just that if `loose`.
        packings: how many gave a number.
        failed: how many gave none.
        default: whether jamlab does this by default.
        note: of the first packing that has one; that of a run that was cut short goes first.
        cut: on how many packings the run was cut short by a limit of time: the number is where it came.
        loose: no reference is known a hundred times better: the floor is its own error, and nothing below is ranked.
    """

    panel: str
    method: str
    setting: str
    seconds: float
    error: float
    low: float
    high: float
    floor: float
    packings: int
    failed: int
    default: bool
    note: str = ""
    cut: int = 0
    loose: bool = False

    @property
    def exact(self) -> bool:
        """Whether the mean cannot be told from the reference."""
        return self.error <= self.floor

    @property
    def ranked(self) -> bool:
        """Whether its error is known well enough to be compared: not if the reference itself may err by more."""
        return not (self.loose and self.exact)

    @property
    def drawn(self) -> bool:
        """Whether there is a number."""
        return bool(np.isfinite(self.error) and np.isfinite(self.seconds))


def points_of(trials: pd.DataFrame, better: float = BETTER) -> list[Point]:
    """Average trials (columns of `Trial`) over packings, in their order; the floor is `better` times the median error
    of the reference in each panel, and loose if that is less than a hundred times."""
    errors = trials.groupby("panel")["reference_error"].median()
    floors = {str(panel): better * float(error) for panel, error in errors.items()}
    points = []
    for (panel, method, setting), rows in trials.groupby(["panel", "method", "setting"], sort=False):
        good = rows[np.isfinite(rows["error"]) & np.isfinite(rows["seconds"])]
        size = np.abs(good["error"].to_numpy(dtype=np.float64))
        low, high = np.quantile(size, BAND) if len(size) else (np.nan, np.nan)
        mean, seconds = (float(size.mean()), float(good["seconds"].median())) if len(size) else (np.nan, np.nan)
        cut = rows["cut"].to_numpy(dtype=bool)
        notes = [str(note) for note in [*rows["note"][cut], *rows["note"]] if note]
        names: Any = (str(panel), str(method), str(setting))
        numbers: Any = (seconds, mean, float(low), float(high), floors[str(panel)], len(good), len(rows) - len(good))
        loose = better < BETTER and floors[str(panel)] > 0
        rest: Any = (bool(rows["default"].any()), next(iter(notes), ""), int(cut.sum()), loose)
        points.append(Point(*names, *numbers, *rest))
    return points


def dominated(points: Sequence[Point]) -> NDArray[np.bool_]:
    """Mark the points (m,) for which another one of the same panel is as good and cheaper, or better and as cheap.

    Costs and errors within 25 % of each other count as equal, and so do errors below the floor. Points without a number
    count as dominated, those that are not ranked do not.
    """
    beaten = [not one.drawn or any(_beats(other, one) for other in points) for one in points]
    return np.array(beaten, dtype=bool)


def price(one: Point, points: Sequence[Point]) -> float:
    """How many times more a point costs than the cheapest of its panel that is as good; at least 1, and 1 if it is not
    ranked."""
    if not one.ranked:
        return 1.0
    others = [other.seconds for other in points if other.panel == one.panel and other.drawn and _as_good(other, one)]
    return max(1.0, one.seconds / min(others, default=one.seconds))


def _beats(other: Point, one: Point) -> bool:
    if other.panel != one.panel or other is one or not other.drawn or not one.ranked:
        return False
    cheaper = other.seconds * SLACK < one.seconds
    better = _size(other) * ALIKE < _size(one)
    return (_as_good(other, one) and cheaper) or (better and other.seconds <= one.seconds)


def _as_good(other: Point, one: Point) -> bool:
    return _size(other) <= ALIKE * _size(one) and other.failed <= one.failed


def _size(point: Point) -> float:
    return max(point.error, point.floor)
