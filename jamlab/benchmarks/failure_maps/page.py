"""Try methods where they are expected to fail, map by map, and write CSV, pictures and one page."""

from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path

from jamlab.benchmarks.chart_page import Chart, write_charts
from jamlab.benchmarks.failure_maps import disks, droplets, spectra
from jamlab.benchmarks.failure_maps.map_figure import stability_figure
from jamlab.benchmarks.failure_maps.verdict import VERDICTS, Outcome
from jamlab.checks import check_choice
from jamlab.figures.html_page import TextTable

MAPS = {**disks.MAPS, **droplets.MAPS, **spectra.MAPS}

_LEAD = (
    "Each mark is one run. Converged: met its tolerance in the basin it came from; stalled: ended above it; wrong "
    "basin: met it elsewhere; blew up: positions or energies ran away; refused: an error instead of a number."
)


def stability(
    out: Path, maps: Sequence[str] = (), *, quick: bool = False, progress: Callable[[str], None] | None = None
) -> dict[str, list[Outcome]]:
    """Measure the maps, and write stability.csv, one PNG for each map and stability.html.

    Args:
        out: folder, made if it is not there.
        maps: names of `MAPS`; all if empty.
        quick: corners of each map only, under a minute.
        progress: called with the name of each map.

    Returns:
        Outcomes of each map.

    Raises:
        InputError: there is no such map.
        StorageError: the folder cannot be written.
    """
    for name in maps:
        check_choice("map", name, MAPS)
    found: dict[str, list[Outcome]] = {}

    def measure(name: str) -> Chart:
        chart = MAPS[name]
        found[name] = chart.measure(quick)
        lines = [[_text(o.x), _text(o.y), o.verdict, o.note] for o in found[name]]
        table = TextTable([chart.x, chart.y, "verdict", "note"], lines, marks=[o.verdict for o in found[name]])
        rows = [{"map": name, **asdict(outcome)} for outcome in found[name]]
        return Chart(chart.title, chart.meaning, stability_figure(chart, found[name]), table, rows)

    title, names = "Where methods fail", maps or MAPS
    write_charts(
        out, "stability", title, _LEAD, measure, names, {"size": "quick" if quick else "full"}, progress=progress
    )
    return found


def counts(found: dict[str, list[Outcome]]) -> list[list[str]]:
    """Count verdicts: one row for each map, its name and how many runs ended in each way."""
    return [[name, *(str(sum(o.verdict == v for o in outcomes)) for v in VERDICTS)] for name, outcomes in found.items()]


def _text(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.3g}"
