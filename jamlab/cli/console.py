"""Print tables, notes and JSON to the terminal: results go to stdout, errors to stderr."""

import json
import os
import sys
from collections.abc import Iterable, Sequence
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

# names may hold [brackets], which are no markup; a file or a pipe has no width of its own
out_console = Console(width=None if sys.stdout.isatty() or "COLUMNS" in os.environ else 160, markup=False, emoji=False)
err_console = Console(stderr=True, markup=False, emoji=False)


def print_stage(name: str) -> None:
    """Print one line of progress on stderr."""
    err_console.print(Text(name, style="dim"), soft_wrap=True)


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
