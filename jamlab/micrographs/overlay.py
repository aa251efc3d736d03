"""Draw what was found over a picture: outlines, numbers, contacts, voids by number of sides, coloured as in plots."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import matplotlib.patheffects
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D

from jamlab.arrays import Array, Indices
from jamlab.plotting.palette import BLUE, ORANGE, OTHER, RATTLER, SIDE_COLOURS
from jamlab.plotting.palette import OUTLINE as CUT

if TYPE_CHECKING:
    from jamlab.micrographs.measured_droplets import Micrograph

OUTLINE, CONTACT = ORANGE, BLUE
INCHES = 9.0  # longer side of the picture
LEAST_FONT, LARGEST_FONT = 3.0, 11.0  # points
LARGEST_SIDE = 2400  # pixels drawn: a larger picture is thinned


def overlay_size(found: Micrograph) -> tuple[float, float]:
    """Width and height of a figure in inches."""
    height, width = found.picture.shape
    scale = INCHES / max(height, width)
    return width * scale + 0.2, height * scale + 1.0


def draw_overlay(ax: Any, found: Micrograph) -> None:
    """Draw droplets, contacts and voids over their picture, on axes of matplotlib."""
    height, width = found.picture.shape
    pixel, cut, sides = found.pixel or 1.0, found.cut_outlines, found.voids.sides
    radius = float(np.sqrt(np.median(found.areas) / np.pi)) / pixel
    points = 72 * ax.figure.get_size_inches().min() * radius / min(height, width)  # radius of a droplet as drawn
    step = max(1, int(np.ceil(max(height, width) / LARGEST_SIDE)))
    extent = (-0.5, width - 0.5, height - 0.5, -0.5)
    ax.imshow(found.picture[::step, ::step], cmap="gray", vmin=-0.15, extent=extent, alpha=0.85)
    for rings, colours, line in (
        (found.outlines, [RATTLER if loose else OUTLINE for loose in found.rattlers], 1.4),
        (cut, [CUT] * len(cut), 1.0),
    ):
        closed = [np.vstack([ring, ring[:1]]) for ring in rings]
        ax.add_collection(LineCollection(closed, colors=colours, linewidths=min(line, 0.12 * points)))
    touching = LineCollection([*found.touching], colors=CONTACT, linewidths=min(1.1, 0.1 * points), alpha=0.8)
    ax.add_collection(touching)
    _write_numbers(ax, found.centres / pixel, points)
    colours = [SIDE_COLOURS.get(int(count), OTHER) for count in sides]
    size = np.clip(0.3 * points, 1.5, 7.0)
    ax.scatter(*found.voids.centroid.T / pixel, s=size**2, c=colours, edgecolors="black", linewidths=0.4, zorder=3)
    ax.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), xticks=[], yticks=[])
    ax.set_title(_title(found), fontsize=11)
    handles = _legend(bool(found.rattlers.any()), bool(cut), sides)
    ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.01), ncols=5, fontsize=9, frameon=False)


def _title(found: Micrograph) -> str:
    parts = (("ρ", "rho", ".3f"), ("z", "z", ".2f"), ("A", "shape_rim", ".3f"))
    means = ", ".join(f"{sign} = {found.means[name].text(form)}" for sign, name, form in parts)
    count = len(found.reasons)
    why = f" ({count} reason{'s'[: count > 1]})" if count else ""
    return f"{found.count} droplets; quality: {found.quality}{why}\n{means}"


def _write_numbers(ax: Any, centres: Array, points: float) -> None:
    """Write the row of each droplet in the table on it, if there is room."""
    size = min(0.55 * points, LARGEST_FONT)
    if size < LEAST_FONT:
        return
    halo = [matplotlib.patheffects.withStroke(linewidth=0.25 * size, foreground="white")]
    for number, (x, y) in enumerate(centres, 1):
        ax.text(x, y, str(number), ha="center", va="center", fontsize=size, color="black", path_effects=halo)


def _legend(loose: bool, cut: bool, sides: Indices) -> list[Line2D]:
    handles = [Line2D([], [], color=OUTLINE, label="droplet"), Line2D([], [], color=CONTACT, label="contact")]
    if loose:
        handles.append(Line2D([], [], color=RATTLER, label="rattler"))
    if cut:
        handles.append(Line2D([], [], color=CUT, label="cut, not counted"))
    kinds = sorted({int(count) for count in sides})
    names = [(SIDE_COLOURS[k], f"void, {k} sides") for k in kinds if k in SIDE_COLOURS]
    if any(k not in SIDE_COLOURS for k in kinds):
        names.append((OTHER, "void, other"))
    look: dict[str, Any] = {"marker": "o", "linestyle": "none", "markeredgecolor": "black", "markersize": 6}
    return handles + [Line2D([], [], color=colour, label=label, **look) for colour, label in names]
