"""Draw the geometry of packings: voids by number of sides, cells with local packing fraction, overlaps.

Colours are from the palette of Okabe & Ito and from cividis, both safe for the colour-blind; voids carry their number
of sides as a digit too.
"""

from __future__ import annotations

from typing import Any

import matplotlib
import numpy as np
import shapely
from matplotlib.collections import LineCollection, PathCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.path import Path
from numpy.typing import NDArray

from jamlab.checks import checked
from jamlab.figures.packing_pictures import frame_cell, home_moves, particle_shapes, periodic_moves
from jamlab.geometry.power_cells import disk_cells
from jamlab.geometry.tessellation import local_packing_fraction, tessellation
from jamlab.geometry.voids.voids import Voids, voids
from jamlab.packing.packing import Packing

SIDE_COLOURS = {3: "#D55E00", 4: "#56B4E9", 5: "#F0E442", 6: "#CC79A7"}
OTHER = "#009E73"  # voids with another number of sides
PARTICLE, OUTLINE, OVERLAP = "#E4E4E4", "#777777", "#6F6F6F"
_ARC_STEP = 0.05  # radians, of drawn arcs
_LABELLED = 0.03  # voids larger than this fraction of the cell per particle have room for a digit


def draw_voids(axes: Any, packing: Packing, title: str = "") -> Voids:
    """Draw a packing with its voids, coloured and labelled by number of sides as fig 8 of Boromand et al.

    A void that percolates is left white. Islands inside a void show the particles.

    Returns:
        The voids that were drawn.
    """
    found = voids(packing)
    _draw_particles(axes, packing)
    paths = void_paths(packing, found)
    closed = np.flatnonzero(found.percolating == 0)
    colours = [SIDE_COLOURS.get(int(found.sides[k]), OTHER) for k in closed]
    for move in periodic_moves(packing):
        moved = [Path(paths[k].vertices + move, paths[k].codes) for k in closed]
        axes.add_collection(PathCollection(moved, facecolors=colours, edgecolors="black", linewidths=0.5))
    for k in closed[found.area[closed] > _LABELLED * packing.area / packing.n]:
        axes.text(*found.centroid[k], str(found.sides[k]), ha="center", va="center", fontsize=7)
    frame_cell(axes, packing, title)
    present = sorted({int(found.sides[k]) for k in closed})
    handles = [Patch(facecolor=SIDE_COLOURS[s], edgecolor="black", label=f"{s}") for s in present if s in SIDE_COLOURS]
    if any(s not in SIDE_COLOURS for s in present):
        handles.append(Patch(facecolor=OTHER, edgecolor="black", label="other"))
    if (found.percolating > 0).any():
        handles.append(Patch(facecolor="white", edgecolor="black", label="percolates"))
    if handles:
        axes.legend(
            handles=handles,
            title="sides of voids",
            loc="upper center",
            bbox_to_anchor=(0.5, -0.01),
            ncols=6,
            fontsize=9,
        )
    return found


def void_paths(packing: Packing, found: Voids) -> list[Path]:
    """Path of each void near its centroid, with islands cut out; arcs become chords of 0.05 radians."""
    boundary = found.boundary
    pieces, place = boundary.pieces, found.image @ packing.box
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
            vertices = vertices - np.round(middle @ np.linalg.inv(packing.box)) @ packing.box
        paths.append(Path(vertices, np.concatenate(codes)))
    return paths


def draw_cells(axes: Any, packing: Packing, title: str = "") -> None:
    """Draw power cells (SP) or set-Voronoi cells (DP), particles coloured by their local packing fraction."""
    fraction, walls = local_packing_fraction(packing), tessellation(packing).lines
    norm = matplotlib.colors.Normalize(np.nanmin(fraction), np.nanmax(fraction))
    colours = matplotlib.colormaps["cividis"](norm(fraction))
    fills = _move_home(packing, particle_shapes(packing)[0])
    walls = walls - (np.floor(walls.mean(axis=1) @ np.linalg.inv(packing.box)) @ packing.box)[:, None]
    for move in periodic_moves(packing):
        axes.add_collection(PolyCollection([fill + move for fill in fills], facecolors=colours))
        axes.add_collection(LineCollection([*(walls + move)], colors="#D55E00", linewidths=1.0))
    frame_cell(axes, packing, title)
    mappable = matplotlib.cm.ScalarMappable(norm, "cividis")
    axes.figure.colorbar(mappable, ax=axes, label="local packing fraction", shrink=0.8)


