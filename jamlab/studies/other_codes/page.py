"""Write the comparison with other codes as tables, CSV, JSON and one HTML page."""

import json
import platform
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

import pandas as pd

from jamlab.figures.html_page import Section, TextTable, write_csv, write_report
from jamlab.storage.atomic_file import atomic_file, make_folder
from jamlab.storage.verified_file import versions
from jamlab.studies.other_codes.analysis import AnalysisRow
from jamlab.studies.other_codes.compare import Row, summary


def comparison_tables(rows: Sequence[Row], analysis: Sequence[AnalysisRow], n: int, phi: float) -> list[TextTable]:
    """Tables for the reader: same coordinates, same basin, speed, analysis."""

    def table(heading: str, columns: dict[str, str], of: Sequence[Row | AnalysisRow] = rows) -> TextTable:
        """Columns of the rows, each with its format."""
        lines = [[_text(getattr(row, name), form) for name, form in columns.items()] for row in of]
        return TextTable([name.replace("_", " ") for name in columns], lines, heading)

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
        table(
            "Analysis of the minimum without rattlers: largest difference from jamlab, over the largest value",
            {"name": "", "version": "", "quantity": "", "difference": small},
            analysis,
        ),
    ]


def write_comparison(folder: Path, rows: Sequence[Row], analysis: Sequence[AnalysisRow], n: int, phi: float) -> None:
    """Write comparison.csv, analysis.csv, comparison.json with both, and index.html.

    Raises:
        StorageError: the folder cannot be written.
    """
    make_folder(folder)
    write_csv(folder / "comparison.csv", pd.DataFrame([asdict(row) for row in rows]))
    write_csv(folder / "analysis.csv", pd.DataFrame([asdict(row) for row in analysis]))
    with atomic_file(folder / "comparison.json") as temporary:
        temporary.write_text(json.dumps(summary(rows, analysis)) + "\n")
    facts = notes(rows, analysis) | {"machine": platform.machine(), **versions()}
    lead = (
        "Every code gets the same coordinates of disks (Boromand et al. eq 5) in double precision, then a start inside "
        "one basin. Cold: with set-up and compiling; warm: the shortest of the runs that follow."
    )
    tables = comparison_tables(rows, analysis, n, phi)
    sections = [Section(table.heading, tables=[replace(table, heading="")]) for table in tables]
    write_report(folder / "index.html", "jamlab beside other codes", lead, sections, facts)


def notes(rows: Sequence[Row], analysis: Sequence[AnalysisRow]) -> dict[str, str]:
    """What a reader must know, by name of the code."""
    return {row.name: row.note for row in rows if row.note} | {row.name: row.note for row in analysis if row.note}


def _text(value: object, form: str) -> str:
    if value is None:
        return "-"
    return f"{value:{form}}" if form else str(value)
