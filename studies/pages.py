"""Write studies as files: a picture, its numbers, and one page of several."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from jamlab.errors import JamlabError
from jamlab.figures.save_picture import save_picture
from jamlab.processes.progress import Progress, no_progress
from jamlab.processes.side_by_side import run_side_by_side
from jamlab.storage.atomic_file import atomic_file, make_folder
from jamlab.storage.verified_file import versions
from studies import registry
from studies.ensemble_tables import EnsembleTables
from studies.html_page import Section, TextTable, write_report
from studies.panels import Drawing
from studies.papers.verdicts import COLUMNS, SUMMARY, Comparison, compare, summary
from studies.study import Group, Overview, Study

VERDICTS = "verdicts.csv"
_FEW = 4  # studies of a process: it takes as long to start
Drawn = tuple[Drawing, bytes]  # with its PNG


def file_names(names: Sequence[str], page: str) -> list[str]:
    """Names of the files that are written of studies and of their page."""
    return [f"{name}.{kind}" for name in names for kind in ("png", "pdf", "csv")] + [f"{page}.html", VERDICTS, SUMMARY]


def write_page(
    folder: Path,
    name: str,
    group: Group,
    tables: EnsembleTables,
    *,
    opening: Sequence[Section] = (),
    pdf: bool = True,
    processes: int = 1,
    progress: Progress = no_progress,
) -> tuple[list[Drawing], dict[str, str]]:
    """Draw the studies of a group, and write PNG, CSV and with `pdf` PDF of each, and one page NAME.html of all.
    Returns what was drawn, and by name why another was not. What was drawn before an interruption is there."""
    make_folder(folder)
    one, names = (
        partial(_draw_and_write, tables=tables, folder=folder, pdf=pdf),
        [study.name for study in group.studies],
    )

    def tell(name: str, *_: Any) -> None:
        progress(names.index(name) / len(names), name)

    if min(processes, len(names) // _FEW) > 1:
        found = run_side_by_side(one, names, processes, report=tell)
    else:
        found = [one(study, partial(tell, study.name)) for study in group.studies]
    drawn = [each for each in found if not isinstance(each, str)]
    failed = {item: each for item, each in zip(names, found, strict=True) if isinstance(each, str)}
    studies = {study.name: study for study in group.studies}
    sections = [*opening, *(_section(studies[drawing.name], drawing, png, tables) for drawing, png in drawn)]
    claims = [claim for drawing, _ in drawn for claim in drawing.claims]
    if group.overview is not None and claims:
        sections.insert(0, _overview(folder, group.overview, claims, sections, pdf))
    if failed:
        rows = [list(item) for item in failed.items()]
        sections.append(Section("Not drawn", tables=[TextTable(("study", "reason"), rows, words=True)]))
    drawings = [drawing for drawing, _ in drawn]
    facts = {**tables.facts, **versions()}
    write_report(
        folder / f"{name}.html", group.title, group.lead(drawings), sections, facts, group.assets, group.columns
    )
    return drawings, failed


def write_verdicts(folder: Path, claims: Sequence[Comparison]) -> None:
    """Write the numbers of papers beside ours as CSV, and their verdicts as text."""
    write_csv(folder / VERDICTS, pd.DataFrame([claim.row() for claim in claims]))
    with atomic_file(folder / SUMMARY) as temporary:
        temporary.write_text("\n".join(summary(claims)) + "\n", encoding="utf-8")


def draw(study: Study | str, tables: EnsembleTables) -> Drawing:
    """Draw one study, by its name one of all that there are."""
    known = registry.studies()[study] if isinstance(study, str) else study
    drawing = known.draw(tables)
    drawing.name, drawing.claims = known.name, compare(known.name, tables)
    return drawing


def _draw_and_write(
    study: Study | str, report: Callable[..., None], *, tables: EnsembleTables, folder: Path, pdf: bool
) -> Drawn | str:
    report("begun")
    try:
        drawing = draw(study, tables)
    except JamlabError as error:
        return str(error)
    png = _write_files(folder, drawing, pdf)
    drawing.figure = Figure()  # of a process to another, pictures go as files
    return drawing, png


def _write_files(folder: Path, drawing: Drawing, pdf: bool) -> bytes:
    """Write the points of a drawing as CSV, its picture as PNG, and as PDF if wanted."""
    write_csv(folder / f"{drawing.name}.csv", drawing.table)
    png = save_picture(drawing.figure, folder / f"{drawing.name}.png")
    if pdf:
        drawing.figure.set_layout_engine("none")  # laid out by now; once more would double the time
        save_picture(drawing.figure, folder / f"{drawing.name}.pdf")
    return png


def _overview(
    folder: Path, overview: Overview, claims: Sequence[Comparison], sections: Sequence[Section], pdf: bool
) -> Section:
    """Write the picture of all numbers, and its section: rows that lead to the figures."""
    _write_files(folder, overview.draw(claims), pdf)
    anchors = {section.heading.partition(":")[0]: section.anchor for section in sections}
    return Section(overview.title, fragment=overview.rows(claims, anchors))


def _section(study: Study, drawing: Drawing, png: bytes, tables: EnsembleTables) -> Section:
    made = f" {tables.made[study.name]}." if study.name in tables.made else ""
    cells, marks = [c.cells for c in drawing.claims], [str(c.verdict) for c in drawing.claims]
    verdicts = [TextTable(COLUMNS, cells, marks=marks, words=True)] if cells else []
    heading = f"{study.name}: {study.title}"
    return Section(heading, png, f"{drawing.caption}{made}", [*verdicts, *drawing.text, *_values(drawing)])


def _values(drawing: Drawing) -> list[TextTable]:
    """Numbers of a figure beside those of papers, with their intervals."""
    rows = [
        [name, f"{one['value']:.4g}", f"{one['low']:.4g} to {one['high']:.4g}" if np.isfinite(one["low"]) else "–"]
        for name, one in drawing.numbers.items()
    ]
    return [TextTable(("number", "value", "95 % interval"), rows, folded=f"{len(rows)} more numbers")] if rows else []


def write_csv(path: Path, table: pd.DataFrame) -> None:
    """Write a table as CSV with 8 significant digits; missing values are empty."""
    with atomic_file(path) as temporary:
        table.to_csv(temporary, index=False, float_format="%.8g")
