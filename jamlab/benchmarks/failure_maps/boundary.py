"""How far a default lies from where a method fails."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from jamlab.benchmarks.failure_maps.map import Axis, Map, shares

_HALF = 0.5  # share of runs that fail, at the boundary
_FAILURES = ("stalled", "blew up", "refused", "silent")


@dataclass(frozen=True)
class Distance:
    """From a default to the nearest boundary, where half of the runs fail.

    Attributes:
        default: value on its axis.
        boundary: value there; nan if no run of half the seeds fails within the map.
        where: the other condition, such as "y = 3".
        axis: which it is measured along.
    """

    default: float
    boundary: float
    where: str
    axis: Axis

    @property
    def far(self) -> float:
        """Factor, or difference on a linear axis; infinite if the map holds no boundary."""
        if np.isnan(self.boundary):
            return np.inf
        if not self.axis.logarithmic:
            return abs(self.boundary - self.default)
        return max(self.boundary / self.default, self.default / self.boundary)

    def __str__(self) -> str:
        if np.isinf(self.far):
            return f"{self.default:g}: no boundary within the map"
        how = f"a factor {self.far:.2g}" if self.axis.logarithmic else f"{self.far:.2g}"
        side = "below" if self.default < self.boundary else "above"
        return f"{self.default:g}: {how} {side} the boundary {self.boundary:.3g} ({self.where})"


def default_distance(chart: Map, table: pd.DataFrame) -> Distance | None:
    """The least distance of the default from a boundary, along x if x has a default, else along y; None without one.

    If both axes have a default, only the row of y's own counts. Rows in which every value fails have no boundary.
    """
    failed = np.sum([shares(chart, table, verdict) for verdict in _FAILURES], axis=0)
    axis, other = chart.x, chart.y
    if axis.default is None:
        axis, other, failed = chart.y, chart.x, failed.T
    if axis.default is None:
        return None
    lines = range(len(failed)) if other.default is None else [_nearest(other)]
    works = [k for k in lines if failed[k].min() < _HALF]  # elsewhere all values of the dial fail
    name = "y" if axis is chart.x else "x"
    found = [
        Distance(
            axis.default, _boundary(axis, axis.default, failed[k]), f"{name} = {other.text(other.values[k])}", axis
        )
        for k in works
    ]
    return min(found, key=lambda distance: distance.far) if found else None


def _nearest(axis: Axis) -> int:
    return round(float(axis.places(axis.default)))


def _boundary(axis: Axis, default: float, failed: np.ndarray) -> float:
    """Where the share of failures crosses one half nearest to the default; the default itself if it fails there."""
    values = np.array([float(v) for v in axis.values])
    scale, back = (np.log, np.exp) if axis.logarithmic else (np.asarray, np.asarray)
    x, start = scale(values), scale(default)
    if np.interp(start, x, failed) > _HALF:
        return default
    crossings = []
    for a, b, low, high in zip(x[:-1], x[1:], failed[:-1], failed[1:], strict=True):
        if (low - _HALF) * (high - _HALF) <= 0 and low != high:
            crossings.append(a + (b - a) * (_HALF - low) / (high - low))
    if not crossings:
        return float("nan")
    return float(back(min(crossings, key=lambda c: abs(c - start))))
