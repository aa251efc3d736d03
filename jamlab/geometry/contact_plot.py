"""Draw the force network of a packing: lines as wide as the forces of contacts are strong."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from jamlab.checks import is_number
from jamlab.errors import InputError
from jamlab.packing.law_parameters import UNIT_OF_FORCE
from jamlab.packing.packing_plot import draw_background, home_moves
from jamlab.plotting.axes import LEGEND, in_unit, label_axes, legend_below, merged
from jamlab.plotting.palette import BLUE, OUTLINE, PARTICLE, RATTLER
from jamlab.plotting.periodic_cell import frame_cell, line_everywhere

if TYPE_CHECKING:
    from jamlab.geometry.contact_network import Contacts
    from jamlab.packing.packing import Packing

MEAN_WIDTH = 2.0  # points, of the mean force: the strongest of disordered packings are three to four times as strong


def contact_lines(packing: Packing, network: Contacts) -> NDArray[np.float64]:
    """(m, 2, 2) from the centre of i, moved into the cell, to that of the image of j that it touches."""
    starts = (packing.centroids + home_moves(packing))[network.pairs[:, 0]]
    return np.stack([starts, starts + network.r], axis=1)


def draw_force_network(axes: Axes, network: Contacts, /, **style: Any) -> None:
    """Draw pale particles, grey rattlers and the contacts in all their images; see `Contacts.plot`."""
    packing = network.packing
    strength = network.forces.size
    look = merged(LineCollection, {"color": BLUE, "linewidth": MEAN_WIDTH, "capstyle": "round"}, style)
    width = look.pop("linewidth")
    if not is_number(width):
        raise InputError(f"linewidth = {width!r:.60}: give one number, the width of the mean force in points")
    bare = not axes.collections
    if bare:
        draw_background(axes, packing, np.where(network.rattlers, RATTLER, PARTICLE))
    handles: list[Any] = []
    if len(strength):
        mean = float(strength.mean())
        widths = width * strength / mean if mean > 0 else strength  # disks in one place press in no direction
        line_everywhere(axes, contact_lines(packing, network), packing.box, linewidth=widths, **look)
        label = f"mean force {mean:.3g} {UNIT_OF_FORCE[packing.model, packing.units]}"
        handles.append(Line2D([], [], color=look.get("edgecolor", look.get("color")), linewidth=width, label=label))
    else:
        handles.append(Line2D([], [], linestyle="none", label="no contacts"))
    if bare and network.rattlers.any():
        count = int(network.rattlers.sum())
        label = "every particle rattles" if count == packing.n else f"{count} rattler{'s' * (count > 1)}"
        handles.append(Patch(facecolor=RATTLER, edgecolor=OUTLINE, label=label))
    frame_cell(axes, packing.box)
    legend_below(axes, handles)


def draw_lengths(axes: Axes, length: NDArray[np.float64], unit: str, /, **style: Any) -> None:
    """Draw the distribution of contact lengths (m,); see `ContactLengths.plot`."""
    plain = {"color": BLUE, "label": f"{len(length)} contacts, mean {length.mean():.3g}"}
    axes.ecdf(length, **merged(Line2D, plain, style))
    label_axes(axes, in_unit("contact length", unit), "share that is shorter")
    axes.legend(fontsize=LEGEND)
