"""Draw the pictures of packings in Boromand et al.: figs 1, 2, 3 and the snapshots of fig 8."""

from functools import cache
from typing import Any

import numpy as np
import shapely
from matplotlib.patches import Patch
from shapely import LinearRing
from shapely.ops import nearest_points

from jamlab.geometry.contact_network import contact_lines, contacts
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.geometry.particle_shape import shape_factors
from jamlab.geometry.power_cells import disk_cells
from jamlab.geometry.voids.voids import PLATEAU_BORDER, Voids, voids
from jamlab.models.pair_laws import RimLaw
from jamlab.packing.hdf5 import read_all
from jamlab.packing.neighbors import moves_home
from jamlab.packing.packing import Packing
from jamlab.packing.packing_plot import draw_background, draw_particles, move_home, size_colours
from jamlab.plotting.palette import GREEN, MODEL_STYLE, ORANGE, OUTLINE, PARTICLE, RATTLER, SIDE_COLOURS
from jamlab.plotting.periodic_cell import circles, fill_everywhere, frame_cell, lattice_moves, line_everywhere
from jamlab.protocols.compression import compress
from jamlab.protocols.droplets_from_disks import droplets_from_disks
from studies.ensemble_tables import EnsembleTables
from studies.panels import Drawing, drawing
from studies.papers.statements import caption
from studies.reference_data import MODELS, example_file

OVERLAP = "#6F6F6F"
SHAPE_OF_ONE_DISK = 1.025  # of the disk that fig 1 marks
CLOSE = 0.13  # half the side of the close-up of fig 8, over that of the box
COMPARED_AT, CLOSE_UP_AT, VOIDS_AT = 0.92, 0.99, 0.97  # rho of figs 2, 3 and 8


@cache
def _examples(model: str, n: int) -> list[tuple[float, Packing]]:
    """Read true packing fraction and packing, in the order of the sweep."""
    return [(packing_fraction(p), p) for p in read_all(example_file(model, n))]


def _nearest(model: str, n: int, rho: float) -> tuple[float, Packing]:
    return min(_examples(model, n), key=lambda state: abs(state[0] - rho))


def _mark_centres(out: Drawing, axes: Any, name: str, packing: Packing) -> None:
    """Draw the centres, which the figure keeps as its points; what fills the particles below is pixels in a PDF."""
    axes.set_rasterization_zorder(1.9)
    centres = packing.positions
    if packing.offsets is not None:
        centres = np.array([polygon.mean(axis=0) for polygon in np.split(centres, packing.offsets[1:-1])])
    centres = centres + moves_home(centres, packing.box)
    look: dict[str, Any] = {"color": "#333333", "linestyle": "none", "marker": ".", "markersize": 3}
    out.curve(axes, f"centres, {name}", *centres.T, label=None, **look)


def draw_packing(axes: Any, packing: Packing, title: str) -> None:
    """Draw particles, rattlers grey, and black lines between the centroids of those in contact."""
    network = contacts(packing)
    draw_particles(axes, packing, np.where(network.rattlers, RATTLER, size_colours(packing)))
    line_everywhere(axes, contact_lines(network), packing.box, color="black", linewidth=1.1)
    frame_cell(axes, packing.box)
    axes.set_title(title, fontsize=12)


def draw_overlaps(axes: Any, packing: Packing) -> None:
    """Draw the overlaps of disks dark, with the common chords (white) that divide them."""
    shapes = shapely.polygons(move_home(packing, packing.kind.rings(packing)[0]))
    moves = lattice_moves(packing.box)
    tree = shapely.STRtree(
        [shapely.transform(shape, lambda x, move=move: x + move) for move in moves for shape in shapes]
    )
    i, j = tree.query(shapes, predicate="intersects")
    own = i != j - len(moves) // 2 * packing.n  # the move in the middle is the identity
    lenses = shapely.intersection(shapes[i[own]], tree.geometries[j[own]])
    draw_background(axes, packing)
    shaded = [shapely.get_coordinates(lens) for lens in lenses[shapely.area(lenses) > 0]]
    fill_everywhere(axes, shaded, packing.box, facecolor=OVERLAP, edgecolor="none")
    cells = disk_cells(packing)
    chords = cells.chords
    foot = packing.positions[chords.i] + chords.height[:, None] * chords.normal
    foot = foot + moves_home(foot, packing.box)
    along = chords.half[:, None] * np.column_stack([-chords.normal[:, 1], chords.normal[:, 0]])
    lines = np.stack([foot - along, foot + along], axis=1)[cells.length > 0]
    line_everywhere(axes, lines, packing.box, color="white", linewidth=0.9)
    frame_cell(axes, packing.box)
    handles = [
        Patch(facecolor=PARTICLE, edgecolor=OUTLINE, label="particle"),
        Patch(facecolor=OVERLAP, label="overlap"),
    ]
    axes.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, 0), ncols=2)


