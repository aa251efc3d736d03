"""A study is a piece of evidence: what is measured task by task, into which table, how it is drawn; pages of some."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np
import pandas as pd
from markupsafe import Markup
from matplotlib.figure import Figure

from jamlab.campaign.campaign import Campaign
from jamlab.campaign.plan import total_time
from jamlab.errors import InputError, JamlabError, StorageError
from jamlab.figures.save_picture import save_picture
from jamlab.processes.progress import Progress, no_progress
from jamlab.processes.side_by_side import run_side_by_side
from jamlab.storage.atomic_file import atomic_file, make_folder
from jamlab.storage.verified_file import versions
from studies.claims import Claim
from studies.html_page import Section, TextTable, write_report
from studies.table import MeasuredTable, Task, done_tasks, measure_table, read_table, shipped_table


def write_csv(path: Path, table: pd.DataFrame) -> None:
    """Write a table as CSV with 8 significant digits; missing values are empty."""
    with atomic_file(path) as temporary:
        table.to_csv(temporary, index=False, float_format="%.8g")


@dataclass(frozen=True)
class Shown:
    """What a study shows of its table."""

    figure: Figure | None = None  # the picture; None if there is none, or it is written, and then `png` holds it
    caption: str = ""  # what is drawn, from which data
    tables: Sequence[TextTable] = ()  # text for the reader, below the picture
    rows: pd.DataFrame = field(default_factory=pd.DataFrame)  # the numbers behind it, for the CSV file
    claims: Sequence[Claim] = ()  # numbers of a paper beside ours
    # further ones, each with value and ends of its interval, by name
    numbers: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    # name, png: of the study, and of its picture, once it is written
    name: str = ""
    png: bytes | None = None


@dataclass(frozen=True)
class Plan:
    """Tasks that are left of a study, and their CPU seconds by the table that ships; None: it lacks some."""

    name: str
    left: int
    seconds: float | None


@dataclass(frozen=True)
class Study(ABC):
    """A measurement that can be planned, run, gone on with and drawn, as `python -m studies` does."""

    name: str  # of its table, its picture and its files; unique among all studies
    title: str  # what it shows, in one line
    kind: ClassVar[str] = "study"

    @property
    def heading(self) -> str:
        """Heading of its section on a page."""
        return self.title

    @abstractmethod
    def plan(self, folder: Path) -> Plan:
        """Count the tasks that a folder of results does not hold."""

    @abstractmethod
    def run(self, folder: Path, progress: Progress = no_progress) -> None:
        """Measure what a folder of results does not hold, and save after every task."""

    @abstractmethod
    def draw(self, folder: Path | None = None) -> Shown:
        """Draw the results of a folder, or those that ship with jamlab."""


@dataclass(frozen=True)
class TableStudy(Study):
    """A study whose tasks are functions that give rows of one table.

    A subclass has `columns`, `tasks` and `show`:

        @dataclass(frozen=True)
        class Contacts(TableStudy):
            columns = ("n", "z")

            def tasks(self):
                return {f"{n}": partial(measure, n) for n in (16, 32)}  # measure(16) -> [{"n": 16, "z": 3.9}]

            def show(self, table):
                figure = Figure()
                table.rows.plot("n", "z", ax=figure.subplots())
                return Shown(figure, f"Contacts of small packings. {table.made}.", rows=table.rows)

        STUDY = Contacts("contacts-of-few", "Mean number of contacts against N")
    """

    columns: ClassVar[Sequence[str]] = ()  # of its table, besides `task` and `took`
    task: ClassVar[str] = "task"  # what one task is called

    @abstractmethod
    def tasks(self) -> Mapping[str, Task]:
        """Name of each task -> function that measures its rows."""

    @abstractmethod
    def show(self, table: MeasuredTable) -> Shown:
        """Draw the table."""

    @property
    def facts(self) -> Mapping[str, Any]:
        """What all rows share; a file with other facts is not gone on with."""
        return {"title": self.title}

    def file(self, folder: Path) -> Path:
        """Table of this study in a folder of results."""
        return folder / f"{self.name}.csv"

    def table(self, folder: Path | None = None) -> MeasuredTable:
        """Read its table from a folder of results, or the one that ships with jamlab."""
        return shipped_table(self.name) if folder is None else read_table(self.file(folder))

    def plan(self, folder: Path) -> Plan:
        """Count the tasks that a folder of results does not hold."""
        left = set(self.tasks()) - done_tasks(self.file(folder))
        if not left:
            return Plan(self.name, 0, 0.0)
        try:
            table = self.table()
        except StorageError:
            return Plan(self.name, len(left), None)
        took = table.rows.groupby("task")["took"].first()
        return Plan(self.name, len(left), float(took[took.index.isin(left)].sum()) if left <= table.tasks else None)

    def run(self, folder: Path, progress: Progress = no_progress) -> None:
        """Measure what a folder of results does not hold, on one core, and save after every task."""
        make_folder(folder)
        tasks = self.tasks()

        def tell(share: float, _: str) -> None:
            progress(share, f"{self.name}: {self.task} {round(share * len(tasks)) + 1} of {len(tasks)}")

        measure_table(self.file(folder), self.columns, tasks, self.facts, progress=tell)

    def draw(self, folder: Path | None = None) -> Shown:
        """Draw the table of a folder of results, or the one that ships with jamlab."""
        return self.show(self.table(folder))


@dataclass(frozen=True)
class CampaignStudy(Study):
    """A study whose tasks are those of a campaign, each with a file of its own, and whose tables are the campaign's."""

    @abstractmethod
    def campaign(self, folder: Path) -> Campaign:
        """Open its campaign in a folder of results."""

    def plan(self, folder: Path) -> Plan:
        """Count the tasks of the campaign that a folder of results does not hold."""
        lines = self.campaign(folder).plan()
        return Plan(self.name, sum(line.left for line in lines), total_time(lines)[1])

    def run(self, folder: Path, progress: Progress = no_progress, *, workers: int | None = None) -> None:
        """Run what is left of the campaign, by default on all cores; `jamlab campaign` has more choices."""
        make_folder(folder)
        self.campaign(folder).run(workers, progress=progress)


