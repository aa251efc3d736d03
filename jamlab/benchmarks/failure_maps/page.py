"""All maps of failure: runs, CSV, pictures, one page."""

import csv
import time
from collections.abc import Callable, Sequence
from dataclasses import astuple
from pathlib import Path

from jamlab.benchmarks.failure_maps import disks as failing_disks
from jamlab.benchmarks.failure_maps import droplets as failing_droplets
from jamlab.benchmarks.failure_maps import spectra as failing_spectra
from jamlab.benchmarks.failure_maps.map_figure import stability_figure
from jamlab.benchmarks.failure_maps.verdict import VERDICTS, Run
from jamlab.checks import check_choice
from jamlab.figures.html_page import Table, save, write_page
from jamlab.packing.atomic_file import atomic_file, make_folder
from jamlab.packing.versions import versions

MAPS = {**failing_disks.MAPS, **failing_droplets.MAPS, **failing_spectra.MAPS}


def stability(
    out: Path, maps: Sequence[str] = (), *, quick: bool = False, progress: Callable[[str], None] | None = None
) -> dict[str, list[Run]]:
    """Run the maps, and write stability.csv, one PNG for each map and stability.html.

    Args:
        out: folder, made if it is not there.
        maps: names of `MAPS`; all if empty.
        quick: corners of each map only, under a minute.
        progress: called with each map's name.

    Raises:
        InputError: there is no such map.
        StorageError: the folder cannot be written.
    """
    for name in maps:
        check_choice("map", name, MAPS)
    make_folder(out)
    began = time.perf_counter()
    found: dict[str, list[Run]] = {}
    pictures, tables = {}, []
    for name in maps or MAPS:
        if progress is not None:
            progress(name)
        chart = MAPS[name]
        runs = found[name] = chart.runs(quick)
        pictures[f"{chart.title}. {chart.meaning}"] = save(stability_figure(chart, runs), out / f"{name}.png")
        rows = [[_text(run.x), _text(run.y), run.verdict, run.note] for run in runs]
        tables.append(Table(chart.title, [chart.x, chart.y, "verdict", "note"], rows))
        _write(out / "stability.csv", found)
    facts = {"wall time": f"{time.perf_counter() - began:.0f} s", "size": "quick" if quick else "full", **versions()}
    lead = (
        "Each mark is one run. Converged: met its tolerance in the basin it came from; stalled: ended above it; wrong "
        "basin: met it elsewhere; blew up: positions or energies ran away; refused: an error instead of a number."
    )
    write_page(out / "stability.html", "Where methods fail", lead, tables, pictures, facts)
    return found


def counts(found: dict[str, list[Run]]) -> list[list[str]]:
    """One row a map: its name and how many runs had each verdict."""
    return [[name, *(str(sum(run.verdict == v for run in runs)) for v in VERDICTS)] for name, runs in found.items()]


def _write(path: Path, found: dict[str, list[Run]]) -> None:
    with atomic_file(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["map", "x", "y", "verdict", "note"])
        writer.writerows([name, *astuple(run)] for name, runs in found.items() for run in runs)


def _text(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.3g}"
