"""Write studies as files: a picture and the numbers of each, and one self-contained HTML page of all of them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from markupsafe import Markup

from jamlab.errors import InputError, JamlabError
from jamlab.figures.html_page import Section, TextTable, save_picture, save_png, write_csv, write_report
from jamlab.processes.progress import Progress, no_progress
from jamlab.processes.side_by_side import run_side_by_side
from jamlab.storage.atomic_file import make_folder
from jamlab.storage.verified_file import versions
from jamlab.studies.claims import Claim
from jamlab.studies.study import Shown, TableStudy
from jamlab.studies.table import MeasuredTable


@dataclass(frozen=True)
class Page:
    """How the page of several studies looks."""

    name: str  # of its HTML file, and of the one CSV file of all numbers, see `each`
    title: str  # its heading
    lead: Callable[[Sequence[Claim]], str]  # function of all claims that gives the first paragraph
    each: bool = False  # whether every study writes PNG, PDF and CSV of its own, not only a PNG
    columns: int = 0  # of sections, see `jamlab.figures.html_page.write_report`
    assets: Markup = field(default_factory=Markup)  # styles and scripts that opening sections need


class Failure(NamedTuple):
    """A study that could not be drawn from its tables."""

    name: str
    reason: str


def write_page(
    folder: Path,
    page: Page,
    headings: Mapping[str, str],
    draw: Callable[[str], Shown],
    facts: Mapping[str, str],
    *,
    opening: Sequence[Section] = (),
    progress: Progress = no_progress,
    processes: int = 1,
) -> tuple[list[Shown], list[Failure]]:
    """Draw studies one after the other, or in processes, for which `draw` must be picklable, write their files, and one
    page of them; returns what was drawn, and what not. What was drawn before an interruption is there."""
    make_folder(folder)
    names = list(headings)
    one = partial(_draw_and_write, draw=draw, folder=folder, each=page.each)
    if min(processes, len(names)) > 1:
        begun: list[str] = []

        def tell(_: str, name: str) -> None:
            begun.append(name)
            progress((len(begun) - 1) / len(names), name)

        ended = run_side_by_side(one, names, processes, report=tell)
    else:
        ended = []
        for name in names:
            ended.append(one(name, partial(progress, len(ended) / len(names))))
            if not page.each:  # grows with every study
                rows = [each.rows for each in ended if isinstance(each, Shown)]
                write_csv(folder / f"{page.name}.csv", pd.concat(rows or [pd.DataFrame()]))
    drawn = [each for each in ended if isinstance(each, Shown)]
    failures = [each for each in ended if isinstance(each, Failure)]
    if not drawn:
        raise InputError(f"no study could be drawn; {failures[0].name}: {failures[0].reason}")
    sections = list(opening)
    for each in drawn:
        verdicts = [_verdicts(each.claims)] if each.claims else []
        sections.append(Section(headings[each.name], each.png, each.caption, [*verdicts, *each.tables]))
    if failures:
        sections.append(Section("Not drawn", tables=[TextTable(("study", "reason"), failures, words=True)]))
    lead = page.lead([c for each in drawn for c in each.claims])
    path = folder / f"{page.name}.html"
    write_report(path, page.title, lead, sections, {**facts, **versions()}, page.assets, page.columns)
    return drawn, failures


def _draw_and_write(
    name: str, progress: Callable[[str], Any], *, draw: Callable[[str], Shown], folder: Path, each: bool
) -> Shown | Failure:
    progress(name)
    try:
        shown = draw(name)
    except JamlabError as error:
        return Failure(name, str(error))
    _, png = write_files(name, shown, folder, each=each)
    return replace(shown, figure=None, name=name, png=png)


def write_files(name: str, shown: Shown, folder: Path, *, each: bool = True) -> tuple[list[Path], bytes | None]:
    """Write PNG, and with `each` PDF and CSV, of a study; returns their paths and the PNG itself."""
    make_folder(folder)
    paths, png = [], None
    if shown.figure is not None:
        paths = [folder / f"{name}.png", folder / f"{name}.pdf"][: 1 + each]
        png = save_png(shown.figure, paths[0])
        if each:
            shown.figure.set_layout_engine("none")  # laid out by now; once more would double the time
            save_picture(shown.figure, paths[1])
    if each:
        paths.append(folder / f"{name}.csv")
        write_csv(paths[-1], shown.rows)
    return paths, png


def _verdicts(claims: Sequence[Claim]) -> TextTable:
    """The numbers of one figure beside those of the paper."""
    columns = ("quantity", "measured", "95 % interval", "paper", "verdict", "how")
    rows = [
        (
            c.quantity,
            f"{c.value:.4g}" if np.isfinite(c.value) else "–",
            f"{c.low:.4g} to {c.high:.4g}" if c.measured else "–",
            c.paper_text,
            c.text,
            c.how,
        )
        for c in claims
    ]
    return TextTable(columns, rows, marks=[str(c.verdict) for c in claims], words=True)


def measured(
    out: Path, studies: Mapping[str, TableStudy], *, measure: bool, progress: Progress = no_progress
) -> dict[str, MeasuredTable]:
    """Table of each study: that of the folder, completed, if `measure`, and what ships otherwise."""
    make_folder(out)
    tables = {}
    for name, study in studies.items():
        if measure:
            study.run(out, progress)
        tables[name] = study.table(out if measure else None)
    return tables


def source_fact(measure: bool) -> dict[str, str]:
    """Where the data of a page come from, as a fact of it."""
    return {"data": "measured now" if measure else "shipped with jamlab"}
