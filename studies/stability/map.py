"""A stability map: two conditions, the runs at every pair of them, how they ended, how far defaults are from that."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke

from jamlab.errors import JamlabError
from jamlab.packing.packing import Packing
from jamlab.plotting.drawable import LABEL, LEGEND, TICK
from jamlab.plotting.palette import GREEN, GREY, ORANGE, PINK, RED, SKY
from studies.ensemble_tables import EnsembleTables
from studies.html_page import TextTable
from studies.panels import Drawing
from studies.stability.plain_physics import plain_max_force
from studies.study import Study

_RUNAWAY = 10.0  # times the energy at the start: a descent loses energy, rounding gains far less than this
_SAME_BASIN = 1e-6  # relative difference of energies: far above what a force within tolerance leaves of them
_ROUNDING = 30 * np.finfo(np.float64).eps  # of forces of order 1, summed in another order

SILENT = "silent"
VERDICTS = ("converged", "another basin", "stalled", "blew up", "refused", SILENT)
_CLAIMS = ("converged", "another basin")  # give a number as if it were right


@dataclass(frozen=True)
class Trial:
    """One run."""

    # one of `VERDICTS`. "converged": met its tolerance where it should. "another basin": met it in another minimum.
    # "stalled": said that it ended above its tolerance. "blew up": positions or energies ran away, for all to see.
    # "refused": jamlab raised an error instead of giving a number. "silent": gave a number as if it were right, and the
    # check says that it is wrong.
    verdict: str
    note: str = ""  # what the run reached, or the message of the error
    error: float = 0.0  # of what is claimed, by the independent check; 0 where nothing is
    allowed: float = np.inf  # the largest error that the claim leaves room for

    @property
    def excess(self) -> float:
        """Error over the allowed one, of claims; not finite where the check found no number."""
        return self.error / self.allowed if self.verdict in (*_CLAIMS, SILENT) else 0.0


def judged(trial: Trial) -> Trial:
    """Give the verdict "silent" to a claim that the check refutes."""
    if trial.verdict in _CLAIMS and not trial.error <= trial.allowed:
        note = f"{trial.note}; error {trial.error:.2g}, allowed {trial.allowed:.2g}"
        return Trial(SILENT, note, trial.error, trial.allowed)
    return trial


def attempt(run: Callable[[], Trial]) -> Trial:
    """Make a run and judge it; an error of jamlab counts as "refused", any other passes through."""
    try:
        trial = run()
    except JamlabError as error:
        return Trial("refused", str(error).splitlines()[0])
    return judged(trial)


def judge_descent(left: float, tolerance: float, energy: float, start: float, minimum: float) -> str:
    """Judge a minimisation by the largest force left, and by energies at its end, its start and the minimum beside."""
    if not (np.isfinite(left) and np.isfinite(energy)) or energy > _RUNAWAY * start:
        return "blew up"
    if left > tolerance:
        return "stalled"
    return "converged" if abs(energy - minimum) <= _SAME_BASIN * minimum else "another basin"


def balanced(verdict: str, packing: Packing, tolerance: float, note: str = "", stiffness: float = 1.0) -> Trial:
    """Check the claim that no force above a tolerance is left, by forces computed anew. Rounding of positions is
    multiplied with a stiffness, force over length."""
    left = plain_max_force(packing)
    size = float(np.abs(packing.box).max())
    return Trial(verdict, note or f"max force {left:.1g}", left, tolerance + _ROUNDING * max(1.0, stiffness * size))


def worst_of(*trials: Trial) -> Trial:
    """Of several checks of one run, which has one verdict, the one that it fails by most."""
    if len({trial.verdict for trial in trials}) > 1:
        raise ValueError(f"checks of one run with several verdicts: {[trial.verdict for trial in trials]}")
    return max(trials, key=lambda trial: trial.excess if np.isfinite(trial.excess) else np.inf)


# Okabe & Ito; from the bottom of a cell to its top. Pale where all is well or said, strong where numbers are lost.
COLOURS = {"converged": GREEN, "another basin": SKY, "stalled": ORANGE, "blew up": RED, "refused": GREY, SILENT: PINK}
_FILLED = 0.9  # of a cell, so that cells stand apart
_SIZE = (7.6, 5.6)
_LONG = 36  # letters of a label, from which on three do not fit side by side
_HALF = 0.5  # share of runs that fail, at the boundary
_FAILURES = ("stalled", "blew up", "refused", "silent")
LEAD = (
    "Every cell is one pair of conditions, filled by the shares of how runs of several seeds ended. Converged: met its "
    "tolerance where it should; another basin: met it in another minimum, or on another path; stalled: says that it "
    "ended above it; blew up: positions or energies ran away; refused: an error instead of a number. Numbers given "
    "as right are checked, as each caption says, by physics written anew from the definitions, at the state where the "
    "run ended: one that does not follow from it is a silent wrong number. Whether that state is in the right basin or "
    "on the right path a run cannot know: a map tells by runs with finer steps, or by what it started beside. "
    "A boundary is where half of the runs or more fail, from there to the end of the axis; cells that fail before "
    "values that work are counted apart. Legends count runs; contents and choices count the pairs of conditions at "
    "which some run did not converge, by how most of their runs ended."
)


@dataclass(frozen=True)
class Axis:
    """One condition of a map."""

    label: str  # with its unit
    values: tuple[float | str, ...]  # numbers, or names on an axis without a scale
    default: float | None = None  # jamlab's own, None where it has none
    logarithmic: bool = True  # whether factors count, or differences

    def scale(self, values: Any) -> Any:
        """Values on the scale of the axis."""
        plain = np.asarray(values, dtype=np.float64)
        return np.log(plain) if self.logarithmic else plain

    def back(self, scaled: Any) -> float:
        """The value at a place on the scale."""
        return float(np.exp(scaled) if self.logarithmic else scaled)

    def places(self, values: Any) -> Any:
        """Where values lie between the cells 0, 1, 2, ... of the axis; up to half a cell beyond the ends."""
        x, known = self.scale(values), self.scale(self.values)
        return np.interp(x, known, np.arange(len(known))) - 0.5 * (x < known[0]) + 0.5 * (x > known[-1])

    def text(self, value: float | str) -> str:
        """A value as a label."""
        return value if isinstance(value, str) else f"{value:.3g}"


def log_axis(label: str, low: float, high: float, default: float | None = None, count: int = 12) -> Axis:
    """An axis with equal factors between its values, each rounded to three digits."""
    return Axis(label, tuple(float(f"{v:.3g}") for v in np.geomspace(low, high, count)), default)


def linear_axis(label: str, low: float, high: float, default: float | None = None, count: int = 12) -> Axis:
    """An axis with equal differences between its values, each rounded to four digits."""
    return Axis(label, tuple(float(f"{v:.4g}") for v in np.linspace(low, high, count)), default, logarithmic=False)


@dataclass(frozen=True)
class Map:
    """A map before it is measured."""

    name: str  # of its table and its files
    title: str  # what it shows, in one line
    # x, y: conditions: x a parameter of a method, y what it works on
    x: Axis
    y: Axis
    seeds: int  # runs at every pair
    attempt: Callable[[Any, Any, int], Trial]  # function of x, y and seed: one run
    meaning: str  # what the map shows
    check: str  # what the independent check of every run is
    # function of y and seed: x where theory puts the boundary; and what that is
    limit: tuple[Callable[[Any, int], float], str] | None = None
    elsewhere: str = "another basin"  # what "another basin" is in this map

    @property
    def study(self) -> Study:
        """The map as a study, with one task for each row."""
        tasks = {self.y.text(y): partial(self.rows, y) for y in self.y.values}
        return Study(self.name, self.title, tasks, self.draw)

    def draw(self, tables: EnsembleTables) -> Drawing:
        """Draw the map, with the distance of the default from where runs fail."""
        rows = tables.read(self.name)
        distance = default_distance(self, rows)
        place = f" Default {distance}." if distance else ""
        caption = f"{self.meaning} Check: {self.check}{place} {rows['runs'].max()} seeds."
        listed = pd.DataFrame({"map": self.name} | {str(name): rows[name] for name in rows})
        return Drawing(self.name, failure_figure(self, rows), caption, rows=[listed], text=[_table(self, rows)])

    def rows(self, y: float | str) -> Iterator[dict[str, Any]]:
        """Make all runs of one y, and count their verdicts for every x."""
        seeds, limits = range(1, self.seeds + 1), []
        for seed in seeds if self.limit else ():
            with suppress(JamlabError):  # then every run of the seed is refused
                limits.append(float(self.limit[0](y, seed)))  # type: ignore[index]
        limit = float(np.median(limits)) if limits else float("nan")
        for x in self.x.values:
            trials = [attempt(partial(self.attempt, x, y, seed)) for seed in seeds]
            yield {"x": x, "y": y, **summary(trials), "limit": limit}


def summary(trials: list[Trial]) -> dict[str, Any]:
    """Count verdicts; the worst error over what is allowed, and what the worst run says."""
    worst = max(trials, key=lambda trial: (VERDICTS.index(trial.verdict), trial.excess))
    return {
        "runs": len(trials),
        **{verdict: sum(trial.verdict == verdict for trial in trials) for verdict in VERDICTS},
        "worst": max(trial.excess for trial in trials),
        "note": "" if worst.verdict == "converged" else worst.note[:100],
    }


def shares(chart: Map, table: pd.DataFrame, verdict: str) -> np.ndarray:
    """(y, x) share of the runs that ended in a verdict; not a number where none was made."""
    found = table.assign(share=table[verdict] / table["runs"]).pivot(index="y", columns="x", values="share")
    return found.reindex(index=chart.y.values, columns=chart.x.values).to_numpy(dtype=np.float64)


def limits_of_rows(chart: Map, table: pd.DataFrame) -> np.ndarray:
    """(y,) limit of theory in each row; not a number where there is none."""
    return table.groupby("y")["limit"].first().reindex(chart.y.values).to_numpy(dtype=np.float64)


# distance of a default from a boundary --------------------------------------------------------------------------------


@dataclass(frozen=True)
class Distance:
    """From a default to the nearest boundary, from which on half of the runs fail, and to the limit of theory."""

    default: float  # value on its axis
    boundary: float  # value there; nan if the map holds none
    where: str  # the other condition, such as "y = 3"
    axis: Axis  # which it is measured along
    limit: float = np.nan  # of theory; nan if the map draws none
    scattered: int = 0  # cells in which half of the runs fail, or more, but not on to an end of the axis

    @property
    def far(self) -> float:
        """Factor, or difference on a linear axis; infinite if the map holds no boundary."""
        return self._to(self.boundary)

    def _to(self, value: float) -> float:
        if np.isnan(value):
            return np.inf
        if not self.axis.logarithmic:
            return abs(value - self.default)
        return max(value / self.default, self.default / value)

    def _side(self, value: float) -> str:
        how = f"a factor {self._to(value):.2g}" if self.axis.logarithmic else f"{self._to(value):.2g}"
        return f"{how} {'below' if self.default < value else 'above'}"

    def __str__(self) -> str:
        nearest = "no boundary within the map"
        if np.isfinite(self.far):
            nearest = f"{self._side(self.boundary)} the boundary {self.boundary:.3g} ({self.where})"
        limit = "" if np.isnan(self.limit) else f", {self._side(self.limit)} the limit drawn, {self.limit:.3g}"
        cells, them = ("1 cell fails", "it") if self.scattered == 1 else (f"{self.scattered} cells fail", "them")
        apart = f"; {cells} although values beyond {them} work" if self.scattered else ""
        return f"{self.default:g}: {nearest}{limit}{apart}"


def default_distance(chart: Map, table: pd.DataFrame) -> Distance | None:
    """The least distance of the default from a boundary, along x if x has a default, else along y; None without one.

    A boundary is where the share of failures crosses one half and stays there to the end of the axis: a cell that fails
    alone, such as one of two seeds that stalled, does not say that values beyond it fail. Such cells are counted.
    If both axes have a default, only the rows around y's own count, and the limit is that at y's own. Rows in which
    every value fails have no boundary.
    """
    failed = np.sum([shares(chart, table, verdict) for verdict in _FAILURES], axis=0)
    limits = limits_of_rows(chart, table)
    axis, other = chart.x, chart.y
    if axis.default is None:
        axis, other, failed = chart.y, chart.x, failed.T
        limits = np.full(len(failed), np.nan)  # those are limits of x
    if axis.default is None:
        return None
    lines = list(range(len(failed)))
    if other.default is not None:  # its cell, or both between which it lies
        place = float(np.clip(other.places(other.default), 0, len(failed) - 1))
        lines = sorted({int(np.floor(place)), int(np.ceil(place))})
    works = [k for k in lines if failed[k].min() < _HALF]  # elsewhere all values of the parameter fail
    name = "y" if axis is chart.x else "x"
    boundaries = {k: _boundary(axis, axis.default, failed[k]) for k in works}
    found = [
        Distance(axis.default, at, f"{name} = {other.text(other.values[k])}", axis) for k, at in boundaries.items()
    ]
    if not found:
        return None
    nearest = min(found, key=lambda distance: distance.far)
    limit = _limit(nearest, other, limits[works], np.array(works))
    return replace(nearest, limit=limit, scattered=sum(int(_scattered(failed[k]).sum()) for k in works))


def _limit(distance: Distance, other: Axis, limits: np.ndarray, rows: np.ndarray) -> float:
    """The limit in the row of the default, between rows as it is drawn; the nearest of all rows without one."""
    known = np.isfinite(limits)
    if not known.any():
        return float("nan")
    if other.default is None:
        return min((float(limit) for limit in limits[known]), key=distance._to)
    axis = distance.axis
    return axis.back(np.interp(other.places(other.default), rows[known], axis.scale(limits[known])))


def _boundary(axis: Axis, default: float, failed: np.ndarray) -> float:
    """Where failures that last to an end of the axis begin, nearest to the default; itself if it fails there."""
    x, start = axis.scale(axis.values), axis.scale(default)
    if np.interp(start, x, failed) > _HALF:
        return default
    above = np.where(_scattered(failed), 0.0, failed) - _HALF
    k = np.flatnonzero((above[:-1] * above[1:] <= 0) & (above[:-1] != above[1:]))
    crossings = x[k] - (x[k + 1] - x[k]) * above[k] / (above[k + 1] - above[k])
    return axis.back(crossings[np.abs(crossings - start).argmin()]) if len(k) else float("nan")


def _scattered(failed: np.ndarray) -> np.ndarray:
    """Cells of a line that fail and have one that works on either side, next to them or farther out."""
    fails = failed >= _HALF
    from_start, from_end = (np.logical_and.accumulate(line) for line in (fails, fails[::-1]))
    return np.asarray(fails & ~from_start & ~from_end[::-1])


# pictures and tables --------------------------------------------------------------------------------------------------


def _table(chart: Map, table: pd.DataFrame) -> TextTable:
    """Pairs of conditions at which some run did not converge, with the verdict of most of its runs."""
    shown = table[table["converged"] < table["runs"]]
    lines, marks = [], []
    for row in shown.to_dict("records"):
        marks.append(SILENT if row[SILENT] else max(VERDICTS, key=lambda verdict: row[verdict]))
        lines.append(
            [
                chart.x.text(row["x"]),
                chart.y.text(row["y"]),
                *(str(int(row[verdict])) for verdict in VERDICTS),
                str(row["note"]),
            ]
        )
    columns = [chart.x.label, chart.y.label, *VERDICTS, "worst run"]
    return TextTable(columns, lines, marks=marks, folded=f"{len(lines)} pairs of conditions in numbers")


def failure_figure(chart: Map, table: pd.DataFrame) -> Figure:
    """Draw a map from its table; a solid line is the limit of theory, dashed lines are jamlab's defaults."""
    figure = Figure(figsize=_SIZE, layout="constrained")
    axes = figure.subplots()
    handles = [*_fill_cells(axes, chart, table), *_draw_limit(axes, chart, table), *_draw_defaults(axes, chart)]
    for axis, side in ((chart.x, axes.xaxis), (chart.y, axes.yaxis)):
        side.set_ticks(range(len(axis.values)), [tick_text(value) for value in axis.values], fontsize=TICK - 1)
        side.set_label_text(axis.label, fontsize=LABEL)
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
        look: dict[str, Any] = {"facecolor": COLOURS[verdict], "hatch": hatch, "linewidth": 0}
        look["edgecolor"] = "black" if hatch else "none"
        axes.bar(columns[some], _FILLED * share[some], _FILLED, floor[some], **look)
        floor = floor + _FILLED * share
        count = int(table[verdict].sum())
        if count or verdict == SILENT:
            name = {SILENT: "silent wrong number", "another basin": chart.elsewhere}.get(verdict, verdict)
            handles.append(Patch(facecolor=COLOURS[verdict], hatch=hatch, label=f"{name}: {count}"))
    return handles


def _draw_limit(axes: Axes, chart: Map, table: pd.DataFrame) -> list[Line2D]:
    limits = limits_of_rows(chart, table)
    rows = np.flatnonzero(np.isfinite(limits))
    if chart.limit is None or not len(rows):
        return []
    places = chart.x.places(limits[rows])
    if len(rows) == 1:
        places, rows = np.repeat(places, 2), np.array([rows[0] - 0.5, rows[0] + 0.5])
    line = axes.plot(places, rows, color="black", linewidth=2.2, path_effects=[withStroke(linewidth=5, foreground="w")])
    line[0].set_label(chart.limit[1])
    return line


def _draw_defaults(axes: Axes, chart: Map) -> list[Line2D]:
    halo = [withStroke(linewidth=4, foreground="w")]
    look: dict[str, Any] = {"color": "black", "linewidth": 1.6, "linestyle": (0, (4, 2)), "path_effects": halo}
    ways = ((chart.x, axes.axvline), (chart.y, axes.axhline))
    drawn = [draw(float(axis.places(axis.default)), **look) for axis, draw in ways if axis.default is not None]
    if drawn:
        drawn[0].set_label("default of jamlab")
    return drawn[:1]
