"""Print packings, tables, notes and JSON on stdout; errors and progress on stderr, as bars or, elsewhere, as lines."""

import json
import os
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.text import Text

from jamlab.errors import JamlabWarning
from jamlab.processes.progress import in_words

if TYPE_CHECKING:
    from jamlab.packing.packing import Packing
    from jamlab.processes.progress import Tell


_fits = (sys.stdout is not None and sys.stdout.isatty()) or "COLUMNS" in os.environ
# names may hold [brackets], which are no markup; a file or a pipe has no width of its own
out_console = Console(width=None if _fits else 160, markup=False, emoji=False)
err_console = Console(stderr=True, markup=False, emoji=False)


def print_line(text: str, console: Console = out_console) -> None:
    """Print lines as they are, neither wrapped nor coloured."""
    console.print(text, soft_wrap=True, highlight=False)


@contextmanager
def warnings_as_lines() -> Iterator[None]:
    """Print the warnings of jamlab as lines on stderr, without the place in the code."""
    with warnings.catch_warnings():
        warnings.simplefilter("always", JamlabWarning)
        plain = warnings.showwarning

        def show(message: Any, category: Any, *place: Any, **how: Any) -> None:
            if issubclass(category, JamlabWarning):
                print_line(f"warning: {message}", err_console)
            else:
                plain(message, category, *place, **how)

        warnings.showwarning = show
        yield


def print_stage(name: str) -> None:
    """Print one line of progress on stderr."""
    err_console.print(Text(name, style="dim"), soft_wrap=True)


def print_note(text: str) -> None:
    """Print a line below a table, wrapped to the terminal; names with brackets are no markup."""
    out_console.print(Text(text), soft_wrap=not out_console.is_terminal)


def print_table(title: str, columns: Sequence[str], lines: Sequence[Sequence[str]]) -> None:
    """Print a table of text on stdout; columns that do not fit follow below, beside the first column again."""
    rows = [columns, *lines]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    blocks: list[list[int]] = [[]]  # columns that stand side by side
    for k in range(1, len(columns)):
        if blocks[-1] and widths[0] + sum(1 + widths[j] for j in [*blocks[-1], k]) + _MARK > out_console.width:
            blocks.append([])
        blocks[-1].append(k)
    out_console.print()
    print_note(title)
    texts = []
    for block in blocks:
        heading, *cells = [
            " ".join([row[0].ljust(widths[0]), *(row[k].rjust(widths[k]) for k in block)]) for row in rows
        ]
        texts.append("\n".join([heading + " \\" * (block is not blocks[-1]), *cells]))
    print_line("\n\n".join(texts), out_console)


_MARK = len(" \\")  # after a heading whose table goes on below


def print_json(content: dict[str, Any]) -> None:
    """Print one JSON object on stdout."""
    # JSON has no nan: a missing value is null
    print(json.dumps(json.loads(json.dumps(content), parse_constant=lambda _: None)))


# s between lines of one name where there is no terminal: a log of a day has some hundred lines
_LINE_INTERVAL, _LONGEST_INTERVAL = 30.0, 600.0


@contextmanager
def progress_bar(name: str, *, guess: bool = True) -> "Iterator[Tell]":
    """Show a bar with a clock, or lines where there is no terminal; yields the function that takes progress. What is
    done at the first call was done before, by a run that is resumed. `guess`: add the time left, by the share that is
    done; False where the text says it."""
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bars

    columns = (TextColumn("{task.description}"), BarColumn(16), TimeElapsedColumn(), TextColumn("{task.fields[at]}"))
    quiet = not err_console.is_terminal
    with Bars(*columns, console=err_console, transient=True, disable=quiet) as bars:
        bar = bars.add_task(name, total=1.0, at="")
        began = last = time.monotonic()
        before = float("nan")

        def show(share: float, text: str) -> None:
            nonlocal last, before
            now = time.monotonic()
            before = share if before != before else before
            at = text + (_time_left(share, before, now - began) if guess else "")
            bars.update(bar, completed=share if share == share else None, at=at)
            interval = max(_LINE_INTERVAL, min(_LONGEST_INTERVAL, (now - began) / 20))
            if quiet and now - last > interval:
                last = now
                print_line(f"{name}: {at}, {in_words(now - began)} so far", err_console)

        yield show


