"""Draw one chart after another and write CSV, pictures and one HTML page of them."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from jamlab.figures.html_page import Section, TextTable, save_png, write_csv, write_report
from jamlab.storage.atomic_file import make_folder
from jamlab.storage.verified_file import versions


@dataclass(frozen=True)
class Chart:
    """One chart as the page shows it.

    Attributes:
        title: heading of its section.
        caption, figure: the picture.
        table: its numbers, for the reader.
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
    draw: Callable[[str], Chart],
    charts: Iterable[str],
    facts: Mapping[str, str],
    *,
    opening: Sequence[Section] = (),
    progress: Callable[[str], None] | None = None,
) -> None:
    """Draw every chart, and write NAME.csv, NAME.html and one PNG for each chart.

    The CSV file grows with every chart, so that an interrupted run leaves what it has drawn.

    Args:
        folder: made if it is not there.
        name: of the CSV and HTML files.
        title, lead: heading and first paragraph of the page.
        draw: function that makes the chart of a name.
        charts: names.
        facts: name -> value, how it was made, beside the versions.
        opening: sections before the charts.
        progress: called with the name of each chart before it is drawn.

    Raises:
        StorageError: the folder cannot be written.
    """
    make_folder(folder)
    rows: list[Mapping[str, Any]] = []
    sections: list[Section] = []
    for key in charts:
        if progress is not None:
            progress(key)
        chart = draw(key)
        rows += chart.rows
        png = save_png(chart.figure, folder / f"{key}.png")
        sections.append(Section(chart.title, png, chart.caption, [chart.table]))
        write_csv(folder / f"{name}.csv", pd.DataFrame(rows))
    write_report(folder / f"{name}.html", title, lead, [*opening, *sections], {**facts, **versions()})
