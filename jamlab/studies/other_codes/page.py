"""The comparison with other codes as a study: tables, CSV, JSON and one HTML page; recipes for codes without wheels."""

import json
import platform
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any, ClassVar, TypeVar

import numpy as np
import pandas as pd

from jamlab.checks import check_choice
from jamlab.engine.session import evaluate
from jamlab.figures.html_page import TextTable, write_csv
from jamlab.packing.packing import Packing
from jamlab.processes.progress import Progress, no_progress
from jamlab.storage.atomic_file import atomic_file, make_folder
from jamlab.studies.other_codes.analysis import AnalysisRow, compare_analysis
from jamlab.studies.other_codes.compare import Row, compare, jolted_minimum, summary
from jamlab.studies.other_codes.peer import mean_diameters
from jamlab.studies.page import Page, write_page
from jamlab.studies.study import Shown, TableStudy
from jamlab.studies.table import MeasuredTable, Task

T = TypeVar("T", Row, AnalysisRow)

_LEAD = (
    "Every code gets the same coordinates of disks (Boromand et al. eq 5) in double precision, then a start inside "
    "one basin. Cold: with set-up and compiling; warm: the shortest of the runs that follow."
)


def _columns() -> list[str]:
    return list(dict.fromkeys(field.name for kind in (Row, AnalysisRow) for field in fields(kind)))


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


@dataclass(frozen=True)
class Comparison(TableStudy):
    """The same packings of disks in other codes, as a study: one task for each size.

    Attributes:
        sizes: numbers of disks, even.
        seed, phi: see `jamlab.studies.other_codes.compare.compare`.
    """

    name: str = "comparison"
    title: str = "jamlab beside other codes"
    sizes: Sequence[int] = (64, 128)
    seed: int = 1
    phi: float = 0.88
    kind: ClassVar[str] = "comparison"
    columns: ClassVar[Sequence[str]] = ("n", "part", *_columns())

    @property
    def facts(self) -> Mapping[str, Any]:
        """Seed and packing fraction."""
        return {"title": self.title, "seed": self.seed, "phi": self.phi}

    def tasks(self) -> Mapping[str, Task]:
        """One task for each size."""
        return {f"N = {n}": partial(self._measure, n) for n in self.sizes}

    def measure(self, n: int, progress: Progress = no_progress) -> tuple[list[Row], list[AnalysisRow]]:
        """Compare one packing of n disks in all codes, and its minimum in those that measure."""
        rows = compare(n, self.seed, self.phi, progress=progress)
        return rows, compare_analysis(jolted_minimum(n, self.seed, self.phi)[1])

    def _measure(self, n: int) -> list[dict[str, Any]]:
        rows, analysis = self.measure(n)
        return [{"n": n, "part": part, **row} for part, each in summary(rows, analysis).items() for row in each]

    def show(self, table: MeasuredTable) -> Shown:
        """Show four tables for each size."""
        tables = []
        for n, part in table.rows.groupby("n"):
            rows, analysis = _as(Row, part[part["part"] == "rows"]), _as(AnalysisRow, part[part["part"] == "analysis"])
            tables += comparison_tables(rows, analysis, int(str(n)), self.phi)
        return Shown(None, f"{_LEAD} {table.made}.", tables, table.rows)


def _as(kind: type[T], rows: pd.DataFrame) -> list[T]:
    """Rows of a table as objects; what is missing is None, or "" of words."""
    found = []
    for row in rows.astype(str).to_dict("records"):
        held = {field.name: (row[field.name], field.type) for field in fields(kind) if row.get(field.name)}
        content: dict[str, Any] = {n: float(v) if form == float | None else v for n, (v, form) in held.items()}
        found.append(kind(**content))
    return found


def write_comparison(folder: Path, rows: Sequence[Row], analysis: Sequence[AnalysisRow], n: int, phi: float) -> None:
    """Write comparison.csv, analysis.csv, comparison.json with both, and index.html.

    Raises:
        StorageError: the folder cannot be written.
    """
    shown = Shown(None, "", comparison_tables(rows, analysis, n, phi), pd.DataFrame([asdict(row) for row in rows]))
    facts = notes(rows, analysis) | {"machine": platform.machine()}
    page = Page("index", "jamlab beside other codes", lambda claims: _LEAD, each=True)
    write_page(folder, page, {"comparison": f"{n} disks, phi = {phi:g}"}, lambda name: shown, facts)
    write_csv(folder / "analysis.csv", pd.DataFrame([asdict(row) for row in analysis]))
    with atomic_file(folder / "comparison.json") as temporary:
        temporary.write_text(json.dumps(summary(rows, analysis)) + "\n")


def notes(rows: Sequence[Row], analysis: Sequence[AnalysisRow]) -> dict[str, str]:
    """What a reader must know, by name of the code."""
    return {row.name: row.note for row in rows if row.note} | {row.name: row.note for row in analysis if row.note}


def _text(value: object, form: str) -> str:
    if value is None:
        return "-"
    return f"{value:{form}}" if form else str(value)


FILES = ("comparison.csv", "analysis.csv", "comparison.json", "index.html")  # of `write_comparison`
RECIPES = {"hoomd": "conda install -c conda-forge hoomd   # version 4 or later; no wheels"}


def write_recipe(name: str, folder: Path, packing: Packing) -> str:
    """Write `packing.npz` and `NAME_check.py` to a folder, and return how to run them.

    The file holds positions (n, 2), diameters (n,), sides (2,), eps, and jamlab's energy, forces and stress at these
    positions. The script prints how far the other code is from them, then minimises.

    Raises:
        InputError: there is no such recipe, or the other code cannot take the packing.
        StorageError: the folder cannot be written.
    """
    check_choice("recipe", name, RECIPES)
    species, s = mean_diameters(packing)
    here = evaluate(packing)
    make_folder(folder)
    with atomic_file(folder / "packing.npz") as temporary, temporary.open("wb") as file:
        np.savez(
            file,
            positions=packing.positions,
            species=species,
            s=s,
            sides=np.diag(packing.box),
            eps=float(packing.params["eps"]),
            energy=here.energy,
            forces=here.forces,
            stress=here.stress,
        )
    script = f"{name}_check.py"
    text = resources.files("jamlab.studies.other_codes").joinpath(f"{script}.txt").read_text(encoding="utf-8")
    with atomic_file(folder / script) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return f"{RECIPES[name]}\ncd {folder} && python {script}"
