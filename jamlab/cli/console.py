"""Print tables, JSON and progress bars: results go to stdout, progress and errors to stderr."""

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bars
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from jamlab.packing.packing import Packing
    from jamlab.protocols.relaxation import Progress
    from jamlab.rheology.mean_spectrum import Spectra

# names may hold [brackets], which are no markup; a file or a pipe has no width of its own, and tables must not be cut
# there: the widest one needs under 160
out_console = Console(width=None if sys.stdout.isatty() else 160, markup=False, emoji=False)
err_console = Console(stderr=True, markup=False, emoji=False)

_START = 0.2  # packing fraction of random starts, where bars begin

# as many as fit on a line; files and --json hold all of jamlab.measure.COLUMNS
SHOWN = ("rho", "phi", "z", "rattlers", "pressure", "contact_energy", "g", "b", "shape", "void_sides", "max_force")


@contextmanager
def progress_bars(names: dict[str, str], to: float) -> "Iterator[dict[str, Progress]]":
    """Show bars on stderr that grow with the packing fraction, from that of a random start up to `to`.

    Args:
        names: key -> text beside the bar.
        to: packing fraction at the end of all bars.

    Yields:
        Key -> a function to pass as `progress` to a protocol.
    """
    columns = (TextColumn("{task.description:28s}"), BarColumn(), TextColumn("{task.fields[at]}"), TimeElapsedColumn())
    quiet = not err_console.is_terminal
    with Bars(*columns, console=err_console, transient=True, disable=quiet) as bars:

        def add(name: str) -> "Progress":
            bar = bars.add_task(name, total=to - _START, at="")

            def show(stage: str, fraction: float) -> None:
                bars.update(bar, completed=fraction - _START, at=f"{stage} {fraction:.4f}")

            return show

        yield {key: add(name) for key, name in names.items()}


@contextmanager
def progress_bar(name: str, to: float) -> "Iterator[Progress]":
    """Show one bar of `progress_bars`; yields its function."""
    with progress_bars({"": name}, to) as progress:
        yield progress[""]


def print_stage(name: str) -> None:
    """Print one line of progress on stderr."""
    err_console.print(Text(name, style="dim"), soft_wrap=True)


def print_packings(packings: "list[Packing]", out: Path | None, as_json: bool) -> None:
    """Measure packings, write them to `out` if it is given, and print what was measured."""
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


def print_spectra(name: str, spectra: "Spectra", every: int = 1) -> None:
    """Print G*(omega) at every `every`-th frequency."""
    limits = ", ".join(f"{label} = {spectra.limit(key):.5g}" for label, key in (("G0", "g0"), ("eta0", "eta0")))
    names, rows = spectra.rows()
    print_table(f"{name}: {limits}, eta_inf = {spectra.limit('eta_inf'):.5g}", names, rows[::every])


def print_table(title: str, columns: list[str], lines: list[list[str]]) -> None:
    """Print a table of text on stdout."""
    table = Table(title=title, title_justify="left", min_width=min(len(title), 100), box=SIMPLE_HEAD, padding=(0, 1))
    for name in columns:
        table.add_column(name, justify="right", no_wrap=True)
    for line in lines:
        table.add_row(*line)
    out_console.print(table)


def print_json(content: dict[str, Any]) -> None:
    """Print one JSON object on stdout."""
    # JSON has no nan: a missing value is null
    print(json.dumps(json.loads(json.dumps(content), parse_constant=lambda _: None)))