def _time_left(share: float, before: float, elapsed: float) -> str:
    # share of the work below which the time left is a guess not worth showing
    if not before + 0.03 <= share < 1:  # nan where it is not known
        return ""
    return f", about {in_words(elapsed * (1 - share) / (share - before))} left"


def print_packings(
    packings: "list[Packing]",
    out: Path | None,
    as_json: bool,
    csv: Path | None = None,
    save: "Callable[[dict[str, Any]], None] | None" = None,
    quantities: list[str] | None = None,
    workers: int | None = None,
    step: int = 1,
) -> None:
    """Measure packings, write them to `out` and what was measured to `csv` if these are given, and print it. `save`
    writes a file of another kind to `out`, given what was measured. `quantities`: what is measured, if not all that is
    usual; `workers`: processes, if not as many as there are cores; `step`: print every step-th packing and the last."""
    from jamlab.measure import MODULI, numbers_of
    from jamlab.mechanics.negative_moduli import warn_of_negative_rows
    from jamlab.packing.hdf5 import write_sweep
    from jamlab.packing.quantities import MEASURED

    with progress_bar("measured") as progress:
        measured = numbers_of(packings, *([quantities] if quantities else []), workers=workers, progress=progress)
    moduli = {name: measured[name] for name in MODULI if name in measured}
    warn_of_negative_rows({MEASURED[name].symbol: values for name, values in moduli.items()}, "packings")
    if save is not None:
        save(measured)
    elif out is not None:
        write_sweep(out, packings, measured)
    if csv is not None:
        import pandas as pd

        from jamlab.storage.table_file import write_table

        write_table(pd.DataFrame(measured), csv)
    # None where no minimisation is known, as in a dump without that word
    marks = [None if p.max_force is None and not p.converged else p.converged and p.on_target for p in packings]
    if as_json:
        columns: dict[str, Any] = {name: values.tolist() for name, values in measured.items()}
        words = {name: MEASURED[name].words for name in measured}
        facts = {"out": out and str(out), "phi_J": packings[-1].phi_J, "converged": marks, "labels": words}
        print_json({**facts, **columns})
        return
    kept = sorted({*range(0, len(packings), step), len(packings) - 1})
    chosen = {name: values[kept] for name, values in measured.items()}
    _print_measured([packings[k] for k in kept], chosen, [marks[k] for k in kept], every=bool(quantities))
    if out is not None:
        print_note(f"wrote {out}")
    if len(kept) < len(packings):
        print_note(f"{len(kept)} of {len(packings)} states; all of them: jamlab analyze {out}")


def _print_measured(packings: "list[Packing]", measured: "dict[str, Any]", marks: list[Any], *, every: bool) -> None:
    """Print a table of what was measured, with notes; every column, or those that hold numbers to be shown."""
    from jamlab.measure import why_no_modulus
    from jamlab.packing.quantities import MEASURED

    filled = [name for name in measured if every or _is_shown(name, measured[name])]
    forms = {name: MEASURED[name].shown or ".4g" for name in filled}
    lines = [[_cell(name, measured[name][k], forms[name]) for name in filled] for k in range(len(packings))]
    for line, mark in zip(lines, marks, strict=True):
        line.append({True: "yes", False: "NO", None: "-"}[mark])
    headings = [MEASURED[name].symbol for name in filled]
    print_table(f"{packings[0].model}, n = {packings[0].n}", [*headings, "converged"], lines)
    if "g" in filled:
        print_note("G: relaxed shear modulus, mean over directions; G_xy: for shear along x of the box")
    if None in marks:
        print_note(
            "converged -: unknown, the file does not state it; G and B are meaningful only at an energy "
            "minimum (see max force)"
        )
    if {"g", "g_x"} <= measured.keys():
        both = zip(packings, measured["g"], measured["g_x"], strict=True)
        reasons = (("not stable: " if x != x else "") + why_no_modulus(p) for p, g, x in both if g != g)
        for reason in dict.fromkeys(reasons):
            print_note(reason)


def _is_shown(name: str, values: Any) -> bool:
    from jamlab.packing.quantities import MEASURED

    return bool(MEASURED[name].shown) and any(value == value for value in values)


def _cell(name: str, value: float, form: str) -> str:
    from jamlab.measure import MODULI

    if value != value:
        return "not stable" if name in MODULI else "-"
    return f"{value:{form}}"
