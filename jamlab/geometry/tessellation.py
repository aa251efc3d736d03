"""Tessellations: cells around particles that fill the plane, their neighbours, local packing fractions.

SP: power (Laguerre) cells, the points whose power |x - x_i|^2 - R_i^2 to disk i is the smallest. DP: set-Voronoi cells,
the points nearest to a polygon, drawn as the Voronoi cells of points along its outline taken together. Both come from
the lower convex hull of the points lifted to z = |x|^2 - R^2. The wall between i and j lies on the radical line at
distance h_ij from x_i; with s_ij the signed length of the wall,

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
from jamlab.geometry.power_cells import radical_height
from jamlab.packing.neighbors import moves_home, periodic_copies, positive_image
from jamlab.packing.outlines import cross
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


@dataclass(frozen=True)
class Tessellation(Result):
    """Cells around particles.

    Attributes:
        area: (n,) area of each cell; the sum is the box area. Zero for a disk without a cell, such as one inside
            another, and for flat walls, where the other cells end.
        wall_i, wall_j: (m,) int64, cells on both sides of a cell wall, i <= j; a cell may meet another's images.
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
    _apart = ("wall_i", "wall_j", "wall_length", "lines")

    area: Array
    wall_i: Indices
    wall_j: Indices
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
        scale = Normalize(np.nanmin(fraction), np.nanmax(fraction))
        draw_coloured(axes, packing, fraction, scale, "local packing fraction")
        line_everywhere(axes, walls, packing.box, **look)
        frame_cell(axes, packing.box)


@dataclass(frozen=True)
class PowerWalls:
    """Half walls seen from points of the primitive cell, one per triangle and side; each ends in a corner."""

    i: Indices
    j: Indices
    shift: Indices
    height: Array
    length: Array
    corner: Array


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
    walls = find_power_walls(points, radius, whole.box)
    if whole is not packing:
        owner, walls = _end_at_planes(packing, owner, walls)
    area = np.bincount(owner[walls.i], 0.5 * walls.height * walls.length, packing.n).astype(np.float64)
    return _merge_cells(packing, owner, area, walls)


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


def find_power_walls(points: Array, radius: Array, box: Array) -> PowerWalls:
    """Half walls of the power cells of points, from as many copies as it takes until the cells fill the box."""
    area = abs(float(box[0, 0] * box[1, 1]))
    # mostly enough, else doubled: beyond the tenth neighbour, further where large disks push the cells of small ones
    reach = 4 * np.sqrt(area / len(points)) + 2 * float(radius.max() - radius.min())
    while True:
        walls = _find_hull_walls(points, radius, box, reach)
        if abs(0.5 * float((walls.height * walls.length).sum()) - area) <= CELLS.closed * area:
            return walls
        if reach > 4 * (np.abs(box).sum() + float(radius.max())):  # every cell lies within
            raise InputError("the cells do not fill the box: are several particles in the same place?")
        reach *= 2


