"""Curves of plain arrays: complex moduli on logarithmic axes, and points with the law fitted to them.

What a logarithm cannot show is counted in the legend.
"""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from jamlab.arrays import Array
from jamlab.plotting.axes import merged
from jamlab.plotting.drawable import LEGEND, in_unit, label_axes, positive
from jamlab.plotting.palette import BLUE, COLOURS, RED

Points = tuple[Array | None, Array | None, Array | None]  # x, y and errors of y


def draw_fit(
    axes: Axes, x: Array, y: Array, label: str, points: Points, new: bool, x_label: str = "$x$", /, **style: Any
) -> None:
    """Draw a law (m,) and the points that it was fitted to, if they are known; new axes get scales and labels."""
    px, py, error = points
    if new:
        label_axes(axes, x_label, "$y$")
        axes.set_xscale("log")
        if np.all(y > 0) and (py is None or np.all(py > 0)) and y.max() > 3 * y.min():
            axes.set_yscale("log")
    if px is not None and py is not None:
        axes.errorbar(px, py, error, fmt="o", color=BLUE, markersize=5, capsize=2.5, label=f"{len(px)} points")
    axes.plot(x, y, **merged(Line2D, {"color": RED, "linewidth": 1.6, "label": label}, style))
    axes.legend(fontsize=LEGEND)


Band = tuple[Array, Array, Array]  # mean, and the ends of its interval


def draw_modulus(
    axes: Axes, omega: Array, storage: Array | Band, loss: Array | Band, /, label: str = "", index: str = "xy",
    **style: Any,
) -> None:  # fmt: skip
    """Draw G' (solid, filled) and G'' (dashed, open) over frequency (m,), each (m,) or a mean with both ends of a
    band; `index` names the direction of shear."""
    colour = COLOURS[len(axes.lines) // 2 % len(COLOURS)]
    looks = (("G'", storage, {"linestyle": "-", "marker": "o"}), ("G''", loss, {"linestyle": "--", "marker": "s"}))
    for symbol, values, look in looks:
        mean, low, high = values if isinstance(values, tuple) else (values, values, values)
        look = merged(Line2D, {"color": colour, "markersize": 4, **look}, style)
        if symbol == "G''":
            look.setdefault("markerfacecolor", "white")
        mean, left_out = positive(mean)
        axes.loglog(omega, mean, label=f"${symbol}_{{{index}}}$" + (f"  {label}" if label else "") + left_out, **look)
        if np.any(high > low):
            bottom = np.maximum(low, 1e-3 * mean)
            axes.fill_between(omega, bottom, high, color=look["color"], alpha=0.25, linewidth=0)


def label_modulus(axes: Axes, unit: str, legend: bool = False, index: str = "xy") -> None:
    """Name frequency and modulus with their units, and add a legend if asked for."""
    label_axes(axes, r"angular frequency $\omega\,\tau_1$", in_unit(f"complex shear modulus $G^*_{{{index}}}$", unit))
    if legend:
        axes.legend(fontsize=LEGEND)
