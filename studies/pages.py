"""Write studies as files: a picture, its numbers, and one self-contained HTML page of several."""

import base64
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from jamlab.errors import JamlabError
from jamlab.figures.save_picture import save_picture
from jamlab.processes.progress import Progress, told
from jamlab.storage.atomic_file import atomic_file, make_folder
from jamlab.storage.verified_file import versions
from studies.ensemble_tables import EnsembleTables
from studies.html_page import render
from studies.panels import Drawing, TextTable, write_interval
from studies.papers.forest import TITLE, forest, forest_rows
from studies.papers.headline import NARROW, headline
from studies.papers.headline import TITLE as HEADLINE
from studies.papers.statements import caption
from studies.papers.verdicts import COLUMNS, RULE, SUMMARY, Comparison, compare, first_line, summary
from studies.registry import STUDIES
from studies.study import Group, Study

VERDICTS = "verdicts.csv"
_WIDE = 1.7  # width over height of a picture: a phone lets it slide instead of making it illegible


@dataclass(frozen=True)
class Section:
    """One part of a page: picture first, then what was measured."""

    heading: str  # also in the table of contents
    picture: str = ""  # PNG as base64, held inside the page; none by default
    wide: bool = False  # whether it holds panels side by side
    caption: str = ""  # of the picture
    tables: Sequence[TextTable] = ()  # in their order
    fragment: str = ""  # HTML above all of them

    @property
    def anchor(self) -> str:
        """Name of the section in links."""
        return re.sub(r"[^a-z0-9]+", "-", self.heading.lower()).strip("-")

    @property
    def marks(self) -> Counter[str]:
        """How often each mark stands in the tables of the section."""
        return Counter(mark for table in self.tables for mark in table.marks)


def file_names(names: Sequence[str], page: str) -> list[str]:
    """Names of the files that are written of studies and of their page."""
    return [f"{name}.{kind}" for name in names for kind in ("png", "pdf", "csv")] + [f"{page}.html", VERDICTS, SUMMARY]


def write_page(
    folder: Path,
    name: str,
    group: Group,
    tables: EnsembleTables,
    *,
    pdf: bool = True,
    progress: Progress | None = None,
) -> tuple[list[Drawing], dict[str, str]]:
    """Draw the studies of a group, and write PNG, CSV and with `pdf` PDF of each, and one page NAME.html of all, with a
    choice of rows by their marks. Returns what was drawn, and by name why another was not. What was drawn before an
    interruption is there."""
    make_folder(folder)
    drawn: list[Drawing] = []
    failed: dict[str, str] = {}
    sections: list[Section] = []
    for k, study in enumerate(group.studies):
        told(progress)(k / len(group.studies), study.name)
        try:
            drawn.append(draw(study, tables))
        except JamlabError as error:
            failed[study.name] = str(error)
            continue
        sections.append(_section(study, drawn[-1], write_files(folder, drawn[-1], pdf), tables))
    claims, lead = [claim for drawing in drawn for claim in drawing.claims], group.lead
    if group.overview and claims:
        lead = f"{lead} {first_line(claims)} {RULE}"
        anchors = {section.heading.partition(":")[0]: section.anchor for section in sections}
        sections[:0] = _overview(folder, claims, anchors, pdf)
    if failed:
        rows = [list(item) for item in failed.items()]
        sections.append(Section("Not drawn", tables=[TextTable(("study", "reason"), rows, words=True)]))
    marks: Counter[str] = sum((section.marks for section in sections), Counter())
    with atomic_file(folder / f"{name}.html") as temporary:
        facts = {**tables.facts, **versions()}
        page = render("page.html", group=group, lead=lead, sections=sections, marks=marks, facts=facts)
        temporary.write_text(page, encoding="utf-8")
    return drawn, failed


def draw(study: Study | str, tables: EnsembleTables) -> Drawing:
    """Draw one study, by its name one of all that there are."""
    known = STUDIES[study] if isinstance(study, str) else study
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
    width, height = drawing.figure.get_size_inches()
    picture = base64.b64encode(png).decode("ascii"), width > _WIDE * height
    return Section(f"{study.name}: {study.title}", *picture, f"{drawing.caption}{made}", [*shown, *drawing.text, *more])


def _overview(folder: Path, claims: Sequence[Comparison], anchors: Mapping[str, str], pdf: bool) -> list[Section]:
    """Write the pictures of all numbers and of the headline numbers; the sections that a page begins with."""
    chosen = headline(claims)
    png = base64.b64encode(write_files(folder, chosen, pdf)).decode("ascii")
    for picture in (headline(claims, NARROW), forest(claims)):
        write_files(folder, picture, pdf)
    rows = Section(TITLE, fragment=forest_rows(claims, anchors))
    return [Section(HEADLINE, png, True, chosen.caption), rows]


def write_verdicts(folder: Path, claims: Sequence[Comparison]) -> None:
    """Write the numbers of papers beside ours as CSV, and their verdicts as text."""
    write_csv(folder / VERDICTS, pd.DataFrame([claim.row() for claim in claims]))
    with atomic_file(folder / SUMMARY) as temporary:
        temporary.write_text("\n".join(summary(claims)) + "\n", encoding="utf-8")


def write_csv(path: Path, table: pd.DataFrame) -> None:
    """Write a table as CSV with 8 significant digits; missing values are empty."""
    with atomic_file(path) as temporary:
        table.to_csv(temporary, index=False, float_format="%.8g")
