"""The comparison as tables, CSV and one HTML page."""

import csv
import json
import platform
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from jamlab.benchmarks.other_codes.compare import Row, summary
from jamlab.figures.html_page import Table, write_page
from jamlab.packing.atomic_file import atomic_file, make_folder
from jamlab.packing.versions import versions


def tables(rows: Sequence[Row], n: int, phi: float) -> list[Table]:
    """Three tables of text: same coordinates, same basin, speed."""

    def table(heading: str, columns: dict[str, str]) -> Table:
        lines = [[_text(getattr(row, name), form) for name, form in columns.items()] for row in rows]
        return Table(heading, [name.replace("_", " ") for name in columns], lines)

    small = ".1e"
    return [
        table(
            f"Same coordinates, {n} disks, phi = {phi:g}: largest difference from jamlab, relative",
            {"name": "", "version": "", "energy": small, "forces": small, "stress": small, "pressure": small},
        ),
        table(
            "Same basin: relative difference of the minimum, difference of z and of G, largest force left",
            {"name": "", "method": "", "minimum": small, "z": "g", "g": small, "max_force": small},
        ),
        table(
            "One minimisation, one core: seconds, and ratio to jamlab",
            {"name": "", "cold": ".4f", "cold_ratio": ".2f", "warm": ".5f", "warm_ratio": ".2f"},
        ),
    ]


def write(folder: Path, rows: Sequence[Row], n: int, phi: float) -> None:
    """Write comparison.csv, comparison.json and index.html.

    Raises:
        StorageError: the folder cannot be written.
    """
    make_folder(folder)
    with atomic_file(folder / "comparison.csv") as temporary, temporary.open("w", newline="") as file:
        writer = csv.DictWriter(file, list(asdict(rows[0])))
        writer.writeheader()
        writer.writerows(asdict(row) for row in rows)
    with atomic_file(folder / "comparison.json") as temporary:
        temporary.write_text(json.dumps(summary(rows)) + "\n")
    facts = {row.name: row.note for row in rows if row.note} | {"machine": platform.machine(), **versions()}
    lead = (
        "Every code gets the same coordinates of disks (Boromand et al. eq 5) in double precision, then a start inside "
        "one basin. Cold: with set-up and compiling; warm: the shortest of the runs that follow."
    )
    write_page(folder / "index.html", "jamlab beside other codes", lead, tables(rows, n, phi), {}, facts)


def _text(value: object, form: str) -> str:
    if value is None:
        return "-"
    return f"{value:{form}}" if form else str(value)
