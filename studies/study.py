"""A study is a piece of evidence: what is measured, task by task, and how tables are drawn; pages show several."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from studies.ensemble_tables import EnsembleTables
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
    lead: str  # its first paragraph
    studies: Sequence[Study]
    columns: int = 0  # of sections that fit on a screen; 0: pictures as wide as the page
    overview: bool = False  # whether the page begins with all numbers of the papers in one picture
