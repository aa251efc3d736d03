"""Tessellations: cells around particles that fill the plane, their neighbours, local packing fractions.

SP: power (Laguerre) cells, the points whose power |x - x_i|^2 - R_i^2 to disk i is the smallest. DP: set-Voronoi cells,
the points nearest to a polygon, drawn as the Voronoi cells of points along its outline taken together. The wall between
i and j lies on the radical line at distance h_ij from x_i; with s_ij the length of the wall,

    area_i = (1/2) sum_j h_ij s_ij.

Source: F. Aurenhammer, SIAM J. Comput. 16, 78 (1987); F. M. Schaller et al., Philos. Mag. 93, 3993 (2013).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array, Indices
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.geometry.particle_shape import particle_areas
from jamlab.geometry.vertex_contacts import named_pairs
from jamlab.kernels.library import INTEGER, INTEGERS, REAL, REALS, kernel
from jamlab.packing.neighbors import MOST_IMAGES, moves_home, positive_image, search_lattice
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.plotting.drawable import CELL, drawn
from jamlab.plotting.palette import RED


@dataclass(frozen=True)
class CellSteps:
    """Walls between cells of polygons."""

    # of the points along a polygon, in sqrt(cell area / particles): areas to 1e-3, see `tessellation`
    spacing: float = 0.05
    closed: float = 1e-9  # part of the box by which the cells may miss it: rounding leaves 1e-15, a cell left out 1/n
    # A wall shorter than this, in sqrt(cell area / particles), is rounding where more than three cells meet in
    # one corner.
    shortest: float = 1e-9


CELLS = CellSteps()
_OUT = (REALS, INTEGERS, INTEGERS, INTEGERS, REALS, REALS, REALS, REALS)
_walls = kernel("power_walls", INTEGER, REALS, REALS, INTEGERS, REALS, REAL, INTEGER, *_OUT)


@dataclass(frozen=True)
class Tessellation(Result):
    """Cells around particles.

    Attributes:
        area: (n,) area of each cell; the sum is the box area. Zero for a disk without a cell, such as one inside
            another, and for flat walls, where the other cells end.
        wall_i, wall_j: (m,) int64, cells on both sides of a cell wall, i <= j; a cell may meet another's images.
        wall_shift: (m, 2) int64, which image of j: multiples of the lattice vectors to add to it; 0 for flat walls.
        wall_length: (m,) length of each wall.
        sides: (n,) int64, neighbours of each cell; the mean is 6 where three cells meet in every corner.
        lines: (k, 2, 2) straight pieces of all cell walls, at the stored image of the particle of lower index. SP: one
            for each wall. DP: one for each pair of outline points on the two sides.
        packing: the packing whose particles they surround.

    Example:
        >>> cells = jamlab.tessellation(jamlab.pack(n=32, pressure=1e-2, seed=1))
        >>> len(cells.wall_i) == int(cells.sides.sum()) // 2  # a wall has two sides
        True
    """

    _rows = ("area", "sides")
    _apart = ("wall_i", "wall_j", "wall_shift", "wall_length", "lines")

    area: Array
    wall_i: Indices
    wall_j: Indices
    wall_shift: Indices
    wall_length: Array
    sides: Indices
    lines: Array
    packing: Packing = field(repr=False, compare=False)

    @drawn("LineCollection that draws the walls, such as linewidth=2", CELL)
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the walls of the cells; particles are coloured by their local packing fraction, with a scale beside.

        >>> ax = jamlab.tessellation(jamlab.jam(n=64, seed=1)).plot()
        """
        from matplotlib.collections import LineCollection
        from matplotlib.colors import Normalize

        from jamlab.packing.packing_plot import draw_coloured
        from jamlab.plotting.axes import merged
        from jamlab.plotting.periodic_cell import frame_cell, line_everywhere

        packing, fraction = self.packing, local_packing_fraction(self.packing)
        look = merged(LineCollection, {"color": RED, "linewidth": 1.0}, style)
        walls = self.lines + moves_home(self.lines.mean(axis=1), packing.box)[:, None]
        scale = Normalize(min(0.6, np.nanmin(fraction)), 1.0)  # one scale for all but very loose packings
        draw_coloured(axes, packing, fraction, scale, "local packing fraction")
        line_everywhere(axes, walls, packing.box, **look)
        frame_cell(axes, packing.box)


@dataclass(frozen=True)
class PowerWalls:
    """Walls of power cells, each seen from the points on both sides."""

    i: Indices
    j: Indices
    shift: Indices  # (m, 2) which image of j
    height: Array  # (m,) distance of the radical line from i
    length: Array
    ends: Array  # (m, 2, 2) where the wall begins and ends beside i, counter-clockwise


@checked
def tessellation(packing: Packing, spacing: float = CELLS.spacing) -> Tessellation:
    """Divide the plane into power cells of disks, or set-Voronoi cells of polygons without rim.

    Args:
        packing: SP or DP.
        spacing: DP: largest distance of points along an outline, in sqrt(cell area / particles). The relative error of
            cell areas is about 1e-3 at 0.05 and scales as its square.

    Raises:
        InputError: `spacing` is not a positive number, or the cells do not fill the box.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> cells = jamlab.tessellation(p)
        >>> bool(np.isclose(cells.area.sum(), p.area)), float(cells.sides.mean())
        (True, 6.0)
    """
    if not (np.isfinite(spacing) and spacing > 0):
        raise InputError(f"spacing is {spacing}: must be a positive number, such as {CELLS.spacing}")
    whole = packing.frame.images
    owner, points, radius = whole.kind.power_points(whole, spacing)
    area, walls = find_power_walls(points, radius, whole.box, owner)
    if whole is not packing:
        area[packing.n - 2 :] = 0.0
        owner, walls = _end_at_planes(packing, owner, walls)
    return _merge_cells(packing, owner, area[: packing.n], walls)


