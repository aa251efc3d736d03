"""A chart of cost against error: every method at every setting of its parameter, on many packings."""

import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field, fields
from functools import partial
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from jamlab.errors import ConvergenceError, EngineError
from jamlab.plotting import in_unit
from jamlab.plotting.drawable import LABEL, LEGEND, TICK
from studies.ensemble_tables import EnsembleTables
from studies.panels import Drawing, TextTable, space_ticks
from studies.study import Study
from studies.tables import shortest

ALIKE = 1.25  # costs, and errors, within this ratio are the same: what repeated runs on a busy machine differ by
BETTER = 100.0  # times, that a reference must be known than what is compared with it
BAND = (0.1, 0.9)  # quantiles
WORDS: dict[str, dict[str, Any]] = tomllib.loads(Path(__file__).with_name("charts.toml").read_text(encoding="utf-8"))
LEAD = (
    "Each curve is one method along its own parameter: median cost on one core and mean error over packings, with the "
    "10 to 90 % of them. A mean above its band is dominated by a few packings. A ring marks the default of jamlab. "
    "Errors in the hatched strip may be errors of the reference: it reaches up to 100 times the error of the "
    "reference. Open marks: some packings gave no number. Half marks: runs were stopped by the time limit."
)

# Okabe & Ito, light yellow left out
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8C510A")
_MARKERS = "osD^vP*X"
_UNKNOWN: dict[str, Any] = {"facecolor": "#EFEFEF", "edgecolor": "#CCCCCC", "hatch": "///", "linewidth": 0}
_HALF: dict[str, Any] = {"fillstyle": "left", "markerfacecoloralt": "white"}
_RING: dict[str, Any] = {"markersize": 14, "markerfacecolor": "none", "color": "black"}


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


# averages over packings -----------------------------------------------------------------------------------------------


def points_of(trials: pd.DataFrame, better: float = BETTER) -> pd.DataFrame:
    """Average trials (columns of `Trial`) over packings: a row for each setting, in their order. Errors are told from
    errors of the reference down to `better` times these.

    Columns: panel, method, setting; seconds: median CPU time, as other programs on a busy machine would carry a mean;
    error, low, high: mean and 10 and 90 % quantiles of the magnitudes; packings, failed: how many gave a number, and
    how many none; default, cut, note: of `Trial`, cut runs first; floor: errors below are not told from zero;
    price: cost over the lowest cost in its panel that is as good; on_front: whether none is as good and cheaper,
    or better and as cheap. Costs and errors within 25 % of each other count as equal, and so do errors below the floor.
    """
    keys = ["panel", "method", "setting"]
    good = np.isfinite(trials["error"]) & np.isfinite(trials["seconds"])
    rows = trials.assign(size=trials["error"].abs().where(good), cost=trials["seconds"].where(good), missed=~good)
    rows["note"] = rows["note"].replace("", np.nan)
    of = rows.sort_values("cut", ascending=False, kind="stable").groupby(keys, sort=False)
    points = pd.DataFrame({"seconds": of["cost"].median(), "error": of["size"].mean()})
    points["low"], points["high"] = (of["size"].quantile(share) for share in BAND)
    points["packings"], points["failed"], points["cut"] = of["cost"].count(), of["missed"].sum(), of["cut"].sum()
    points["default"], points["note"] = of["default"].any(), of["note"].first().fillna("")
    points = points.reindex(pd.MultiIndex.from_frame(trials[keys].drop_duplicates())).reset_index()
    points["floor"] = points["panel"].map(better * trials.groupby("panel")["reference_error"].median())
    return ranked(points)


def ranked(points: pd.DataFrame) -> pd.DataFrame:
    """Add the columns `price` and `on_front`."""
    return points.assign(**_ranked(points))


def _ranked(points: pd.DataFrame) -> dict[str, Any]:
    """The price of every point, and whether it lies on the front of its panel."""
    seconds, failed = (points[name].to_numpy(dtype=np.float64) for name in ("seconds", "failed"))
    size = points[["error", "floor"]].to_numpy().max(axis=1)
    drawn, panel = drawn_of(points), points["panel"].to_numpy()
    with np.errstate(invalid="ignore"):  # rows: one; columns: the others
        rivals = (panel[:, None] == panel) & drawn
        as_good = rivals & (size <= ALIKE * size[:, None]) & (failed <= failed[:, None])
        better = rivals & (ALIKE * size < size[:, None]) & (seconds <= seconds[:, None])
        beaten = (as_good & (ALIKE * seconds < seconds[:, None])) | better
    cheapest = np.where(as_good, seconds, np.inf).min(axis=1)
    return {"price": np.where(drawn, np.maximum(1.0, seconds / cheapest), np.nan), "on_front": drawn & ~beaten.any(1)}