def draw_overlaps(axes: Any, packing: Packing, title: str = "") -> None:
    """Draw overlaps dark, with the common chords that divide them, as fig 1 of Boromand et al.

    SP: the chord (white) divides the overlap of two disks. DP: rims overlap; the bare polygons are outlined.
    """
    fills, lines = (_move_home(packing, shapes) for shapes in particle_shapes(packing))
    shapes = shapely.polygons([shapely.linearrings(fill) for fill in fills])
    moved = [shapely.transform(shapes, lambda x, move=move: x + move) for move in periodic_moves(packing)]
    tree = shapely.STRtree(np.concatenate(moved))
    i, j = tree.query(shapes, predicate="intersects")
    own = i != j - 4 * packing.n  # the fifth of the nine moves is the identity
    overlaps = shapely.intersection(shapes[i[own]], tree.geometries[j[own]])
    parts = shapely.get_parts(overlaps)
    parts = parts[shapely.area(parts) > 0]
    chords = _chords(packing) if packing.diameters is not None else lines
    colour, width = ("white", 0.9) if packing.diameters is not None else (OUTLINE, 0.5)
    for move in periodic_moves(packing):
        axes.add_collection(PolyCollection([fill + move for fill in fills], facecolors=PARTICLE, edgecolors=OUTLINE))
    for move in periodic_moves(packing):
        shaded = [shapely.get_coordinates(part) + move for part in parts]
        axes.add_collection(PolyCollection(shaded, facecolors=OVERLAP, edgecolors="none"))
        axes.add_collection(LineCollection([line + move for line in chords], colors=colour, linewidths=width))
    frame_cell(axes, packing, title)
    handles = [
        Patch(facecolor=PARTICLE, edgecolor=OUTLINE, label="particle"),
        Patch(facecolor=OVERLAP, label="overlap"),
    ]
    axes.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, 0), ncols=2)


@checked
def geometry_figure(packing: Packing) -> Figure:
    """Draw overlaps, voids and cells of one packing side by side."""
    figure = Figure(figsize=(16.5, 6.6), layout="constrained")
    axes = figure.subplots(1, 3)
    draw_overlaps(axes[0], packing, "overlaps")
    found = draw_voids(axes[1], packing)
    rho = 1 - found.area.sum() / packing.area
    axes[1].set_title(rf"{len(found.area)} voids, $\rho$ = {rho:.4f}", fontsize=12)
    kind = "power cells" if packing.model == "sp" else "set-Voronoi cells"
    draw_cells(axes[2], packing, kind)
    return figure


def _draw_particles(axes: Any, packing: Packing) -> None:
    fills = _move_home(packing, particle_shapes(packing)[0])
    for move in periodic_moves(packing):
        moved = [fill + move for fill in fills]
        axes.add_collection(PolyCollection(moved, facecolors=PARTICLE, edgecolors=OUTLINE, linewidths=0.6))


def _move_home(packing: Packing, shapes: list[NDArray[np.float64]]) -> list[NDArray[np.float64]]:
    """Move the shapes of particles so that their centres lie inside the cell."""
    return [shape + move for shape, move in zip(shapes, home_moves(packing), strict=True)]


def _chords(packing: Packing) -> NDArray[np.float64]:
    """Common chords (m, 2, 2) of disks that bound power cells, in the primitive cell."""
    cells = disk_cells(packing)
    assert packing.diameters is not None
    half = np.sqrt(np.maximum((0.5 * packing.diameters[cells.chord_i]) ** 2 - cells.chord_height**2, 0.0))
    kept = cells.chord_length > 0
    foot = packing.positions[cells.chord_i] + cells.chord_height[:, None] * cells.chord_normal
    foot = foot - np.floor(foot @ np.linalg.inv(packing.box)) @ packing.box
    along = half[:, None] * np.column_stack([-cells.chord_normal[:, 1], cells.chord_normal[:, 0]])
    return np.asarray(np.stack([foot - along, foot + along], axis=1)[kept])
