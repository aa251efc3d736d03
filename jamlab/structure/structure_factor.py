"""S(k) of the centres of particles, and what it shares with spectra of covered area: sums of waves over a lattice.

The wavevectors of a periodic box are the reciprocal lattice vectors, exp(i k.a) = 1 for both of its rows a. Sums of
exp(-i k.x) over points anywhere are taken for all of them at once by a fast Fourier transform of points off the grid
(Barnett, Magland & af Klinteberg, SIAM J. Sci. Comput. 41, C479 (2019)), in the library ducc0, to rounding.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Self

import numpy as np

from jamlab.arrays import Array, ArrayLike, Complex, Indices
from jamlab.checks import checked, finite_array
from jamlab.errors import InputError
from jamlab.mechanics.like_packings import packings_of_one_kind
from jamlab.motion.between_states import Run
from jamlab.packing.neighbors import reduced_cell
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line, positive
from jamlab.plotting.palette import BLUE
from jamlab.statistics.confidence import ratio_of_sums
from jamlab.statistics.rows_of_one_kind import Campaign, Select


@dataclass(frozen=True)
class Lattices:
    """Sizes of sums over wavevectors."""

    most: int = 20_000_000  # wavevectors, and places of the grid that holds them: 1 GB
    rounding: float = 1e-14  # of sums, asked of ducc0, over the root of the sum of squared weights
    shells: int = 10_000  # at most


LATTICES = Lattices()


@dataclass(frozen=True)
class ShellMeans(Result):
    """Means over shells of wavevectors of similar length.

    Attributes:
        k: (m,) mean length of the wavevectors in each shell that has any.
        mean: (m,) mean of the values; all wavevectors of all packings have the same weight.
        error: (m,) standard error of `mean` over packings; for one packing over wavevectors, nan for a single one.
        wavevectors: (m,) int64, number of wavevectors, summed over packings.
        packings: number of packings.
        unit: unit of k, for labels.
        value_unit: unit of the values, for labels.
        label: what the values are, for labels.

    Example:
        >>> s = jamlab.structure_factor([jamlab.pack(n=32, pressure=1e-2, seed=seed) for seed in (1, 2)], k_max=12.0)
        >>> shells = s.shells([0.0, 4.0, 8.0, 12.0])
        >>> shells.packings, int(shells.wavevectors.sum()) == len(s.values)
        (2, True)
    """

    _rows = ("k", "mean", "error", "wavevectors")

    k: Array
    mean: Array
    error: Array
    wavevectors: Indices
    packings: int
    unit: str = field(default="", repr=False)
    value_unit: str = field(default="", repr=False)
    label: str = field(default="", repr=False)

    @drawn("Line2D")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the means against k on logarithmic axes, with a band of one standard error.

        >>> ax = jamlab.structure_factor(jamlab.jam(n=64, seed=1), k_max=20.0).shells(40).plot()
        """
        mean, left_out = positive(self.mean)
        label = f"{self.packings} packing{'s' * (self.packings > 1)}{left_out}"
        look = merged_line({"color": BLUE, "marker": "o", "markersize": 3, "linewidth": 1.0, "label": label}, style)
        axes.loglog(self.k, mean, **look)
        low = np.maximum(self.mean - self.error, 0.1 * mean)
        axes.fill_between(self.k, low, self.mean + self.error, color=look["color"], alpha=0.25, linewidth=0)
        label_axes(axes, in_unit("wavenumber $k$", self.unit), in_unit(self.label, self.value_unit))
        axes.legend(fontsize=LEGEND)


