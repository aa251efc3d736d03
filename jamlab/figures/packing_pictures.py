"""Pictures of packings side by side, of their curves and moduli, and of their overlaps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import shapely
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from jamlab.geometry.contact_network import contact_lines, contacts
from jamlab.geometry.power_cells import disk_cells
from jamlab.packing.neighbors import moves_home
from jamlab.packing.packing import Packing
from jamlab.packing.packing_plot import (
    add_size_bar,
    draw_background,
    draw_particles,
    move_home,
    size_colours,
)
from jamlab.plotting.curves import draw_modulus, draw_slopes, label_modulus
from jamlab.plotting.palette import COLOURS, OUTLINE, PARTICLE, RATTLER, ordered_colours
from jamlab.plotting.periodic_cell import fill_everywhere, frame_cell, lattice_moves, line_everywhere
from jamlab.rheology.mean_spectrum import Spectra


def draw_packing(axes: Any, packing: Packing, title: str = "") -> None:
    """Draw one periodic cell with its particles, as fig 2 of Boromand et al.: large blue, small pink, rattlers grey.
    Where there are more than two sizes, a bar says what the colours mean. DP: the fill is the outline with its rim of
    width delta/2, the line inside it the bare polygon. Black lines join the centroids of particles in contact."""
    network = contacts(packing)
    draw_particles(axes, packing, np.where(network.rattlers, RATTLER, size_colours(packing)))
    line_everywhere(axes, contact_lines(network), packing.box, color="black", linewidth=1.1)
    frame_cell(axes, packing.box)
    add_size_bar(axes, packing)
    axes.set_title(title, fontsize=12)


def modulus_figure(spectra: Mapping[str, Spectra], unit: str, title: str = "") -> Figure:
    """Draw storage (solid, filled) and loss modulus (dashed, open) over frequency, log-log, one colour per entry.
    Several packings of an entry: mean and standard error. Dotted: slope 1 from eta_0 and slope 1/2 from G_0 at
    1/tau*."""
    figure = Figure(figsize=(6.4, 4.6), layout="constrained")
    axes = figure.subplots()
    few = len(spectra) <= len(COLOURS)
    colours = COLOURS[: len(spectra)] if few else ordered_colours(len(spectra))
    for colour, (name, s) in zip(colours, spectra.items(), strict=True):
        draw_modulus(axes, s.omega, s.band("storage"), s.band("loss"), label=name, color=colour)
        draw_slopes(axes, s.omega, *s.packings[["g0", "eta0"]].mean())
    label_modulus(axes, unit)
    axes.legend(fontsize=10 if len(spectra) < 3 else 7)
    axes.set_title(title, fontsize=11)
    return figure


OVERLAP = "#6F6F6F"


def draw_overlaps(axes: Any, packing: Packing, title: str = "") -> None:
    """Draw overlaps dark, with the common chords that divide them, as fig 1 of Boromand et al. SP: the chord (white)
    divides the overlap of two disks. DP: rims overlap; the bare polygons are outlined."""
    fills, lines = (move_home(packing, shapes) for shapes in packing.kind.rings(packing))
    shapes = shapely.polygons([shapely.linearrings(fill) for fill in fills])
    moves = lattice_moves(packing.box)
    moved = [shapely.transform(shapes, lambda x, move=move: x + move) for move in moves]
    tree = shapely.STRtree(np.concatenate(moved))
    i, j = tree.query(shapes, predicate="intersects")
    own = i != j - len(moves) // 2 * packing.n  # the move in the middle is the identity
    overlaps = shapely.intersection(shapes[i[own]], tree.geometries[j[own]])
    parts = shapely.get_parts(overlaps)
    parts = parts[shapely.area(parts) > 0]
    look: dict[str, Any] = {"color": OUTLINE, "linewidth": 0.5}
    if packing.diameters is not None:
        lines, look = [*_chords(packing)], {"color": "white", "linewidth": 0.9}
    draw_background(axes, packing)
    shaded = [shapely.get_coordinates(part) for part in parts]
    fill_everywhere(axes, shaded, packing.box, facecolor=OVERLAP, edgecolor="none")
    line_everywhere(axes, lines, packing.box, **look)
    frame_cell(axes, packing.box)
    axes.set_title(title, fontsize=12)
    handles = [
        Patch(facecolor=PARTICLE, edgecolor=OUTLINE, label="particle"),
        Patch(facecolor=OVERLAP, label="overlap"),
    ]
    axes.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, 0), ncols=2)


def _chords(packing: Packing) -> NDArray[np.float64]:
    """Common chords (m, 2, 2) of disks that bound power cells, in the primitive cell."""
    cells = disk_cells(packing)
    chords = cells.chords
    foot = packing.positions[chords.i] + chords.height[:, None] * chords.normal
    foot = foot + moves_home(foot, packing.box)
    along = chords.half[:, None] * np.column_stack([-chords.normal[:, 1], chords.normal[:, 0]])
    return np.asarray(np.stack([foot - along, foot + along], axis=1)[cells.length > 0])
