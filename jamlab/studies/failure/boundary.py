"""How far a default lies from where a method fails."""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from jamlab.studies.failure.map import Axis, Map, limits_of_rows, shares

_HALF = 0.5  # share of runs that fail, at the boundary
_FAILURES = ("stalled", "blew up", "refused", "silent")


@dataclass(frozen=True)
class Distance:
    """From a default to the nearest boundary, from which on half of the runs fail, and to the limit of theory.

    Attributes:
        default: value on its axis.
        boundary: value there; nan if the map holds none.
        where: the other condition, such as "y = 3".
        axis: which it is measured along.
        limit: of theory; nan if the map draws none.
        scattered: cells in which half of the runs fail, or more, but not on to an end of the axis.
    """

    default: float
    boundary: float
    where: str
    axis: Axis
    limit: float = np.nan
    scattered: int = 0

    @property
    def far(self) -> float:
        """Factor, or difference on a linear axis; infinite if the map holds no boundary."""
        return self._to(self.boundary)

    def _to(self, value: float) -> float:
        if np.isnan(value):
            return np.inf
        if not self.axis.logarithmic:
            return abs(value - self.default)
        return max(value / self.default, self.default / value)

    def _side(self, value: float) -> str:
        how = f"a factor {self._to(value):.2g}" if self.axis.logarithmic else f"{self._to(value):.2g}"
        return f"{how} {'below' if self.default < value else 'above'}"

    def __str__(self) -> str:
        nearest = "no boundary within the map"
        if np.isfinite(self.far):
            nearest = f"{self._side(self.boundary)} the boundary {self.boundary:.3g} ({self.where})"
        limit = "" if np.isnan(self.limit) else f", {self._side(self.limit)} the limit drawn, {self.limit:.3g}"
        return f"{self.default:g}: {nearest}{limit}{self._apart()}"

    def _apart(self) -> str:
        if self.scattered == 0:
            return ""
        cells, them = ("1 cell fails", "it") if self.scattered == 1 else (f"{self.scattered} cells fail", "them")
        return f"; {cells} although values beyond {them} work"


def default_distance(chart: Map, table: pd.DataFrame) -> Distance | None:
    """The least distance of the default from a boundary, along x if x has a default, else along y; None without one.

    A boundary is where the share of failures crosses one half and stays there to the end of the axis: a cell that fails
    alone, such as one of two seeds that stalled, does not say that values beyond it fail. Such cells are counted.
    If both axes have a default, only the rows around y's own count, and the limit is that at y's own. Rows in which
    every value fails have no boundary.
    """
    failed = np.sum([shares(chart, table, verdict) for verdict in _FAILURES], axis=0)
    limits = limits_of_rows(chart, table)
    axis, other = chart.x, chart.y
    if axis.default is None:
        axis, other, failed = chart.y, chart.x, failed.T
        limits = np.full(len(failed), np.nan)  # those are limits of x
    if axis.default is None:
        return None
    lines = list(range(len(failed))) if other.default is None else _around(other)
    works = [k for k in lines if failed[k].min() < _HALF]  # elsewhere all values of the dial fail
    name = "y" if axis is chart.x else "x"
    boundaries = {k: _boundary(axis, axis.default, failed[k]) for k in works}
    found = [
        Distance(axis.default, at, f"{name} = {other.text(other.values[k])}", axis) for k, at in boundaries.items()
    ]
    if not found:
        return None
    nearest = min(found, key=lambda distance: distance.far)
    limit = _limit(nearest, other, limits[works], np.array(works))
    return replace(nearest, limit=limit, scattered=sum(int(_scattered(failed[k]).sum()) for k in works))


def _around(axis: Axis) -> list[int]:
    """The cell of a default, or both between which it lies."""
    place = float(np.clip(axis.places(axis.default), 0, len(axis.values) - 1))
    return sorted({int(np.floor(place)), int(np.ceil(place))})


def _limit(distance: Distance, other: Axis, limits: np.ndarray, rows: np.ndarray) -> float:
    """The limit in the row of the default, between rows as it is drawn; the nearest of all rows without one."""
    known = np.isfinite(limits)
    if not known.any():
        return float("nan")
    if other.default is None:
        return min((float(limit) for limit in limits[known]), key=distance._to)
    scale, back = (np.log, np.exp) if distance.axis.logarithmic else (np.asarray, np.asarray)
    return float(back(np.interp(other.places(other.default), rows[known], scale(limits[known]))))


def _boundary(axis: Axis, default: float, failed: np.ndarray) -> float:
    """Where failures that last to an end of the axis begin, nearest to the default; itself if it fails there."""
    values = np.array([float(v) for v in axis.values])
    scale, back = (np.log, np.exp) if axis.logarithmic else (np.asarray, np.asarray)
    x, start = scale(values), scale(default)
    if np.interp(start, x, failed) > _HALF:
        return default
    failed = np.where(_scattered(failed), 0.0, failed)
    crossings = []
    for a, b, low, high in zip(x[:-1], x[1:], failed[:-1], failed[1:], strict=True):
        if (low - _HALF) * (high - _HALF) <= 0 and low != high:
            crossings.append(a + (b - a) * (_HALF - low) / (high - low))
    if not crossings:
        return float("nan")
    return float(back(min(crossings, key=lambda c: abs(c - start))))


def _scattered(failed: np.ndarray) -> np.ndarray:
    """Cells of a line that fail and have one that works on either side, next to them or farther out."""
    fails = failed >= _HALF
    from_start, from_end = (np.logical_and.accumulate(line) for line in (fails, fails[::-1]))
    return np.asarray(fails & ~from_start & ~from_end[::-1])
