"""A drawing is a figure that keeps every point and every number behind it."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from string import ascii_lowercase
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from numpy.typing import ArrayLike

from jamlab.arrays import Array
from jamlab.plotting.palette import BLACK, BLUE, GREEN, ORANGE, PINK, RED, SKY
from jamlab.statistics.confidence import Interval

if TYPE_CHECKING:
    from studies.papers.verdicts import Comparison

COLOURS = (RED, BLUE, GREEN, PINK, ORANGE, SKY, BLACK)
MARKERS = "so^vDP*"
FREQUENCY = r"frequency $\omega\,\tau_1$"
MODEL_STYLE: dict[str, dict[str, Any]] = {
    "sp": {"color": RED, "marker": "v", "label": "soft disks (SP)"},
    "dp": {"color": BLUE, "marker": "D", "label": "deformable droplets (DP)"},
}
SIZE_STYLE: dict[int, dict[str, Any]] = {  # markers of Boromand et al. fig 6
    32: {"color": RED, "marker": "s"},
    64: {"color": BLUE, "marker": "o"},
    128: {"color": GREEN, "marker": "^"},
    256: {"color": PINK, "marker": "v"},
    512: {"color": ORANGE, "marker": "D"},
    1024: {"color": SKY, "marker": "P"},
    2048: {"color": BLACK, "marker": "*"},
    8192: {"color": "#8C6D00", "marker": "p"},
    32768: {"color": "#777777", "marker": "X"},
}
PAPER: dict[str, Any] = {"color": BLACK, "linestyle": "--", "linewidth": 1.3, "zorder": 5}
SLOPE: dict[str, Any] = {"color": BLACK, "linestyle": "-", "linewidth": 1.0, "marker": "", "zorder": 5}
FIT: dict[str, Any] = {"color": BLACK, "linestyle": "-", "linewidth": 1.6, "alpha": 0.75, "zorder": 4}


def style(index: int) -> dict[str, Any]:
    """Choose colour and marker of the index-th series."""
    return {"color": COLOURS[index % len(COLOURS)], "marker": MARKERS[index % len(MARKERS)]}


def model_style(model: str, **more: Any) -> dict[str, Any]:
    """Choose colour and marker of a model, without a line unless one is asked for."""
    look = MODEL_STYLE[model]
    return {"color": look["color"], "marker": look["marker"], "linestyle": "none"} | more


def sequence(index: int, count: int) -> dict[str, Any]:
    """Choose colour and marker of the index-th of an ordered series; more than five differ by shade."""
    if count <= 5:
        return style(index)
    return {
        "color": matplotlib.colormaps["cividis"](0.92 * index / (count - 1)),
        "marker": MARKERS[index % len(MARKERS)],
    }


def size_style(n: int) -> dict[str, Any]:
    """Choose colour and marker of a system size."""
    return SIZE_STYLE.get(n, style(int(np.log2(max(n, 1))) + 2))


@dataclass(frozen=True)
class TextTable:
    """A table as the reader sees it."""

    columns: Sequence[str]  # their names, with units
    rows: Sequence[Sequence[str]]  # cells
    heading: str = ""  # above the table; none by default
    # a word for each row, such as its verdict, by which the reader can filter; none by default
    marks: Sequence[str] = ()
    words: bool = False  # columns of text: they are set left, and wrap
    folded: str = ""  # what stands in place of the table until the reader opens it; "" shows it at once


@dataclass
class Drawing:
    """A figure with its points, its numbers, and what it says of them."""

    name: str  # such as "boromand-6"
    figure: Figure  # matplotlib
    caption: str = ""  # what is drawn, and what of the paper's figure is missing
    claims: "list[Comparison]" = field(default_factory=list)  # numbers of the paper beside ours
    # further numbers of the figure
    values: dict[str, Interval] = field(default_factory=dict)
    rows: list[pd.DataFrame] = field(default_factory=list)  # one table per curve drawn
    text: list[TextTable] = field(default_factory=list)  # tables for the reader, below the picture

    @property
    def numbers(self) -> dict[str, dict[str, float]]:
        """Write `values` as plain numbers, the form that JSON takes: value, low and high by name."""
        ends = ("value", "low", "high")
        return {name: {end: float(getattr(found, end)) for end in ends} for name, found in self.values.items()}

    @property
    def table(self) -> pd.DataFrame:
        """Join all points drawn: panel, series, x, y, low, high; series of the paper begin with "paper"."""
        return pd.concat(self.rows, ignore_index=True)

    def curve(
        self,
        axes: Any,
        series: str,
        x: ArrayLike,
        y: ArrayLike | Interval,
        *,
        label: str | None = "",
        band: bool = True,
        **look: Any,
    ) -> None:
        """Draw a curve, with the interval of an `Interval` as a band or as bars, and keep its points; nan are left out.
        In the legend the label "" takes the name of the series, None leaves the curve out."""
        if isinstance(y, Interval):
            px, py, bottom, top = map(_row, (x, y.value, y.low, y.high))
        else:
            px, py = _row(x), _row(y)
            bottom, top = np.full((2, *py.shape), np.nan)
        kept = np.isfinite(px) & np.isfinite(py)
        if axes.get_xscale() == "log":
            kept &= px > 0
        if axes.get_yscale() == "log":
            kept &= py > 0
        px, py, bottom, top = px[kept], py[kept], bottom[kept], top[kept]
        values = {"panel": axes.get_gid(), "series": series, "x": px, "y": py, "low": bottom, "high": top}
        self.rows.append(pd.DataFrame(values))
        if not len(px):  # nor a name in the legend
            return
        text = series if label == "" else label
        axes.plot(px, py, **{"linewidth": 1.2, "markersize": 4.5, "label": text} | look)
        known = np.isfinite(bottom) & np.isfinite(top)
        if not known.any():
            return
        if axes.get_yscale() == "log":  # a band that reaches below zero ends at a third of the value
            bottom = np.maximum(bottom, 0.3 * py)
        colour = look.get("color")
        if band:
            axes.fill_between(px[known], bottom[known], top[known], color=colour, alpha=0.22, linewidth=0)
        else:
            lengths = np.maximum([(py - bottom)[known], (top - py)[known]], 0)
            axes.errorbar(px[known], py[known], lengths, fmt="none", ecolor=colour, elinewidth=1.2, capsize=2.5)

    def slope(
        self, axes: Any, exponent: float, x: Sequence[float], y: float, text: str | None = None, above: bool = False
    ) -> None:
        """Draw a triangle of a slope, at most a decade wide, beside the data: on a line through (x[0], y) and in the
        middle of x. Its height says nothing; its corner lies below the line or above."""
        first, last = x
        half = min(10**0.5, (last / first) ** 0.5)
        ends = (first * last) ** 0.5 * np.array([1 / half, half])
        values = y * (ends / first) ** exponent
        right = (exponent >= 0) != above
        corner = (ends[1], values[0]) if right else (ends[0], values[1])
        sides = np.array([*zip(ends, values, strict=True), corner, (ends[0], values[0])])
        self.curve(axes, f"paper: slope {exponent:g}", *sides.T, label=None, **SLOPE)
        axes.annotate(
            f"{exponent:g}" if text is None else text,
            (corner[0], np.sqrt(values.prod())),
            textcoords="offset points",
            xytext=(4 if right else -4, 0),
            fontsize=9,
            ha="left" if right else "right",
            va="center",
        )

    def legend_above(self, axes: Any, fontsize: float = 9, ncols: int | None = None) -> None:
        """Write the legend of some axes once, above all panels."""
        handles, names = axes.get_legend_handles_labels()
        place: dict[str, Any] = {"loc": "outside upper center", "frameon": False}
        self.figure.legend(handles, names, ncols=ncols or len(names), fontsize=fontsize, **place)


# of a legend, where curves fill a panel
BESIDE: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1.01, 1.0), "borderaxespad": 0.0}


def drawing(name: str, rows: int, columns: int, width: float = 4.6, height: float = 3.8) -> tuple[Drawing, list[Any]]:
    """Make an empty figure and its axes, named a, b, c, ... row by row."""
    figure = Figure(figsize=(width * columns, height * rows), layout="constrained")
    axes = list(figure.subplots(rows, columns, squeeze=False).flat)
    for index, part in enumerate(axes):
        part.set_gid(ascii_lowercase[index])
    return Drawing(name, figure), axes


def label(axes: Any, x: str, y: str, *, legend: bool = True, **place: Any) -> None:
    """Add labels, panel letter, grid and legend; call it when everything is drawn, and `scale` before."""
    axes.set_xlabel(x, fontsize=11)
    axes.set_ylabel(y, fontsize=11)
    axes.tick_params(labelsize=9.5)
    axes.grid(alpha=0.25)
    if len(axes.figure.axes) > 1:
        axes.set_title(f"({axes.get_gid()})", loc="left", fontsize=11)
    space_ticks(axes)
    if legend:
        axes.legend(**({"fontsize": 8.5, "framealpha": 0.85} | place))


def space_ticks(axes: Any) -> None:
    """Label 1, 2 and 5 on short logarithmic axes, where labels of minor ticks overlap or are missing; call it when
    everything is drawn."""
    for axis, low, high in ((axes.xaxis, *axes.get_xlim()), (axes.yaxis, *axes.get_ylim())):
        if axis.get_scale() == "log" and high / low < 100:
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
        if axis.get_scale() == "log":
            axis.set_minor_formatter(NullFormatter())


def scale(*axes: Any, x: str = "log", y: str = "log") -> None:
    """Set the scales before curves are drawn, so that points that a logarithm cannot show are left out."""
    for part in axes:
        part.set_xscale(x)
        part.set_yscale(y)


def _row(values: ArrayLike) -> Array:
    return np.atleast_1d(np.asarray(values, dtype=np.float64))


# numbers with their intervals, in captions ----------------------------------------------------------------------------


def write_interval(found: Interval, digits: int = 2) -> str:
    """Write a number with its 95 % interval, such as "0.21 [0.19, 0.23]"."""
    return f"{_fixed(found.value, digits)} [{_fixed(found.low, digits)}, {_fixed(found.high, digits)}]"


def _fixed(value: ArrayLike, digits: int) -> str:
    number = float(np.ravel(value)[0])
    return f"{number:.{digits}f}" if abs(number) >= 10.0**-digits or number == 0 else f"{number:.2g}"
