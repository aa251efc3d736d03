"""Complex moduli on logarithmic axes; what a logarithm cannot show is counted in the legend."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from jamlab.arrays import Array
from jamlab.plotting.axes import merged
from jamlab.plotting.drawable import LEGEND, in_unit, label_axes, positive
from jamlab.plotting.palette import COLOURS

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
