"""Draw maps of failure: one mark for each run, whose colour and shape give the verdict."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullLocator

from jamlab.benchmarks.failure_maps.verdict import VERDICTS, Map, Outcome

# Okabe & Ito; filled is good, crosses are bad
_STYLE = {
    "converged": ("o", "#009E73"),
    "stalled": ("s", "#E69F00"),
    "wrong basin": ("D", "#56B4E9"),
    "blew up": ("X", "#D55E00"),
    "refused": ("P", "#000000"),
}
_MOST_TICKS = 10  # with their own labels; more would overlap


def stability_figure(chart: Map, runs: Sequence[Outcome]) -> Figure:
    """Draw one map; a dashed line marks jamlab's default on its axis."""
    figure = Figure(figsize=(7.2, 4.8), layout="constrained")
    axes = figure.subplots()
    x, x_names = _places([run.x for run in runs])
    y, y_names = _places([run.y for run in runs])
    for verdict in VERDICTS:
        here = np.array([run.verdict == verdict for run in runs])
        marker, colour = _STYLE[verdict]
        axes.plot(x[here], y[here], marker, color=colour, markersize=12, linestyle="")
    _set_scale(axes.xaxis, axes.set_xscale, x, x_names)
    _set_scale(axes.yaxis, axes.set_yscale, y, y_names)
    axes.margins(0.12)
    for value, line in ((chart.mark[0], axes.axvline), (chart.mark[1], axes.axhline)):
        if isinstance(value, int | float):
            line(value, color="#777777", linestyle="--", linewidth=1.2, zorder=0)
    axes.set_xlabel(chart.x, fontsize=12)
    axes.set_ylabel(chart.y, fontsize=12)
    axes.set_title(chart.title, fontsize=12)
    axes.tick_params(labelsize=11)
    axes.grid(alpha=0.25)
    found = [verdict for verdict in VERDICTS if any(run.verdict == verdict for run in runs)]
    handles = [
        Line2D([], [], linestyle="", marker=_STYLE[v][0], color=_STYLE[v][1], markersize=10, label=v) for v in found
    ]
    if any(isinstance(value, int | float) for value in chart.mark):
        handles.append(Line2D([], [], color="#777777", linestyle="--", label="jamlab's default"))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), fontsize=10)
    return figure


def _places(values: list[float | str]) -> tuple[np.ndarray, list[str]]:
    """Places on an axis: numbers as they are, or the ranks of names, with the names."""
    if not any(isinstance(value, str) for value in values):
        return np.array(values, dtype=np.float64), []
    names = list(dict.fromkeys(str(value) for value in values))
    return np.array([names.index(str(value)) for value in values], dtype=np.float64), names


def _set_scale(axis: Any, set_scale: Any, places: np.ndarray, names: list[str]) -> None:
    if names:
        axis.set_ticks(range(len(names)), names)
        return
    values = np.unique(places)
    if places.min() > 0 and places.max() / places.min() > 5:
        set_scale("log")
    if len(values) <= _MOST_TICKS:
        axis.set_ticks(values, [f"{value:.3g}" for value in values])
        axis.set_minor_locator(NullLocator())
