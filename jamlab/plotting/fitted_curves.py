"""Draw points with their errors and the law fitted to them."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from jamlab.arrays import Array
from jamlab.plotting.axes import merged
from jamlab.plotting.drawable import LEGEND, label_axes
from jamlab.plotting.palette import BLACK, BLUE, RED

Points = tuple[Array | None, Array | None, Array | None]  # x, y and errors of y


def draw_fit(
    axes: Axes, x: Array, y: Array, label: str, points: Points, new: bool, x_label: str = "$x$", /, **style: Any
) -> None:
    """Draw a law (m,) and the points that it was fitted to.

    Args:
        axes: to draw into.
        x, y: (m,) of the law.
        label: of the law in the legend.
        points: what it was fitted to, None where that is not known.
        new: whether the axes are new, and get scales and labels.
        x_label: of the x axis.
        style: of the law, matplotlib's Line2D.
    """
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


def draw_limit(axes: Axes, limit: float) -> None:
    """Draw a dotted line at the value that a law tends to."""
    axes.axhline(limit, color=BLACK, linestyle=":", linewidth=1.4, label=f"limit {limit:.4g}")
