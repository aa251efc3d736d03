"""Draw voids in the periodic cell, coloured by number of sides as fig 8 of Boromand et al."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.patches import Patch
from matplotlib.path import Path
from numpy.typing import NDArray

from jamlab.arrays import Array, Indices
from jamlab.packing.packing_plot import draw_background
from jamlab.plotting.axes import legend_below, merged
from jamlab.plotting.palette import OTHER, SIDE_COLOURS
from jamlab.plotting.periodic_cell import frame_cell, lattice_moves

if TYPE_CHECKING:
    from jamlab.geometry.voids.voids import Voids
    from jamlab.packing.packing import Packing

_ARC_STEP = 0.05  # radians, of drawn arcs
_LABELLED = 0.03  # voids larger than this fraction of the cell per particle have room for a digit


def draw_voids(
    axes: Axes, packing: Packing, paths: list[Path], sides: Indices, percolating: Indices, area: Array, centroid: Array,
    /, **style: Any,
) -> None:  # fmt: skip
    """Draw pale particles and voids (v,) by their paths, sides, areas and centroids (v, 2); see `Voids.plot`."""
    draw_background(axes, packing)
    closed = np.flatnonzero(percolating == 0)
    colours = [SIDE_COLOURS.get(int(sides[k]), OTHER) for k in closed]
    look = merged(PathCollection, {"facecolor": colours, "edgecolor": "black", "linewidth": 0.5}, style)
    for move in lattice_moves(packing.box):
        moved = [Path(paths[k].vertices + move, paths[k].codes) for k in closed]
        axes.add_collection(PathCollection(moved, **look))
    for k in closed[area[closed] > _LABELLED * packing.area / packing.n]:
        x, y = centroid[k]
        axes.text(x, y, str(sides[k]), ha="center", va="center", fontsize=7)
    frame_cell(axes, packing.box)
    handles = _side_handles(sides[closed], bool((percolating > 0).any()))
    if handles:
        legend_below(axes, handles, "sides of voids")


def _side_handles(sides: Indices, percolates: bool) -> list[Any]:
    """Legend entries of the numbers of sides that occur, and of voids that percolate."""
    present = sorted(set(sides.tolist()))
    handles = [Patch(facecolor=SIDE_COLOURS[s], edgecolor="black", label=f"{s}") for s in present if s in SIDE_COLOURS]
    if any(s not in SIDE_COLOURS for s in present):
        handles.append(Patch(facecolor=OTHER, edgecolor="black", label="other"))
    if percolates:
        handles.append(Patch(facecolor="white", edgecolor="black", label="percolates"))
    return handles


def void_paths(found: Voids) -> list[Path]:
    """Path of each void near its centroid, with islands cut out; arcs become chords of 0.05 radians."""
    boundary, box = found.boundary, found.packing.box
    pieces, place = boundary.pieces, found.image @ box
    loops: list[list[NDArray[np.float64]]] = [[] for _ in found.sides]
    for first in boundary.origin:
        if found.void[first] < 0:
            continue
        points, piece = [], first
        while True:
            if pieces.radius[piece] > 0:
                steps = max(int(np.ceil(pieces.angle[piece] / _ARC_STEP)), 1)
                turn = pieces.begin[piece] + pieces.angle[piece] * np.arange(steps) / steps
                drawn = pieces.centre[piece] + pieces.radius[piece] * np.column_stack([np.cos(turn), np.sin(turn)])
            else:
                drawn = pieces.start[piece][None]
            points.append(drawn + place[piece])
            piece = boundary.following[piece]
            if piece == first:
                break
        loops[found.void[first]].append(np.concatenate([*points, points[0][:1]]))
    paths = []
    for k, rings in enumerate(loops):
        codes = [np.r_[Path.MOVETO, np.full(len(ring) - 2, Path.LINETO), Path.CLOSEPOLY] for ring in rings]
        vertices = np.concatenate(rings)
        if found.percolating[k] == 0:
            # the outline may lie in another cell than its centroid
            middle = vertices.mean(axis=0) - found.centroid[k]
            vertices = vertices - np.round(middle @ np.linalg.inv(box)) @ box
        paths.append(Path(vertices, np.concatenate(codes)))
    return paths
