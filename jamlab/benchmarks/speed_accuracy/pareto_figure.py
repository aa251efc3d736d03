"""Draw speed-accuracy charts: seconds along x, error along y, dominated points grey, jamlab's default in a ring."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter

from jamlab.benchmarks.speed_accuracy.trial import FLOOR, Topic, Trial, dominated

# Okabe & Ito, grey left for what is dominated
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8C510A")
_MARKERS = "osD^vP*X"
_GREY = "#B8B8B8"
_COLUMNS = 3  # of panels; four where they fill the rows of more than eight
_CROWDED = 12  # points of a panel above which dominated ones have no label


def pareto_figure(topic: Topic, trials: Sequence[Trial]) -> Figure:
    """Draw one panel for each `Trial.panel`; its title counts the points that gave no number."""
    panels = list(dict.fromkeys(t.panel for t in trials))
    methods = list(dict.fromkeys(t.method for t in trials))
    style = {m: (_COLOURS[k % 8], _MARKERS[k % 8]) for k, m in enumerate(methods)}
    beaten = dict(zip(map(id, trials), dominated(trials), strict=True))
    columns = 4 if len(panels) > 8 and len(panels) % 4 == 0 else min(_COLUMNS, len(panels))
    rows = -(-len(panels) // columns)
    figure = Figure(figsize=(4.9 * columns, 3.9 * rows + 1.0), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, panel in zip(grid, panels, strict=False):
        here = [t for t in trials if t.panel == panel]
        labelled = len({t.setting for t in here}) > 1
        drawn = [t for t in here if np.isfinite(t.error) and np.isfinite(t.seconds)]
        for t in drawn:
            colour, marker = style[t.method]
            grey = beaten[id(t)]
            x, y = t.seconds, max(t.error, FLOOR)
            axes.loglog(x, y, marker, color=_GREY if grey else colour, markersize=8, zorder=2 if grey else 3)
            if t.default:
                axes.loglog(x, y, "o", markersize=17, markerfacecolor="none", markeredgecolor="black", zorder=4)
            if t.setting and labelled and (t.default or not grey or len(drawn) <= _CROWDED):
                tint = "#888888" if grey else "black"
                axes.annotate(t.setting, (x, y), (7, 5), textcoords="offset points", fontsize=8, color=tint)
        front = sorted((t.seconds, max(t.error, FLOOR)) for t in drawn if not beaten[id(t)])
        if len(front) > 1:
            axes.plot(*zip(*front, strict=True), "-", color="#555555", linewidth=1, zorder=1)
        missing = len(here) - len(drawn)
        axes.set_title(panel + (f"\n({missing} gave no number: see table)" if missing else ""), fontsize=11)
        axes.set_xlabel("CPU time on one core, s", fontsize=11)
        axes.set_ylabel(topic.error, fontsize=11)
        axes.margins(0.16)
        for limits, set_limits in ((axes.get_xlim, axes.set_xlim), (axes.get_ylim, axes.set_ylim)):
            set_limits(_widen(*limits()))
        axes.grid(alpha=0.3, which="major")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_minor_formatter(NullFormatter())
            axis.set_major_locator(LogLocator(numticks=7))
    for axes in grid[len(panels) :]:
        axes.set_axis_off()
    figure.suptitle(topic.title, fontsize=14)
    figure.legend(handles=_handles(style), loc="outside lower center", ncols=min(5, len(methods) + 2), fontsize=9)
    return figure


def _widen(low: float, high: float) -> tuple[float, float]:
    """Widen the limits of a logarithmic axis until a labelled power of ten surely lies within."""
    spare = max(0.0, 1.5 - np.log10(high / low)) / 2
    return low / 10**spare, high * 10**spare


def _handles(style: dict[str, tuple[str, str]]) -> list[Line2D]:
    handles = [Line2D([], [], linestyle="", marker=m, color=c, markersize=8, label=n) for n, (c, m) in style.items()]
    handles.append(Line2D([], [], linestyle="", marker="s", color=_GREY, markersize=8, label="dominated"))
    ring = Line2D([], [], linestyle="", marker="o", markersize=14, markerfacecolor="none", color="black")
    ring.set_label("jamlab's default")
    handles.append(ring)
    return handles
