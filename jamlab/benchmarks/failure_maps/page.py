"""Draw where methods fail, map by map, from data that ship with jamlab or are measured anew."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import pandas as pd

from jamlab.benchmarks.chart_page import Chart, write_charts
from jamlab.benchmarks.failure_maps.boundary import default_distance
from jamlab.benchmarks.failure_maps.map import Map
from jamlab.benchmarks.failure_maps.map_figure import failure_figure
from jamlab.benchmarks.failure_maps.measurement import MAPS, measure_map, shipped_map, tasks
from jamlab.benchmarks.failure_maps.verdict import SILENT, VERDICTS
from jamlab.benchmarks.measured_table import MeasuredTable, done_tasks
from jamlab.checks import check_choice
from jamlab.errors import StorageError
from jamlab.figures.html_page import TextTable
from jamlab.packing.atomic_file import make_folder

_LEAD = (
    "Every cell is one pair of conditions, filled by the shares of how runs of several seeds ended. Converged: met its "
    "tolerance where it should; another basin: met it in another minimum, or on another path; stalled: says that it "
    "ended above it; blew up: positions or energies ran away; refused: an error instead of a number. Each number that "
    "is given as right is checked by physics written anew from the definitions: one that fails the check is a silent "
    "wrong number."
)


def stability(
    out: Path,
    maps: Sequence[str] = (),
    *,
    measure: bool = False,
    progress: Callable[[str], None] | None = None,
) -> dict[str, pd.DataFrame]:
    """Draw the maps, and write stability.csv, one PNG for each and stability.html.

    Args:
        out: folder, made if it is not there.
        maps: names of `MAPS`; all if empty.
        measure: measure the rows that OUT/MAP.csv does not hold, and draw these files instead of what ships.
        progress: called with the name of each map, or of each row that is measured.

    Returns:
        Table of each map, a row for each pair of conditions.

    Raises:
        InputError: there is no such map.
        StorageError: the folder cannot be written, or holds another measurement.
    """
    names = check_maps(maps)
    make_folder(out)
    say = progress or (lambda text: None)
    tables: dict[str, MeasuredTable] = {}
    for name in names:
        if measure:

            def tell(row: str, done: int, of: int, name: str = name) -> None:
                say(f"{name}: row {done + 1} of {of}")

            tables[name] = measure_map(out, name, progress=tell)
        else:
            tables[name] = shipped_map(name)

    def chart(name: str) -> Chart:
        return _chart(name, MAPS[name], tables[name])

    facts = {"data": "measured now" if measure else "shipped with jamlab"}
    write_charts(out, "stability", "Where methods fail", _LEAD, chart, names, facts, progress=progress)
    return {name: table.rows for name, table in tables.items()}


def check_maps(maps: Sequence[str]) -> list[str]:
    """Names of maps, all if none is given.

    Raises:
        InputError: there is no such map.
    """
    for name in maps:
        check_choice("map", name, MAPS)
    return list(maps or MAPS)


def plan(out: Path, maps: Sequence[str] = ()) -> list[list[str]]:
    """What `measure` would do: a row for each map, its name, rows left and CPU seconds, by the shipped data."""
    rows = []
    for name in check_maps(maps):
        left = set(tasks(MAPS[name])) - done_tasks(out / f"{name}.csv")
        try:
            took = shipped_map(name).rows.groupby("task")["took"].first()
            seconds = f"{took[[task for task in took.index if task in left]].sum():.0f}"
        except StorageError:
            seconds = "unknown"
        rows.append([name, str(len(left)), seconds])
    return rows


def counts(found: Mapping[str, pd.DataFrame]) -> list[list[str]]:
    """A row for each map: name, conditions, runs, how many ended in each way, and where the default lies."""
    rows = []
    for name, table in found.items():
        ended = [str(int(table[verdict].sum())) for verdict in VERDICTS]
        conditions, runs = str(len(table)), str(int(table["runs"].sum()))
        rows.append([name, conditions, runs, *ended, str(default_distance(MAPS[name], table) or "-")])
    return rows


COUNTED = ("map", "conditions", "runs", *VERDICTS, "default")


def _chart(name: str, chart: Map, measured: MeasuredTable) -> Chart:
    table = measured.rows
    distance = default_distance(chart, table)
    place = f" Default {distance}." if distance else ""
    seeds = measured.provenance["facts"]["seeds"]
    caption = f"{chart.meaning} Check: {chart.check}{place} {seeds} seeds; {measured.made}."
    rows = [{"map": name, **{str(k): v for k, v in row.items()}} for row in table.to_dict("records")]
    return Chart(chart.title, caption, failure_figure(chart, table), _table(chart, table), rows)


def _table(chart: Map, table: pd.DataFrame) -> TextTable:
    """Pairs of conditions at which some run did not converge, with the verdict of most of its runs."""
    shown = table[table["converged"] < table["runs"]]
    lines, marks = [], []
    for row in shown.to_dict("records"):
        marks.append(SILENT if row[SILENT] else max(VERDICTS, key=lambda verdict: row[verdict]))
        values = [v if isinstance(v, str) else f"{v:.3g}" for v in (row["x"], row["y"])]
        lines.append([*values, *(str(int(row[verdict])) for verdict in VERDICTS), str(row["note"])])
    return TextTable([chart.x.label, chart.y.label, *VERDICTS, "worst run"], lines, marks=marks)