@dataclass(frozen=True)
class ValuesAtWavevectors(Result):
    """Values at the wavevectors of one or several packings.

    Attributes:
        wavevectors: (m, 2) reciprocal lattice vectors up to `k_max`, without 0; of each pair k, -k the one with
            k_x > 0, or k_x = 0 and k_y > 0. Sorted by packing, k_x and k_y.
        values: (m,) value at each.
        state: (m,) int64, packing of each, from 0.
        packings: number of packings.
        width: 2 pi over the root of the area of the box, the mean over packings: default width of shells.
        unit: unit of wavevectors, for labels.
        value_unit: unit of values, for labels.
    """

    _rows = ("state", "wavevectors", "k", "values")
    _label: ClassVar[str]

    wavevectors: Array
    values: Array
    state: Indices
    packings: int
    width: float
    unit: str = field(default="", repr=False)
    value_unit: str = field(default="", repr=False)

    @property
    def k(self) -> Array:
        """(m,) lengths of the wavevectors."""
        return np.asarray(np.hypot(*self.wavevectors.T))

    @checked
    def shells(self, bins: int | ArrayLike | None = None) -> ShellMeans:
        """Average over shells of wavevectors of similar length.

        Args:
            bins: number of shells of one width, up to the longest wavevector, or their edges, ascending. Default:
                shells as wide as `width`, their middles at its multiples.

        Returns:
            `ShellMeans`; shells without wavevectors are left out.

        Raises:
            InputError: edges that are not ascending, no wavevector between them, or too many shells.

        Example:
            >>> s = jamlab.structure_factor(jamlab.pack(n=32, pressure=1e-2, seed=1), k_max=12.0)
            >>> bool((np.diff(s.shells().k) > 0).all()), len(s.shells(5).k)
            (True, 5)
        """
        edges, k = self._edges(bins), self.k
        last = np.nextafter(edges[-1], np.inf)  # the longest wavevector is in the last shell
        shell = np.searchsorted(np.append(edges[:-1], last), k, side="right") - 1
        inside = (shell >= 0) & (shell < len(edges) - 1)
        if not inside.any():
            raise InputError(
                f"bins from {edges[0]:.6g} to {edges[-1]:.6g}: the wavevectors are {k.min():.6g} to "
                f"{k.max():.6g} long; give edges around them"
            )
        count = np.bincount(shell[inside], minlength=len(edges) - 1)
        kept = np.flatnonzero(count)
        shell = np.searchsorted(kept, shell[inside])
        lengths = np.bincount(shell, k[inside]) / count[kept]
        unit = float(np.abs(self.values).max()) or 1.0  # squares of areas may overflow
        mean, error = self._means(shell, self.values[inside] / unit, self.state[inside], len(kept))
        named = (self.packings, self.unit, self.value_unit, self._label)
        return ShellMeans(lengths, unit * mean, unit * error, count[kept], *named)

    def _means(self, shell: Indices, values: Array, state: Indices, shells: int) -> tuple[Array, Array]:
        if self.packings > 1:
            place, size = state * shells + shell, self.packings * shells
            weights = (values, np.ones(len(values)))
            sums, counts = (np.bincount(place, each, minlength=size).reshape(-1, shells) for each in weights)
            return ratio_of_sums(sums, counts)
        count = np.bincount(shell)
        mean = np.bincount(shell, values) / count
        scatter = np.bincount(shell, (values - mean[shell]) ** 2)
        with np.errstate(invalid="ignore", divide="ignore"):
            return mean, np.where(count > 1, np.sqrt(scatter / (count - 1.0) / count), np.nan)

    def _edges(self, bins: int | ArrayLike | None) -> Array:
        longest = float(self.k.max())
        if bins is None:
            edges = self.width * (np.arange(int(longest / self.width + 0.5) + 2) - 0.5)
            edges[0] = 0.0
        elif isinstance(bins, int | float):
            if not isinstance(bins, int) or not 1 <= bins <= LATTICES.shells:
                raise InputError(f"bins = {bins}: must be a number of shells from 1 to {LATTICES.shells}, or edges")
            edges = np.linspace(0.0, longest, bins + 1)
        else:
            edges = finite_array("bins", bins, (None,))
        if len(edges) < 2 or edges[0] < 0 or not np.all(np.diff(edges) > 0):
            raise InputError(f"bins = {edges}: give the edges of shells, two or more, from 0 on, ascending")
        return np.asarray(edges)

    @drawn("Line2D, of the means")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the means over shells, see `ShellMeans.plot`."""
        self.shells().plot(axes, **style)

    @classmethod
    def _of(cls, packings: Sequence[Packing], k_max: float, one: Callable[[Packing, Waves], Array], unit: str) -> Self:
        """Values of `one` at the wavevectors of every packing."""
        waves = [waves_of(packing, k_max) for packing in packings]
        values = [one(packing, own) for packing, own in zip(packings, waves, strict=True)]
        length = packings[0].unit_names.length
        return cls(values=np.concatenate(values), value_unit=unit and unit.format(length), **places(packings, waves))


def places(packings: Sequence[Packing], waves: Sequence[Waves]) -> dict[str, Any]:
    """What values at the wavevectors of packings hold beside the values, by the names of their attributes."""
    return {
        "wavevectors": np.concatenate([own.k for own in waves]),
        "state": np.repeat(np.arange(len(waves)), [len(own.k) for own in waves]),
        "packings": len(packings),
        "width": float(np.mean([2 * np.pi / np.sqrt(packing.area) for packing in packings])),
        "unit": f"1/{packings[0].unit_names.length}",
    }


class StructureFactor(ValuesAtWavevectors):
    """S(k) at the wavevectors of one or several packings, see `jamlab.structure_factor`.

    Attributes:
        wavevectors: (m, 2) reciprocal lattice vectors up to `k_max`, without 0; of each pair k, -k the one with
            k_x > 0, or k_x = 0 and k_y > 0. Sorted by packing, k_x and k_y.
        values: (m,) S(k).
        state: (m,) int64, packing of each wavevector, from 0.
        packings: number of packings.
        width: 2 pi over the root of the area of the box, the mean over packings: default width of shells.
        unit: unit of wavevectors, for labels.
        value_unit: unit of values, for labels: none.

    Example:
        >>> s = jamlab.structure_factor(jamlab.pack(n=32, pressure=1e-2, seed=1), k_max=12.0)
        >>> s.wavevectors.shape == (len(s.values), 2), bool(s.k.max() <= 12.0)
        (True, True)
    """

    _label = "structure factor $S(k)$"


@checked
def structure_factor(
    packings: Packing | Sequence[Packing] | Run | Campaign, k_max: float, *, select: Select | None = None
) -> StructureFactor:
    """Compute S(k) = |sum over particles of exp(-i k.x)|^2/n of the centres (SP) or area centroids (DP).

    Every particle has the same weight; in `spectral_density` the covered area is the weight. Of each pair k, -k one
    wavevector is given, since S(-k) = S(k) (Hansen & McDonald, Theory of Simple Liquids, 4th ed. (2013), sec. 4.1).

    Args:
        packings: one packing, several of one kind, a flow (its frames), or a campaign (its converged states). Values
            follow each other; `StructureFactor.shells` averages over packings.
        k_max: longest wavevector, 1/length.
        select: for a campaign: values of columns of its table "states", such as {"n": 128, "target_pressure": 1e-3}.

    Returns:
        `StructureFactor`: `wavevectors` (m, 2) and `values` (m,).

    Raises:
        InputError: walls, packings of several kinds, a packing given twice, `k_max` below the shortest wavevector
            of a box, or too many wavevectors.

    Example:
        >>> lattice = np.array([[i, j] for i in range(4) for j in range(4)], dtype=float)  # side 1
        >>> square = jamlab.Packing("sp", 4 * np.eye(2), lattice, {"k": 1.0}, "k", np.full(16, 1.0))
        >>> s = jamlab.structure_factor(square, k_max=7.0)
        >>> s.values[s.values > 1e-9].round(9), (s.wavevectors[s.values > 1e-9] / (2 * np.pi)).round(9)
        (array([16., 16.]), array([[0., 1.],
               [1., 0.]]))
    """

    def one(packing: Packing, waves: Waves) -> Array:
        return np.abs(waves.sum_over(packing.centroids, np.ones(packing.n))) ** 2 / packing.n

    return StructureFactor._of(without_walls(packings, select, "S(k)"), k_max, one, "")


def without_walls(
    packings: Packing | Sequence[Packing] | Run | Campaign, select: Select | None, what: str
) -> list[Packing]:
    """Packings of one kind, or frames of one flow; refused between walls, where space is not uniform."""
    several = packings.frames if isinstance(packings, Run) else packings
    each = packings_of_one_kind(several, select, frames=True)
    for number, packing in enumerate(each):
        if packing.frame.has_walls:
            raise InputError(
                f"packings[{number}] has walls: {what} is of a periodic box, uniform in space; use a packing without "
                "walls, such as the one that they were put into"
            )
    return each


@dataclass(frozen=True)
class Waves:
    """Half of the wavevectors of a box."""

    k: Array  # (m, 2)
    cell: Array  # (2, 2) its shortest lattice vectors
    number: Indices  # (m, 2) k = 2 pi number @ inv(cell).T
    shape: tuple[int, int]  # of a grid that holds the numbers, positive and negative

    def sum_over(self, points: Array, weights: Array) -> Complex:
        """(m,) sum over points (n, 2) of weights (n,) times exp(-i k.x)."""
        from ducc0.nufft import nu2u

        place = points @ np.linalg.inv(self.cell)
        place -= np.floor(place)
        grid = nu2u(
            points=np.asarray(weights, dtype=np.complex128),
            coord=np.ascontiguousarray(place),
            forward=True,
            epsilon=LATTICES.rounding,
            nthreads=1,
            out=np.empty(self.shape, dtype=np.complex128),
            periodicity=1.0,
            fft_order=True,
        )
        return np.asarray(grid[self.number[:, 0], self.number[:, 1]])


def waves_of(packing: Packing, k_max: float) -> Waves:
    """Wavevectors of a packing up to a length, sorted by k_x, then k_y."""
    box, cell = packing.box, reduced_cell(packing.box)[0]
    reciprocal = 2 * np.pi * np.linalg.inv(cell).T  # rows b_i, with a_i . b_j = 2 pi for i = j, else 0
    reach = k_max * np.hypot(*cell.T) / (2 * np.pi)  # k.a_i = 2 pi n_i, so |n_i| is at most |k||a_i|/(2 pi)
    sides = np.floor(reach * (1 + 1e-12))
    places = float(np.prod(2 * sides + 1))
    if not places <= LATTICES.most:
        raise InputError(
            f"k_max = {k_max:.6g}: about {places:.3g} wavevectors of the box are shorter, and at most "
            f"{LATTICES.most:.3g} are summed; lower k_max to {k_max * np.sqrt(0.9 * LATTICES.most / places):.3g}"
        )
    first, second = (np.arange(-int(side), int(side) + 1) for side in sides)
    number = np.stack(np.meshgrid(first, second, indexing="ij"), axis=-1).reshape(-1, 2)
    k = number @ reciprocal
    along = np.rint(k[:, 0] * box[0, 0] / (2 * np.pi)).astype(np.int64)  # k.a of the first row of the box, over 2 pi
    half = (along > 0) | ((along == 0) & (k[:, 1] > 0))
    kept = half & (np.hypot(*k.T) <= k_max * (1 + 1e-12))
    if not kept.any():
        shortest = float(np.hypot(*reciprocal.T).min())
        raise InputError(f"k_max = {k_max:.6g}: the shortest wavevector of the box is {shortest:.6g}; give more")
    number, k, along = number[kept], k[kept], along[kept]
    order = np.lexsort([k[:, 1], along])
    return Waves(k[order], cell, number[order], (len(first), len(second)))
