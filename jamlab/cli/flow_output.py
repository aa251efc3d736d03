"""What the commands of flow in time print and write beside their HDF5 file: a table, a picture, JSON."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jamlab.cli.console import print_json, print_note, print_table
from jamlab.cli.interruption import expect_output
from jamlab.errors import InputError
from jamlab.packing.atomic_file import atomic_file, check_target

if TYPE_CHECKING:
    from jamlab.flow.read_flow import Flow

_LINES = 15  # of a table on the screen
_PICTURES = (".png", ".pdf", ".svg")


def expect_files(source: Path, out: Path, plot: Path | None, csv: Path | None) -> None:
    """Refuse, before anything runs, what cannot be written at the end.

    Raises:
        InputError: the ending of a name does not fit.
        StorageError: see `check_target`.
    """
    check_target(out, source)
    if plot is not None and plot.suffix.lower() not in _PICTURES:
        raise InputError(f"cannot draw {plot}: end its name in {', '.join(_PICTURES)}")
    for path in (plot, csv):
        if path is not None:
            check_target(path, source, out)
    expect_output(out)


def give(
    found: "Flow", columns: Mapping[str, str], notes: Sequence[str], out: Path, plot: Path | None, csv: Path | None,
    as_json: bool,
) -> None:  # fmt: skip
    """Write picture and table of a result that is in `out` already, and print it.

    Args:
        found: the result.
        columns: names of its arrays that are shown -> format.
        notes: lines below the table, before the verdict.
        out: file that holds it.
        plot, csv: to write, or None.
        as_json: print one JSON object instead of the table.
    """
    if plot is not None:
        _draw(found, plot)
    if csv is not None:
        _write_rows(found, csv)
    if as_json:
        print_json(_plain(found) | {"verdict": found.verdict, "out": str(out), "drag": found.describe()})
        return
    count = len(getattr(found, next(iter(columns))))
    shown = np.unique(np.linspace(0, count - 1, min(count, _LINES)).round().astype(int))
    lines = [[f"{getattr(found, name)[k]:{form}}" for name, form in columns.items()] for k in shown]
    print_table(found.describe(), list(columns), lines)
    for note in (*notes, found.verdict, f"unit of stress {found.unit}, of time tau_1; wrote {out}"):
        print_note(note)


def _rows(found: "Flow") -> dict[str, Any]:
    """Arrays of a result that have one value a row, the first of them first, and what of energy is not balanced."""
    arrays = {f.name: getattr(found, f.name) for f in fields(found)}
    derived = ("compliance", "modulus", "steady", "energy_gap")
    arrays |= {name: getattr(found, name) for name in derived if hasattr(found, name)}
    arrays = {name: value for name, value in arrays.items() if isinstance(value, np.ndarray) and value.ndim == 1}
    count = len(next(iter(arrays.values())))
    return {name: value for name, value in arrays.items() if len(value) == count}


def _write_rows(found: "Flow", path: Path) -> None:
    import pandas as pd

    with atomic_file(path) as temporary:
        pd.DataFrame(_rows(found)).to_csv(temporary, index=False)


def _draw(found: "Flow", path: Path) -> None:
    from matplotlib.figure import Figure

    from jamlab.figures.picture_file import save_picture
    from jamlab.plotting.axes import CURVES

    figure = Figure(figsize=CURVES, layout="constrained")
    found.plot(figure.subplots())
    save_picture(figure, path)


def _plain(found: "Flow") -> dict[str, Any]:
    """Numbers and text of a result; complex numbers as pairs."""
    content: dict[str, Any] = {name: values.tolist() for name, values in _rows(found).items()}
    content["imbalance"] = np.asarray(found.imbalance).tolist()
    for f in fields(found):
        value = getattr(found, f.name)
        if isinstance(value, bool | int | float | str):
            content[f.name] = value
    return content
