"""A study is a piece of evidence: what is measured, task by task, and how tables are drawn; pages show several."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from studies.ensemble_tables import EnsembleTables
from studies.html_page import Section
from studies.panels import Drawing
from studies.tables import Task


@dataclass(frozen=True)
class Study:
    """What is measured, and how it is drawn."""

    name: str  # of its table, its picture and its files; unique among all studies
    title: str  # what it shows, in one line
    # name -> function that measures rows of the table of the study's name; none where campaigns make the tables
    tasks: Mapping[str, Task]
    draw: Callable[[EnsembleTables], Drawing]  # function of tables by name


@dataclass(frozen=True)
class Group:
    """Studies that are drawn on one page."""

    title: str  # its heading
    lead: Callable[[Sequence[Drawing]], str]  # function of all drawings that gives its first paragraph
    studies: Sequence[Study]
    columns: int = 0  # of sections, see `studies.html_page.write_report`
    # module that draws all numbers of papers beside ours in one picture, first on the page: TITLE, `forest`, a function
    # of all comparisons, and `forest_rows`, of these and of the anchors of studies: a line with a link for each
    overview: Any = None
    opening: Callable[[], Sequence[Section]] = lambda: ()  # sections at the top, where shipped tables are drawn
