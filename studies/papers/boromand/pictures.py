"""Draw the pictures of packings in Boromand et al.: fig 2 and the snapshots of fig 8."""

from functools import cache
from typing import Any

import numpy as np
from matplotlib.patches import Patch

from jamlab.geometry.contact_network import contact_lines, contacts
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.geometry.particle_shape import shape_factors
from jamlab.geometry.voids.voids import PLATEAU_BORDER, Voids, voids
from jamlab.packing.hdf5 import read_all_hdf5
from jamlab.packing.neighbors import moves_home
from jamlab.packing.packing import Packing
from jamlab.packing.packing_plot import draw_background, draw_particles, size_colours
from jamlab.plotting.palette import ORANGE, RATTLER, SIDE_COLOURS
from jamlab.plotting.periodic_cell import frame_cell, line_everywhere
from jamlab.protocols.droplets_from_disks import droplets_from_disks
from studies.ensemble_tables import EnsembleTables
from studies.panels import MODEL_STYLE, Drawing, drawing
from studies.papers.statements import caption
from studies.reference_data import MODELS, example_file

CLOSE = 0.13  # side of the close-up of fig 8 over the side of the box, halved
COMPARED_AT, VOIDS_AT = 0.92, 0.97  # rho of figs 2 and 8


@cache
def _examples(model: str, n: int) -> list[tuple[float, Packing]]:
    """Read true packing fraction and packing, in the order of the sweep."""
    return [(packing_fraction(p), p) for p in read_all_hdf5(example_file(model, n))]


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


def _zoom_on_borders(axes: Any, found: Voids) -> None:
    """Zoom on the three-sided void of median shape, and write A into those around it."""
    three = np.flatnonzero(found.sides == 3)
    shapes = found.shape_factor[three]
    middle = found.centroid[three[np.argsort(shapes)[len(three) // 2]]]
    look: dict[str, Any] = {"fontsize": 10, "weight": "bold", "ha": "center", "va": "center"}
    half = CLOSE * float(found.packing.box[0, 0])
    for k in three:
        place = found.centroid[k]
        if (np.abs(place - middle) < 0.9 * half).all():
            axes.annotate(f"{found.shape_factor[k]:.2f}", place, xytext=(36, 0), textcoords="offset points", **look)
    axes.set_xlim(middle[0] - half, middle[0] + half)
    axes.set_ylim(middle[1] - half, middle[1] + half)
    for text in list(axes.texts):
        text.set_clip_on(True)
    ideal = axes.inset_axes([0.72, 0.02, 0.26, 0.26])
    arc = 2j / 3**0.5 + np.exp(1j * np.linspace(-2, -1, 20) * np.pi / 3)  # of the upper of three disks that touch
    border = np.concatenate([arc * np.exp(-2j * np.pi * k / 3) for k in range(3)])
    ideal.fill(border.real, border.imag, facecolor=SIDE_COLOURS[3], edgecolor="black")
    ideal.set(aspect="equal", xlim=(-0.8, 0.8), ylim=(-0.7, 0.9), xticks=[], yticks=[])
    ideal.annotate(f"ideal: {PLATEAU_BORDER:.2f}", (0, 0.72), **look)


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
            text += r"$\mathcal{A}$ of three-sided voids"
        else:
            text += f"{len(found.area)} voids"
        axes.set_title(text, fontsize=11)
    handles = [Patch(facecolor=SIDE_COLOURS[side], edgecolor="black", label=f"{side} sides") for side in (3, 4, 5, 6)]
    out.figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=10)
    return out
