"""A stability map: two conditions, the runs at every pair of them, and how they ended."""

import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke

from jamlab.arrays import Array
from jamlab.errors import JamlabError
from jamlab.packing.packing import Packing
from jamlab.plotting.drawable import LABEL, LEGEND, TICK, in_unit
from jamlab.plotting.palette import GREEN, GREY, ORANGE, PINK, RED, SKY
from studies.ensemble_tables import EnsembleTables
from studies.panels import Drawing, TextTable
from studies.stability.plain_physics import plain_max_force
from studies.study import Study

_RUNAWAY = 10.0  # times the energy at the start: a descent loses energy, rounding gains far less than this
_SAME_MINIMUM = 1e-6  # relative difference of energies: far above what a force within tolerance leaves of them
_ROUNDING = 30 * float(np.finfo(np.float64).eps)  # of forces of order 1, summed in another order

SILENT = "silent"
# verdict -> its colour (Okabe & Ito), from the bottom of a cell to its top: pale where all is well or said
COLOURS = {
    "converged": GREEN,
    "another minimum": SKY,
    "stalled": ORANGE,
    "diverged": RED,
    "refused": GREY,
    SILENT: PINK,
}
VERDICTS = tuple(COLOURS)
_CLAIMS = ("converged", "another minimum")  # give a number as if it were right
_FILLED = 0.9  # of a cell, so that cells stand apart
WORDS: dict[str, dict[str, Any]] = tomllib.loads(Path(__file__).with_name("maps.toml").read_text(encoding="utf-8"))
LEAD = (
    "Every cell is one pair of conditions, filled by the shares of how runs of several seeds ended. Converged: met its "
    "tolerance in the expected minimum; another minimum: met it in another minimum, or on another path; stalled: "
    "reported a residual above its tolerance; diverged: positions or energies grew without bound; refused: an error "
    "instead of a number. Every number reported without a warning is compared with an independent implementation at "
    "the final state; a difference counts as a silent wrong number. Legends count runs; contents count the "
    "pairs of conditions at which some run did not converge, by how most of their runs ended."
)


@dataclass(frozen=True)
class Trial:
    """One run."""

    # one of `VERDICTS`. "converged": met its tolerance where it should. "another minimum": met it in another minimum.
    # "stalled": said that it ended above its tolerance. "diverged": positions or energies grew without bound.
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
        return judged(run())
    except JamlabError as error:
        return Trial("refused", str(error).splitlines()[0])


def judge_descent(left: float, tolerance: float, energy: float, start: float, minimum: float) -> str:
    """Judge a minimisation by the residual force, and by energies at its end, its start and the minimum beside."""
    if not (np.isfinite(left) and np.isfinite(energy)) or energy > _RUNAWAY * start:
        return "diverged"
    if left > tolerance:
        return "stalled"
    return "converged" if abs(energy - minimum) <= _SAME_MINIMUM * minimum else "another minimum"


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


@dataclass(frozen=True)
class Axis:
    """One condition of a map."""

    values: tuple[float, ...]
    default: float | None = None  # jamlab's own, None where it has none
    logarithmic: bool = True  # whether factors count, or differences

    @classmethod
    def of(cls, given: Mapping[str, Any], default: float | None) -> "Axis":
        """An axis as `maps.toml` has it: its values, or the ends and number of values with equal factors between them,
        each rounded to three digits, or with equal differences, to four."""
        if "values" in given:
            return cls(tuple(given["values"]), default, given.get("logarithmic", True))
        logarithmic = "factors" in given
        low, high, count = given["factors" if logarithmic else "differences"]
        values = (np.geomspace if logarithmic else np.linspace)(low, high, count)
        return cls(tuple(float(f"{v:.{3 if logarithmic else 4}g}") for v in values), default, logarithmic)

    def places(self, values: Any) -> Any:
        """Where values lie between the cells 0, 1, 2, ... of the axis; up to half a cell beyond the ends."""
        x, known = (np.asarray(v, dtype=np.float64) for v in (values, self.values))
        if self.logarithmic:
            x, known = np.log(x), np.log(known)
        return np.interp(x, known, np.arange(len(known))) - 0.5 * (x < known[0]) + 0.5 * (x > known[-1])


