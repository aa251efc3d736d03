"""Draw what was found over the picture: outlines, numbers, contacts, voids by number of sides.

Colours are from the palette of Okabe & Ito, safe for the colour-blind.
"""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib.patheffects
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from jamlab.storage.atomic_file import atomic_file, check_target

if TYPE_CHECKING:
    from jamlab.micrographs.measured_droplets import Micrograph

OUTLINE, RATTLER, CUT, CONTACT = "#D55E00", "#CC79A7", "#999999", "#0072B2"
SIDE_COLOURS = {3: "#E69F00", 4: "#56B4E9", 5: "#F0E442", 6: "#CC79A7"}
OTHER = "#009E73"  # voids with another number of sides
INCHES = 9.0  # longer side of the picture
DPI = 150
LEAST_FONT, LARGEST_FONT = 3.0, 11.0  # points
LARGEST_SIDE = 2400  # pixels drawn: a larger picture is thinned


def draw_overlay(micrograph: Micrograph, ax: Any = None) -> Any:
    """Draw on axes of matplotlib; makes a figure if none are given.

    Returns:
        The axes.
    """
    m = micrograph
    height, width = m.picture.shape
    if ax is None:
        scale = INCHES / max(height, width)
        ax = Figure(figsize=(width * scale + 0.2, height * scale + 1.0), layout="constrained").subplots()
    inches = ax.figure.get_size_inches().min()
    points = 72 * inches * _radius(m) / min(height, width)  # radius of a droplet as drawn
    step = max(1, int(np.ceil(max(height, width) / LARGEST_SIDE)))
    ax.imshow(
        m.picture[::step, ::step], cmap="gray", vmin=-0.15, extent=(-0.5, width - 0.5, height - 0.5, -0.5), alpha=0.85
    )
    for rings, colours, line in (
        (m.outlines, [RATTLER if r else OUTLINE for r in m.rattlers], 1.4),
        (m.cut_outlines, [CUT] * len(m.cut_outlines), 1.0),
    ):
        closed = [np.vstack([ring, ring[:1]]) for ring in rings]
        ax.add_collection(LineCollection(closed, colors=colours, linewidths=min(line, 0.12 * points)))
    ax.add_collection(LineCollection([*m.touching], colors=CONTACT, linewidths=min(1.1, 0.1 * points), alpha=0.8))
    _write_numbers(ax, m, points)
    _mark_voids(ax, m, points)
    ax.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), xticks=[], yticks=[])
    rho, z, shape = (m.means[name].text(form) for name, form in (("rho", ".3f"), ("z", ".2f"), ("shape_rim", ".3f")))
    verdict = f"quality: {m.quality}" + (f" ({len(m.reasons)} reason{'s'[: len(m.reasons) > 1]})" if m.reasons else "")
    ax.set_title(f"{m.count} droplets; {verdict}\nρ = {rho}, z = {z}, A = {shape}", fontsize=11)
    handles = _legend(m)
    ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.01), ncols=5, fontsize=9, frameon=False)
    return ax


def write_overlay(micrograph: Micrograph, path: str | Path) -> None:
    """Write the overlay as PNG.

    Raises:
        StorageError: the file cannot be written.
    """
    check_target(path)
    buffer = BytesIO()
    draw_overlay(micrograph).figure.savefig(buffer, format="png", dpi=DPI)
    with atomic_file(path) as temporary:
        temporary.write_bytes(buffer.getvalue())


def _radius(m: Micrograph) -> float:
    return float(np.sqrt(np.median(m.areas) / np.pi)) / (m.pixel or 1.0)


def _write_numbers(ax: Any, m: Micrograph, points: float) -> None:
    """Write the row of each droplet in the table on it, if there is room."""
    size = min(0.55 * points, LARGEST_FONT)
    if size < LEAST_FONT:
        return
    halo = [matplotlib.patheffects.withStroke(linewidth=0.25 * size, foreground="white")]
    for number, (x, y) in enumerate(m.centres / (m.pixel or 1.0), 1):
        ax.text(x, y, str(number), ha="center", va="center", fontsize=size, color="black", path_effects=halo)


def _mark_voids(ax: Any, m: Micrograph, points: float) -> None:
    colours = [SIDE_COLOURS.get(int(sides), OTHER) for sides in m.voids.sides]
    places = m.voids.centroid / (m.pixel or 1.0)
    size = np.clip(0.3 * points, 1.5, 7.0)
    ax.scatter(*places.T, s=size**2, c=colours, edgecolors="black", linewidths=0.4, zorder=3)


def _legend(m: Micrograph) -> list[Line2D]:
    handles = [Line2D([], [], color=OUTLINE, label="droplet"), Line2D([], [], color=CONTACT, label="contact")]
    if m.rattlers.any():
        handles.append(Line2D([], [], color=RATTLER, label="rattler"))
    if m.cut:
        handles.append(Line2D([], [], color=CUT, label="cut, not counted"))
    kinds = sorted({int(sides) for sides in m.voids.sides})
    names = [(SIDE_COLOURS[k], f"void, {k} sides") for k in kinds if k in SIDE_COLOURS]
    if any(k not in SIDE_COLOURS for k in kinds):
        names.append((OTHER, "void, other"))
    look: dict[str, Any] = {"marker": "o", "linestyle": "none", "markeredgecolor": "black", "markersize": 6}
    return handles + [Line2D([], [], color=colour, label=label, **look) for colour, label in names]
