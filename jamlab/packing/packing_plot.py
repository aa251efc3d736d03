"""Draw the particles of a packing in their periodic cell."""

from __future__ import annotations

from dataclasses import dataclass
from io import BytesIO
from textwrap import fill
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize, to_hex
from matplotlib.figure import Figure
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.packing.bare_packing import BarePacking
from jamlab.packing.frame import frame_of
from jamlab.packing.kinds import kind_of
from jamlab.packing.neighbors import moves_home
from jamlab.plotting.axes import merged
from jamlab.plotting.palette import LARGE, OUTLINE, PARTICLE, RATTLER, SMALL
from jamlab.plotting.periodic_cell import fill_everywhere, line_everywhere


@dataclass(frozen=True)
class Glance:
    """A picture of a packing for notebooks."""

    particles: int = 4000  # particles: beyond, a picture this small shows grey
    # of a picture for notebooks
    inches: float = 4.0
    dpi: int = 80


GLANCE = Glance()


def draw_png(packing: BarePacking) -> bytes | None:
    """Picture of the packing for notebooks, with its facts above it; None for more particles than it can show."""
    if packing.n > GLANCE.particles:
        return None
    figure, buffer = Figure(figsize=(GLANCE.inches, GLANCE.inches), layout="constrained"), BytesIO()
    axes = packing.plot(figure.subplots())
    axes.set_title(fill(repr(packing), 60), fontsize=7)
    figure.savefig(buffer, format="png", dpi=GLANCE.dpi)
    return buffer.getvalue()


QUARTER_ARC = 16  # steps of a right angle around the corners of a rim
_SCALE = "viridis"  # of many sizes; nothing in it looks like the grey of rattlers


def size_colours(packing: BarePacking) -> NDArray[np.str_]:
    """(n,) colours: of two sizes the large ones blue and the small ones pink; more sizes on a scale of colours; fixed
    particles grey."""
    sizes, mean = kind_of(packing).sizes(packing), frame_of(packing).sizes.mean()
    many = has_many_sizes(packing)
    free = _scale_colours(_size_scale(packing)(sizes)) if many else np.where(sizes > mean, LARGE, SMALL)
    return np.where(frame_of(packing).fixed, RATTLER, free)


def bar_colours() -> list[str]:
    """Colours of a bar from the smallest to the largest of many sizes."""
    return list(_scale_colours(np.linspace(0, 1, 9)))


def _scale_colours(places: Array) -> NDArray[np.str_]:
    return np.array([to_hex(colour) for colour in matplotlib.colormaps[_SCALE](places)])


def has_many_sizes(packing: BarePacking) -> bool:
    """Whether particles have more sizes than two colours can tell apart."""
    return len(np.unique(frame_of(packing).sizes)) > 2


def add_size_bar(axes: Axes, packing: BarePacking) -> None:
    """Say beside the axes what the colours of `size_colours` mean, where there are more than two."""
    if has_many_sizes(packing):
        scale = matplotlib.cm.ScalarMappable(_size_scale(packing), _SCALE)
        axes.figure.colorbar(scale, ax=axes, label=kind_of(packing).size_label, shrink=0.8)


def _size_scale(packing: BarePacking) -> Normalize:
    sizes = frame_of(packing).sizes
    return Normalize(sizes.min(), sizes.max())


def draw_particles(axes: Axes, packing: BarePacking, facecolor: Any, /, **style: Any) -> None:
    """Fill every particle in all its images, droplets with their rims, and draw a line around each (DP: bare polygon).

    Args:
        axes: to draw into.
        facecolor: one colour, or (n,) of them.
        style: of matplotlib's PolyCollection.
    """
    fills, edges = (move_home(packing, shapes) for shapes in rings(packing))
    look = merged(
        PolyCollection, {"facecolor": facecolor, "edgecolor": "white", "linewidth": 0.8, "alpha": 0.55}, style
    )
    fill_everywhere(axes, fills, packing.box, **look)
    line_everywhere(axes, edges, packing.box, color="#333333", linewidth=0.6)


def rings(packing: BarePacking) -> tuple[list[Array], list[Array]]:
    """Shapes of particles to fill and to outline, as stored; a flat wall is drawn up to the edge of the cell."""
    fills, edges = kind_of(packing).rings(packing)
    for k in np.flatnonzero(packing.flat_walls):
        (x, y), height = packing.centroids[k], packing.box[1, 1]
        edge, (low, high) = height * np.round(y / height), frame_of(packing).planes
        face = edge + low if edge < y else edge - height + high
        right = x + packing.box[0, 0]
        fills[k] = edges[k] = np.array([[x, face], [right, face], [right, edge], [x, edge]])
    return fills, edges


def draw_background(axes: Axes, packing: BarePacking, facecolor: Any = PARTICLE) -> None:
    """Fill every particle pale, for pictures of something else."""
    fills = move_home(packing, rings(packing)[0])
    fill_everywhere(axes, fills, packing.box, facecolor=facecolor, edgecolor=OUTLINE, linewidth=0.6)


def move_home(packing: BarePacking, shapes: list[Array]) -> list[Array]:
    """Move the shapes of particles so that their centres lie inside the cell."""
    return [shape + move for shape, move in zip(shapes, home_moves(packing), strict=True)]


def home_moves(packing: BarePacking) -> Array:
    """(n, 2) translations that bring the centre of each particle into the cell."""
    return moves_home(packing.centroids, packing.box)


def draw_coloured(
    axes: Axes, packing: BarePacking, values: Array, scale: Normalize, label: str, /, **style: Any
) -> None:
    """Fill particles by values (n,), white where there is none, and add the scale of colours beside the axes."""
    colours = matplotlib.colormaps["cividis"](scale(values))
    colours[~np.isfinite(values)] = 1.0
    fills = move_home(packing, rings(packing)[0])
    fill_everywhere(axes, fills, packing.box, **merged(PolyCollection, {"facecolor": colours}, style))
    axes.figure.colorbar(matplotlib.cm.ScalarMappable(scale, "cividis"), ax=axes, label=label, shrink=0.8)
