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
from typing import Any

import numpy as np

from jamlab.arrays import Array, Indices
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.geometry.boundary_pieces import Pieces
from jamlab.geometry.power_cells import CELL_ROUNDING
from jamlab.geometry.rims import ARC_STEP
from jamlab.geometry.voids.boundary_loops import Boundary, find_first_hits, follow_rays, trace
from jamlab.kernels.library import INTEGER, INTEGERS, REAL, REALS, kernel
from jamlab.packing.derived import per_packing
from jamlab.packing.neighbors import moves_home
from jamlab.packing.outlines import cross
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.plotting.drawable import CELL, LABEL, drawn, label_axes
from jamlab.plotting.palette import OTHER, SIDE_COLOURS, side_names

VOIDS_DEFINITION = 1  # version, see jamlab.campaign.tasks
SLIVER = 1e-10  # of sqrt(A/n): a shorter piece is no side, as the void that it would bound there is below `empty`
PLATEAU_BORDER = np.pi / (4 * np.sqrt(3) - 2 * np.pi)  # shape of the void between three equal disks that touch, 4.8706


_IN = (INTEGERS, *[REALS] * 5, INTEGERS, INTEGERS, INTEGERS, REAL, REALS)
_sums = kernel("void_sums", INTEGER, *_IN, INTEGER, REALS, INTEGERS, REALS, REALS)


