"""Measure speed against accuracy, topic by topic, and write CSV, pictures and one page."""

from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path

from jamlab.benchmarks.chart_page import Chart, write_charts
from jamlab.benchmarks.cpu_time import one_core
from jamlab.benchmarks.speed_accuracy.pareto_figure import pareto_figure
from jamlab.benchmarks.speed_accuracy.topics import TOPICS
from jamlab.benchmarks.speed_accuracy.trial import Trial, dominated
from jamlab.checks import check_choice
from jamlab.figures.html_page import TextTable

_LEAD = (
    "Each point is one method with one setting. Points that another one beats in time or error, and equals in the "
    "other, are grey; times within 20 % count as equal. A ring marks what jamlab does by default."
)


def speed_accuracy(
    out: Path,
    topics: Sequence[str] = (),
    *,
    quick: bool = False,
    progress: Callable[[str], None] | None = None,
) -> dict[str, list[Trial]]:
    """Measure, and write speed-accuracy.csv, one PNG for each topic and speed-accuracy.html.

    Args:
        out: folder, made if it is not there.
        topics: names of `TOPICS`; all if empty.
        quick: fewer and smaller packings, under a minute for all topics.
        progress: called with the name of each topic.

    Returns:
        Trials of each topic.

    Raises:
        InputError: there is no such topic.
        StorageError: the folder cannot be written.
    """
    for name in topics:
        check_choice("topic", name, TOPICS)
    found: dict[str, list[Trial]] = {}

    def measure(name: str) -> Chart:
        topic = TOPICS[name]
        with one_core():
            found[name] = topic.measure(quick)
        caption = f"Reference: {topic.reference}." + (f" {topic.verdict}" if topic.verdict else "")
        on_front = [not beaten for beaten in dominated(found[name])]
        rows = [{"topic": name, **asdict(t), "on_front": f} for t, f in zip(found[name], on_front, strict=True)]
        table = _table(topic.error, found[name], on_front)
        return Chart(topic.title, caption, pareto_figure(topic, found[name]), table, rows)

    title, names = "Speed against accuracy", topics or TOPICS
    write_charts(out, "speed-accuracy", title, _LEAD, measure, names, quick=quick, progress=progress)
    return found


def defaults_off_the_front(found: dict[str, list[Trial]]) -> list[str]:
    """One line for every default that another method beats."""
    lines = []
    for name, trials in found.items():
        for trial, beaten in zip(trials, dominated(trials), strict=True):
            if trial.default and beaten:
                lines.append(f"{name}, {trial.panel}: {trial.method} {trial.setting}".rstrip())
    return lines


def _table(error: str, trials: Sequence[Trial], on_front: Sequence[bool]) -> TextTable:
    """Trials as text, in their order."""
    columns = ["panel", "method", "setting", "time [s]", error, "on the front", "note"]
    rows = [
        [
            *(t.panel, t.method + (" (default)" if t.default else ""), t.setting),
            *(f"{t.seconds:.3g}", f"{t.error:.2g}", "yes" if front else "", t.note),
        ]
        for t, front in zip(trials, on_front, strict=True)
    ]
    return TextTable(columns, rows, marks=["on the front" if front else "beaten" for front in on_front])
