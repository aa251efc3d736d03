"""Draw particles coloured by a quantity of their own: local packing fraction in its cells, orientational order."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize

from jamlab.arrays import Array
from jamlab.packing.packing_plot import move_home, particle_shapes
from jamlab.plotting.axes import merged
from jamlab.plotting.palette import RED
from jamlab.plotting.periodic_cell import fill_everywhere, frame_cell, line_everywhere, moves_home

if TYPE_CHECKING:
    from jamlab.geometry.tessellation import Tessellation
    from jamlab.packing.packing import Packing


def draw_cells(axes: Axes, cells: Tessellation, fraction: Array, /, **style: Any) -> None:
    """Draw the walls between particles coloured by local packing fraction; see `Tessellation.plot`."""
    packing = cells.packing
    scale = Normalize(np.nanmin(fraction), np.nanmax(fraction))
    look = merged(LineCollection, {"color": RED, "linewidth": 1.0}, style)
    walls = cells.lines + moves_home(cells.lines.mean(axis=1), packing.box)[:, None]
    draw_coloured(axes, packing, fraction, scale, "local packing fraction")
    line_everywhere(axes, walls, packing.box, **look)
    frame_cell(axes, packing.box)


def draw_order(axes: Axes, packing: Packing, local: Array, k: int, /, **style: Any) -> None:
    """Draw particles coloured by their (n,) |psi_k|; see `OrientationalOrder.plot`."""
    draw_coloured(axes, packing, local, Normalize(0, 1), rf"bond-orientational order $|\psi_{{{k}}}|$", **style)
    frame_cell(axes, packing.box)


def draw_coloured(axes: Axes, packing: Packing, values: Array, scale: Normalize, label: str, /, **style: Any) -> None:
    """Fill particles by values (n,), white where there is none, and add the scale of colours beside the axes."""
    colours = matplotlib.colormaps["cividis"](scale(values))
    colours[~np.isfinite(values)] = 1.0
    fills = move_home(packing, particle_shapes(packing)[0])
    fill_everywhere(axes, fills, packing.box, **merged(PolyCollection, {"facecolor": colours}, style))
    axes.figure.colorbar(matplotlib.cm.ScalarMappable(scale, "cividis"), ax=axes, label=label, shrink=0.8)