@checked
def local_packing_fraction(packing: Packing) -> Array:
    """Return the area of each particle (overlaps shared) over the area of its cell, (n,).

    SP: disk cut by its power cell over the power cell, at most 1; nan for a disk that has no cell (see `Tessellation`).
    DP: `particle_areas` over the set-Voronoi cell; may exceed 1 by the error of the cells. The mean, weighted with the
    areas of the cells, is rho.

    Args:
        packing: SP or DP.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> local, cells = jamlab.local_packing_fraction(p), jamlab.tessellation(p)
        >>> bool(np.isclose(np.average(local, weights=cells.area), jamlab.packing_fraction(p)))
        True
    """
    cells = tessellation(packing)
    fraction = np.full(packing.n, np.nan)
    np.divide(particle_areas(packing), cells.area, out=fraction, where=cells.area > 0)
    return fraction


def find_power_walls(points: Array, radius: Array, box: Array, owner: Indices) -> tuple[Array, PowerWalls]:
    """Areas of the power cells of owners of points, each that of all its points, and the walls between the cells of
    different owners."""
    n, area = len(points), np.empty(len(points))
    given = (np.ascontiguousarray(values, dtype=np.float64) for values in (points, radius))

    def fill(room: int, search: Array) -> tuple[int, tuple[Any, ...]]:
        (i, j), shift = np.empty((2, room), dtype=np.int64), np.empty((room, 2), dtype=np.int64)
        height, length, ends = np.empty(room), np.empty(room), np.empty((room, 2, 2))
        found = (i, j, shift, height, length, ends)
        return _walls(n, *arrays, box, MOST_IMAGES, room, area, *found, search), found

    arrays = (*given, np.ascontiguousarray(owner, dtype=np.int64))
    walls = PowerWalls(*search_lattice(fill, 8 * n + 64))
    whole = abs(float(box[0, 0] * box[1, 1]))
    if abs(float(area.sum()) - whole) > CELLS.closed * whole:
        raise InputError("the cells do not fill the box: are several particles in the same place?")
    return np.bincount(owner, area), walls


def _end_at_planes(packing: Packing, owner: Indices, walls: PowerWalls) -> tuple[Indices, PowerWalls]:
    """The points and walls of a slab, without its mirror image; walls to an image are flat walls."""
    n, height = packing.n - 2, packing.box[1, 1]
    count, kept = np.searchsorted(owner, n), owner[walls.i] < n
    i, j, shift = walls.i[kept], walls.j[kept], walls.shift[kept]
    flat = j >= count
    lower = np.argsort(packing.centroids[n:, 1] % height)
    places = np.outer(np.floor(packing.centroids[owner[i], 1] / height), packing.box[1])
    places[:, 1] += packing.frame.planes[0]
    j = np.where(flat, count + (shift[:, 1] != 0), j)
    walls = PowerWalls(
        i, j, np.where(flat[:, None], 0, shift), walls.height[kept], walls.length[kept],
        walls.ends[kept] + places[:, None],
    )  # fmt: skip
    return np.append(owner[:count], n + lower), walls


def _merge_cells(packing: Packing, owner: Indices, area: Array, walls: PowerWalls) -> Tessellation:
    """Merge the cells of all points of a particle; walls between them vanish."""
    shortest = CELLS.shortest * np.sqrt(packing.area / packing.n)
    once = _stands_for_both(owner[walls.i], owner[walls.j], walls.shift)
    i, j, shift = walls.i[once], walls.j[once], walls.shift[once]
    length, ends = walls.length[once], walls.ends[once]
    names, which, _ = named_pairs(owner[i], owner[j], shift)
    total = np.bincount(which, length, len(names))
    names, total = names[total > shortest], total[total > shortest]
    sides = np.bincount(names[:, :2].ravel(), minlength=packing.n)
    sides[packing.flat_walls] = 0
    order = np.lexsort((shift[:, 1], shift[:, 0], j, i))
    lines = ends[order[length[order] > shortest]]
    image = names[:, 2:] - _images_of_slab(packing, names)
    return Tessellation(area, names[:, 0], names[:, 1], image, total, sides, lines, packing)


def _images_of_slab(packing: Packing, names: Indices) -> Indices:
    """(m, 2) by how many boxes the particles of a slab were moved into it, j less i, of pairs (m, 4); 0 without flat
    walls."""
    found = np.zeros((len(names), 2), dtype=np.int64)
    if packing.frame.is_flat:
        boxes = np.floor(packing.centroids[:, 1] / packing.box[1, 1]).astype(np.int64)
        both = ~packing.flat_walls[names[:, :2]].any(axis=1)
        found[both, 1] = (boxes[names[:, 1]] - boxes[names[:, 0]])[both]
    return found


def _stands_for_both(i: Indices, j: Indices, shift: Indices) -> NDArray[np.bool_]:
    """Of the two rows of a wall, seen from either side, mark the one with i < j or the positive image."""
    return np.asarray((i < j) | ((i == j) & positive_image(shift)))
