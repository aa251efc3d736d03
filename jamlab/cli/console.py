"""Print tables and JSON: results go to stdout, errors to stderr."""

import json
import os
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from jamlab.packing.packing import Packing
    from jamlab.rheology.mean_spectrum import Spectra

# a file or a pipe has no width of its own
out_console = Console(width=None if sys.stdout.isatty() or "COLUMNS" in os.environ else 160)
err_console = Console(stderr=True)

# name in files -> heading and format of a table; files and --json hold all of jamlab.measure.COLUMNS
SHOWN = {
    "rho": ("rho", ".6g"),
    "phi": ("phi", ".6g"),
    "z": ("z", ".4f"),
    "rattlers": ("rattlers", ".0f"),
    "pressure": ("pressure", ".5g"),
    "g": ("G", ".5g"),
    "g_x": ("G_xy", ".5g"),
    "b": ("B", ".5g"),
    "shape": ("shape", ".5g"),
    "void_sides": ("void_sides", ".4f"),
    "max_force": ("max_force", ".1e"),
}
G_NOTE = "G: relaxed shear modulus, mean over directions; G_xy: for shear along x of the box"
_NEGATIVE = "G below 0: at this box shape the packing would shear by itself; ensemble shear-stabilized lets it"
_MODULI = ("g", "g_x", "b")


def print_stage(name: str) -> None:
    """Print one line of progress on stderr."""
    err_console.print(Text(name, style="dim"), soft_wrap=True)


def print_packings(packings: "list[Packing]", out: Path | None, as_json: bool) -> None:
    """Measure packings, write them to `out` if it is given, and print what was measured."""
    from jamlab.measure import LABELS, table, why_no_modulus
    from jamlab.packing.hdf5 import write

    measured = table(packings)
    if out is not None:
        write(out, packings, measured)
    marks = [p.converged and p.on_target for p in packings]
    if as_json:
        columns: dict[str, Any] = {name: values.tolist() for name, values in measured.items()}
        facts = {"out": out and str(out), "onset": packings[-1].onset, "converged": marks, "labels": LABELS}
        print_json({**facts, **columns})
        return
    filled = [name for name in SHOWN if any(value == value for value in measured[name])]
    lines = [[_cell(name, measured[name][k]) for name in filled] for k in range(len(packings))]
    for line, mark in zip(lines, marks, strict=True):
        line.append("yes" if mark else "NO")
    headings = [SHOWN[name][0] for name in filled]
    print_table(f"{packings[0].model}, n = {packings[0].n}", [*headings, "converged"], lines)
    if "g" in filled:
        print_note(G_NOTE)
    if any(measured["g"] < 0) or any(measured["g_x"] < 0):
        print_note(_NEGATIVE)
    reasons = [why_no_modulus(p) for p, g in zip(packings, measured["g"], strict=True) if g != g]
    print_not_stable(reasons)
    if out is not None:
        print_note(f"wrote {out}")


def _cell(name: str, value: float) -> str:
    if value != value:
        return "not stable" if name in _MODULI else "-"
    return f"{value:{SHOWN[name][1]}}"


def print_not_stable(reasons: Sequence[str]) -> None:
    """Explain the states that have no modulus, each reason once."""
    for reason in dict.fromkeys(reasons):
        print_note(f"not stable: {reason}")


def print_spectra(name: str, spectra: "Spectra", every: int = 1) -> None:
    """Print G*_xy(omega) at every `every`-th frequency, below its limits and the static G averaged over directions."""
    names, rows = spectra.rows()
    print_table(name, names, rows[::every])
    print_note(
        f"G_xy = {spectra.limit('g0'):.5g}: static, for shear along x of the box, as G*; "
        f"G = {spectra.mean_g:.5g}: static, mean over directions"
    )
    print_note(f"eta0 = {spectra.limit('eta0'):.5g}, eta_inf = {spectra.limit('eta_inf'):.5g}")


def print_note(text: str) -> None:
    """Print a line below a table, wrapped to the terminal; names with brackets are no markup."""
    out_console.print(Text(text), soft_wrap=not out_console.is_terminal)


def print_table(title: str, columns: Sequence[str], lines: Sequence[Sequence[str]]) -> None:
    """Print a table of text on stdout; columns that do not fit follow below, beside the first column again."""
    out_console.print()
    print_note(title)
    rest = list(range(1, len(columns)))
    while True:
        shown = [0, *rest]
        while len(shown) > 2 and not _fits(_table(columns, lines, shown)):
            shown.pop()
        out_console.print(_table(columns, lines, shown))
        rest = [k for k in rest if k not in shown]
        if not rest:
            return


def _fits(table: Table) -> bool:
    unbounded = out_console.options.update(max_width=10_000)
    return Measurement.get(out_console, unbounded, table).maximum <= out_console.width


def _table(columns: Sequence[str], lines: Sequence[Sequence[str]], shown: Iterable[int]) -> Table:
    table = Table(box=SIMPLE_HEAD, padding=(0, 1), pad_edge=False, show_edge=False)
    shown = list(shown)
    for k in shown:
        table.add_column(Text(columns[k]), justify="right", overflow="fold")
    for line in lines:
        table.add_row(*(Text(line[k]) for k in shown))
    return table


def print_json(content: dict[str, Any]) -> None:
    """Print one JSON object on stdout."""
    # JSON has no nan: a missing value is null
    print(json.dumps(json.loads(json.dumps(content), parse_constant=lambda _: None)))
