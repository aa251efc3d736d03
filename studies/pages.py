"""Write studies as files: a picture, its numbers, and one page of several."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from jamlab.errors import JamlabError
from jamlab.figures.explorer.write_page import explorer_assets
from jamlab.figures.save_picture import save_picture
from jamlab.processes.progress import Progress, no_progress
from jamlab.storage.atomic_file import atomic_file, make_folder
from jamlab.storage.verified_file import versions
from studies import registry
from studies.ensemble_tables import EnsembleTables
from studies.html_page import Section, TextTable, write_report
from studies.panels import Drawing, write_interval
from studies.papers.statements import caption
from studies.papers.verdicts import COLUMNS, SUMMARY, Comparison, compare, summary
from studies.study import Group, Study

VERDICTS = "verdicts.csv"


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
    progress: Progress = no_progress,
) -> tuple[list[Drawing], dict[str, str]]:
    """Draw the studies of a group, and write PNG, CSV and with `pdf` PDF of each, and one page NAME.html of all.
    Returns what was drawn, and by name why another was not. What was drawn before an interruption is there."""
    make_folder(folder)
    drawn: list[Drawing] = []
    failed: dict[str, str] = {}
    sections = list(opening)
    for k, study in enumerate(group.studies):
        progress(k / len(group.studies), study.name)
        try:
            drawn.append(draw(study, tables))
        except JamlabError as error:
            failed[study.name] = str(error)
            continue
        sections.append(_section(study, drawn[-1], write_files(folder, drawn[-1], pdf), tables))
    claims = [claim for drawing in drawn for claim in drawing.claims]
    if group.overview is not None and claims:
        write_files(folder, group.overview.forest(claims), pdf)
        anchors = {section.heading.partition(":")[0]: section.anchor for section in sections}
        sections.insert(0, Section(group.overview.TITLE, fragment=group.overview.forest_rows(claims, anchors)))
    if failed:
        rows = [list(item) for item in failed.items()]
        sections.append(Section("Not drawn", tables=[TextTable(("study", "reason"), rows, words=True)]))
    words: dict[str, Any] = {"title": group.title, "lead": group.lead(drawn), "columns": group.columns}
    words |= {"facts": {**tables.facts, **versions()}, "assets": "" if group.columns else explorer_assets()}
    write_report(folder / f"{name}.html", sections, **words)
    return drawn, failed


def draw(study: Study | str, tables: EnsembleTables) -> Drawing:
    """Draw one study, by its name one of all that there are."""
    known = registry.studies()[study] if isinstance(study, str) else study
    drawing = known.draw(tables)
    drawing.name, drawing.claims = known.name, compare(known.name, tables)
    drawing.caption = drawing.caption or caption(known.name)
    return drawing


def write_files(folder: Path, drawing: Drawing, pdf: bool) -> bytes:
    """Write the points of a drawing as CSV, its picture as PNG, which is returned, and as PDF if wanted."""
    write_csv(folder / f"{drawing.name}.csv", drawing.table)
    png = save_picture(drawing.figure, folder / f"{drawing.name}.png")
    if pdf:
        drawing.figure.set_layout_engine("none")  # laid out by now; once more would double the time
        save_picture(drawing.figure, folder / f"{drawing.name}.pdf")
    return png


def _section(study: Study, drawing: Drawing, png: bytes, tables: EnsembleTables) -> Section:
    made = f" {tables.made[study.name]}." if study.name in tables.made else ""
    cells, marks = [c.cells for c in drawing.claims], [str(c.verdict) for c in drawing.claims]
    shown = [TextTable(COLUMNS, cells, marks=marks, words=True)] if cells else []
    rows = [[name, *write_interval(v, 4).split(" ", 1)] for name, v in drawing.values.items()]
    more = [TextTable(("number", "value", "95 % interval"), rows, folded=f"{len(rows)} more numbers")] if rows else []
    heading = f"{study.name}: {study.title}"
    return Section(heading, png, f"{drawing.caption}{made}", [*shown, *drawing.text, *more])


def write_verdicts(folder: Path, claims: Sequence[Comparison]) -> None:
    """Write the numbers of papers beside ours as CSV, and their verdicts as text."""
    write_csv(folder / VERDICTS, pd.DataFrame([claim.row() for claim in claims]))
    with atomic_file(folder / SUMMARY) as temporary:
        temporary.write_text("\n".join(summary(claims)) + "\n", encoding="utf-8")


def write_csv(path: Path, table: pd.DataFrame) -> None:
    """Write a table as CSV with 8 significant digits; missing values are empty."""
    with atomic_file(path) as temporary:
        table.to_csv(temporary, index=False, float_format="%.8g")
