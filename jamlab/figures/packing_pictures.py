"""Draw packings and curves from packings and tables, without running physics.

Colours are from the colour-blind-safe palette of Okabe & Ito.
"""

from collections.abc import Mapping
from itertools import product
from typing import Any

import matplotlib
import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from jamlab.geometry.contact_network import Contacts, contacts
from jamlab.geometry.rims import rims
from jamlab.packing.packing import Packing
from jamlab.rheology.mean_spectrum import Spectra

matplotlib.use("Agg")

SMALL, LARGE, RATTLER = "#CC79A7", "#0072B2", "#BBBBBB"
MODEL_STYLE = {
    "sp": {"color": "#D55E00", "marker": "v", "label": "soft particles (SP)"},
    "dp": {"color": "#0072B2", "marker": "D", "label": "deformable polygons (DP)"},
}
_ARC = 48  # corners of a drawn disk: a circle to the eye at this size


def draw_packing(axes: Any, packing: Packing, title: str = "") -> None:
    """Draw one periodic cell with its particles, as fig 2 of Boromand et al.: large blue, small pink, rattlers grey.

    DP: the fill is the outline with its rim of width delta/2, the line inside it the bare polygon. Black lines join the
    centroids of particles in contact.
    """
    shapes, edges = particle_shapes(packing)
    network = contacts(packing)
    sizes = packing.diameters if packing.diameters is not None else packing.params["a0"]
    colours = np.where(network.rattlers, RATTLER, np.where(sizes > sizes.mean(), LARGE, SMALL))
    moves = periodic_moves(packing)
    home = home_moves(packing)
    for move in moves:
        offset = home + move
        fills = [shape + shift for shape, shift in zip(shapes, offset, strict=True)]
        axes.add_collection(PolyCollection(fills, facecolors=colours, edgecolors="white", linewidths=0.8, alpha=0.55))
        rings = [edge + shift for edge, shift in zip(edges, offset, strict=True)]
        axes.add_collection(LineCollection(rings, colors="#333333", linewidths=0.6))
    segments = _contact_lines(packing, network, home)
    axes.add_collection(LineCollection(segments, colors="black", linewidths=1.1))
    frame_cell(axes, packing, title)


def periodic_moves(packing: Packing) -> NDArray[np.float64]:
    """(9, 2) translations of the cell to itself and its neighbours."""
    return np.asarray(np.array(list(product((-1, 0, 1), repeat=2))) @ packing.box)


def home_moves(packing: Packing) -> NDArray[np.float64]:
    """(n, 2) translations that bring the centre of each particle into the cell."""
    return np.asarray(-np.floor(packing.centroids @ np.linalg.inv(packing.box)) @ packing.box)


def frame_cell(axes: Any, packing: Packing, title: str) -> None:
    """Draw the outline of the periodic cell, set limits with a margin around it, and remove ticks."""
    corner, margin = packing.box.sum(axis=0), 0.35
    cell = np.array([[0, 0], packing.box[0], corner, packing.box[1], [0, 0]])
    axes.plot(*cell.T, color="black", linewidth=1.4)
    axes.set_xlim(min(0, packing.box[1, 0]) - margin, max(corner[0], packing.box[0, 0]) + margin)
    axes.set_ylim(-margin, corner[1] + margin)
    axes.set_aspect("equal")
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_title(title, fontsize=12)


def packings_figure(packings: Mapping[str, Packing], titles: Mapping[str, str]) -> Figure:
    """Draw packings side by side, one for each model."""
    figure = Figure(figsize=(6.2 * len(packings), 6.4), layout="constrained")
    for axes, (model, packing) in zip(
        figure.subplots(1, len(packings), squeeze=False)[0], packings.items(), strict=True
    ):
        draw_packing(axes, packing, titles[model])
    return figure


def curve_figure(tables: Mapping[str, Mapping[str, NDArray[np.float64]]], column: str, label: str) -> Figure:
    """Draw a measured column over the true packing fraction, one curve per model; the legend counts missing values."""
    figure = Figure(figsize=(6.4, 4.6), layout="constrained")
    axes = figure.subplots()
    for model, table in tables.items():
        style: dict[str, Any] = MODEL_STYLE[model]
        axes.plot(table["rho"], table[column], linewidth=1.4, markersize=6, **style)
        missing = int(np.isnan(table[column]).sum())
        if missing:
            axes.plot([], [], " ", label=f"{missing} {model.upper()} state(s) without a stable value left out")
    axes.set_xlabel(r"true packing fraction $\rho$", fontsize=12)
    axes.set_ylabel(label, fontsize=12)
    axes.tick_params(labelsize=11)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=10)
    return figure


