"""g(r), how many particles lie at a distance from another over how many would in a gas, in all and by pairs of sizes.

Every periodic image within reach counts, also those of a particle itself, so that a packing and several copies of it
side by side have the same g(r), however small the box.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations_with_replacement
from typing import Any

import numpy as np

from jamlab.arrays import Array, ArrayLike, Indices
from jamlab.checks import checked, finite_array
from jamlab.errors import InputError
from jamlab.motion.between_states import Run
from jamlab.packing.magnitudes import ROUNDING
from jamlab.packing.neighbors import periodic_neighbors
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line
from jamlab.plotting.palette import BLACK, BLUE
from jamlab.statistics.confidence import ratio_of_sums
from jamlab.statistics.rows_of_one_kind import Campaign, Select
from jamlab.structure.structure_factor import without_walls


@dataclass(frozen=True)
class PairCounting:
    """How pairs and sizes are counted."""

    width: float = 0.02  # of bins, in mean sizes, where only the largest distance is given
    bins: int = 100_000  # at most
    pairs: float = 1e9  # at most, a minute and a half
    part: float = 2e6  # pairs that are listed at once: 0.1 GB
    kinds: int = 4  # sizes each of which is a class of its own
    classes: int = 3  # of equal numbers of particles, where there are more sizes
    same: float = 1e-9  # relative difference of sizes that are one


COUNTING = PairCounting()


@dataclass(frozen=True)
class PairCorrelation(Result):
    """g(r) of one or several packings, of all particles and by class of size.

    Attributes:
        r: (m,) middles of the bins of distance between centres (SP) or area centroids (DP).
        g: (m,) g(r) of all particles.
        error: (m,) standard error of g over packings; nan for one packing.
        pairs: (m,) int64, pairs of particles in each bin, summed over packings.
        edges: (m + 1,) of the bins.
        sizes: (c,) mean size of the particles of each class, ascending: diameter, DP root of the rest area.
        shares: (c,) share of the particles in each class.
        partial: (c, c, m) g_ab(r) of pairs of classes, symmetric; g is the sum of shares_a shares_b g_ab.
        partial_error: (c, c, m) its standard error over packings; nan for one packing.
        packings: number of packings.
        unit: unit of length, for labels.

    Example:
        >>> g = jamlab.pair_correlation(jamlab.pack(n=32, pressure=1e-2, seed=1), 3.0)
        >>> g.partial.shape == (2, 2, len(g.r)), g.sizes.round(4)  # a bidisperse packing
        (True, array([0.8333, 1.1667]))
        >>> bool(np.allclose(np.einsum("a,b,abm->m", g.shares, g.shares, g.partial), g.g))
        True
    """

    _rows = ("r", "g", "error", "pairs")
    _apart = ("edges", "partial", "partial_error")

    r: Array
    g: Array
    error: Array
    pairs: Indices
    edges: Array
    sizes: Array
    shares: Array
    partial: Array
    partial_error: Array
    packings: int
    unit: str = field(default="", repr=False)

    def _columns(self) -> dict[str, Any]:
        """With g_ab of classes a <= b, counted from 0, as g_0_1."""
        several = {f"g_{a}_{b}": self.partial[a, b] for a, b in self._classes()} if len(self.sizes) > 1 else {}
        return super()._columns() | several

    def _classes(self) -> list[tuple[int, int]]:
        return list(combinations_with_replacement(range(len(self.sizes)), 2))

    @drawn("Line2D, of g of all")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw g(r) of all particles with a band of one standard error, and thinner g_ab(r) of each pair of classes.

        >>> ax = jamlab.pair_correlation(jamlab.jam(n=64, seed=1), 4.0).plot()
        """
        from matplotlib import colormaps

        axes.axhline(1.0, color=BLACK, linewidth=0.8)
        if len(self.sizes) > 1:
            classes = self._classes()
            colours = colormaps["cividis"](np.linspace(0.05, 0.85, len(classes)))
            for (a, b), colour in zip(classes, colours, strict=True):
                label = f"{self.sizes[a]:.3g}, {self.sizes[b]:.3g}"
                axes.plot(self.r, self.partial[a, b], color=colour, linewidth=0.9, label=label)
        look = merged_line({"color": BLUE, "linewidth": 1.8, "label": "all"}, style)
        axes.plot(self.r, self.g, **look)
        axes.fill_between(self.r, self.g - self.error, self.g + self.error, color=look["color"], alpha=0.3, linewidth=0)
        label_axes(axes, in_unit("distance $r$", self.unit), "pair correlation $g(r)$")
        axes.legend(fontsize=LEGEND, title="sizes" if len(self.sizes) > 1 else None)