def drawn_of(points: pd.DataFrame) -> NDArray[np.bool_]:
    """Whether points (m,) have a number."""
    return points[["error", "seconds"]].notna().all(axis=1).to_numpy()


# pictures -------------------------------------------------------------------------------------------------------------


def curve_figure(title: str, error: str, points: pd.DataFrame, parameter: str) -> Figure:
    """Draw one panel for each of the panels of `points_of`; the legend says what settings are: `parameter`.

    Lines are mean errors over packings, bars the 10 to 90 % of them. What lies below the floor of a panel stands on it.
    Open marks: some packings gave no number. Half marks: runs were cut short by a limit of time, and stand where they
    came. Curves are named at both ends and at defaults.
    """
    names, shown = list(points["panel"].unique()), points[drawn_of(points)]
    columns = 2 if len(names) == 4 else min(3, len(names))
    rows = -(-len(names) // columns)
    figure = Figure(figsize=(max(5.0 * columns, 7.6), 4.1 * rows + 1.0), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    style: dict[str, dict[str, Any]] = {
        m: {"color": _COLOURS[k % 8], "marker": _MARKERS[k % 8]} for k, m in enumerate(shown["method"].unique())
    }
    for axes, name in zip(grid, names, strict=False):
        here = shown[shown["panel"] == name]
        _draw_panel(axes, here, style)
        missing = int((points["panel"] == name).sum()) - len(here)
        axes.set_title(name + (f"   (without a number: {missing})" if missing else ""), fontsize=TICK)
        axes.set_xlabel(in_unit("CPU time on one core", "s"), fontsize=LABEL)
        axes.set_ylabel(error, fontsize=LABEL)
    for axes in grid[len(names) :]:
        axes.set_axis_off()
    figure.suptitle(title, fontsize=14)
    grey: dict[str, Any] = {"color": "#444444", "marker": "o", "linestyle": ""}
    handles: list[Line2D | Patch] = [Line2D([], [], markersize=7, label=m, **look) for m, look in style.items()]
    handles.append(Patch(color="#888888", alpha=0.3, label="10 to 90 % of packings"))
    for text, column, look in (
        ("jamlab's default", "default", _RING),
        ("some runs failed", "failed", {"markerfacecolor": "white"}),
        ("stopped by the time limit", "cut", _HALF),
    ):
        if shown[column].any():
            handles.append(Line2D([], [], label=text, **grey | look))
    handles.append(Patch(label="within the error of the reference", **_UNKNOWN))
    words: dict[str, Any] = {
        "title": fill(f"numbers beside marks: {parameter}", 110),
        "title_fontsize": LEGEND,
        "fontsize": LEGEND,
    }
    figure.legend(
        handles=handles, loc="outside lower center", ncols=min(5 if columns > 1 else 3, len(handles)), **words
    )
    return figure


def _draw_panel(axes: Axes, points: pd.DataFrame, style: Mapping[str, dict[str, Any]]) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.grid(alpha=0.3)
    axes.margins(x=0.16, y=0.1)
    axes.tick_params(labelsize=TICK)
    floor, named = float(points["floor"].max()) if len(points) else 0.0, dict[str, tuple[float, float, str]]()
    for method, look in style.items():
        curve = points[points["method"] == method]
        x = curve["seconds"].to_numpy()
        y, low, high = (np.maximum(curve[end].to_numpy(), floor) for end in ("error", "low", "high"))
        axes.vlines(x, low, high, color=look["color"], linewidth=5, alpha=0.2)
        axes.plot(x, y, "-", color=look["color"], linewidth=1.4)
        for k, point in enumerate(curve.to_dict("records")):
            face = {"markerfacecolor": "white" if point["failed"] else look["color"]} | (_HALF if point["cut"] else {})
            axes.plot(x[k], y[k], markersize=7, **look | face)
            if point["default"]:
                axes.plot(x[k], y[k], "o", **_RING)
            if (point["default"] or k in (0, len(curve) - 1)) and point["setting"] not in named:
                named[point["setting"]] = (x[k], y[k], look["color"])
    if (points["low"] <= floor).any() and floor > 0:
        axes.axhspan(floor / 1e3, floor, **_UNKNOWN, zorder=0)
        axes.set_ylim(bottom=floor / 3)
    axes.set_xlim(*_widened(*axes.get_xlim()))
    axes.set_ylim(*_widened(*axes.get_ylim()))
    space_ticks(axes)
    _name_settings(axes, named, np.maximum(points[["seconds", "error"]].to_numpy(), [0.0, floor]))


def _name_settings(axes: Axes, named: Mapping[str, tuple[float, float, str]], points: NDArray[np.float64]) -> None:
    """Write settings beside their points, each where it is farthest from all points (m, 2)."""
    places = np.array([[14, 9], [-14, 9], [14, -9], [-14, -9], [0, 15], [0, -15]]) * axes.figure.dpi / 72  # pixels
    marks = axes.transData.transform(points)
    for setting, (x, y, colour) in named.items():
        tried = axes.transData.transform((x, y)) + places
        free = np.abs((tried[:, None] - marks) / (2.0, 1.0)).max(axis=2).min(axis=1)  # words are wider than high
        free[(tried < axes.bbox.p0 + 24).any(axis=1) | (tried > axes.bbox.p1 - 24).any(axis=1)] = 0.0  # not within
        place: dict[str, Any] = {"xytext": tuple(places[free.argmax()] * 72 / axes.figure.dpi), "color": colour}
        halo = [withStroke(linewidth=3, foreground="w")]
        place |= {"textcoords": "offset points", "ha": "center", "va": "center", "path_effects": halo, "zorder": 6}
        axes.annotate(_setting_text(setting), (x, y), fontsize=9, **place)


def _setting_text(setting: str) -> str:
    """A setting as the reader sees it: numbers far from 1 as powers of ten."""
    try:
        digits, exponent = f"{float(setting):e}".split("e")
    except ValueError:
        return setting
    if -3 <= int(exponent) < 4:
        return setting
    power = f"10^{{{int(exponent)}}}"
    return f"${power}$" if float(digits) == 1 else f"${float(digits):g} \times {power}$"


def _widened(low: float, high: float) -> tuple[float, float]:
    """Ends of an axis that shows 1.5 decades or more: on fewer, powers of ten are too few ticks."""
    spare = 10 ** max(0.0, (1.5 - np.log10(high / low)) / 2)
    return low / spare, high * spare


# charts as studies ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Chart:
    """A chart before it is measured.

    Its words stand in `charts.toml`: title; error and unit, the label of its axis; parameter, what settings are;
    reference, for errors, and how well it is known; packings, the number of seeds; of some a reason why a default is
    not on the Pareto front.
    """

    name: str  # of its table and its files
    measure: Callable[[int], Iterable[Trial]]  # function of a seed that makes the trials of one packing
    rehearsed: bool = True  # whether a process measures its first packing twice: the first time also loads libraries
    points: Callable[[pd.DataFrame], pd.DataFrame] = points_of  # of all its trials

    @property
    def words(self) -> dict[str, Any]:
        """Its words, by name."""
        return WORDS[self.name]

    @property
    def error(self) -> str:
        """Label of the axis of errors, with its unit."""
        return in_unit(self.words["error"], self.words.get("unit", ""))

    @property
    def study(self) -> Study:
        """The chart as a study, with one task for each packing."""
        seeds = range(self.words["packings"], 0, -1)
        return Study(self.name, self.words["title"], {f"{s}": partial(_rows, self, s) for s in seeds}, self.draw)

    def draw(self, tables: EnsembleTables) -> Drawing:
        """Draw the mean cost and error of every setting, and say which defaults are not on the Pareto front."""
        points, words = self.points(tables.read(self.name)), self.words
        error = self.error
        figure = curve_figure(words["title"], error, points, words["parameter"])
        caption = f"Reference: {words['reference']}. Settings: {words['parameter']}."
        columns = ("panel", "method", "setting", in_unit("time", "s"), error, "price")
        more, rows, off, marks = ("10 to 90 %", "packings", "note"), [], [], []
        for p in points.to_dict("records"):
            size = "exact" if p["error"] <= p["floor"] else f"{p['error']:.1e}"
            cells = [p["panel"], p["method"], p["setting"], f"{p['seconds']:.2g}", size, f"{p['price']:.1f}"]
            made, band = f"{p['packings']} of {p['packings'] + p['failed']}", f"{p['low']:.1e} .. {p['high']:.1e}"
            rows.append([*cells, band, made, p["note"]])
            marks.append("on the front" if p["on_front"] else "dominated")
            if p["default"] and p["price"] > ALIKE:
                off.append(cells)
        said = f"Defaults that are not on the Pareto front: {words.get('reason', '')}"
        text = [TextTable(columns, off, said, words=True)] if off else []
        text.append(TextTable((*columns, *more), rows, marks=marks, folded=f"{len(rows)} points in numbers"))
        return Drawing(self.name, figure, caption, rows=[points], text=text)


_LOADED: set[str] = set()


def _rows(chart: Chart, seed: int) -> list[dict[str, Any]]:
    """Rows of one packing."""
    if chart.rehearsed and chart.name not in _LOADED:
        _LOADED.add(chart.name)
        list(chart.measure(seed))
    return [asdict(trial) for trial in chart.measure(seed)]
