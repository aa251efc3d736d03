"""Draw the particles of a packing in their periodic cell, and as a small SVG picture for notebooks."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Any
from zlib import crc32

import matplotlib
import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize, to_hex
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.packing.neighbors import moves_home
from jamlab.plotting.axes import merged
from jamlab.plotting.palette import LARGE, OUTLINE, PARTICLE, SMALL
from jamlab.plotting.periodic_cell import circles, fill_everywhere, lattice_moves, line_everywhere

if TYPE_CHECKING:
    from jamlab.packing.packing import Packing

_WIDTH = 280  # pixels of the cell
_MOST = 4000  # particles: beyond, a picture this small shows grey and makes a notebook heavy


def draw_svg(packing: Packing) -> str:
    """SVG of one periodic cell: small particles pink, large ones blue; polygons with their rims, drawn as strokes.
    Returns an `<svg>` element, or "" for more particles than such a picture can show."""
    if packing.n > _MOST:
        return ""
    scale = _WIDTH / packing.box[0, 0]
    width, height = packing.box[0, 0] + abs(packing.box[1, 0]), packing.box[1, 1]
    left = min(0.0, packing.box[1, 0])
    colours = size_colours(packing)
    shapes = [_shape(packing, m, move, colours[m], scale, left, height) for m, move in _copies(packing)]
    corners = np.array([[0, 0], packing.box[0], packing.box.sum(axis=0), packing.box[1]])
    cell = _points(corners, scale, left, height)
    name = f"cell{crc32(packing.positions.tobytes())}"  # a notebook holds several pictures, and names must differ
    size = f'width="{scale * width:.0f}" height="{scale * height:.0f}"'
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" {size}><clipPath id="{name}"><polygon points="{cell}"/></clipPath>'
        f'<g clip-path="url(#{name})" opacity="0.6" stroke="#333" stroke-width="0.5">{"".join(shapes)}</g>'
        f'<polygon points="{cell}" fill="none" stroke="black"/></svg>'
    )


def _copies(packing: Packing) -> list[tuple[int, np.ndarray]]:
    """Particles with the translations at which they, or an image of them, reach into the cell."""
    home = home_moves(packing)
    reach = _reach(packing)
    inverse = np.linalg.inv(packing.box)
    margin = reach[:, None] * np.hypot(*inverse)  # of lattice coordinates
    copies = []
    for image in product((-1, 0, 1), repeat=2):
        place = (packing.centroids + home) @ inverse + image
        inside = np.all((place > -margin) & (place < 1 + margin), axis=1)
        copies += [(int(m), home[m] + np.array(image) @ packing.box) for m in np.flatnonzero(inside)]
    return copies


def _reach(packing: Packing) -> np.ndarray:
    """(n,) radius around the centroid that holds the particle with its rim."""
    if packing.diameters is not None:
        return np.asarray(0.5 * packing.diameters)
    assert packing.offsets is not None
    from_centre = packing.positions - packing.centroids[packing.particle]
    rim = 0.5 * packing.params["delta"]
    return np.asarray(np.maximum.reduceat(np.hypot(*from_centre.T), packing.offsets[:-1]) + rim)


def _shape(packing: Packing, m: int, move: np.ndarray, colour: str, scale: float, left: float, height: float) -> str:
    fill = f'fill="{colour}"'
    if packing.diameters is not None:
        x, y = packing.positions[m] + move
        place = f'cx="{scale * (x - left):.1f}" cy="{scale * (height - y):.1f}"'
        return f'<circle {place} r="{0.5 * scale * packing.diameters[m]:.1f}" {fill}/>'
    assert packing.offsets is not None
    ring = packing.positions[packing.offsets[m] : packing.offsets[m + 1]] + move
    rim = f'stroke="{colour}" stroke-width="{scale * packing.params["delta"]:.1f}" stroke-linejoin="round"'
    return f'<polygon points="{_points(ring, scale, left, height)}" {fill} {rim}/>'


def _points(ring: np.ndarray, scale: float, left: float, height: float) -> str:
    return " ".join(f"{scale * (x - left):.1f},{scale * (height - y):.1f}" for x, y in ring)


_QUARTER_ARC = 16  # steps of a right angle around the corners of a rim
_SCALE = "viridis"  # of many sizes; nothing in it looks like the grey of rattlers


def size_colours(packing: Packing) -> NDArray[np.str_]:
    """(n,) colours: of two sizes the large ones blue and the small ones pink; more sizes on a scale of colours."""
    sizes = particle_sizes(packing)
    if not has_many_sizes(packing):
        return np.where(sizes > sizes.mean(), LARGE, SMALL)
    return _scale_colours(_size_scale(sizes)(sizes))


def bar_colours() -> list[str]:
    """Colours of a bar from the smallest to the largest of many sizes."""
    return list(_scale_colours(np.linspace(0, 1, 9)))


def _scale_colours(places: Array) -> NDArray[np.str_]:
    return np.array([to_hex(colour) for colour in matplotlib.colormaps[_SCALE](places)])


def particle_sizes(packing: Packing) -> Array:
    """(n,) diameters of disks; of droplets the root of the rest area."""
    return packing.diameters if packing.diameters is not None else np.sqrt(packing.params["a0"])


def has_many_sizes(packing: Packing) -> bool:
    """Whether particles have more sizes than two colours can tell apart."""
    return len(np.unique(particle_sizes(packing))) > 2


def add_size_bar(axes: Axes, packing: Packing) -> None:
    """Say beside the axes what the colours of `size_colours` mean, where there are more than two."""
    if has_many_sizes(packing):
        label = "diameter" if packing.model == "sp" else r"$\sqrt{a_0}$"
        scale = matplotlib.cm.ScalarMappable(_size_scale(particle_sizes(packing)), _SCALE)
        axes.figure.colorbar(scale, ax=axes, label=label, shrink=0.8)


def _size_scale(sizes: Array) -> Normalize:
    return Normalize(sizes.min(), sizes.max())


def draw_particles(axes: Axes, packing: Packing, facecolor: Any, /, **style: Any) -> None:
    """Fill every particle in all its images, droplets with their rims, and draw a line around each (DP: bare polygon).
    `axes`: to draw into; `facecolor`: one colour, or (n,) of them; `style`: of matplotlib's PolyCollection."""
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
    """Rings to fill and rings to outline for each particle, at the place where it is stored. Disks: the circle, twice.
    Droplets: the polygon grown by its rim of width delta/2, and the polygon itself."""
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


def draw_coloured(axes: Axes, packing: Packing, values: Array, scale: Normalize, label: str, /, **style: Any) -> None:
    """Fill particles by values (n,), white where there is none, and add the scale of colours beside the axes."""
    colours = matplotlib.colormaps["cividis"](scale(values))
    colours[~np.isfinite(values)] = 1.0
    fills = move_home(packing, particle_shapes(packing)[0])
    fill_everywhere(axes, fills, packing.box, **merged(PolyCollection, {"facecolor": colours}, style))
    axes.figure.colorbar(matplotlib.cm.ScalarMappable(scale, "cividis"), ax=axes, label=label, shrink=0.8)
