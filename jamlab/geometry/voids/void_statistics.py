"""Statistics of voids: numbers of sides, areas, and shapes beside that of a Plateau border."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from jamlab.arrays import Array, Indices
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.geometry.voids.voids import PLATEAU_BORDER, Voids
from jamlab.packing.short_repr import short_repr
from jamlab.plotting.drawable import LABEL, drawn, label_axes
from jamlab.plotting.palette import OTHER, SIDE_COLOURS


@dataclass(frozen=True)
class VoidStatistics:
    """Voids of one or several packings by number of sides; voids that percolate are counted apart.

    Attributes:
        sides: (m,) int64, every l that occurs, ascending.
        number: (m,) int64, voids with l sides.
        probability: (m,) P_l, which adds up to 1 over l (Boromand et al. fig 8).
        area: (m,) mean area.
        shape: (m,) mean shape factor.
        shape_spread: (m,) standard deviation of the shape factor.
        percolating: number of voids that percolate.

    Example:
        >>> s = jamlab.void_statistics(jamlab.voids(jamlab.pack(n=32, pressure=1e-2, seed=1)))
        >>> bool(np.isclose(s.probability.sum(), 1)), s.sides[:2]
        (True, array([3, 4]))
    """

    sides: Indices
    number: Indices
    probability: Array
    area: Array
    shape: Array
    shape_spread: Array
    percolating: int

    __repr__ = short_repr

    @property
    def plateau(self) -> float:
        """Mean shape factor of voids with three sides over that of a Plateau border, 4.8706; nan without such voids."""
        found = np.flatnonzero(self.sides == 3)
        return float(self.shape[found[0]] / PLATEAU_BORDER) if len(found) else float("nan")

    @drawn('bars, such as edgecolor="none"')
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw P_l as bars, in the colours that voids of l sides have in `Voids.plot`.

        >>> ax = jamlab.void_statistics(jamlab.voids(jamlab.jam(n=64, seed=1))).plot()
        """
        from matplotlib.patches import Rectangle
        from matplotlib.ticker import MaxNLocator

        from jamlab.plotting.axes import merged

        colours = [SIDE_COLOURS.get(int(s), OTHER) for s in self.sides]
        look = merged(Rectangle, {"facecolor": colours, "edgecolor": "black", "linewidth": 0.5}, style)
        axes.bar(self.sides, self.probability, **look)
        label_axes(axes, "sides $l$ of a void", "share of voids $P_l$")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        apart = f", {self.percolating} more percolate" if self.percolating else ""
        axes.set_title(f"{self.number.sum()} voids{apart}", fontsize=LABEL)


@checked
def void_statistics(*found: Voids) -> VoidStatistics:
    """Compute P_l, mean area and mean shape of the voids of one or several packings together.

    Raises:
        InputError: if none is given.

    Example:
        >>> v = [jamlab.voids(jamlab.pack(n=32, pressure=1e-2, seed=seed)) for seed in (1, 2)]
        >>> statistics = jamlab.void_statistics(*v)
        >>> int(statistics.number.sum()) + statistics.percolating == sum(len(one.sides) for one in v)
        True
    """
    if not found:
        raise InputError("void_statistics got no voids: give it the voids of one packing at least")
    closed = np.concatenate([v.percolating == 0 for v in found])
    sides, area, shape = (
        np.concatenate(values)[closed]
        for values in ([v.sides for v in found], [v.area for v in found], [v.shape for v in found])
    )
    kinds, which, number = np.unique(sides, return_inverse=True, return_counts=True)
    means = [np.bincount(which, values) / number for values in (area, shape, shape**2)]
    spread = np.sqrt(np.maximum(means[2] - means[1] ** 2, 0.0))
    share = number / max(len(sides), 1)
    return VoidStatistics(kinds, number, share, means[0], means[1], spread, int((~closed).sum()))