@dataclass(frozen=True)
class Map:
    """A map before it is measured.

    Its words and conditions stand in `maps.toml`: title; x, y: names of both conditions, x a parameter of a method, y
    what it works on; across, up: their values, see `Axis.of`; runs: at every pair; meaning; check; of some also the
    limit, and what "another minimum" is.
    """

    name: str  # of its table and its files
    attempt: Callable[[Any, Any, int], Trial]  # function of x, y and seed: one run
    limit: Callable[[Any, int], float] | None = None  # function of y and seed: x where theory puts the boundary
    defaults: tuple[float | None, float | None] = (None, None)  # jamlab's own x and y

    @property
    def words(self) -> dict[str, Any]:
        """Its words, by name."""
        return {"elsewhere": "another minimum"} | WORDS[self.name]

    def label(self, axis: str) -> str:
        """Name and unit of an axis, "x" or "y"."""
        return in_unit(self.words[axis], self.words.get(f"{axis}_unit", ""))

    @property
    def x(self) -> Axis:
        """The parameter of the method."""
        return Axis.of(self.words["across"], self.defaults[0])

    @property
    def y(self) -> Axis:
        """What it works on."""
        return Axis.of(self.words["up"], self.defaults[1])

    @property
    def study(self) -> Study:
        """The map as a study, with one task for each row."""
        tasks = {f"{y:.3g}": partial(self.rows, y) for y in self.y.values}
        return Study(self.name, self.words["title"], tasks, self.draw)

    def rows(self, y: float) -> Iterator[dict[str, Any]]:
        """Make all runs of one y, and count their verdicts for every x."""
        seeds, limits = range(1, self.words["runs"] + 1), []
        for seed in seeds if self.limit else ():
            with suppress(JamlabError):  # then every run of the seed is refused
                limits.append(float(self.limit(y, seed)))  # type: ignore[misc]
        limit = float(np.median(limits)) if limits else float("nan")
        for x in self.x.values:
            trials = [attempt(partial(self.attempt, x, y, seed)) for seed in seeds]
            yield {"x": x, "y": y, **summary(trials), "limit": limit}

    def draw(self, tables: EnsembleTables) -> Drawing:
        """Draw the map, and list the conditions at which some run did not converge."""
        table, words = tables.read(self.name), self.words
        shown = table[table["converged"] < table["runs"]].to_dict("records")
        marks = [SILENT if row[SILENT] else max(VERDICTS, key=row.__getitem__) for row in shown]
        lines = [[f"{row['x']:.3g}", f"{row['y']:.3g}", *(str(row[v]) for v in VERDICTS), row["note"]] for row in shown]
        columns = [self.label("x"), self.label("y"), *VERDICTS, "worst run"]
        text = TextTable(columns, lines, marks=marks, folded=f"{len(lines)} pairs of conditions in numbers")
        caption = f"{words['meaning']} Check: {words['check']} {table['runs'].max()} seeds."
        return Drawing(self.name, failure_figure(self, table), caption, rows=[table], text=[text])


def summary(trials: list[Trial]) -> dict[str, Any]:
    """Count verdicts; the worst error over what is allowed, and what the worst run says."""
    worst = max(trials, key=lambda trial: (VERDICTS.index(trial.verdict), trial.excess))
    return {
        "runs": len(trials),
        **{verdict: sum(trial.verdict == verdict for trial in trials) for verdict in VERDICTS},
        "worst": max(trial.excess for trial in trials),
        "note": "" if worst.verdict == "converged" else worst.note[:100],
    }


