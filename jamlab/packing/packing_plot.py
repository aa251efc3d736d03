"""Draw the particles of a packing in their periodic cell."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from numpy.typing import NDArray

from jamlab.plotting.axes import merged
from jamlab.plotting.palette import LARGE, OUTLINE, PARTICLE, SMALL
from jamlab.plotting.periodic_cell import circles, fill_everywhere, lattice_moves, line_everywhere, moves_home

if TYPE_CHECKING:
    from jamlab.packing.packing import Packing

Array = NDArray[np.float64]

_QUARTER_ARC = 16  # steps of a right angle around the corners of a rim


def size_colours(packing: Packing) -> NDArray[np.str_]:
    """(n,) colours: particles larger than the mean blue, the others pink."""
    sizes = packing.diameters if packing.diameters is not None else packing.params["a0"]
    return np.where(sizes > sizes.mean(), LARGE, SMALL)


def draw_particles(axes: Axes, packing: Packing, facecolor: Any, /, **style: Any) -> None:
    """Fill every particle in all its images, droplets with their rims, and draw a line around each (DP: bare polygon).

    Args:
        axes: to draw into.
        packing: SP or DP.
        facecolor: one colour, or (n,) of them.
        style: of matplotlib's PolyCollection.
    """
    fills, edges = (move_home(packing, shapes) for shapes in particle_shapes(packing))
    look = merged(
        PolyCollection, {"facecolor": facecolor, "edgecolor": "white", "linewidth": 0.8, "alpha": 0.55}, style
    )
    fill_everywhere(axes, fills, packing.box, **look)
    line_everywhere(axes, edges, packing.box, color="#333333", linewidth=0.6)


def draw_background(axes: Axes, packing: Packing, facecolor: Any = PARTICLE) -> None:
    """Fill every particle pale, for pictures of something else."""
    fills = move_home(packing, particle_shapes(packing)[0])
    fill_everywhere(axes, fills, packing.box, facecolor=facecolor, edgecolor=OUTLINE, linewidth=0.6)


def particle_shapes(packing: Packing) -> tuple[list[Array], list[Array]]:
    """Rings to fill and rings to outline for each particle, at the place where it is stored.

    Disks: the circle, twice. Droplets: the polygon grown by its rim of width delta/2, and the polygon itself.
    """
    if packing.diameters is not None:
        disks = circles(packing.positions, packing.diameters)
        return disks, disks
    outlines = packing.outlines()
    grown = shapely.buffer(outlines, 0.5 * packing.params["delta"], quad_segs=_QUARTER_ARC)
    fills, edges = (
        [shapely.get_coordinates(shapely.get_exterior_ring(shape)) for shape in part] for part in (grown, outlines)
    )
    return fills, edges


def move_home(packing: Packing, shapes: list[Array]) -> list[Array]:
    """Move the shapes of particles so that their centres lie inside the cell."""
    return [shape + move for shape, move in zip(shapes, home_moves(packing), strict=True)]


def home_moves(packing: Packing) -> Array:
    """(n, 2) translations that bring the centre of each particle into the cell."""
    return moves_home(packing.centroids, packing.box)


def periodic_moves(packing: Packing) -> Array:
    """(m, 2) translations of the cell to itself, in the middle, and to the images that reach into a picture."""
    return lattice_moves(packing.box)
