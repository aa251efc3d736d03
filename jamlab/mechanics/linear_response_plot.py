"""Draw linear responses at rest: shear modulus over direction, displacements in slow shear, lowest eigenvalues."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from jamlab.arrays import Array
from jamlab.plotting.axes import LEGEND, in_unit, label_axes, merged
from jamlab.plotting.palette import BLACK, BLUE, GREEN, RED


def draw_directions(
    axes: Axes, angles: Array, moduli: Mapping[str, Array], mean: float, unit: str, /, **style: Any
) -> None:
    """Draw moduli (m,) by name over angles (m,), radian; and the mean over angles of the first."""
    for values, name, line, colour in zip(moduli.values(), moduli, ("-", "--"), (BLUE, RED), strict=True):
        look = merged(Line2D, {"color": colour, "linestyle": line, "label": name}, style)
        axes.plot(np.degrees(angles), values, **look)
    axes.axhline(mean, color=BLACK, linestyle=":", linewidth=1.4, label=f"mean, relaxed: {mean:.4g}")
    axes.set_xticks(np.arange(0, 181, 45))
    axes.set_xlim(0, 180)
    axes.margins(y=0.25)
    label_axes(axes, "direction of shear, degrees from x", in_unit("shear modulus $G$", unit))
    axes.legend(fontsize=LEGEND)


def draw_displacements(axes: Axes, parts: Mapping[str, Array], unit: str, /, **style: Any) -> None:
    """Draw the distribution of lengths (m,) by name, as the share that is shorter, on a logarithmic axis."""
    for (name, values), line, colour in zip(parts.items(), ("-", "--", "-."), (BLUE, RED, GREEN), strict=True):
        lengths = values[values > 0]
        zero = len(values) - len(lengths)
        label = f"{name}, median {np.median(values):.3g}" + (f", {zero} that do not move left out" if zero else "")
        if len(lengths):
            axes.ecdf(lengths, **merged(Line2D, {"color": colour, "linestyle": line, "label": label}, style))
    axes.set_xscale("log")
    label_axes(axes, in_unit(r"displacement per strain", unit), "share that is smaller")
    axes.legend(fontsize=LEGEND)


def draw_modes(axes: Axes, eigenvalues: Array, below: int, unit: str, /, **style: Any) -> None:
    """Draw eigenvalues (m,) over their numbers, from 1, so many of them below zero; see `Modes.plot`."""
    label = f"{len(eigenvalues)} lowest modes" + (f", {below} below zero" if below else "")
    plain = {"color": BLUE, "marker": "o", "markersize": 4, "linestyle": "none", "label": label}
    axes.axhline(0.0, color=BLACK, linewidth=0.8)
    axes.plot(np.arange(1, len(eigenvalues) + 1), eigenvalues, **merged(Line2D, plain, style))
    label_axes(axes, "number of the mode", in_unit("eigenvalue of the Hessian", unit))
    axes.legend(fontsize=LEGEND)
