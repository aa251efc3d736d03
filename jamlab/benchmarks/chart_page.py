"""Measure one chart after another and write CSV, pictures and one HTML page of them."""

import os
import platform
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from jamlab.figures.html_page import Section, TextTable, save_png, write_csv, write_report
from jamlab.packing.atomic_file import make_folder
from jamlab.packing.versions import versions


@dataclass(frozen=True)
class Chart:
    """One measurement as the page shows it.

    Attributes:
        title: heading of its section.
        caption, figure: the picture.
        table: what was measured, for the reader.
        rows: the same as values, for the CSV file.
    """

    title: str
    caption: str
    figure: Figure
    table: TextTable
    rows: Sequence[Mapping[str, Any]]


def write_charts(
    folder: Path,
    name: str,
    title: str,
    lead: str,
    measure: Callable[[str], Chart],
    charts: Iterable[str],
    *,
    quick: bool,
    progress: Callable[[str], None] | None = None,
) -> None:
    """Measure every chart, and write NAME.csv, NAME.html and one PNG for each chart.

    The CSV file grows with every chart, so that an interrupted run leaves what it has measured.

    Args:
        folder: made if it is not there.
        name: of the CSV and HTML files.
        title, lead: heading and first paragraph of the page.
        measure: function that measures the chart of a name.
        charts: names.
        quick: what the page says about the size of the measurement.
        progress: called with the name of each chart before it is measured.

    Raises:
        StorageError: the folder cannot be written.
    """
    make_folder(folder)
    began = time.perf_counter()
    rows: list[Mapping[str, Any]] = []
    sections: list[Section] = []
    for key in charts:
        if progress is not None:
            progress(key)
        chart = measure(key)
        rows += chart.rows
        png = save_png(chart.figure, folder / f"{key}.png")
        sections.append(Section(chart.title, png, chart.caption, [chart.table]))
        write_csv(folder / f"{name}.csv", pd.DataFrame(rows))
    facts = {
        "wall time": f"{time.perf_counter() - began:.0f} s",
        "size": "quick" if quick else "full",
        "machine": f"{platform.machine()}, {os.cpu_count()} cores, one used",
        **versions(),
    }
    write_report(folder / f"{name}.html", title, lead, sections, facts)
