"""A chart of cost against error: every method at every setting of its parameter, on many packings."""

import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from jamlab.errors import ConvergenceError, EngineError
from jamlab.plotting.drawable import LABEL, LEGEND, TICK
from studies.ensemble_tables import EnsembleTables
from studies.html_page import TextTable
from studies.panels import Drawing
from studies.study import Study
from studies.tables import shortest

SLACK = 1.25  # costs within this ratio are the same: what repeated runs on a busy machine differ by
ALIKE = 1.25  # errors within this ratio are the same: means over twenty packings
BETTER = 100.0  # times, that a reference must be known than what is compared with it
BAND = (0.1, 0.9)  # quantiles
WORDS: dict[str, Mapping[str, str]] = tomllib.loads(Path(__file__).with_name("charts.toml").read_text(encoding="utf-8"))

# Okabe & Ito, light yellow left out
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8C510A")
_MARKERS = "osD^vP*X"
_UNKNOWN: dict[str, Any] = {"facecolor": "#EFEFEF", "edgecolor": "#CCCCCC", "hatch": "///", "linewidth": 0}
_HALF: dict[str, Any] = {"fillstyle": "left", "markerfacecoloralt": "white"}
_RING: dict[str, Any] = {"markersize": 14, "markerfacecolor": "none", "color": "black"}


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
    floors = better * trials.groupby("panel")["reference_error"].median()
    points = []
    for names, rows in trials.groupby(["panel", "method", "setting"], sort=False):
        good = rows[np.isfinite(rows["error"]) & np.isfinite(rows["seconds"])]
        size, floor = good["error"].astype(float).abs(), float(floors[str(names[0])])
        cut = rows["cut"].to_numpy(dtype=bool)
        notes = [str(note) for note in [*rows["note"][cut], *rows["note"]] if note]
        low, high = size.quantile(list(BAND))
        words: Any = dict(zip(("panel", "method", "setting"), names, strict=True)) | {"note": next(iter(notes), "")}
        numbers: Any = {"seconds": float(good["seconds"].median()), "error": float(size.mean()), "floor": floor}
        numbers |= {"low": float(low), "high": float(high), "cut": int(cut.sum())}
        numbers |= {"packings": len(good), "failed": len(rows) - len(good), "default": bool(rows["default"].any())}
        points.append(Point(**words, **numbers, loose=better < BETTER and floor > 0))
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