@dataclass(frozen=True)
class Voids(Result):
    """Voids of a packing, one entry each.

    Attributes:
        sides: (m,) int64, l, number of particles on the boundary. Void that does not percolate: on the loop around
            it, not on islands inside; a particle with several pieces in the loop counts once, two periodic images of
            it twice. Void that percolates: different particles on all its loops.
        area: (m,) area; the sum is (1 - rho) times the box area.
        perimeter: (m,) length of the whole boundary, islands included.
        centroid: (m, 2) centre of area, inside the cell; nan for a void that percolates.
        percolating: (m,) int64, independent directions in which a void winds around the torus: 0, 1 or 2.
        islands: (m,) int64, loops around particles that float inside the void, each a rattler or a cluster.
        boundary: pieces and loops that bound the voids.
        void: (k,) int64, void that each piece of the boundary bounds; -1 for slivers of rounding size.
        image: (k, 2) int64, lattice translation that puts a piece in line with the other pieces of its void.
        packing: the packing whose voids they are.

    Example:
        >>> v = jamlab.voids(jamlab.pack(n=32, pressure=1e-2, seed=1))
        >>> len(v.sides) == len(v.area) == len(v.shape_factor), int(v.sides.min())
        (True, 3)
    """

    _rows = ("sides", "area", "perimeter", "shape_factor", "centroid", "percolating", "islands")
    _apart = ("void", "image")

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

    @property
    def shape_factor(self) -> Array:
        """(m,) shape factor perimeter^2/(4 pi area); Plateau border of three equal disks: 4.8706."""
        return np.asarray(self.perimeter**2 / (4 * np.pi * self.area))

    @drawn('PathCollection, such as edgecolor="none"', CELL)
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the voids between pale particles, coloured by number of sides; large ones carry it as a digit.

        A void that percolates is left white. Islands inside a void show the particles.

        >>> ax = jamlab.voids(jamlab.jam(n=64, seed=1)).plot()
        """
        from matplotlib.collections import PathCollection
        from matplotlib.patches import Patch
        from matplotlib.path import Path

        from jamlab.packing.packing_plot import draw_background
        from jamlab.plotting.axes import legend_below, merged
        from jamlab.plotting.periodic_cell import frame_cell, lattice_moves

        packing, paths, closed = self.packing, void_paths(self), np.flatnonzero(self.percolating == 0)
        sides = self.sides[closed].tolist()
        draw_background(axes, packing)
        colours = [SIDE_COLOURS.get(count, OTHER) for count in sides]
        look = merged(PathCollection, {"facecolor": colours, "edgecolor": "black", "linewidth": 0.5}, style)
        for move in lattice_moves(packing.box):
            moved = [Path(paths[k].vertices + move, paths[k].codes) for k in closed]
            axes.add_collection(PathCollection(moved, **look))
        # voids larger than this fraction of the cell per particle have room for a digit
        for k in closed[self.area[closed] > 0.03 * packing.area / packing.n]:
            axes.text(*self.centroid[k], str(self.sides[k]), ha="center", va="center", fontsize=7)
        frame_cell(axes, packing.box)
        names = side_names(sides) | ({"white": "percolates"} if len(closed) < len(self.sides) else {})
        if names:
            handles = [Patch(facecolor=colour, edgecolor="black", label=name) for colour, name in names.items()]
            legend_below(axes, handles, "sides of voids")


class LoopKind(IntEnum):
    """What a loop of the boundary, with the void on its right, is to that void."""

    ROUNDING = 0  # encloses less than rounding size: no void
    AROUND = 1  # encloses the void
    ISLAND = 2  # goes around particles inside the void
    WINDING = 3  # winds around the torus


@checked
def voids(packing: Packing) -> Voids:
    """Find the voids of a packing.

    SP: regions outside all disks, bounded by arcs; gaps below 1e-12 of the size are closed. DP: regions outside all
        polygons with rims of width delta/2, bounded by straight pieces and arcs. Flat walls bound them as well.

    A rattler without contacts is an island in a void: it changes area and perimeter, but not the number of sides. A
    rattler with contacts counts like any other particle. For the voids of the force-bearing network, as for P_l, use
    `remove_rattlers` first.

    Args:
        packing: SP or DP.

    Raises:
        BoundaryError: too many boundaries meet in one point, or outlines of polygons cross.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> v = jamlab.voids(p)
        >>> bool(np.isclose(v.area.sum() / p.area, 1 - jamlab.packing_fraction(p)))
        True
    """
    area, percolating, islands, boundary, kind, void_of_loop, image_of_loop = bound_voids(packing)
    pieces, count = boundary.pieces, len(area)
    void, image = void_of_loop[boundary.loop], boundary.image + image_of_loop[boundary.loop]
    # of a void that percolates the particles on all loops are sides, of others those on the loop around it
    percolates = percolating > 0
    counts = (kind == LoopKind.AROUND) + 2 * np.append(percolates, False)[void_of_loop]
    perimeter, sides = np.empty(count), np.empty(count, dtype=np.int64)
    reference, moment = np.empty((2, count, 2))
    _sums(
        len(void), pieces.particle, pieces.start, pieces.end, pieces.centre, pieces.radius, pieces.angle, void, image,
        counts[boundary.loop], SLIVER * np.sqrt(packing.area / packing.n), packing.box,
        count, perimeter, sides, reference, moment,
    )  # fmt: skip
    centre = reference + moment / area[:, None]
    centre += moves_home(centre, packing.box)
    centre[percolates] = np.nan
    return Voids(sides, area, perimeter, centre, percolating, islands, boundary, void, image, packing)


@per_packing
def bound_voids(packing: Packing) -> tuple[Array, Indices, Indices, Boundary, Indices, Indices, Indices]:
    """Area, percolation, islands and boundary of voids, as in `Voids`; of loops, (loops,) `LoopKind`, void that each
    bounds, -1 for none, and (loops, 2) in which image of the void it lies."""
    boundary = trace(packing)
    pieces, loop, place = boundary.pieces, boundary.loop, boundary.image @ packing.box
    wound, first = boundary.winding @ packing.box, (pieces.start + place)[boundary.origin]
    # loops that close are measured from their own beginning, which keeps the digits of small ones
    move = place - np.where((wound == 0).all(axis=1)[:, None], first, 0.0)[loop]
    part = 0.5 * cross(pieces.start + move, pieces.end + move) + _bulge(pieces.radius, pieces.angle)
    signed = 0.5 * cross(wound, first) - np.bincount(loop, part, len(first))  # to the right of each loop
    kind = np.where(signed > 0, LoopKind.AROUND, LoopKind.ISLAND)
    kind[np.abs(signed) < CELL_ROUNDING.empty * packing.area / packing.n] = LoopKind.ROUNDING
    kind[(boundary.winding != 0).any(axis=1)] = LoopKind.WINDING
    count, void, image = _group_loops(boundary, packing.box, kind)
    enclosing, winding, islands = (
        np.bincount(void[kind == which], minlength=count)
        for which in (LoopKind.AROUND, LoopKind.WINDING, LoopKind.ISLAND)
    )
    percolating = np.where(enclosing > 0, 0, np.where(winding > 0, 1, 2))
    loops = np.flatnonzero(kind != LoopKind.ROUNDING)
    area = np.bincount(void[loops], signed[loops], count).astype(np.float64)
    area = np.where(percolating > 0, np.mod(area, packing.area), area)
    return area, percolating, islands, boundary, kind, void, image


def _bulge(radius: Array, angle: Array) -> Array:
    """Area between circular pieces and their chords; 0 of straight ones."""
    return np.asarray(0.5 * radius**2 * (angle - np.sin(angle)))


def _group_loops(boundary: Boundary, box: Array, kind: Indices) -> tuple[int, Indices, Indices]:
    """Number of voids, the void that each loop bounds (-1: none), and in which image of the void the loop lies."""
    rounding = kind == LoopKind.ROUNDING
    casting = np.flatnonzero((kind == LoopKind.ISLAND) | (kind == LoopKind.WINDING))
    group, image = follow_rays(len(kind), casting, *find_first_hits(boundary, box, casting, rounding))
    held = np.zeros(len(kind), dtype=bool)
    held[group[kind != LoopKind.ISLAND]] = True
    free = ~held[group]
    if free.any():  # islands that nothing encloses share the one void that percolates in both directions
        group[free] = group[free].min()
    bounding = np.zeros(len(kind), dtype=bool)
    bounding[group[~rounding]] = True
    number = np.cumsum(bounding) - 1
    return int(bounding.sum()), np.where(rounding, -1, number[group]), image


def _draw_pieces(pieces: Pieces, place: Array) -> tuple[Array, list[int]]:
    """Points of every piece of a boundary without its end, one piece after the other, moved by its row of `place`, and
    where in them each begins; arcs have one for every `ARC_STEP`."""
    round_ = pieces.radius > 0
    steps = np.where(round_, np.maximum(np.ceil(pieces.angle / ARC_STEP), 1), 1).astype(np.int64)
    begins = np.concatenate([[0], np.cumsum(steps)])
    of = np.repeat(np.arange(len(steps)), steps)
    turn = pieces.begin[of] + pieces.angle[of] * (np.arange(len(of)) - begins[of]) / steps[of]
    arcs = pieces.centre[of] + pieces.radius[of, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    return np.where(round_[of, None], arcs, pieces.start[of]) + place[of], begins.tolist()


def void_paths(found: Voids) -> list[Any]:
    """Path of each void near its centroid, with islands cut out; arcs become chords of 0.05 radians."""
    from matplotlib.path import Path

    boundary, box = found.boundary, found.packing.box
    points, ends = _draw_pieces(boundary.pieces, found.image @ box)
    after = boundary.following.tolist()
    loops: list[list[Array]] = [[] for _ in found.sides]
    for first, void in zip(boundary.origin.tolist(), found.void[boundary.origin].tolist(), strict=True):
        if void < 0:
            continue
        order = [first]
        while (piece := after[order[-1]]) != first:
            order.append(piece)
        loops[void].append(np.concatenate([*(points[ends[k] : ends[k + 1]] for k in order), points[ends[first]][None]]))
    paths = []
    for k, rings in enumerate(loops):
        codes = [[Path.MOVETO, *[Path.LINETO] * (len(ring) - 2), Path.CLOSEPOLY] for ring in rings]
        vertices = np.concatenate(rings)
        if found.percolating[k] == 0:
            # the outline may lie in another cell than its centroid
            middle = vertices.mean(axis=0) - found.centroid[k]
            vertices = vertices - np.round(middle @ np.linalg.inv(box)) @ box
        paths.append(Path(vertices, np.concatenate(codes)))
    return paths


@dataclass(frozen=True)
class VoidStatistics(Result):
    """Voids of one or several packings by number of sides; voids that percolate are counted separately.

    Attributes:
        sides: (m,) int64, every l that occurs, ascending.
        number: (m,) int64, voids with l sides.
        probability: (m,) P_l, which adds up to 1 over l (Boromand et al. fig 8).
        area: (m,) mean area.
        shape_factor: (m,) mean shape factor.
        shape_factor_spread: (m,) standard deviation of the shape factor.
        percolating: number of voids that percolate.

    Example:
        >>> s = jamlab.void_statistics(jamlab.voids(jamlab.pack(n=32, pressure=1e-2, seed=1)))
        >>> bool(np.isclose(s.probability.sum(), 1)), s.sides[:2]
        (True, array([3, 4]))
    """

    _rows = ("sides", "number", "probability", "area", "shape_factor", "shape_factor_spread")

    sides: Indices
    number: Indices
    probability: Array
    area: Array
    shape_factor: Array
    shape_factor_spread: Array
    percolating: int

    @property
    def plateau(self) -> float:
        """Mean shape factor of three-sided voids over 4.8706, the value of a Plateau border; nan without such voids."""
        found = np.flatnonzero(self.sides == 3)
        return float(self.shape_factor[found[0]] / PLATEAU_BORDER) if len(found) else float("nan")

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
        InputError: no voids are given.

    Example:
        >>> v = [jamlab.voids(jamlab.pack(n=32, pressure=1e-2, seed=seed)) for seed in (1, 2)]
        >>> statistics = jamlab.void_statistics(*v)
        >>> int(statistics.number.sum()) + statistics.percolating == sum(len(one.sides) for one in v)
        True
    """
    if not found:
        raise InputError("void_statistics got no voids: give the voids of at least one packing")
    closed = np.concatenate([v.percolating == 0 for v in found])
    sides, area, shape = (
        np.concatenate(values)[closed]
        for values in ([v.sides for v in found], [v.area for v in found], [v.shape_factor for v in found])
    )
    kinds, which, number = np.unique(sides, return_inverse=True, return_counts=True)
    means = [np.bincount(which, values) / number for values in (area, shape, shape**2)]
    spread = np.sqrt(np.maximum(means[2] - means[1] ** 2, 0.0))
    share = number / max(len(sides), 1)
    return VoidStatistics(kinds, number, share, means[0], means[1], spread, int((~closed).sum()))
