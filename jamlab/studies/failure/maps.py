"""All maps of failure, and how each is measured, row by row."""

from functools import partial
from pathlib import Path
from typing import Any

from jamlab.studies.failure import disk_minimisers, disk_packings, droplets, dynamics, elastic_moduli, spectra
from jamlab.studies.failure.map import COLUMNS, Map
from jamlab.studies.table import MeasuredTable, Progress, Task, measure_table, shipped_table

PACKAGE = "jamlab.studies.failure"
_TOPICS = (disk_minimisers, disk_packings, elastic_moduli, spectra, droplets, dynamics)
MAPS: dict[str, Map] = {name: chart for topic in _TOPICS for name, chart in topic.MAPS.items()}


def measure_map(path: Path, name: str, progress: Progress = lambda task, done, of: None) -> MeasuredTable:
    """Measure a map into a CSV file, a task for every y; goes on where it was interrupted, see `measure_table`."""
    chart = MAPS[name]
    facts: dict[str, Any] = {"map": name, "seeds": chart.seeds, "x": chart.x.label, "y": chart.y.label}
    return measure_table(path, COLUMNS, tasks(chart), facts, progress=progress)


def tasks(chart: Map) -> dict[str, Task]:
    """Rows of a map by the name of their y, each as a function that measures it."""
    return {chart.y.text(y): partial(_row, chart, y) for y in chart.y.values}


def _row(chart: Map, y: Any) -> list[dict[str, Any]]:
    return list(chart.rows(y))


def shipped_map(name: str) -> MeasuredTable:
    """The table of a map that lies in the package."""
    return shipped_table(PACKAGE, name)