@checked
def pair_correlation(
    packings: Packing | Sequence[Packing] | Run | Campaign,
    r: ArrayLike,
    size_classes: int | ArrayLike | None = None,
    *,
    select: Select | None = None,
) -> PairCorrelation:
    """Compute g(r) of centres (SP) or area centroids (DP), of all particles and of pairs of size classes.

    g_ab(r) is the number of pairs of a particle of class a and one of class b in a bin, over N_a N_b/A times the area
    of the ring between its edges (Hansen & McDonald, Theory of Simple Liquids, 4th ed. (2013), sec. 2.5). All periodic
    images within r count.

    Args:
        packings: one packing, several of one kind, a flow (average over its frames), or a campaign (its converged
            states).
        r: edges of the bins of distance, ascending from 0 or more; or the largest distance, with bins from 0 on of
            about 0.02 mean sizes.
        size_classes: number of classes with equal numbers of particles; or the sizes between classes, ascending; a
            size on a bound belongs to the class above. Default: a class for each size, or 3 for more than four sizes.
            Size: diameter; for droplets the root of the rest area.
        select: for a campaign: values of columns of its table "states", such as {"n": 128, "target_pressure": 1e-3}.

    Raises:
        InputError: walls, packings of several kinds, a packing given twice, edges that are not ascending, a class
            without particles, or too many pairs.

    Example:
        >>> triangle = np.array([[1.0, 0.0], [0.5, np.sqrt(0.75)]])
        >>> centres = np.array([[i, j] for i in range(4) for j in range(4)]) @ triangle
        >>> crystal = jamlab.Packing("sp", 4 * triangle, centres, {"k": 1.0}, "k", np.full(16, 1.0))
        >>> g = jamlab.pair_correlation(crystal, [0.9, 1.1, 1.6, 1.9])
        >>> (2 * g.pairs / 16).tolist()  # six neighbours, none, and six at the root of 3
        [6.0, 0.0, 6.0]
    """
    each = without_walls(packings, select, "g(r)")
    sizes = [packing.kind.sizes(packing) for packing in each]
    edges = _edges(r, float(np.mean(np.concatenate(sizes))))
    bounds = _bounds(np.concatenate(sizes), size_classes)
    kinds = [np.searchsorted(bounds, size, side="right") for size in sizes]
    count = len(bounds) + 1
    total = np.bincount(np.concatenate(kinds), minlength=count)
    if not total.all():
        raise InputError(
            f"size_classes = {size_classes!r}: class {total.argmin()} has no particle: the sizes are "
            f"{min(map(np.min, sizes)):.6g} to {max(map(np.max, sizes)):.6g}"
        )
    _check_cost(each, edges[-1])
    ordered = np.array([_count(*one, count, edges) for one in zip(each, kinds, strict=True)])
    numbers = np.array([np.bincount(kind, minlength=count) for kind in kinds], dtype=np.float64)
    rings = np.pi * np.diff(edges**2) / np.array([packing.area for packing in each])[:, None]
    gas = numbers[:, :, None, None] * numbers[:, None, :, None] * rings[:, None, None]
    partial, partial_error = ratio_of_sums(ordered, gas)
    g, error = ratio_of_sums(ordered.sum(axis=(1, 2)), gas.sum(axis=(1, 2)))
    return PairCorrelation(
        r=0.5 * (edges[1:] + edges[:-1]),
        g=g,
        error=error,
        pairs=np.rint(0.5 * ordered.sum(axis=(0, 1, 2))).astype(np.int64),
        edges=edges,
        sizes=np.bincount(np.concatenate(kinds), np.concatenate(sizes)) / total,
        shares=total / total.sum(),
        partial=partial,
        partial_error=partial_error,
        packings=len(each),
        unit=each[0].unit_names.length,
    )


