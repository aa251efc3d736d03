"""The bond-orientational order of neighbours, which tells a crystal from a disordered packing."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Indices
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.geometry.tessellation import CELLS, find_power_walls
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.plotting.drawable import CELL, drawn


@dataclass(frozen=True)
class HexaticOrder(Result):
    """psi_k of every particle over its Delaunay neighbours, psi_k = mean of exp(i k angle).

    Attributes:
        local: (n,) complex128, psi_k of each particle.
        neighbors: (n,) int64, number of Delaunay neighbours; the mean is 6 where the triangulation is unique.
        mean_local: mean of |psi_k|; 1 in a triangular lattice for k = 6.
        global_order: |mean of psi_k|; 1 in a single crystal, of order 1/sqrt(n) in a disordered packing.
        k: symmetry.
        packing: the packing whose order it is.

    Example:
        >>> psi = jamlab.hexatic_order(jamlab.pack(n=32, pressure=1e-2, seed=1))
        >>> psi.local.shape, psi.global_order < psi.mean_local < 1
        ((32,), True)
    """

    _rows = ("local", "neighbors")

    local: NDArray[np.complex128]
    neighbors: Indices
    k: int
    packing: Packing = field(repr=False, compare=False)

    @property
    def mean_local(self) -> float:
        """Mean of |psi_k| over particles."""
        return float(np.abs(self.local).mean())

    @property
    def global_order(self) -> float:
        """|Mean of psi_k| over particles."""
        return float(np.abs(self.local.mean()))

    @drawn("PolyCollection", CELL)
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the particles, coloured by |psi_k| from 0 to 1.

        >>> ax = jamlab.hexatic_order(jamlab.jam(n=64, seed=1)).plot()
        """
        from matplotlib.colors import Normalize

        from jamlab.packing.packing_plot import draw_coloured
        from jamlab.plotting.periodic_cell import frame_cell

        label = rf"bond-orientational order $|\psi_{{{self.k}}}|$"
        draw_coloured(axes, self.packing, np.abs(self.local), Normalize(0, 1), label, **style)
        frame_cell(axes, self.packing.box)


@checked
def hexatic_order(packing: Packing, k: int = 6) -> HexaticOrder:
    """Compute the bond-orientational order of the centres (SP) or area centroids (DP).

    Neighbours share a side of their Voronoi cells, that is, a bond of the Delaunay triangulation. Diagonals of a
    square, where four cells meet in a point, are no bonds: sides below 1e-9 of the mean distance are rounding.

    Args:
        packing: SP or DP.
        k: symmetry, 6 for the triangular lattice.

    Raises:
        InputError: k below 1, centres on one line, or two in one place.

    Example:
        >>> lattice = np.array([[1.0, 0.0], [0.5, np.sqrt(0.75)]])
        >>> centres = np.array([[i, j] for i in range(4) for j in range(4)]) @ lattice
        >>> crystal = jamlab.Packing("sp", 4 * lattice, centres, {"k": 1.0}, "k", np.full(16, 1.0))
        >>> psi = jamlab.hexatic_order(crystal)
        >>> round(psi.mean_local, 6), round(psi.global_order, 6)
        (1.0, 1.0)
    """
    if isinstance(k, bool) or not isinstance(k, int | np.integer) or k < 1:
        raise InputError(f"k = {k!r}: the symmetry must be a whole number, 1 or more")
    centres = packing.centroids
    walls = find_power_walls(centres, np.zeros(packing.n), packing.box, np.arange(packing.n))[1]  # seen from both sides
    bonds = np.column_stack([walls.i, walls.j, walls.shift])
    bonds = bonds[walls.length > CELLS.shortest * np.sqrt(packing.area / packing.n)]
    bonds = bonds[np.lexsort(bonds.T[::-1])]
    i, j = bonds[:, :2].T
    neighbors = np.bincount(i, minlength=packing.n)
    if not neighbors.all():
        raise InputError(f"particle {neighbors.argmin()} has the same position as another particle: move one of them")
    x, y = (centres[j] + bonds[:, 2:] @ packing.box - centres[i]).T
    waves = np.exp(1j * k * np.arctan2(y, x))
    local = np.zeros(packing.n, dtype=np.complex128)
    np.add.at(local, i, waves)
    return HexaticOrder(local / neighbors, neighbors, int(k), packing)
