"""Draw cost against error, topic by topic, from data that ship with jamlab or are measured anew."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

from jamlab.figures.html_page import Section, TextTable
from jamlab.storage.atomic_file import make_folder
from jamlab.studies.chart_page import Chart, write_charts
from jamlab.studies.cost.curve_figure import curve_figure
from jamlab.studies.cost.curve_points import SLACK, Point, dominated, price
from jamlab.studies.cost.topic import measure_trials, shipped_trials
from jamlab.studies.cost.topics import TOPICS
from jamlab.studies.measured_charts import MeasuredCharts, Say, source

_LEAD = (
    "Each curve is one method along its own dial: median cost on one core and mean error over packings, with the 10 to "
    "90 % of them. A mean above its band is carried by a few packings. A ring marks what jamlab does by default. "
    "'exact' below the break of an axis: the difference to the reference is none, or below the floor, 100 times the "
    "error of the reference itself. Where no reference is known that well, a hatched strip reaches up to its error, "
    "and what lies in there is not ranked. Open marks: some packings gave no number. "
    "Half marks: runs were cut short by a limit of time, and stand where they came."
)

OFF_COLUMNS = ["topic: panel", "default", "cost", "error", "times the cheapest as good", "reason"]

TOPIC_CHARTS = MeasuredCharts(
    *("topic", "packing", TOPICS),
    tasks=lambda topic: {str(seed) for seed in topic.seeds},
    shipped=shipped_trials,
    measure=lambda path, name, progress: measure_trials(path, TOPICS[name], progress=progress),
)


def speed_accuracy(
    out: Path, topics: Sequence[str] = (), *, measure: bool = False, progress: Say | None = None
) -> dict[str, list[Point]]:
    """Draw the topics, and write speed-accuracy.csv, one PNG for each and speed-accuracy.html.

    Args:
        out: folder, made if it is not there.
        topics: names of `TOPICS`; all if empty.
        measure: measure the packings that OUT/TOPIC.csv does not hold, and draw these files instead of what ships.
        progress: called with the name of each topic, or of each packing that is measured.

    Returns:
        Points of each topic.

    Raises:
        InputError: there is no such topic.
        StorageError: the folder cannot be written, or holds another measurement.
    """
    names = TOPIC_CHARTS.names(topics)
    make_folder(out)
    tables = TOPIC_CHARTS.tables(out, names, measure=measure, progress=progress)
    found = {name: TOPICS[name].points(table.rows) for name, table in tables.items()}

    def chart(name: str) -> Chart:
        topic, points = TOPICS[name], found[name]
        caption = f"Reference: {topic.reference}. Settings: {topic.dial}. {tables[name].made}."
        beaten = dominated(points)
        front = [p.ranked and not b for p, b in zip(points, beaten, strict=True)]
        rows = [{"topic": name, **asdict(p), "on_front": f} for p, f in zip(points, front, strict=True)]
        table = _table(topic.error, points, beaten)
        return Chart(topic.title, caption, curve_figure(topic.title, topic.error, points), table, rows)

    off = defaults_off_the_front(found)
    opening = [Section("Defaults off their front", tables=[TextTable(OFF_COLUMNS, off, words=True)])] if off else []
    title, made = "Cost against error", source(measure)
    write_charts(out, "speed-accuracy", title, _LEAD, chart, names, made, opening=opening, progress=progress)
    return found


def defaults_off_the_front(found: Mapping[str, Sequence[Point]]) -> list[list[str]]:
    """A row of `OFF_COLUMNS` for every default that costs more than 1.25 times the cheapest one as good."""
    rows = []
    for name, points in found.items():
        for point in points:
            paid = price(point, points)
            if point.default and paid > SLACK:
                setting = f"{point.method} {point.setting}".rstrip()
                numbers = [f"{point.seconds:.2g} s", _error(point), f"{paid:.1f}"]
                rows.append([f"{name}: {point.panel}", setting, *numbers, TOPICS[name].reason or "-"])
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
    return TextTable(columns, rows, marks=marks)
