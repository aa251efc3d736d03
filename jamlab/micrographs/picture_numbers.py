"""Numbers of a picture: each with how far it is known, means over droplets, and voids."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.special import stdtrit

from jamlab.arrays import Array, Indices
from jamlab.micrographs.segmentation import borders, edge_of
from jamlab.packing.result import Result
from jamlab.statistics.confidence import CONFIDENCE

# errors up to these are right: droplets, packing fraction, coordination, mean shape factor
LIMITS = {"count": 2.0, "rho": 0.02, "z": 0.4, "shape": 0.02}


@dataclass(frozen=True)
class CountedVoids:
    """Voids of a picture that are counted."""

    pixels: float = 3.0  # pixels of area: a corner between three walls has as much
    share: float = 1e-3  # of a droplet


VOIDS = CountedVoids()


@dataclass(frozen=True)
class Number:
    """A number of a picture, with how far a mean over its droplets may be from a mean over many more.

    The mean over n droplets has the standard error s/sqrt(n), with their standard deviation s, as if each had been
    drawn on its own; for rho, the area of droplets over the area of their cells, it is the error of a ratio,
    sqrt(n/(n - 1) sum_i (a_i - rho c_i)^2) / sum_i c_i. Neighbours share contacts and gaps, which evens out what is
    beside each other: in windows of 30 to 120 out of 1200 and 2048 disks, jammed at 1e-3 k and 3e-2 k, means of z
    scatter by 0.7 to 0.8 of this error, and rho by 0.6 to 1.0 of it from two sizes to a power law of 10:1; where disks
    of one size crystallise, by 2.

    What a picture does to all droplets alike is not in the error but in `bound`: light, blur and films, or edges of
    labels, contacts that are a guess, and labels in doubt. The interval has both.

    Source: W. G. Cochran, Sampling Techniques, 3rd ed. (1977), sections 2.6 and 2.11.
    """

    value: float  # nan without droplets
    error: float = float("nan")  # standard error; nan of counts, and for fewer than two droplets
    count: int = 0  # of droplets that it is a mean over
    reasons: tuple[str, ...] = ()  # why it may be wrong
    bound: float = 0.0  # how far it may be off for what the picture shows badly

    @property
    def quality(self) -> str:
        """Reliability: "good" or "doubtful"."""
        return "doubtful" if self.reasons else "good"

    @property
    def half_width(self) -> float:
        """Half of the 95 % interval of a mean, by Student's t for few droplets."""
        return float(stdtrit(max(self.count - 1, 1), 0.5 + 0.5 * CONFIDENCE) * self.error)

    @property
    def uncertainty(self) -> float:
        """Half of `interval`: half-width of the mean plus `bound`."""
        return self.bound + (self.half_width if np.isfinite(self.half_width) else 0.0)

    @property
    def interval(self) -> tuple[float, float]:
        """Ends of the 95 % interval, including `bound`."""
        return self.value - self.uncertainty, self.value + self.uncertainty

    def text(self, form: str) -> str:
        """Value ± uncertainty in a format, or "none" if there is no value."""
        return f"{self.value:{form}} ± {self.uncertainty:{form}}" if np.isfinite(self.value) else "none"


def mean_of(values: Array) -> Number:
    """Mean over droplets, (n,)."""
    n = len(values)
    value = float(np.mean(values)) if n else float("nan")
    return Number(value, float(np.std(values, ddof=1) / np.sqrt(n)) if n > 1 else float("nan"), n)


def share_of(areas: Array, cells: Array, value: float) -> Number:
    """Packing fraction, a ratio of two sums, with the scatter of droplets around their own ratio.

    Args:
        areas: (n,) of droplets.
        cells: (n,) of their cells.
        value: packing fraction of all that the picture shows.
    """
    n, whole = len(areas), float(cells.sum())
    rest = areas - areas.sum() / whole * cells
    return Number(value, float(np.sqrt(n / (n - 1) * (rest**2).sum()) / whole) if n > 1 else float("nan"), n)


@dataclass(frozen=True)
class PictureVoids(Result):
    """Voids that the picture shows whole, one entry each; names as in `jamlab.voids`."""

    _rows = ("sides", "area", "centroid")

    sides: Indices  # (m,) int64, l, droplets around the void
    area: Array  # (m,) area, in the unit of length squared
    centroid: Array  # (m, 2) x to the right and y down

    @property
    def probability(self) -> dict[int, float]:
        """P_l: share of the voids with l sides (Boromand et al. fig 8)."""
        kinds, number = np.unique(self.sides, return_counts=True)
        return {int(kind): float(count / len(self.sides)) for kind, count in zip(kinds, number, strict=True)}


def find_voids(void: Indices, cells: Indices, darkness: Array, radius: float, scale: float) -> PictureVoids:
    """Measure voids.

    Args:
        void: (h, w) void that a pixel belongs to, -1 in none.
        cells: (h, w) droplet that a pixel is nearest to.
        darkness: (h, w), 0 in droplets and 1 on the ground.
        radius: typical radius, pixels.
        scale: length of a pixel.
    """
    count = int(void.max()) + 1
    y, x = np.nonzero(void >= 0)
    label, weight = void[y, x], np.clip(darkness[y, x], 0, None)
    area = np.bincount(label, darkness[y, x], count)
    mass = np.maximum(np.bincount(label, weight, count), 1e-12)
    centre = np.column_stack([np.bincount(label, weight * p, count) / mass for p in (x, y)])
    near = (darkness[y, x] > 0.25) | ndimage.binary_dilation(borders(cells))[y, x]
    width = int(cells.max()) + 1
    rows = np.unique(label[near] * width + cells[y, x][near])
    sides = np.bincount(rows // width, minlength=count)
    kept = (
        ~np.isin(np.arange(count), edge_of(void))
        & (area > max(VOIDS.pixels, VOIDS.share * np.pi * radius**2))
        & (sides >= 2)
    )
    return PictureVoids(sides[kept].astype(np.int64), (area[kept] * scale**2).astype(np.float64), centre[kept] * scale)
