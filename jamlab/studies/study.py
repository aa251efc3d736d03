"""A study is one piece of evidence: what is measured task by task, into which table, and how that table is drawn."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import pandas as pd
from matplotlib.figure import Figure

from jamlab.campaign.campaign import Campaign
from jamlab.errors import StorageError
from jamlab.figures.html_page import TextTable
from jamlab.processes.progress import Progress, no_progress
from jamlab.storage.atomic_file import make_folder
from jamlab.studies.claims import Claim
from jamlab.studies.table import MeasuredTable, Task, done_tasks, measure_table, read_table, shipped_table


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
    """How many tasks are left of a study, and their CPU seconds by the table that ships, None if that is not known."""

    name: str
    left: int
    seconds: float | None


@dataclass(frozen=True)
class Study(ABC):
    """A measurement that can be planned, run, gone on with and drawn, as `jamlab study` does."""

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
    """A study whose tasks are functions that give rows of one table; those of your own are such.

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
            took = self.table().rows.groupby("task")["took"].first()
        except StorageError:
            return Plan(self.name, len(left), None)
        return Plan(self.name, len(left), float(took[took.index.isin(left)].sum()))

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
        return Plan(self.name, sum(line.left for line in lines), sum(line.seconds for line in lines))

    def run(self, folder: Path, progress: Progress = no_progress, *, workers: int | None = None) -> None:
        """Run what is left of the campaign, by default on all cores; `jamlab campaign` has more choices."""
        make_folder(folder)
        self.campaign(folder).run(workers, progress=progress)
