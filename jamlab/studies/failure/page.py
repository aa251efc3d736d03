"""Draw where methods fail, map by map, from data that ship with jamlab or are measured anew."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from jamlab.figures.html_page import TextTable
from jamlab.storage.atomic_file import make_folder
from jamlab.studies.chart_page import Chart, write_charts
from jamlab.studies.failure.boundary import default_distance
from jamlab.studies.failure.map import Map
from jamlab.studies.failure.map_figure import failure_figure
from jamlab.studies.failure.maps import MAPS, measure_map, shipped_map, tasks
from jamlab.studies.failure.verdict import SILENT, VERDICTS
from jamlab.studies.measured_charts import MeasuredCharts, Say, source
from jamlab.studies.table import MeasuredTable

_LEAD = (
    "Every cell is one pair of conditions, filled by the shares of how runs of several seeds ended. Converged: met its "
    "tolerance where it should; another basin: met it in another minimum, or on another path; stalled: says that it "
    "ended above it; blew up: positions or energies ran away; refused: an error instead of a number. Numbers given "
    "as right are checked, as each caption says, by physics written anew from the definitions, at the state where the "
    "run ended: one that does not follow from it is a silent wrong number. Whether that state is in the right basin or "
    "on the right path a run cannot know: a map tells by runs with finer steps, or by what it started beside. "
    "A boundary is where half of the runs or more fail, from there to the end of the axis; cells that fail before "
    "values that work are counted apart."
)


MAP_CHARTS = MeasuredCharts("map", "row", MAPS, lambda chart: set(tasks(chart)), shipped_map, measure_map)


def stability(
    out: Path, maps: Sequence[str] = (), *, measure: bool = False, progress: Say | None = None
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
    names = MAP_CHARTS.names(maps)
    make_folder(out)
    tables = MAP_CHARTS.tables(out, names, measure=measure, progress=progress)

    def chart(name: str) -> Chart:
        return _chart(name, MAPS[name], tables[name])

    write_charts(out, "stability", "Where methods fail", _LEAD, chart, names, source(measure), progress=progress)
    return {name: table.rows for name, table in tables.items()}


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
