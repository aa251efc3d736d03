"""The whole speed-accuracy measurement: trials, CSV, pictures, one page."""

import csv
import os
import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, fields
from pathlib import Path

from jamlab.benchmarks.cpu_time import one_core
from jamlab.benchmarks.speed_accuracy.pareto_figure import pareto_figure
from jamlab.benchmarks.speed_accuracy.topics import TOPICS
from jamlab.benchmarks.speed_accuracy.trial import Trial, dominated
from jamlab.checks import check_choice
from jamlab.figures.html_page import Table, save, write_page
from jamlab.packing.atomic_file import atomic_file, make_folder
from jamlab.packing.versions import versions


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
        progress: called with each topic's name.

    Returns:
        Trials of each topic.

    Raises:
        InputError: there is no such topic.
        StorageError: the folder cannot be written.
    """
    for name in topics:
        check_choice("topic", name, TOPICS)
    make_folder(out)
    began = time.perf_counter()
    found: dict[str, list[Trial]] = {}
    pictures, tables = {}, []
    for name in topics or TOPICS:
        if progress is not None:
            progress(name)
        topic = TOPICS[name]
        with one_core():
            found[name] = topic.trials(quick)
        caption = f"{topic.title}. Reference: {topic.reference}." + (f" {topic.verdict}" if topic.verdict else "")
        pictures[caption] = save(pareto_figure(topic, found[name]), out / f"{name}.png")
        tables.append(_table(topic.title, found[name]))
        write_trials(out / "speed-accuracy.csv", found)
    facts = {
        "wall time": f"{time.perf_counter() - began:.0f} s",
        "size": "quick" if quick else "full",
        "machine": f"{platform.machine()}, {os.cpu_count()} cores, one used",
        **versions(),
    }
    lead = (
        "Each point is one method with one setting. Points that another one beats in time or error, and equals in the "
        "other, are grey; times within 20 % count as equal. A ring marks what jamlab does by default."
    )
    write_page(out / "speed-accuracy.html", "Speed against accuracy", lead, tables, pictures, facts)
    return found


def write_trials(path: Path, found: dict[str, list[Trial]]) -> None:
    """Write all trials as CSV, with their topic and whether they are on the front."""
    with atomic_file(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        names = [f.name for f in fields(Trial)]
        writer.writerow(["topic", *names, "on_front"])
        for name, trials in found.items():
            for trial, beaten in zip(trials, dominated(trials), strict=True):
                writer.writerow([name, *asdict(trial).values(), not beaten])


def defaults_off_the_front(found: dict[str, list[Trial]]) -> list[str]:
    """One line for every default that another method beats."""
    lines = []
    for name, trials in found.items():
        for trial, beaten in zip(trials, dominated(trials), strict=True):
            if trial.default and beaten:
                lines.append(f"{name}, {trial.panel}: {trial.method} {trial.setting}".rstrip())
    return lines


def _table(title: str, trials: list[Trial]) -> Table:
    rows = []
    for t, beaten in zip(trials, dominated(trials), strict=True):
        mark = " (default)" if t.default else ""
        rows.append(
            [t.panel, t.method + mark, t.setting, f"{t.seconds:.3g}", f"{t.error:.2g}", "" if beaten else "yes", t.note]
        )
    return Table(title, ["panel", "method", "setting", "seconds", "error", "on the front", "note"], rows)
