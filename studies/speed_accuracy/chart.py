"""A chart of cost against error: every method at every setting of its parameter, on many packings."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator, LogLocator, NullFormatter, NullLocator
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.plotting.drawable import LABEL, LEGEND, TICK
from studies.ensemble_tables import EnsembleTables
from studies.html_page import TextTable
from studies.panels import Drawing
from studies.study import Study

SLACK = 1.25  # costs within this ratio are the same: what repeated runs on a busy machine differ by
ALIKE = 1.25  # errors within this ratio are the same: means over twenty packings
BETTER = 100.0  # times, that a reference must be known than what is compared with it
BAND = (0.1, 0.9)  # quantiles

# Okabe & Ito, light yellow left out
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8C510A")
_MARKERS = "osD^vP*X"
_GREY = "#D9D9D9"
_UNKNOWN: dict[str, Any] = {"facecolor": "#EFEFEF", "edgecolor": "#CCCCCC", "hatch": "///", "linewidth": 0}
_HALF_MARK: dict[str, Any] = {"fillstyle": "left", "markerfacecoloralt": "white", "markersize": 9}
_COLUMNS = 3  # of panels, four where that fills two rows
_MOST_TICKS = 6
_LETTER = (0.0185, 0.04)  # width and height of a letter of a label, parts of the axes
_GAP = (0.02, 0.02)  # between a mark and its label
_MARK = 0.018  # half of a mark
_SIDES = ((1, 1), (-1, 1), (1, -1), (-1, -1))  # of a mark, where a label may stand
_PALE = 0.5  # of marks that are not ranked
_EXACT = 1.3  # decades between the break and the line of what is exact
_SHORT = 100.0  # ratio of the ends of the axis of times below which powers of ten are too few ticks
_BELOW = 10.0  # times the error of the reference may be what is drawn below it


@dataclass(frozen=True)
class Point:
    """One setting of one method, over many packings."""

    # panel, method, setting, default: as in `Trial`
    panel: str
    method: str
    setting: str
    seconds: float  # median CPU time on one core: what other programs do to a busy machine would carry a mean
    error: float  # mean of the magnitudes
    # low, high: 10 and 90 % quantiles of the magnitudes
    low: float
    high: float
    floor: float  # errors below are not told from 0: 100 times the error of the reference, or just that if `loose`
    packings: int  # how many gave a number
    failed: int  # how many gave none
    default: bool
    note: str = ""  # of the first packing that has one; that of a run that was cut short goes first
    cut: int = 0  # on how many packings the run was cut short by a limit of time: the number is where it came
    # no reference is known a hundred times better: the floor is its own error, and nothing below is ranked
    loose: bool = False

    @property
    def exact(self) -> bool:
        """Whether the mean cannot be told from the reference."""
        return self.error <= self.floor

    @property
    def ranked(self) -> bool:
        """Whether its error is known well enough to be compared: not if the reference itself may err by more."""
        return not (self.loose and self.exact)

    @property
    def drawn(self) -> bool:
        """Whether there is a number."""
        return bool(np.isfinite(self.error) and np.isfinite(self.seconds))


def points_of(trials: pd.DataFrame, better: float = BETTER) -> list[Point]:
    """Average trials (columns of `Trial`) over packings, in their order; the floor is `better` times the median error
    of the reference in each panel, and loose if that is less than a hundred times."""
    errors = trials.groupby("panel")["reference_error"].median()
    floors = {str(panel): better * float(error) for panel, error in errors.items()}
    points = []
    for (panel, method, setting), rows in trials.groupby(["panel", "method", "setting"], sort=False):
        good = rows[np.isfinite(rows["error"]) & np.isfinite(rows["seconds"])]
        size = np.abs(good["error"].to_numpy(dtype=np.float64))
        low, high = np.quantile(size, BAND) if len(size) else (np.nan, np.nan)
        mean, seconds = (float(size.mean()), float(good["seconds"].median())) if len(size) else (np.nan, np.nan)
        cut = rows["cut"].to_numpy(dtype=bool)
        notes = [str(note) for note in [*rows["note"][cut], *rows["note"]] if note]
        names: Any = (str(panel), str(method), str(setting))
        numbers: Any = (seconds, mean, float(low), float(high), floors[str(panel)], len(good), len(rows) - len(good))
        loose = better < BETTER and floors[str(panel)] > 0
        rest: Any = (bool(rows["default"].any()), next(iter(notes), ""), int(cut.sum()), loose)
        points.append(Point(*names, *numbers, *rest))
    return points


def dominated(points: Sequence[Point]) -> NDArray[np.bool_]:
    """Mark the points (m,) for which another one of the same panel is as good and cheaper, or better and as cheap.
    Costs and errors within 25 % of each other count as equal, and so do errors below the floor. Points without a number
    count as dominated, those that are not ranked do not."""
    beaten = [not one.drawn or any(_beats(other, one) for other in points) for one in points]
    return np.array(beaten, dtype=bool)


def price(one: Point, points: Sequence[Point]) -> float:
    """How many times more a point costs than the cheapest of its panel that is as good; at least 1, and 1 if it is not
    ranked."""
    if not one.ranked:
        return 1.0
    others = [other.seconds for other in points if other.panel == one.panel and other.drawn and _as_good(other, one)]
    return max(1.0, one.seconds / min(others, default=one.seconds))


def _beats(other: Point, one: Point) -> bool:
    if other.panel != one.panel or other is one or not other.drawn or not one.ranked:
        return False
    cheaper = other.seconds * SLACK < one.seconds
    better = _size(other) * ALIKE < _size(one)
    return (_as_good(other, one) and cheaper) or (better and other.seconds <= one.seconds)


def _as_good(other: Point, one: Point) -> bool:
    return _size(other) <= ALIKE * _size(one) and other.failed <= one.failed


def _size(point: Point) -> float:
    return max(point.error, point.floor)


# pictures -------------------------------------------------------------------------------------------------------------


class _Scale(NamedTuple):
    """Errors of a panel: least and largest above all floors; either the height of what is exact, below a break of the
    axis, or the error of the reference where nothing below is ranked; else None."""

    bottom: float
    top: float
    exact: float | None
    known: float | None

    def height(self, point: Point, value: float) -> float:
        """Where a value of a point stands."""
        if self.known is not None:
            return max(value, self.bottom)
        return self.exact if self.exact is not None and value <= point.floor else value


class _Label(NamedTuple):
    """A setting beside its mark, and the first one of its curve."""

    text: str
    first: str
    default: bool
    mark: tuple[float, float]
    colour: str


def curve_figure(title: str, error: str, points: Sequence[Point]) -> Figure:
    """Draw one panel for each `Point.panel`.

    Lines are mean errors over packings, shades and bars the 10 to 90 % of them. What cannot be told from the reference
    stands on a line of its own below a break of the axis; where no reference is a hundred times better than what is
    compared with it, its own error is a hatched strip, and what lies in there is not ranked. Open marks: some packings
    gave no number. Half marks: runs were cut short by a limit of time, and stand where they came.
    """
    names = list(dict.fromkeys(point.panel for point in points))
    methods = list(dict.fromkeys(point.method for point in points if point.drawn))
    columns = 2 if len(names) == 4 else min(_COLUMNS, len(names))
    rows = -(-len(names) // columns)
    figure = Figure(figsize=(max(5.0 * columns, 6.4), 4.1 * rows + 1.0), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    style = {m: (_COLOURS[k % 8], _MARKERS[k % 8]) for k, m in enumerate(methods)}
    for axes, name in zip(grid, names, strict=False):
        here = [point for point in points if point.panel == name]
        if any(point.drawn for point in here):
            _draw_panel(axes, [point for point in here if point.drawn], style)
        missing = sum(not point.drawn for point in here)
        settings = "1 setting" if missing == 1 else f"{missing} settings"
        axes.set_title(name + (f"   (without a number: {settings})" if missing else ""), fontsize=TICK)
        axes.set_xlabel("CPU time on one core, s", fontsize=LABEL)
        axes.set_ylabel(error, fontsize=LABEL)
    for axes in grid[len(names) :]:
        axes.set_axis_off()
    figure.suptitle(title, fontsize=14)
    figure.legend(
        handles=_handles(style, points), loc="outside lower center", ncols=min(5, len(methods) + 3), fontsize=LEGEND
    )
    return figure


def _draw_panel(axes: Axes, points: Sequence[Point], style: dict[str, tuple[str, str]]) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    scale = _scale(points)
    labels: list[_Label] = []
    curves: list[Array] = []
    for method, (colour, marker) in style.items():
        curve = [p for p in points if p.method == method]
        if not curve:
            continue
        x = [p.seconds for p in curve]
        y, low, high = (
            [scale.height(p, value) for p, value in zip(curve, values, strict=True)]
            for values in ([p.error for p in curve], [p.low for p in curve], [p.high for p in curve])
        )
        if len(curve) > 1 and np.all(np.diff(x) > 0):
            axes.fill_between(x, low, high, color=colour, alpha=0.15, linewidth=0)
        else:  # a parameter that does not go from cheap to dear
            axes.vlines(x, low, high, color=colour, linewidth=5, alpha=0.2)
        axes.plot(x, y, "-", color=colour, linewidth=1.4)
        for p, here_x, here_y in zip(curve, x, y, strict=True):
            face = "white" if p.failed else colour
            more: dict[str, Any] = dict(_HALF_MARK) if p.cut else {"markersize": 7}
            more["alpha"] = 1.0 if p.ranked else _PALE
            axes.plot(here_x, here_y, marker, color=colour, markerfacecolor=face, **more)
            if p.default:
                axes.plot(here_x, here_y, "o", markersize=16, markerfacecolor="none", markeredgecolor="black", zorder=5)
        curves.append(np.column_stack([x, y]))
        ends = {0, len(curve) - 1}
        labels += [
            _Label(p.setting, curve[0].setting, p.default, (x[k], y[k]), colour)
            for k, p in enumerate(curve)
            if p.setting and (p.default or k in ends)
        ]
    axes.margins(x=0.16)
    left, right = axes.get_xlim()
    spare = 10 ** max(0.0, (1.5 - np.log10(right / left)) / 2)
    axes.set_xlim(left / spare, right * spare)
    least = scale.bottom / 2 if scale.exact is None else scale.exact / 3
    axes.set_ylim(least, scale.top * (scale.top / scale.bottom) ** 0.1)
    _label(axes, labels, curves)
    _tick(axes, scale)


def _scale(points: Sequence[Point]) -> _Scale:
    known = max((p.floor for p in points if p.loose), default=None)
    if known is None:
        above = [value for p in points for value in (p.low, p.error) if value > p.floor and not p.exact]
        bottom = 10 ** np.floor(np.log10(min(above))) if above else max(p.floor for p in points) or 1e-16
    else:
        bottom = max(known / _BELOW, min([known / 2, *(value for p in points for value in (p.low, p.error))]))
    top = max([10 * bottom, *(2 * max(p.error, p.high) for p in points)])
    broken = known is None and any(p.exact or p.low <= p.floor for p in points)
    exact = bottom / 10 ** (_EXACT * max(1.0, np.log10(top / bottom) / 8)) if broken else None
    return _Scale(float(bottom), float(top), exact, known)


def _label(axes: Axes, labels: list[_Label], curves: list[Array]) -> None:
    """Write settings at both ends of curves and at defaults, these first, once where curves begin with the same. Of the
    places around a mark, the one with least of the curves (k, 2) is taken; what would lie on a mark or another label is
    left out."""
    within = axes.transData + axes.transAxes.inverted()
    ends = [within.transform(curve) for curve in curves]
    marks = np.concatenate(ends)
    along = np.linspace(0, 1, 40)[:, None, None]
    ink = np.concatenate([((1 - along) * c[:-1] + along * c[1:]).reshape(-1, 2) for c in ends])
    taken: dict[tuple[str, str], Bbox] = {}
    for label in sorted(labels, key=lambda label: not label.default):
        size = (_LETTER[0] * len(label.text), _LETTER[1])
        boxes = [_beside(within.transform(label.mark), side, size) for side in _SIDES]
        free = [box for box in boxes if _fits(box, marks, taken.values())]
        if free and (label.text, label.first) not in taken:
            box = min(free, key=lambda box: box.count_contains(ink))
            taken[label.text, label.first] = box
            middle = ((box.x0 + box.x1) / 2, (box.y0 + box.y1) / 2)
            style: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 9, "color": label.colour}
            axes.annotate(label.text, middle, xycoords="axes fraction", **style)


def _beside(mark: Array, side: tuple[int, int], size: tuple[float, float]) -> Bbox:
    left, foot = (m + s * gap - (s < 0) * length for m, s, gap, length in zip(mark, side, _GAP, size, strict=True))
    return Bbox.from_bounds(float(left), float(foot), *size)


def _fits(box: Bbox, marks: Array, taken: Iterable[Bbox]) -> bool:
    inside = min(box.x0, box.y0) > 0 and max(box.x1, box.y1) < 1
    around = Bbox.from_extents(box.x0 - _MARK, box.y0 - _MARK, box.x1 + _MARK, box.y1 + _MARK)
    return inside and not around.count_contains(marks) and not any(box.overlaps(other) for other in taken)


def _tick(axes: Axes, scale: _Scale) -> None:
    """Powers of ten above the break, and `exact` below it; or the strip of the error of the reference."""
    bottom, top, exact, known = scale
    first, last = int(np.ceil(np.log10(bottom) - 1e-9)), int(np.floor(np.log10(2 * top)))
    every = max(1, -(-(last - first + 1) // _MOST_TICKS))
    powers = list(range(first, last + 1, every))
    values = [10.0**k for k in powers]
    names = [f"$10^{{{k}}}$" for k in powers]
    left, right = axes.get_xlim()
    short = right / left < _SHORT
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5) if short else (1,), numticks=6))
    if short:
        axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.grid(alpha=0.3, which="major")
    if known is not None:
        axes.axhspan(bottom / 1e3, known, **_UNKNOWN, zorder=0)
    if exact is not None:
        values, names = [exact, *values], ["exact", *names]
        middle = np.sqrt(exact * bottom / 1.5)
        axes.axhspan(exact / 1e3, middle, color=_GREY, alpha=0.45, linewidth=0, zorder=0)
        slash: dict[str, Any] = {"marker": [(-1, -0.5), (1, 0.5)], "markersize": 9, "linestyle": "", "color": "black"}
        slash |= {"transform": axes.get_yaxis_transform(), "clip_on": False, "zorder": 6}
        for height in (middle / 1.15, middle * 1.15):
            axes.plot([0], [height], **slash)
    axes.yaxis.set_major_locator(FixedLocator(values))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.set_yticks(values, names)
    axes.tick_params(labelsize=TICK)


def _handles(style: dict[str, tuple[str, str]], points: Sequence[Point]) -> list[Line2D | Patch]:
    handles: list[Line2D | Patch] = [
        Line2D([], [], marker=m, color=c, markersize=7, label=name) for name, (c, m) in style.items()
    ]
    handles.append(Patch(color="#888888", alpha=0.3, label="10 to 90 % of packings"))
    if any(p.loose and p.drawn for p in points):
        handles.append(Patch(label="error of the reference itself", **_UNKNOWN))
    marks: tuple[tuple[str, bool, dict[str, Any]], ...] = (
        (
            "jamlab's default",
            any(p.default for p in points),
            {"markersize": 13, "markerfacecolor": "none", "color": "k"},
        ),
        ("some failed", any(p.failed and p.drawn for p in points), {"markerfacecolor": "white"}),
        ("cut short by its limit of time", any(p.cut and p.drawn for p in points), _HALF_MARK),
    )
    for name, shown, look in marks:
        if shown:
            handles.append(Line2D([], [], label=name, marker="o", linestyle="", **{"color": "#444444"} | look))
    return handles


SEEDS = range(1, 21)  # packings of a chart


@dataclass(frozen=True)
class Trial:
    """One method with one setting on one packing, measured."""

    panel: str  # which panel of the chart
    method: str  # name
    setting: str  # value of its parameter, as text; "" without one
    seconds: float  # CPU time on one core
    error: float  # difference to the reference, with its sign; nan if the method gave no number, and `note` says why
    reference_error: float = 0.0  # of the reference itself, on this packing
    default: bool = False  # whether jamlab does this by default
    note: str = ""  # what a reader must know
    cut: bool = False  # whether a limit of time ended the run, and not what it was told to reach


COLUMNS = tuple(field.name for field in fields(Trial))


@dataclass(frozen=True)
class Chart:
    """A chart before it is measured."""

    name: str  # of its table and its files
    title: str  # what it shows, in one line
    error: str  # label of the axis of errors
    parameter: str  # what the settings are
    reference: str  # what the error is measured against, and how well that is known
    measure: Callable[[int], Iterable[Trial]]  # function of a seed that makes the trials of one packing
    seeds: Sequence[int] = SEEDS  # of the packings
    # function that makes the points of the curves from all trials
    average: Callable[[pd.DataFrame], list[Point]] = points_of
    reason: str = ""  # why a default may lie off its front, in one line; "" if none does

    @property
    def study(self) -> Study:
        """The chart as a study, with one task for each packing."""
        tasks = {f"{seed}": partial(_rows, self.measure, seed) for seed in self.seeds}
        return Study(self.name, self.title, tasks, self.draw)

    def draw(self, tables: EnsembleTables) -> Drawing:
        """Draw the mean cost and error of every setting, and say which defaults lie off their front."""
        points = self.average(tables.read(self.name))
        beaten = dominated(points)
        prices = [price(point, points) for point in points]
        front = [p.ranked and not b for p, b in zip(points, beaten, strict=True)]
        rows = [{"topic": self.name, **asdict(p), "on_front": f} for p, f in zip(points, front, strict=True)]
        off = [
            (p.panel, f"{p.method} {p.setting}".rstrip(), f"{p.seconds:.2g} s", _error(p), f"{paid:.1f}", self.reason)
            for p, paid in zip(points, prices, strict=True)
            if p.default and paid > SLACK
        ]
        text = [TextTable(OFF_COLUMNS, off, "Defaults off their front", words=True)] if off else []
        caption = f"Reference: {self.reference}. Settings: {self.parameter}."
        figure = curve_figure(self.title, self.error, points)
        text.append(_table(self.error, points, beaten))
        return Drawing(self.name, figure, caption, rows=[pd.DataFrame(rows)], text=text)


_LOADED: set[Callable[[int], Iterable[Trial]]] = set()


def _rows(measure: Callable[[int], Iterable[Trial]], seed: int) -> list[dict[str, Any]]:
    """Rows of one packing; the first one of a process is measured twice: the first time also loads libraries."""
    if measure not in _LOADED:
        _LOADED.add(measure)
        list(measure(seed))
    return [asdict(trial) for trial in measure(seed)]


LEAD = (
    "Each curve is one method along its own parameter: median cost on one core and mean error over packings, with the "
    "10 to 90 % of them. A mean above its band is carried by a few packings. A ring marks what jamlab does by default. "
    "'exact' below the break of an axis: the difference to the reference is none, or below the floor, 100 times the "
    "error of the reference itself. Where no reference is known that well, a hatched strip reaches up to its error, "
    "and what lies in there is not ranked. Open marks: some packings gave no number. "
    "Half marks: runs were cut short by a limit of time, and stand where they came."
)
OFF_COLUMNS = ("panel", "default", "cost", "error", "times the cheapest as good", "reason")


def _error(point: Point) -> str:
    if not point.ranked:
        return f"below {point.floor:.1e}"
    return "exact" if point.exact else f"{point.error:.1e}"


def _table(error: str, points: Sequence[Point], beaten: Iterable[bool]) -> TextTable:
    columns = ["panel", "method", "setting", "time [s]", error, "10 to 90 %", "packings", "on the front", "note"]
    marks = [
        ("beaten" if b else "on the front") if p.ranked else "not ranked" for p, b in zip(points, beaten, strict=True)
    ]
    words = {"on the front": "yes", "beaten": ""}
    rows = [
        [
            *(p.panel, p.method + (" (default)" if p.default else ""), p.setting, f"{p.seconds:.3g}", _error(p)),
            *(f"{p.low:.1e} .. {p.high:.1e}", f"{p.packings} of {p.packings + p.failed}"),
            *(words.get(mark, mark), p.note),
        ]
        for p, mark in zip(points, marks, strict=True)
    ]
    return TextTable(columns, rows, marks=marks, folded=f"{len(rows)} points in numbers")