def figure_1(tables: EnsembleTables) -> Drawing:
    """Disks with their overlaps at phi = 1, shared half and half."""
    out, (axes,) = drawing("boromand-1", 1, 1, 6.0, 6.2)
    before = max((p for _, p in _examples("sp", 32) if p.phi < 1), key=lambda p: p.phi)
    *_, packing = compress(before, 1.0, by="phi")
    rho = packing_fraction(packing)
    shapes = shape_factors(packing)
    chosen = int(np.abs(shapes - SHAPE_OF_ONE_DISK).argmin())
    draw_overlaps(axes, packing)
    assert packing.diameters is not None
    disk = circles(packing.positions[chosen : chosen + 1], packing.diameters[chosen : chosen + 1])
    fill_everywhere(axes, disk, packing.box, facecolor=GREEN, alpha=0.5, edgecolor=GREEN, linewidth=1.5)
    _mark_centres(out, axes, "SP", packing)
    axes.set_title(
        rf"SP, $\phi$ = {packing.phi:.3f}, $\rho$ = {rho:.3f}; green: $\mathcal{{A}}$ = {shapes[chosen]:.3f}"
    )
    return out


def figure_2(tables: EnsembleTables) -> Drawing:
    """Disks and the droplets that they become at the same rho, with contacts that one has and the other has not."""
    out, panels = drawing("boromand-2", 1, 2, 5.4, 5.9)
    disks = _nearest("sp", 64, COMPARED_AT)[1]
    both = contacts(disks), contacts(droplets_from_disks(disks))
    pairs = [{(i, j, *shift) for (i, j), shift in zip(c.pairs.tolist(), c.shift.tolist(), strict=True)} for c in both]
    for k, (axes, network) in enumerate(zip(panels, both, strict=True)):
        packing, name = network.packing, MODEL_STYLE[MODELS[k]]["label"]
        text = f"({axes.get_gid()}) {name}: ρ = {packing_fraction(packing):.3f}"
        draw_packing(axes, packing, f"{text}, mean A = {shape_factors(packing).mean():.3f}")
        own = [pair not in pairs[1 - k] for pair in sorted(pairs[k])]
        order = sorted(range(len(network.pairs)), key=lambda m: (*network.pairs[m], *network.shift[m]))
        lines = contact_lines(network)[order][own]
        line_everywhere(axes, lines, packing.box, color=ORANGE, linewidth=4.0, alpha=0.9)
        _mark_centres(out, axes, MODELS[k].upper(), packing)
    only = [len(pairs[k] - pairs[1 - k]) for k in (0, 1)]
    out.caption = caption(out.name, disks=only[0], droplets=only[1], shared=len(pairs[0] & pairs[1]))
    return out


def figure_3(tables: EnsembleTables) -> Drawing:
    """Close-up of droplets near confluence, with the rims of their polygons, and of two that interact."""
    out, (whole, close, pair) = drawing("boromand-3", 1, 3, 5.0, 5.5)
    rho, packing = _nearest("dp", 128, CLOSE_UP_AT)
    for axes in (whole, close, pair):
        draw_packing(axes, packing, f"DP: ρ = {rho:.3f}, mean A = {shape_factors(packing).mean():.3f}")
        _mark_centres(out, axes, "DP", packing)
    x, y = packing.positions.T
    for axes in (close, pair):
        out.curve(axes, "vertices", x, y, label=None, color="black", linestyle="none", marker="o", markersize=2.5)
    side = float(packing.box[0, 0])
    close.set_xlim(0.35 * side, 0.75 * side)
    close.set_ylim(0.35 * side, 0.75 * side)
    close.set_title("close-up: vertices, polygons, rims", fontsize=12)
    _zoom_on_a_contact(pair, packing)
    return out


