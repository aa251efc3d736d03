"""A chart of cost against error: every method at every setting of its parameter, on many packings."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import pandas as pd

from jamlab.figures.html_page import Section, TextTable
from jamlab.processes.progress import Progress, no_progress
from jamlab.studies.cost.curves import SLACK, Point, curve_figure, dominated, points_of, price
from jamlab.studies.page import Page, measured, source_fact, write_page
from jamlab.studies.study import Shown, TableStudy
from jamlab.studies.table import MeasuredTable, Task

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
class Chart(TableStudy):
    """A chart before it is measured."""

    error: str  # label of the axis of errors
    parameter: str  # what the settings are
    reference: str  # what the error is measured against, and how well that is known
    measure: Callable[[int], Iterable[Trial]]  # function of a seed that makes the trials of one packing
    seeds: Sequence[int] = SEEDS  # of the packings
    # function that makes the points of the curves from all trials
    average: Callable[[pd.DataFrame], list[Point]] = points_of
    reason: str = ""  # why a default may lie off its front, in one line; "" if none does
    kind: ClassVar[str] = "topic"
    columns: ClassVar[Sequence[str]] = COLUMNS
    task: ClassVar[str] = "packing"

    @property
    def facts(self) -> Mapping[str, Any]:
        """Title, error and reference."""
        return {"title": self.title, "error": self.error, "reference": self.reference}

    def tasks(self) -> Mapping[str, Task]:
        """One task for each packing; the first one is measured twice: the first time also loads libraries."""
        warm = False

        def rows(seed: int) -> list[dict[str, Any]]:
            nonlocal warm
            if not warm:
                list(self.measure(seed))
                warm = True
            return [asdict(trial) for trial in self.measure(seed)]

        return {str(seed): partial(rows, seed) for seed in self.seeds}

    def points(self, folder: Path | None = None) -> list[Point]:
        """Points of all curves, from a folder of results or from the table that ships."""
        return self.average(self.table(folder).rows)

    def show(self, table: MeasuredTable) -> Shown:
        """Draw the curves."""
        return self._show_points(self.average(table.rows), table.made)

    def _show_points(self, points: Sequence[Point], made: str) -> Shown:
        beaten = dominated(points)
        front = [p.ranked and not b for p, b in zip(points, beaten, strict=True)]
        rows = [{"topic": self.name, **asdict(p), "on_front": f} for p, f in zip(points, front, strict=True)]
        caption = f"Reference: {self.reference}. Settings: {self.parameter}. {made}."
        figure = curve_figure(self.title, self.error, points)
        return Shown(figure, caption, [_table(self.error, points, beaten)], pd.DataFrame(rows))


_LEAD = (
    "Each curve is one method along its own parameter: median cost on one core and mean error over packings, with the "
    "10 to 90 % of them. A mean above its band is carried by a few packings. A ring marks what jamlab does by default. "
    "'exact' below the break of an axis: the difference to the reference is none, or below the floor, 100 times the "
    "error of the reference itself. Where no reference is known that well, a hatched strip reaches up to its error, "
    "and what lies in there is not ranked. Open marks: some packings gave no number. "
    "Half marks: runs were cut short by a limit of time, and stand where they came."
)
OFF_COLUMNS = ["topic: panel", "default", "cost", "error", "times the cheapest as good", "reason"]


def write_charts(
    out: Path, charts: Mapping[str, Chart], *, measure: bool = False, progress: Progress = no_progress
) -> dict[str, list[Point]]:
    """Draw charts, and write speed-accuracy.csv, one PNG for each and speed-accuracy.html; returns their points. With
    `measure` packings that OUT/CHART.csv does not hold are measured, and these files are drawn, not what ships."""
    tables = measured(out, charts, measure=measure, progress=progress)
    found = {name: charts[name].average(table.rows) for name, table in tables.items()}
    off = defaults_off_the_front(charts, found)
    opening = [Section("Defaults off their front", tables=[TextTable(OFF_COLUMNS, off, words=True)])] if off else []
    write_page(
        out,
        Page("speed-accuracy", "Cost against error", lambda claims: _LEAD, columns=1),
        {name: chart.heading for name, chart in charts.items()},
        lambda name: charts[name]._show_points(found[name], tables[name].made),
        source_fact(measure),
        opening=opening,
        progress=progress,
    )
    return found


def defaults_off_the_front(charts: Mapping[str, Chart], found: Mapping[str, Sequence[Point]]) -> list[list[str]]:
    """A row of `OFF_COLUMNS` for every default that costs more than 1.25 times the cheapest one as good."""
    rows = []
    for name, points in found.items():
        for point in points:
            paid = price(point, points)
            if point.default and paid > SLACK:
                setting = f"{point.method} {point.setting}".rstrip()
                numbers = [f"{point.seconds:.2g} s", _error(point), f"{paid:.1f}"]
                rows.append([f"{name}: {point.panel}", setting, *numbers, charts[name].reason or "-"])
    return rows


def _error(point: Point) -> str:
    if not point.ranked:
        return f"below {point.floor:.1e}"
    return "exact" if point.exact else f"{point.error:.1e}"


def _table(error: str, points: Sequence[Point], beaten: Iterable[bool]) -> TextTable:
    """Points as text, in their order."""
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
