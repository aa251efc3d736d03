"""What the command line shows: tables, JSON and progress bars. Results go to stdout, progress and errors to stderr."""

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

# a file or a pipe has no width of its own; tables must not be cut there
out_console = Console(width=None if sys.stdout.isatty() else 160)
err_console = Console(stderr=True)

# what fits on a line; files and --json hold all of jamlab.measure.COLUMNS
SHOWN = ("rho", "phi", "z", "rattlers", "pressure", "contact_energy", "g", "b", "shape", "void_sides", "max_force")


@contextmanager
def bars(names: dict[str, str], to: float) -> Iterator[Any]:
    """Progress bars on stderr, one per model, from phi = 0.2 to the last packing fraction."""
    columns = (TextColumn("{task.description:28s}"), BarColumn(), TextColumn("{task.fields[at]}"), TimeElapsedColumn())
    quiet = not err_console.is_terminal
    with Progress(*columns, console=err_console, transient=True, disable=quiet) as progress:
        tasks = {model: progress.add_task(name, total=to - 0.2, at="") for model, name in names.items()}

        def tell(model: str, stage: str, fraction: float) -> None:
            progress.update(tasks[model], completed=fraction - 0.2, at=f"{stage} {fraction:.4f}")

        yield tell


def report(packings: list[Any], out: Path | None, as_json: bool) -> None:
    """Measure packings, store them if a file is named, and print the table."""
    from jamlab.measure import table
    from jamlab.packing.hdf5 import write

    measured = table(packings)
    if out is not None:
        write(out, packings, measured)
    marks = [p.converged and p.on_target for p in packings]
    if as_json:
        columns: dict[str, Any] = {name: values.tolist() for name, values in measured.items()}
        print_json({"out": out and str(out), "onset": packings[-1].onset, "converged": marks, **columns})
        return
    names = [name for name in SHOWN if name in measured]
    rows = zip(*(measured[name] for name in names), strict=True)
    lines = [
        [f"{value:.6g}" for value in row] + ["yes" if mark else "NO"] for row, mark in zip(rows, marks, strict=True)
    ]
    print_table(f"{packings[0].model}, n = {packings[0].n}", [*names, "converged"], lines)
    if out is not None:
        out_console.print(f"wrote {out}", soft_wrap=True)


def print_spectra(name: str, spectra: Any, every: int = 1) -> None:
    """Table of G*(omega), every so many frequencies."""
    limits = ", ".join(f"{label} = {spectra.limit(key):.5g}" for label, key in (("G0", "g0"), ("eta0", "eta0")))
    names, rows = spectra.rows()
    print_table(f"{name}: {limits}, eta_inf = {spectra.limit('eta_inf'):.5g}", names, rows[::every])


def print_table(title: str, columns: list[str], lines: list[list[str]]) -> None:
    """Table of text on stdout."""
    table = Table(title=title, title_justify="left", min_width=min(len(title), 100), box=SIMPLE_HEAD, padding=(0, 1))
    for name in columns:
        table.add_column(name, justify="right", no_wrap=True)
    for line in lines:
        table.add_row(*line)
    out_console.print(table)


def print_json(content: dict[str, Any]) -> None:
    """One JSON object on stdout."""
    # JSON knows no nan: a value that is not there is null
    print(json.dumps(json.loads(json.dumps(content), parse_constant=lambda _: None)))
