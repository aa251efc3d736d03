"""Draw a map of failure: a cell for every pair of conditions, filled by the shares of how its runs ended."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke

from jamlab.plotting.drawable import LABEL, LEGEND, TICK
from jamlab.plotting.palette import GREEN, GREY, ORANGE, PINK, RED, SKY
from jamlab.studies.failure.map import Axis, Map, limits_of_rows, shares
from jamlab.studies.failure.verdict import SILENT, VERDICTS

# Okabe & Ito; from the bottom of a cell to its top. Pale where all is well or said, strong where numbers are lost.
COLOURS = {
    "converged": GREEN,
    "another basin": SKY,
    "stalled": ORANGE,
    "blew up": RED,
    "refused": GREY,
    SILENT: PINK,
}
_FILLED = 0.9  # of a cell, so that cells stand apart
_SIZE = (7.6, 5.6)
_LONG = 36  # letters of a label, from which on three do not fit side by side


def failure_figure(chart: Map, table: pd.DataFrame) -> Figure:
    """Draw a map from its table; a solid line is the limit of theory, dashed lines are jamlab's defaults."""
    figure = Figure(figsize=_SIZE, layout="constrained")
    axes = figure.subplots()
    handles = [
        *_fill_cells(axes, chart, table),
        *_draw_limit(axes, chart, table),
        *_draw_defaults(axes, chart),
    ]
    for axis, ticks, labels, name in (
        (chart.x, axes.set_xticks, axes.set_xticklabels, axes.set_xlabel),
        (chart.y, axes.set_yticks, axes.set_yticklabels, axes.set_ylabel),
    ):
        ticks(range(len(axis.values)))
        labels([tick_text(value) for value in axis.values], fontsize=TICK - 1)
        name(axis.label, fontsize=LABEL)
    if max(len(tick_text(value)) for value in chart.x.values) > 4:
        axes.tick_params(axis="x", rotation=45)
    axes.tick_params(length=0)
    axes.set_xlim(-0.55, len(chart.x.values) - 0.45)
    axes.set_ylim(-0.55, len(chart.y.values) - 0.45)
    for spine in axes.spines.values():
        spine.set_visible(False)
    axes.set_title(chart.title, fontsize=LABEL)
    columns = 3 if max(len(str(handle.get_label())) for handle in handles) < _LONG else 2
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, fontsize=LEGEND, frameon=False)
    return figure


def tick_text(value: float | str) -> str:
    """A value beside its cell; powers of ten as such."""
    if isinstance(value, str):
        return value
    if value and not 1e-2 <= abs(value) < 1e4:
        exponent = int(np.floor(np.log10(abs(value)) + 1e-9))
        digits = f"{value / 10.0**exponent:.2g}"
        return f"$10^{{{exponent}}}$" if digits == "1" else f"${digits}\\cdot10^{{{exponent}}}$"
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"


def _fill_cells(axes: Axes, chart: Map, table: pd.DataFrame) -> list[Patch]:
    height, width = len(chart.y.values), len(chart.x.values)
    columns, rows = (grid.ravel() for grid in np.meshgrid(np.arange(width), np.arange(height)))
    floor = rows - 0.5 * _FILLED
    handles = []
    for verdict in VERDICTS:
        share = np.nan_to_num(shares(chart, table, verdict)).ravel()
        some = share > 0
        hatch = "xxx" if verdict == SILENT else None
        axes.bar(
            columns[some],
            _FILLED * share[some],
            _FILLED,
            floor[some],
            facecolor=COLOURS[verdict],
            edgecolor="black" if hatch else "none",
            hatch=hatch,
            linewidth=0,
        )
        floor = floor + _FILLED * share
        count = int(table[verdict].sum())
        if count or verdict == SILENT:
            name = {SILENT: "silent wrong number", "another basin": chart.elsewhere}.get(verdict, verdict)
            handles.append(Patch(facecolor=COLOURS[verdict], hatch=hatch, label=f"{name}: {count}"))
    return handles


def _draw_limit(axes: Axes, chart: Map, table: pd.DataFrame) -> list[Line2D]:
    """The limit of theory, one place in every row."""
    if chart.limit is None:
        return []
    limits = limits_of_rows(chart, table)
    rows = np.flatnonzero(np.isfinite(limits))
    if not len(rows):
        return []
    places = chart.x.places(limits[rows])
    if len(rows) == 1:
        places, rows = np.repeat(places, 2), np.array([rows[0] - 0.5, rows[0] + 0.5])
    line = axes.plot(places, rows, color="black", linewidth=2.2, path_effects=[withStroke(linewidth=5, foreground="w")])
    line[0].set_label(chart.limit_label)
    return line


def _draw_defaults(axes: Axes, chart: Map) -> list[Line2D]:
    drawn = []
    for axis, draw in ((chart.x, axes.axvline), (chart.y, axes.axhline)):
        if axis.default is not None:
            halo = [withStroke(linewidth=4, foreground="w")]
            drawn.append(draw(_place(axis), color="black", linewidth=1.6, linestyle=(0, (4, 2)), path_effects=halo))
    if drawn:
        drawn[0].set_label("default of jamlab")
    return drawn[:1]


def _place(axis: Axis) -> float:
    return float(axis.places(axis.default))