def modulus_figure(spectra: Mapping[str, Spectra], unit: str, title: str = "") -> Figure:
    """Draw storage (solid, filled) and loss modulus (dashed, open) over frequency, log-log, one colour per entry.

    Several packings of an entry: mean and standard error. Dotted: slope 1 from eta_0 and slope 1/2 from G_0 at 1/tau*.
    """
    figure = Figure(figsize=(6.4, 4.6), layout="constrained")
    axes = figure.subplots()
    for colour, (name, s) in zip(_colours(len(spectra)), spectra.items(), strict=True):
        for column, line, fill, label in (("storage", "-o", colour, "G'"), ("loss", "--s", "white", "G''")):
            mean, low, high = s.band(column)
            positive = mean > 0
            left_out = "" if positive.all() else f", {np.sum(~positive)} value(s) below 0 left out"
            mean = np.where(positive, mean, np.nan)
            axes.loglog(
                s.omega,
                mean,
                line,
                color=colour,
                markersize=4,
                markerfacecolor=fill,
                label=f"${label}_{{xy}}$  {name}{left_out}",
            )
            if len(s.members) > 1:
                axes.fill_between(s.omega, np.maximum(low, 1e-3 * mean), high, color=colour, alpha=0.25, linewidth=0)
        _draw_slopes(axes, s)
    axes.set_xlabel(r"angular frequency $\omega\,\tau_1$", fontsize=12)
    axes.set_ylabel(f"complex shear modulus $G^*_{{xy}}$  [{unit}]", fontsize=12)
    axes.tick_params(labelsize=11)
    axes.grid(alpha=0.3, which="major")
    axes.legend(fontsize=10 if len(spectra) < 3 else 7)
    axes.set_title(title, fontsize=11)
    return figure


def _colours(count: int) -> list[Any]:
    """Colours that differ: of the palette, or of a scale where there are more curves than it has."""
    palette: list[Any] = ["#009E73", "#D55E00", "#0072B2", "#CC79A7"]
    return (
        palette[:count] if count <= len(palette) else list(matplotlib.colormaps["viridis"](np.linspace(0, 0.9, count)))
    )


def _draw_slopes(axes: Any, s: Spectra) -> None:
    """Draw dotted lines of slope 1 below 1/tau* and 1/2 above, a little beside the curves."""
    g0, eta0 = s.limit("g0"), s.limit("eta0")
    if not (g0 > 0 and eta0 > 0):
        return
    turn = g0 / eta0
    for low, high, slope, height, beside in ((1e-3, 0.3, 1.0, 0.4, (6, -13)), (3.0, 300.0, 0.5, 2.5, (-9, 5))):
        x = turn * np.array([low, high])
        x = np.clip(x, s.omega.min(), s.omega.max())
        if x[0] >= x[1]:
            continue
        y = height * g0 * (x / turn) ** slope
        axes.loglog(x, y, ":", color="#555555", linewidth=1.4)
        middle = np.sqrt(x[0] * x[1]), np.sqrt(y[0] * y[1])
        axes.annotate(f"{slope:g}", middle, textcoords="offset points", xytext=beside, color="#555555", fontsize=10)


def particle_shapes(packing: Packing) -> tuple[list[NDArray[np.float64]], list[NDArray[np.float64]]]:
    """Rings to fill and rings to outline for each particle, at the place where it is stored.

    Disks: the circle, twice. Droplets: the outline with its rim, and the closed polygon.
    """
    if packing.diameters is not None:
        turn = 2 * np.pi * np.arange(_ARC + 1) / _ARC
        circle = np.column_stack([np.cos(turn), np.sin(turn)])
        disks = [x + 0.5 * d * circle for x, d in zip(packing.positions, packing.diameters, strict=True)]
        return disks, disks
    assert packing.offsets is not None
    polygons = np.split(packing.positions, packing.offsets[1:-1])
    grown = [
        np.asarray(outline.exterior.coords) + centre
        for outline, centre in zip(rims(packing).outlines, packing.centroids, strict=True)
    ]
    return grown, [np.concatenate([polygon, polygon[:1]]) for polygon in polygons]


def _contact_lines(packing: Packing, network: Contacts, home: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Lines between the centroids of particles in contact, each from the cell into the image that is touched."""
    (i, j), r = network.pairs.T, network.r
    centres = packing.centroids + home
    starts, ends = centres[i], centres[j]
    return [np.array(line) for line in [*zip(starts, starts + r, strict=True), *zip(ends, ends - r, strict=True)]]
