"""Voids: the connected regions that no particle covers, with their exact boundary, on the torus.

The boundary of the covered region is chained into loops (`boundary`). With the void on the right, a loop that closes
around a void encloses a positive void area, one around an island of particles (a rattler, or a cluster, that floats
inside a void) a negative one. By Green's theorem, with the start p, the end q and the bulge b of each piece,

    area = - sum over pieces of (p x q)/2 + b.

A loop that winds around the torus by w has area -(sum - (w x p_0)/2), which is defined up to multiples of the cell; the
areas of all loops of one void, modulo the cell, add up to the area of the void.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jamlab.geometry.voids.boundary_loops import SLIVER, Boundary, disk_boundary
from jamlab.geometry.voids.polygon_boundary import outline_boundary
from jamlab.geometry.voids.torus_graph import components
from jamlab.geometry.voids.void_rays import first_hits
from jamlab.packing.packing import Packing

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

EMPTY = 1e-14  # a void smaller than this part of R^2 is nothing but rounding
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
        centroid: (m, 2) centre of area, inside the cell; nan for a void that percolates, which has none.
        percolating: (m,) int64, independent directions in which a void winds around the torus: 0, 1 or 2.
        islands: (m,) int64, loops around particles that float inside the void, each a rattler or a cluster.
        boundary: pieces and loops that bound the voids.
        void: (k,) int64, void that each piece of the boundary bounds; -1 for slivers of rounding size.
        image: (k, 2) int64, lattice translation that puts a piece in line with the other pieces of its void.
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

    @property
    def shape(self) -> Array:
        """(m,) shape factor perimeter^2/(4 pi area); Plateau border of three equal disks: 4.8706."""
        return np.asarray(self.perimeter**2 / (4 * np.pi * self.area))


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
    boundary = disk_boundary(packing) if packing.model == "sp" else outline_boundary(packing)
    signed = _signed_areas(boundary, packing.box)
    winds = (boundary.winding != 0).any(axis=1)
    rounding = ~winds & (np.abs(signed) < EMPTY * packing.area / packing.n)
    around, island = ~winds & ~rounding & (signed > 0), ~winds & ~rounding & (signed < 0)
    count, void_of_loop, loop_image = _grouped(boundary, packing.box, around, rounding)

    loops = np.flatnonzero(~rounding)
    enclosed, strip, islands = (
        np.bincount(void_of_loop[loops], kind[loops], count).astype(np.int64) for kind in (around, winds, island)
    )
    percolating = np.where(enclosed > 0, 0, np.where(strip > 0, 1, 2))
    area = np.bincount(void_of_loop[loops], signed[loops], count).astype(np.float64)
    area = np.where(percolating > 0, np.mod(area, packing.area), area)

    void, image = void_of_loop[boundary.loop], boundary.image + loop_image[boundary.loop]
    length = boundary.pieces.length
    k = np.flatnonzero(void >= 0)
    perimeter = np.bincount(void[k], length[k], count).astype(np.float64)
    k = k[length[k] > SLIVER * np.sqrt(packing.area / packing.n)]
    open_void = percolating[void[k]] > 0
    corners = np.column_stack([void[k], boundary.pieces.particle[k], np.where(open_void[:, None], 0, image[k])])
    corners = corners[open_void | around[boundary.loop[k]]]
    corners = corners[np.lexsort(corners.T)]
    different = np.ones(len(corners), dtype=bool)
    different[1:] = (corners[1:] != corners[:-1]).any(axis=1)
    sides = np.bincount(corners[different, 0], minlength=count)
    centroid = _centroids(boundary, packing.box, void, image, area)
    centroid[percolating > 0] = np.nan
    return Voids(sides, area, perimeter, centroid, percolating, islands, boundary, void, image)


def _signed_areas(boundary: Boundary, box: Array) -> Array:
    """(loops,) area to the right of each loop; of a loop that winds, up to multiples of the cell."""
    pieces, loop = boundary.pieces, boundary.loop
    winding = boundary.winding @ box
    place = boundary.image @ box
    origin = pieces.start[boundary.origin] + place[boundary.origin]
    # loops that close are measured from their own beginning, which keeps the digits of small ones
    reference = np.where((boundary.winding != 0).any(axis=1)[:, None], 0.0, origin)
    p, q = (x + place - reference[loop] for x in (pieces.start, pieces.end))
    green = np.bincount(loop, 0.5 * _cross(p, q) + pieces.bulge, len(winding))
    return np.asarray(0.5 * _cross(winding, origin) - green)


def _grouped(
    boundary: Boundary, box: Array, around: NDArray[np.bool_], rounding: NDArray[np.bool_]
) -> tuple[int, Indices, Indices]:
    """Number of voids, the void that each loop bounds (-1: none), and in which image of the void the loop lies."""
    casting = np.flatnonzero(~around & ~rounding)
    hit, shift = first_hits(boundary, box, casting, rounding)
    found = components(len(around), casting, hit, shift)
    group = found.label.copy()
    held = np.zeros(found.count, dtype=bool)
    held[group[around | rounding | (boundary.winding != 0).any(axis=1)]] = True
    if not held.all():  # islands that nothing encloses share the one void that percolates in both directions
        group[~held[group]] = np.flatnonzero(~held)[0]
    group[rounding] = -1
    names, void = np.unique(group, return_inverse=True)
    none = int(len(names) > 0 and names[0] == -1)
    return len(names) - none, void - none, found.image


def _centroids(boundary: Boundary, box: Array, void: Indices, image: Indices, area: Array) -> Array:
    """(m, 2) centres of area, wrapped into the cell; meaningless for voids that percolate."""
    pieces = boundary.pieces
    k = np.flatnonzero(void >= 0)
    first = k[np.unique(void[k], return_index=True)[1]]
    reference = pieces.start[first] + image[first] @ box
    move = image[k] @ box - reference[void[k]]
    p, q = pieces.start[k] + move, pieces.end[k] + move
    moment = (p + q) * _cross(p, q)[:, None] / 6 + pieces.bulge_moment[k] + pieces.bulge[k][:, None] * move
    total = np.column_stack([np.bincount(void[k], -moment[:, axis], len(area)) for axis in (0, 1)])
    centre = reference + total / area[:, None]
    return np.asarray(centre - np.floor(centre @ np.linalg.inv(box)) @ box)


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
