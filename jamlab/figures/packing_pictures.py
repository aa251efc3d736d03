"""Draw packings and curves from packings and tables, without running physics.

Colours are from the colour-blind-safe palette of Okabe & Ito.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from jamlab.geometry.contact_network import contact_lines, contacts
from jamlab.packing.packing import Packing
from jamlab.packing.packing_plot import add_size_bar, draw_particles, home_moves, periodic_moves, size_colours
from jamlab.plotting.curves import draw_modulus, draw_slopes, label_modulus
from jamlab.plotting.drawable import label_axes
from jamlab.plotting.palette import COLOURS, MODEL_STYLE, RATTLER, ordered_colours
from jamlab.plotting.periodic_cell import frame_cell, line_everywhere
from jamlab.rheology.mean_spectrum import Spectra

__all__ = [
    "MODEL_STYLE",
    "curve_figure",
    "draw_packing",
    "home_moves",
    "modulus_figure",
    "packings_figure",
    "periodic_moves",
]


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
    label_axes(axes, r"true packing fraction $\rho$", label)
    axes.legend(fontsize=10)
    return figure


def modulus_figure(spectra: Mapping[str, Spectra], unit: str, title: str = "") -> Figure:
    """Draw storage (solid, filled) and loss modulus (dashed, open) over frequency, log-log, one colour per entry.
    Several packings of an entry: mean and standard error. Dotted: slope 1 from eta_0 and slope 1/2 from G_0 at
    1/tau*."""
    figure = Figure(figsize=(6.4, 4.6), layout="constrained")
    axes = figure.subplots()
    for colour, (name, s) in zip(_colours(len(spectra)), spectra.items(), strict=True):
        draw_modulus(axes, s.omega, s.band("storage"), s.band("loss"), label=name, color=colour)
        draw_slopes(axes, s.omega, s.limit("g0"), s.limit("eta0"))
    label_modulus(axes, unit)
    axes.legend(fontsize=10 if len(spectra) < 3 else 7)
    axes.set_title(title, fontsize=11)
    return figure


def _colours(count: int) -> list[Any]:
    """Colours that differ: of the palette, or of a scale where there are more curves than it has."""
    return list(COLOURS[:count]) if count <= len(COLOURS) else ordered_colours(count)