@dataclass(frozen=True)
class Page:
    """How the page of several studies looks."""

    name: str  # of its HTML file, and of the one CSV file of all numbers, see `each`
    title: str  # its heading
    lead: Callable[[Sequence[Claim]], str]  # function of all claims that gives the first paragraph
    each: bool = False  # whether every study writes PNG, PDF and CSV of its own, not only a PNG
    columns: int = 0  # of sections, see `studies.html_page.write_report`
    assets: Markup = field(default_factory=Markup)  # styles and scripts that opening sections need
    # function of studies and of their rows that gives the sections at the top, see `draw_tables`
    opening: Callable[[Any, Mapping[str, pd.DataFrame]], Sequence[Section]] = lambda studies, rows: ()


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
        png = save_picture(shown.figure, paths[0])
        if each:
            shown.figure.set_layout_engine("none")  # laid out by now; once more would double the time
            save_picture(shown.figure, paths[1])
    if each:
        paths.append(folder / f"{name}.csv")
        write_csv(paths[-1], shown.rows)
    return paths, png


def file_names(studies: Iterable[str], page: str = "", *, each: bool = True) -> list[str]:
    """Names of all files that `write_files` writes of these studies, and `write_page` of a page of them."""
    names = [f"{name}.{kind}" for name in studies for kind in (("png", "pdf", "csv") if each else ("png",))]
    return names + ([f"{page}.html"] if page else []) + ([] if each else [f"{page}.csv"])


def _verdicts(claims: Sequence[Claim]) -> TextTable:
    columns = ("quantity", "measured", "95 % interval", "paper", "verdict", "how")
    rows = []
    for c in claims:
        value = f"{c.value:.4g}" if np.isfinite(c.value) else "–"
        ends = f"{c.low:.4g} to {c.high:.4g}" if c.measured else "–"
        rows.append((c.quantity, value, ends, c.paper_text, c.text, c.how))
    return TextTable(columns, rows, marks=[str(c.verdict) for c in claims], words=True)


def draw_tables(
    out: Path,
    studies: Mapping[str, TableStudy],
    page: Page,
    *,
    source: Path | None = None,
    progress: Progress = no_progress,
) -> dict[str, pd.DataFrame]:
    """Draw one page of studies from the tables of this folder or of a folder of results; returns their rows."""
    make_folder(out)
    tables = {name: study.table(source) for name, study in studies.items()}
    rows = {name: table.rows for name, table in tables.items()}
    headings = {name: study.heading for name, study in studies.items()}
    facts, first = source_fact(source is not None), page.opening(studies, rows)
    write_page(out, page, headings, lambda n: studies[n].show(tables[n]), facts, opening=first, progress=progress)
    return rows


def source_fact(results: bool) -> dict[str, str]:
    """Where the data of a page come from, as a fact of it."""
    return {"data": "a folder of results" if results else "data of the studies"}