def _find_hull_walls(points: Array, radius: Array, box: Array, reach: float) -> PowerWalls:
    from scipy.spatial import ConvexHull

    source, shift = periodic_copies(points, box, reach)
    x, r = points[source] + shift @ box, radius[source]
    middle = x.mean(axis=0)
    lifted = np.einsum("ij,ij->i", x - middle, x - middle) - r**2
    hull = ConvexHull(np.column_stack([x - middle, lifted / np.sqrt(np.abs(box).max())]))
    below = hull.simplices[hull.equations[:, 2] < -1e-12]  # upright faces are rounding of the rim of the hull
    ccw = cross(x[below[:, 1]] - x[below[:, 0]], x[below[:, 2]] - x[below[:, 0]]) > 0
    below = np.where(ccw[:, None], below, below[:, ::-1])

    a, b, c = np.concatenate([below, np.roll(below, -1, axis=1), np.roll(below, -2, axis=1)]).T
    home = a < len(points)
    a, b, c = a[home], b[home], c[home]
    ab, ac = x[b] - x[a], x[c] - x[a]
    d_ab, d_ac, det = np.hypot(*ab.T), np.hypot(*ac.T), cross(ab, ac)
    solid = det > 1e-14 * d_ab * d_ac  # three points on one line have no circle
    a, b, c, ab, ac, d_ab, d_ac, det = (v[solid] for v in (a, b, c, ab, ac, d_ab, d_ac, det))
    h_ab, h_ac = radical_height(d_ab, r[a], r[b]), radical_height(d_ac, r[a], r[c])
    p, q = (d_ab * h_ab)[:, None], (d_ac * h_ac)[:, None]
    corner = (p * np.column_stack([ac[:, 1], -ac[:, 0]]) + q * np.column_stack([-ab[:, 1], ab[:, 0]])) / det[:, None]
    return PowerWalls(
        np.concatenate([a, a]),
        source[np.concatenate([b, c])],
        np.concatenate([shift[b] - shift[a], shift[c] - shift[a]]),
        np.concatenate([h_ab, h_ac]),
        np.concatenate([cross(ab, corner) / d_ab, -cross(ac, corner) / d_ac]),
        np.tile(points[a] + corner, (2, 1)),
    )


def _end_at_planes(packing: Packing, owner: Indices, walls: PowerWalls) -> tuple[Indices, PowerWalls]:
    """The points and half walls of a slab, without its mirror image; walls to an image are flat walls."""
    n, height = packing.n - 2, packing.box[1, 1]
    count, kept = np.searchsorted(owner, n), owner[walls.i] < n
    i, j, shift = walls.i[kept], walls.j[kept], walls.shift[kept]
    flat = j >= count
    lower = np.argsort(packing.centroids[n:, 1] % height)
    places = np.outer(np.floor(packing.centroids[owner[i], 1] / height), packing.box[1])
    places[:, 1] += packing.frame.planes[0]
    j = np.where(flat, count + (shift[:, 1] != 0), j)
    walls = PowerWalls(
        i, j, np.where(flat[:, None], 0, shift), walls.height[kept], walls.length[kept], walls.corner[kept] + places
    )
    return np.append(owner[:count], n + lower), walls


def _merge_cells(packing: Packing, owner: Indices, area: Array, walls: PowerWalls) -> Tessellation:
    """Merge the cells of all points of a particle; walls between them vanish."""
    n, shortest = packing.n, CELLS.shortest * np.sqrt(packing.area / packing.n)
    i, j, shift = owner[walls.i], owner[walls.j], walls.shift
    outside = (i != j) | shift.any(axis=1)
    names, which = np.unique(np.column_stack([i, j, shift])[outside], axis=0, return_inverse=True)
    length = np.bincount(which, walls.length[outside], len(names))
    names, length = names[length > shortest], length[length > shortest]
    sides = np.bincount(names[:, 0], minlength=n)
    once = _stands_for_both(names[:, 0], names[:, 1], names[:, 2:])

    k = np.flatnonzero(outside)[_stands_for_both(i, j, shift)[outside]]
    k = k[np.lexsort((walls.shift[k, 1], walls.shift[k, 0], walls.j[k], walls.i[k]))]
    name = np.column_stack([walls.i, walls.j, walls.shift])[k]
    twin = np.flatnonzero((name[1:] == name[:-1]).all(axis=1))  # every wall has two halves
    lines = np.stack([walls.corner[k[twin]], walls.corner[k[twin + 1]]], axis=1)
    return Tessellation(area, names[once, 0], names[once, 1], length[once], sides, lines, packing)


def _stands_for_both(i: Indices, j: Indices, shift: Indices) -> NDArray[np.bool_]:
    """Of the two rows of a wall, seen from either side, mark the one with i < j or the positive image."""
    return np.asarray((i < j) | ((i == j) & positive_image(shift)))
