"""Sizes of droplets: one size, two, or many, told from how much of their spread two groups explain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jamlab.packing.short_repr import short_repr

Array = NDArray[np.float64]

ONE_SIZE = 0.07  # standard deviation of log radius up to which droplets have one size
TWO_SIZES = 0.86  # of the variance that two groups explain: an even distribution 0.75, a normal one 0.64
LEAST_GROUP = 0.05  # of the droplets in the smaller group
LEAST = 8  # droplets: fewer have no distribution


@dataclass(frozen=True)
class SizeDistribution:
    """Sizes of droplets.

    Attributes:
        verdict: "monodisperse", "bidisperse", "polydisperse" or "too few".
        mean: mean radius, in the unit of length.
        spread: standard deviation over mean of the radii.
        ratio: bidisperse: mean radius of the large over that of the small; else nan.
        large: bidisperse: number share of the large ones; else nan.
        explained: share of the variance of log radius that the best two groups explain.
    """

    verdict: str
    mean: float
    spread: float
    ratio: float
    large: float
    explained: float

    __repr__ = short_repr

    def __str__(self) -> str:
        if self.verdict == "bidisperse":
            return f"bidisperse, ratio {self.ratio:.2f}, {self.large:.0%} large"
        return f"{self.verdict}, spread {self.spread:.0%}" if self.verdict != "too few" else "too few droplets"


def size_distribution(areas: Array) -> SizeDistribution:
    """Sort droplets by size.

    Args:
        areas: (n,) of whole droplets.
    """
    radii = np.sort(np.sqrt(areas / np.pi))
    mean = float(radii.mean()) if len(radii) else float("nan")
    spread = float(radii.std() / mean) if len(radii) else float("nan")
    nan = float("nan")
    if len(radii) < LEAST:
        return SizeDistribution("too few", mean, spread, nan, nan, nan)
    log = np.log(radii)
    best, cut = 0.0, 1
    for k in range(1, len(log)):
        between = k * (len(log) - k) / len(log) ** 2 * (log[:k].mean() - log[k:].mean()) ** 2
        if between > best:
            best, cut = between, k
    explained = float(best / log.var()) if log.var() > 0 else nan
    if log.std() < ONE_SIZE:
        return SizeDistribution("monodisperse", mean, spread, nan, nan, explained)
    share = 1 - cut / len(log)
    if explained > TWO_SIZES and min(share, 1 - share) >= LEAST_GROUP:
        ratio = float(radii[cut:].mean() / radii[:cut].mean())
        return SizeDistribution("bidisperse", mean, spread, ratio, share, explained)
    return SizeDistribution("polydisperse", mean, spread, nan, nan, explained)