def _zoom_on_a_contact(axes: Any, packing: Packing) -> None:
    """Zoom on the first two droplets in contact that no boundary parts, and mark delta and d_min of their rims."""
    network = contacts(packing)
    polygons = np.split(packing.positions, network.packing.offsets[1:-1])  # type: ignore[index]
    i, j = network.pairs[(network.shift == 0).all(axis=1)][0]
    rings = [LinearRing(polygons[k]) for k in (i, j)]
    here, there = (np.array(point.coords[0]) for point in nearest_points(*rings))
    across = (there - here) / np.linalg.norm(there - here)
    assert isinstance(packing.law, RimLaw)
    width = packing.law.delta
    axes.plot(*np.array([here, there]).T, color="red", linewidth=2.5)
    axes.annotate(
        r"$d_{min}$", 0.5 * (here + there), xytext=(14, 0), textcoords="offset points", color="red", fontsize=13
    )
    edges = np.roll(polygons[i], -1, axis=0) - polygons[i]
    middles = polygons[i] + 0.5 * edges
    away = np.linalg.norm(middles - here, axis=1)
    k = int(
        np.where(away > width, away, np.inf).argmin()
    )  # an edge apart from the contact, across which delta is drawn
    half = 0.5 * width * np.array([-edges[k, 1], edges[k, 0]]) / np.linalg.norm(edges[k])
    arrow: dict[str, Any] = {"arrowstyle": "<->", "linewidth": 1.5, "color": "black", "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", middles[k] + half, middles[k] - half, arrowprops=arrow)
    axes.annotate(r"$\delta$", middles[k] + half, xytext=(6, 4), textcoords="offset points", fontsize=14)
    for name, point, way in (("m", here, -1), ("n", there, 1)):
        axes.text(*(point + way * 1.6 * width * across), f"${name}$", fontsize=16, ha="center", va="center")
    middle = 0.5 * (here + there)
    axes.set_xlim(middle[0] - 2.6 * width, middle[0] + 2.6 * width)
    axes.set_ylim(middle[1] - 2.6 * width, middle[1] + 2.6 * width)
    axes.set_title("two droplets", fontsize=12)


def _zoom_on_borders(axes: Any, found: Voids) -> None:
    """Zoom on the three-sided void of median shape, and write A into those around it."""
    three = np.flatnonzero(found.sides == 3)
    shapes = found.shape[three]
    middle = found.centroid[three[np.argsort(shapes)[len(three) // 2]]]
    box = {"facecolor": "white", "alpha": 0.7, "linewidth": 0, "pad": 1}
    look: dict[str, Any] = {"fontsize": 10, "weight": "bold", "ha": "center", "va": "center", "bbox": box}
    half = CLOSE * float(found.packing.box[0, 0])
    for k in three:
        place = found.centroid[k]
        if (np.abs(place - middle) < 0.9 * half).all():
            axes.annotate(f"{found.shape[k]:.2f}", place, **look)
    axes.set_xlim(middle[0] - half, middle[0] + half)
    axes.set_ylim(middle[1] - half, middle[1] + half)
    for text in list(axes.texts):
        text.set_clip_on(True)


def figure_8_snapshots(tables: EnsembleTables) -> Drawing:
    """Voids of both models near confluence, coloured by their number of sides."""
    out, panels = drawing("boromand-8-voids", 1, 3, 5.0, 6.0)
    for axes, model in zip(panels, ("dp", "sp", "dp"), strict=True):
        reached, packing = _nearest(model, 64, VOIDS_AT)
        draw_background(axes, packing)
        found = voids(packing)
        found.plot(axes)
        _mark_centres(out, axes, f"{model.upper()}, rho = {reached:.3f}", packing)
        axes.get_legend().remove()
        text = f"({axes.get_gid()}) {model.upper()}, ρ = {reached:.3f}, "
        if axes is panels[-1]:
            _zoom_on_borders(axes, found)
            text += rf"$\mathcal{{A}}$ of three-sided voids, ideal {PLATEAU_BORDER:.2f}"
        else:
            text += f"{len(found.area)} voids"
        axes.set_title(text, fontsize=11)
    handles = [Patch(facecolor=SIDE_COLOURS[side], edgecolor="black", label=f"{side} sides") for side in (3, 4, 5, 6)]
    out.figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=10)
    return out