def shares(chart: Map, table: pd.DataFrame, verdict: str) -> Array:
    """(y, x) share of the runs that ended in a verdict; not a number where none was made."""
    found = table.assign(share=table[verdict] / table["runs"]).pivot(index="y", columns="x", values="share")
    return found.reindex(index=chart.y.values, columns=chart.x.values).to_numpy(dtype=np.float64)


def failure_figure(chart: Map, table: pd.DataFrame) -> Figure:
    """Draw a map from its table; a solid line is the limit of theory, dashed lines are jamlab's defaults."""
    figure = Figure(figsize=(7.6, 5.6), layout="constrained")
    axes = figure.subplots()
    handles = [*_fill_cells(axes, chart, table), *_draw_limit(axes, chart, table), *_draw_defaults(axes, chart)]
    for axis, side, name in ((chart.x, axes.xaxis, "x"), (chart.y, axes.yaxis, "y")):
        side.set_ticks(range(len(axis.values)), [tick_text(value) for value in axis.values], fontsize=TICK - 1)
        side.set_label_text(chart.label(name), fontsize=LABEL)
    axes.tick_params(axis="x", rotation=45)
    axes.tick_params(length=0)
    axes.set_xlim(-0.55, len(chart.x.values) - 0.45)
    axes.set_ylim(-0.55, len(chart.y.values) - 0.45)
    axes.spines[:].set_visible(False)
    axes.set_title(chart.words["title"], fontsize=LABEL)
    figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=LEGEND, frameon=False)
    return figure


def tick_text(value: float) -> str:
    """A value beside its cell; powers of ten as such."""
    if value and not 1e-2 <= abs(value) < 1e4:
        digits, exponent = f"{value:.2e}".split("e")
        power = f"10^{{{int(exponent)}}}"
        return f"${power}$" if digits == "1.00" else f"${float(digits):.2g}\\cdot{power}$"
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"


def _fill_cells(axes: Axes, chart: Map, table: pd.DataFrame) -> list[Patch]:
    columns, rows = (grid.ravel() for grid in np.meshgrid(range(len(chart.x.values)), range(len(chart.y.values))))
    floor, handles = rows - 0.5 * _FILLED, []
    for verdict, colour in COLOURS.items():
        share, count = np.nan_to_num(shares(chart, table, verdict)).ravel(), int(table[verdict].sum())
        some, hatch = share > 0, "xxx" if verdict == SILENT else None
        look: dict[str, Any] = {"facecolor": colour, "hatch": hatch, "edgecolor": "black" if hatch else "none"}
        axes.bar(columns[some], _FILLED * share[some], _FILLED, floor[some], linewidth=0, **look)
        floor = floor + _FILLED * share
        if count or verdict == SILENT:
            name = {SILENT: "silent wrong number", "another minimum": chart.words["elsewhere"]}.get(verdict, verdict)
            handles.append(Patch(label=f"{name}: {count}", **look))
    return handles


def _draw_limit(axes: Axes, chart: Map, table: pd.DataFrame) -> list[Line2D]:
    limits = table.groupby("y")["limit"].first().reindex(chart.y.values).to_numpy(dtype=np.float64)
    rows = np.flatnonzero(np.isfinite(limits))
    if chart.limit is None or not len(rows):
        return []
    places = chart.x.places(limits[rows])
    halo = [withStroke(linewidth=5, foreground="w")]
    return axes.plot(places, rows, color="black", linewidth=2.2, path_effects=halo, label=chart.words["limit"])


def _draw_defaults(axes: Axes, chart: Map) -> list[Line2D]:
    halo = [withStroke(linewidth=4, foreground="w")]
    look: dict[str, Any] = {"color": "black", "linewidth": 1.6, "linestyle": (0, (4, 2)), "path_effects": halo}
    ways = ((chart.x, axes.axvline), (chart.y, axes.axhline))
    drawn = [draw(float(axis.places(axis.default)), **look) for axis, draw in ways if axis.default is not None]
    if drawn:
        drawn[0].set_label("default of jamlab")
    return drawn[:1]