def curve_figure(title: str, error: str, points: Sequence[Point]) -> Figure:
    """Draw one panel for each `Point.panel`.

    Lines are mean errors over packings, bars the 10 to 90 % of them. What lies below the floor of a panel stands on it.
    Open marks: some packings gave no number. Half marks: runs were cut short by a limit of time, and stand where they
    came. Curves are named at both ends and at defaults.
    """
    names = list(dict.fromkeys(point.panel for point in points))
    methods = list(dict.fromkeys(point.method for point in points if point.drawn))
    columns = 2 if len(names) == 4 else min(3, len(names))
    rows = -(-len(names) // columns)
    figure = Figure(figsize=(max(5.0 * columns, 6.4), 4.1 * rows + 1.0), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    style: dict[str, dict[str, Any]] = {
        m: {"color": _COLOURS[k % 8], "marker": _MARKERS[k % 8]} for k, m in enumerate(methods)
    }
    for axes, name in zip(grid, names, strict=False):
        here = [point for point in points if point.panel == name]
        _draw_panel(axes, [point for point in here if point.drawn], style)
        missing = sum(not point.drawn for point in here)
        axes.set_title(name + (f"   (without a number: {missing})" if missing else ""), fontsize=TICK)
        axes.set_xlabel("CPU time on one core, s", fontsize=LABEL)
        axes.set_ylabel(error, fontsize=LABEL)
    for axes in grid[len(names) :]:
        axes.set_axis_off()
    figure.suptitle(title, fontsize=14)
    grey: dict[str, Any] = {"color": "#444444", "marker": "o", "linestyle": ""}
    handles: list[Line2D | Patch] = [Line2D([], [], markersize=7, label=m, **look) for m, look in style.items()]
    handles.append(Patch(color="#888888", alpha=0.3, label="10 to 90 % of packings"))
    for text, shown, look in (
        ("jamlab's default", any(p.default for p in points), _RING),
        ("some failed", any(p.failed and p.drawn for p in points), {"markerfacecolor": "white"}),
        ("cut short by its limit of time", any(p.cut and p.drawn for p in points), _HALF),
    ):
        if shown:
            handles.append(Line2D([], [], label=text, **grey | look))
    handles.append(Patch(label="not told from the reference", **_UNKNOWN))
    figure.legend(handles=handles, loc="outside lower center", ncols=min(5, len(handles)), fontsize=LEGEND)
    return figure


def _draw_panel(axes: Axes, points: Sequence[Point], style: Mapping[str, dict[str, Any]]) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.grid(alpha=0.3)
    axes.margins(x=0.16, y=0.1)
    axes.tick_params(labelsize=TICK)
    floor, named = max((p.floor for p in points), default=0.0), set[str]()
    for method, look in style.items():
        curve = [p for p in points if p.method == method]
        x = [p.seconds for p in curve]
        y, low, high = (np.maximum([getattr(p, end) for p in curve], floor) for end in ("error", "low", "high"))
        axes.vlines(x, low, high, color=look["color"], linewidth=5, alpha=0.2)
        axes.plot(x, y, "-", color=look["color"], linewidth=1.4)
        for k, p in enumerate(curve):
            face = {"markerfacecolor": "white" if p.failed else look["color"]} | (_HALF if p.cut else {})
            axes.plot(x[k], y[k], markersize=7, alpha=1.0 if p.ranked else 0.5, **look | face)
            if p.default:
                axes.plot(x[k], y[k], "o", **_RING)
            if (p.default or k in (0, len(curve) - 1)) and p.setting not in named:
                named.add(p.setting)
                axes.annotate(
                    p.setting, (x[k], y[k]), xytext=(5, 4), textcoords="offset points", fontsize=8, color=look["color"]
                )
    if any(p.low <= floor for p in points) and floor > 0:
        axes.axhspan(floor / 1e3, floor, **_UNKNOWN, zorder=0)
        axes.set_ylim(bottom=floor / 3)
    axes.set_xlim(*_widened(*axes.get_xlim()))
    axes.set_ylim(*_widened(*axes.get_ylim()))


def _widened(low: float, high: float) -> tuple[float, float]:
    """Ends of an axis that shows 1.5 decades or more: on fewer, powers of ten are too few ticks."""
    spare = 10 ** max(0.0, (1.5 - np.log10(high / low)) / 2)
    return low / spare, high * spare


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


COLUMNS = tuple(column.name for column in fields(Trial))


@dataclass(frozen=True)
class Panel:
    """One packing in one panel, on which every method is measured against the same reference."""

    name: str
    reference: Any  # what every method should give
    reference_error: float  # its own
    error: Callable[[Any, Any], float]  # function of what a method gives and of the reference: their difference
    timing: Mapping[str, Any] = field(default_factory=dict)  # of `studies.tables.shortest`

    def trial(self, method: str, setting: str, run: Callable[[], Any], default: bool = False) -> Trial:
        """Measure a method with one setting; one that does not converge gives no number, and says why."""
        try:
            seconds, found = shortest(run, **self.timing)
            error, note = self.error(found, self.reference), ""
        except (ConvergenceError, EngineError) as failed:
            seconds, error, note = float("nan"), float("nan"), str(failed).splitlines()[0]
        return Trial(self.name, method, setting, seconds, error, self.reference_error, default, note)


@dataclass(frozen=True)
class Chart:
    """A chart before it is measured; its words stand in `charts.toml`."""

    name: str  # of its table and its files
    measure: Callable[[int], Iterable[Trial]]  # function of a seed that makes the trials of one packing
    seeds: Sequence[int] = SEEDS  # of the packings
    # function that makes the points of the curves from all trials
    average: Callable[[pd.DataFrame], list[Point]] = points_of

    @property
    def words(self) -> Mapping[str, str]:
        """Title; error: label of its axis; parameter: what settings are; reference: what errors are measured against,
        and how well that is known; of some a reason why a default lies off its front."""
        return WORDS[self.name]

    @property
    def study(self) -> Study:
        """The chart as a study, with one task for each packing."""
        tasks = {f"{seed}": partial(_rows, self.measure, seed) for seed in self.seeds}
        return Study(self.name, self.words["title"], tasks, self.draw)

    def draw(self, tables: EnsembleTables) -> Drawing:
        """Draw the mean cost and error of every setting, and say which defaults lie off their front."""
        points, words = self.average(tables.read(self.name)), self.words
        beaten = dominated(points)
        prices = [price(point, points) for point in points]
        front = [p.ranked and not b for p, b in zip(points, beaten, strict=True)]
        rows = [{"topic": self.name, **asdict(p), "on_front": f} for p, f in zip(points, front, strict=True)]
        off = [
            (
                p.panel,
                f"{p.method} {p.setting}".rstrip(),
                f"{p.seconds:.2g} s",
                _error(p),
                f"{paid:.1f}",
                words.get("reason", ""),
            )
            for p, paid in zip(points, prices, strict=True)
            if p.default and paid > SLACK
        ]
        text = [TextTable(OFF_COLUMNS, off, "Defaults off their front", words=True)] if off else []
        caption = f"Reference: {words['reference']}. Settings: {words['parameter']}."
        figure = curve_figure(words["title"], words["error"], points)
        text.append(_table(words["error"], points, beaten))
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
    "Errors in the hatched strip are not told from those of the reference: it reaches up to 100 times the error of the "
    "reference, or to that error itself where no reference is known better; then what lies in there is not ranked. "
    "Open marks: some packings gave no number. Half marks: runs were cut short by a limit of time."
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
