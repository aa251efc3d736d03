"""Voids: the connected regions that no particle covers, with their exact boundary, on the torus.

The boundary of the covered region is chained into loops, with the void on the right. A loop that closes around a void
encloses a positive void area, one around an island of particles (a rattler, or a cluster, that floats
inside a void) a negative one. By Green's theorem, with the start p, the end q and the bulge b of each piece,

    area = - sum over pieces of (p x q)/2 + b.

A loop that winds around the torus by w has area -(sum - (w x p_0)/2), which is defined up to multiples of the cell; the
areas of all loops of one void, modulo the cell, add up to the area of the void.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from jamlab.checks import checked
from jamlab.geometry.cross_product import cross
from jamlab.geometry.voids.boundary_loops import Boundary
from jamlab.geometry.voids.disk_boundary import trace_disks
from jamlab.geometry.voids.polygon_boundary import trace_polygons
from jamlab.geometry.voids.torus_graph import find_components
from jamlab.geometry.voids.void_rays import find_first_hits
from jamlab.packing.packing import Packing
from jamlab.packing.short_repr import short_repr

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

EMPTY = 1e-14  # a void smaller than this part of A/n is rounding: a hundred times that of a double in one loop
SLIVER = 1e-10  # of sqrt(A/n): a shorter piece is no side, as the void that it would bound there is below EMPTY
PLATEAU_BORDER = np.pi / (4 * np.sqrt(3) - 2 * np.pi)  # shape of the void between three equal disks that touch, 4.8706


@dataclass(frozen=True)
class Voids:
    """Voids of a packing, one entry each.

    Attributes:
        sides: (m,) int64, l, particles on the boundary. Of a void that does not percolate only the loop around it
            counts, not the islands inside; a particle with several pieces in the loop counts once, two periodic images
            of a particle count twice. Of a void that percolates: different particles on all its loops.
        area: (m,) area; the sum is (1 - rho) times the cell.
        perimeter: (m,) length of the whole boundary, islands included.
        centroid: (m, 2) centre of area, inside the cell; nan for a void that percolates.
        percolating: (m,) int64, independent directions in which a void winds around the torus: 0, 1 or 2.
        islands: (m,) int64, loops around particles that float inside the void, each a rattler or a cluster.
        boundary: pieces and loops that bound the voids.
        void: (k,) int64, void that each piece of the boundary bounds; -1 for slivers of rounding size.
        image: (k, 2) int64, lattice translation that puts a piece in line with the other pieces of its void.
        packing: the packing whose voids they are.
    """

    sides: Indices
    area: Array
    perimeter: Array
    centroid: Array
    percolating: Indices
    islands: Indices
    boundary: Boundary
    void: Indices
    image: Indices
    packing: Packing = field(repr=False, compare=False)

    __repr__ = short_repr

    @property
    def shape(self) -> Array:
        """(m,) shape factor perimeter^2/(4 pi area); Plateau border of three equal disks: 4.8706."""
        return np.asarray(self.perimeter**2 / (4 * np.pi * self.area))

    def plot(self, ax: Any = None, **style: Any) -> Axes:
        """Draw the voids between pale particles, coloured by number of sides; large ones carry it as a digit.

        A void that percolates is left white. Islands inside a void show the particles.

        >>> ax = jamlab.voids(jamlab.jam(n=64, seed=1)).plot()

        Args:
            ax: matplotlib Axes; by default those of a new figure.
            style: of matplotlib's PathCollection, such as edgecolor="none".

        Returns:
            The axes.

        Raises:
            InputError: `ax` is something else, or matplotlib refuses the style.
        """
        from jamlab.geometry.voids.void_plot import draw_voids
        from jamlab.plotting.axes import CELL, axes_for

        with axes_for(ax, style, CELL) as axes:
            draw_voids(axes, self, **style)
        return axes


class LoopKind(IntEnum):
    """What a loop of the boundary, with the void on its right, is to that void."""

    ROUNDING = 0  # encloses less than rounding size: no void
    AROUND = 1  # encloses the void
    ISLAND = 2  # goes around particles inside the void
    WINDING = 3  # winds around the torus


@checked
def voids(packing: Packing) -> Voids:
    """Find the voids of a packing.

    SP: regions outside all disks, bounded by arcs; disks that touch within 1e-12 of their size close a void between
    them. DP: regions outside all polygons grown by their rim delta/2, bounded by straight pieces and arcs.

    A rattler that floats in a void is an island of it: its area and perimeter count, its side does not. A rattler that
    touches the particles around it adds to the sides of the void, or divides it, like any other particle. Take
    rattlers out with `without_rattlers` for the voids of the force-bearing network, as for P_l.

    Args:
        packing: SP or DP.

    Raises:
        BoundaryError: if more boundaries meet in one point than can be told apart; DP: if outlines of polygons cross.
    """
    boundary = trace_disks(packing) if packing.model == "sp" else trace_polygons(packing)
    signed = _sign_areas(boundary, packing.box)
    kind = _classify_loops(boundary, signed, EMPTY * packing.area / packing.n)
    count, void_of_loop, loop_image = _group_loops(boundary, packing.box, kind)

    enclosing, winding, islands = (
        np.bincount(void_of_loop[kind == which], minlength=count)
        for which in (LoopKind.AROUND, LoopKind.WINDING, LoopKind.ISLAND)
    )
    percolating = np.where(enclosing > 0, 0, np.where(winding > 0, 1, 2))
    loops = np.flatnonzero(kind != LoopKind.ROUNDING)
    area = np.bincount(void_of_loop[loops], signed[loops], count).astype(np.float64)
    area = np.where(percolating > 0, np.mod(area, packing.area), area)

    void, image = void_of_loop[boundary.loop], boundary.image + loop_image[boundary.loop]
    length = boundary.pieces.length
    k = np.flatnonzero(void >= 0)
    perimeter = np.bincount(void[k], length[k], count).astype(np.float64)
    # of a void that percolates the particles on all loops are sides, of others those on the loop around it
    k = k[length[k] > SLIVER * np.sqrt(packing.area / packing.n)]
    percolates = percolating[void[k]] > 0
    particle_image = np.where(percolates[:, None], 0, image[k])
    corners = np.column_stack([void[k], boundary.pieces.particle[k], particle_image])
    corners = corners[percolates | (kind[boundary.loop[k]] == LoopKind.AROUND)]
    sides = np.bincount(corners[_find_different(corners), 0], minlength=count)
    centroid = _find_centroids(boundary, packing.box, void, image, area)
    centroid[percolating > 0] = np.nan
    return Voids(sides, area, perimeter, centroid, percolating, islands, boundary, void, image, packing)


def _find_different(rows: Indices) -> Indices:
    """Find the first of every kind of row (m, 4), by sorting: `np.unique` over rows takes four times as long."""
    order = np.lexsort(rows.T)
    new = np.ones(len(rows), dtype=bool)
    new[1:] = (rows[order[1:]] != rows[order[:-1]]).any(axis=1)
    return order[new]


def _classify_loops(boundary: Boundary, signed: Array, smallest: float) -> Indices:
    """(loops,) `LoopKind` of each loop, from its signed area."""
    kind = np.where(signed > 0, LoopKind.AROUND, LoopKind.ISLAND)
    kind[np.abs(signed) < smallest] = LoopKind.ROUNDING
    kind[(boundary.winding != 0).any(axis=1)] = LoopKind.WINDING
    return kind


def _sign_areas(boundary: Boundary, box: Array) -> Array:
    """(loops,) area to the right of each loop; of a loop that winds, up to multiples of the cell."""
    pieces, loop = boundary.pieces, boundary.loop
    winding = boundary.winding @ box
    place = boundary.image @ box
    origin = pieces.start[boundary.origin] + place[boundary.origin]
    # loops that close are measured from their own beginning, which keeps the digits of small ones
    reference = np.where((boundary.winding != 0).any(axis=1)[:, None], 0.0, origin)
    p, q = (x + place - reference[loop] for x in (pieces.start, pieces.end))
    green = np.bincount(loop, 0.5 * cross(p, q) + pieces.bulge, len(winding))
    return np.asarray(0.5 * cross(winding, origin) - green)


def _group_loops(boundary: Boundary, box: Array, kind: Indices) -> tuple[int, Indices, Indices]:
    """Number of voids, the void that each loop bounds (-1: none), and in which image of the void the loop lies."""
    rounding = kind == LoopKind.ROUNDING
    casting = np.flatnonzero((kind == LoopKind.ISLAND) | (kind == LoopKind.WINDING))
    hit, shift = find_first_hits(boundary, box, casting, rounding)
    found = find_components(len(kind), casting, hit, shift)
    group = found.label.copy()
    held = np.zeros(found.count, dtype=bool)
    held[group[kind != LoopKind.ISLAND]] = True
    if not held.all():  # islands that nothing encloses share the one void that percolates in both directions
        group[~held[group]] = np.flatnonzero(~held)[0]
    group[rounding] = -1
    names, void = np.unique(group, return_inverse=True)
    none = int(len(names) > 0 and names[0] == -1)
    return len(names) - none, void - none, found.image


def _find_centroids(boundary: Boundary, box: Array, void: Indices, image: Indices, area: Array) -> Array:
    """(m, 2) centres of area, wrapped into the cell; meaningless for voids that percolate."""
    pieces = boundary.pieces
    k = np.flatnonzero(void >= 0)
    first = k[np.unique(void[k], return_index=True)[1]]
    reference = pieces.start[first] + image[first] @ box
    move = image[k] @ box - reference[void[k]]
    p, q = pieces.start[k] + move, pieces.end[k] + move
    moment = (p + q) * cross(p, q)[:, None] / 6 + pieces.bulge_moment[k] + pieces.bulge[k][:, None] * move
    total = np.column_stack([np.bincount(void[k], -moment[:, axis], len(area)) for axis in (0, 1)])
    centre = reference + total / area[:, None]
    return np.asarray(centre - np.floor(centre @ np.linalg.inv(box)) @ box)
