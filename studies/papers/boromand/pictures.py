"""Draw the pictures of packings in Boromand et al.: figs 1, 2, 3 and the snapshots of fig 8."""

from functools import cache
from typing import Any

import numpy as np
from matplotlib.patches import Patch

from jamlab.figures.packing_pictures import draw_overlaps, draw_packing
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.geometry.particle_shape import shape_factors
from jamlab.geometry.voids.voids import voids
from jamlab.packing.hdf5 import read_all
from jamlab.packing.neighbors import moves_home
from jamlab.packing.packing import Packing
from jamlab.packing.packing_plot import draw_background
from jamlab.plotting.palette import GREEN, MODEL_STYLE, SIDE_COLOURS
from jamlab.plotting.periodic_cell import circles, fill_everywhere
from studies.ensemble_tables import EnsembleTables
from studies.panels import Drawing, drawing
from studies.papers.statements import caption
from studies.reference_data import MODELS, example_file

SHAPE_OF_ONE_DISK = 1.025  # of the disk that fig 1 marks
COMPARED_AT, CLOSE_UP_AT, VOIDS_AT = 0.92, 0.99, 0.97  # rho of figs 2, 3 and 8


@cache
def _examples(model: str, n: int) -> list[tuple[float, Packing]]:
    """Read true packing fraction and packing, in the order of the sweep."""
    return [(packing_fraction(p), p) for p in read_all(example_file(model, n))]


def _nearest(model: str, n: int, rho: float) -> tuple[float, Packing]:
    return min(_examples(model, n), key=lambda state: abs(state[0] - rho))


def _mark_centres(out: Drawing, axes: Any, name: str, packing: Packing) -> None:
    """Draw the centres, which the figure keeps as its points."""
    centres = packing.positions
    if packing.offsets is not None:
        centres = np.array([polygon.mean(axis=0) for polygon in np.split(centres, packing.offsets[1:-1])])
    centres = centres + moves_home(centres, packing.box)
    look: dict[str, Any] = {"color": "#333333", "linestyle": "none", "marker": ".", "markersize": 3}
    out.curve(axes, f"centres, {name}", *centres.T, label=None, **look)


def figure_1(tables: EnsembleTables) -> Drawing:
    """Disks with their overlaps at phi = 1, shared half and half."""
    out, (axes,) = drawing("boromand-1", 1, 1, 6.0, 6.2)
    rho, packing = min(_examples("sp", 32), key=lambda state: abs(state[1].phi - 1))
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
    out.caption = caption(out.name)
    return out


def figure_2(tables: EnsembleTables) -> Drawing:
    """Packings of both models near rho = 0.92, with their contacts."""
    out, panels = drawing("boromand-2", 1, 2, 5.4, 5.6)
    for model, axes in zip(MODELS, panels, strict=True):
        rho, packing = _nearest(model, 64, COMPARED_AT)
        text = f"{MODEL_STYLE[model]['label']}: ρ = {rho:.3f}, mean A = {shape_factors(packing).mean():.3f}"
        draw_packing(axes, packing, text)
        _mark_centres(out, axes, model.upper(), packing)
    out.caption = caption(out.name)
    return out


def figure_3(tables: EnsembleTables) -> Drawing:
    """Close-up of droplets near confluence, with the rims of their polygons."""
    out, (whole, close) = drawing("boromand-3", 1, 2, 5.4, 5.6)
    rho, packing = _nearest("dp", 128, CLOSE_UP_AT)
    for axes in (whole, close):
        draw_packing(axes, packing, f"DP: ρ = {rho:.3f}, mean A = {shape_factors(packing).mean():.3f}")
        _mark_centres(out, axes, "DP", packing)
    x, y = packing.positions.T
    out.curve(close, "vertices", x, y, label=None, color="black", linestyle="none", marker="o", markersize=2.5)
    side = float(packing.box[0, 0])
    close.set_xlim(0.35 * side, 0.75 * side)
    close.set_ylim(0.35 * side, 0.75 * side)
    close.set_title("close-up: vertices, polygons, rims", fontsize=12)
    out.caption = caption(out.name)
    return out


def figure_8_snapshots(tables: EnsembleTables) -> Drawing:
    """Voids of both models near confluence, coloured by their number of sides."""
    out, panels = drawing("boromand-8-voids", 1, len(MODELS), 5.4, 5.8)
    for axes, model in zip(panels, MODELS[::-1], strict=True):
        reached, packing = _nearest(model, 64, VOIDS_AT)
        draw_background(axes, packing)
        found = voids(packing)
        found.plot(axes)
        _mark_centres(out, axes, f"{model.upper()}, rho = {reached:.3f}", packing)
        axes.get_legend().remove()
        axes.set_title(f"{model.upper()}, ρ = {reached:.3f}, {len(found.area)} voids", fontsize=11)
    handles = [Patch(facecolor=SIDE_COLOURS[side], edgecolor="black", label=f"{side} sides") for side in (3, 4, 5, 6)]
    out.figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=10)
    out.caption = caption(out.name)
    return out