def _edges(r: ArrayLike, size: float) -> Array:
    if np.ndim(r) == 0:
        farthest = float(finite_array("r", r, ()))
        count = int(np.ceil((1 - ROUNDING) * min(farthest / (COUNTING.width * size), 1e15)))
        edges = np.linspace(0.0, farthest, max(count, 1) + 1) if 0 < count <= COUNTING.bins else np.array([farthest])
        if len(edges) < 2:
            most = COUNTING.bins * COUNTING.width * size
            raise InputError(f"r = {farthest:.6g}: must be a distance above 0 and at most {most:.6g}, or edges of bins")
        return edges
    edges = finite_array("r", r, (None,))
    if not 2 <= len(edges) <= COUNTING.bins or edges[0] < 0 or not np.all(np.diff(edges) > 0):
        raise InputError(f"r = {edges}: give the edges of bins, 2 to {COUNTING.bins}, from 0 on, ascending")
    return edges


def _bounds(sizes: Array, classes: int | ArrayLike | None) -> Array:
    """(c - 1,) sizes between classes; a size on a bound belongs to the class above."""
    ordered = np.sort(sizes)
    steps = np.flatnonzero(np.diff(ordered) > COUNTING.same * ordered[1:])
    between = 0.5 * (ordered[steps] + ordered[steps + 1])
    if classes is None:
        if len(between) < COUNTING.kinds:
            return np.asarray(between)
        classes = COUNTING.classes
    if isinstance(classes, float) or isinstance(classes, int):
        if not isinstance(classes, int) or isinstance(classes, bool) or not 1 <= classes <= len(between) + 1:
            raise InputError(
                f"size_classes = {classes}: must be a whole number from 1 to {len(between) + 1}, the number of sizes, "
                "or sizes between classes"
            )
        wanted = np.arange(1, classes) * len(ordered) / classes
        nearest = np.abs(steps + 1 - wanted[:, None]).argmin(axis=1) if classes > 1 else np.empty(0, dtype=np.int64)
        return np.asarray(between[np.unique(nearest)])
    bounds = finite_array("size_classes", classes, (None,))
    if not np.all(np.diff(bounds) > 0):
        raise InputError(f"size_classes = {bounds}: give the sizes between classes, ascending")
    return bounds


def _check_cost(packings: Sequence[Packing], farthest: float) -> None:
    pairs = sum(packing.n * (1 + np.pi * farthest**2 * packing.n / packing.area) for packing in packings)
    if pairs > COUNTING.pairs:
        raise InputError(
            f"r = {farthest:.6g}: there are about {pairs:.3g} pairs up to there, and at most {COUNTING.pairs:.3g} are "
            f"counted; lower it to {farthest * np.sqrt(0.9 * COUNTING.pairs / pairs):.3g}, or give fewer packings"
        )


def _count(packing: Packing, kind: Indices, classes: int, edges: Array) -> Array:
    """(classes, classes, bins) pairs of a particle of one class and an image of another, or of itself, by distance."""
    centres, farthest, bins = packing.centroids, float(edges[-1]), len(edges) - 1
    found = np.zeros(classes**2 * bins)
    expected = packing.n * (1 + np.pi * farthest**2 * packing.n / packing.area)
    for some in np.array_split(np.arange(packing.n), min(packing.n, 1 + int(expected / COUNTING.part))):
        near = periodic_neighbors(centres[some], centres, packing.box, farthest)
        i, distance = some[near.i], np.hypot(*near.r.T)
        place = np.searchsorted(edges, distance, side="right") - 1
        itself = (i == near.j) & (near.shift == 0).all(axis=1)
        counted = (place >= 0) & (place < bins) & ~itself
        cell = (kind[i] * classes + kind[near.j]) * bins + place
        found += np.bincount(cell[counted], minlength=len(found))
    return found.reshape(classes, classes, bins)
