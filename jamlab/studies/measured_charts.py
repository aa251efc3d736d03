"""Charts whose data ship with jamlab or are measured anew: which are meant, their tables, what is left to measure."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jamlab.checks import check_choice
from jamlab.errors import StorageError
from jamlab.studies.table import MeasuredTable, Progress, done_tasks

Say = Callable[[str], None]


@dataclass(frozen=True)
class MeasuredCharts:
    """Charts of one kind.

    Attributes:
        kind: what one chart is called.
        task: what one task of a measurement is called.
        charts: name -> chart.
        tasks: function of a chart: names of its tasks.
        shipped: function of a name: the table that lies in the package.
        measure: function of a CSV file, a name and what is called before each task: does what the file does not hold.
    """

    kind: str
    task: str
    charts: Mapping[str, Any]
    tasks: Callable[[Any], set[str]]
    shipped: Callable[[str], MeasuredTable]
    measure: Callable[[Path, str, Progress], MeasuredTable]

    def names(self, chosen: Sequence[str]) -> list[str]:
        """The chosen names, all if none is given.

        Raises:
            InputError: there is no such chart.
        """
        for name in chosen:
            check_choice(self.kind, name, self.charts)
        return list(chosen or self.charts)

    def tables(
        self, out: Path, names: Sequence[str], *, measure: bool, progress: Say | None
    ) -> dict[str, MeasuredTable]:
        """Table of each chart: that of OUT/NAME.csv, completed, if `measure`, and what ships otherwise.

        Raises:
            StorageError: OUT/NAME.csv cannot be written, or holds another measurement.
        """
        if not measure:
            return {name: self.shipped(name) for name in names}
        tables = {}
        for name in names:

            def tell(task: str, done: int, of: int, name: str = name) -> None:
                if progress is not None:
                    progress(f"{name}: {self.task} {done + 1} of {of}")

            tables[name] = self.measure(out / f"{name}.csv", name, tell)
        return tables

    def plan(self, out: Path, chosen: Sequence[str] = ()) -> list[list[str]]:
        """What `measure` would do: a row for each chart, its name, tasks left and CPU seconds, by the shipped data."""
        rows = []
        for name in self.names(chosen):
            left = self.tasks(self.charts[name]) - done_tasks(out / f"{name}.csv")
            try:
                took = self.shipped(name).rows.groupby("task")["took"].first()
                seconds = f"{took[took.index.isin(left)].sum():.0f}"
            except StorageError:
                seconds = "unknown"
            rows.append([name, str(len(left)), seconds])
        return rows


def source(measure: bool) -> dict[str, str]:
    """Where the data of a page come from, as a fact of it."""
    return {"data": "measured now" if measure else "shipped with jamlab"}
