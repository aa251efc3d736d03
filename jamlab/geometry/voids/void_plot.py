"""Draw voids in the periodic cell, coloured by number of sides as fig 8 of Boromand et al."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.patches import Patch
from matplotlib.path import Path

from jamlab.arrays import Array, Indices
from jamlab.packing.packing_plot import draw_background
from jamlab.plotting.axes import legend_below, merged
from jamlab.plotting.palette import OTHER, SIDE_COLOURS
from jamlab.plotting.periodic_cell import frame_cell, lattice_moves

if TYPE_CHECKING:
    from jamlab.packing.packing import Packing

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
