"""Published points, read from CSV to lay them beside a simulation."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.errors import StorageError


@checked
def read_points(path: str | Path, columns: tuple[str, ...] = ()) -> dict[str, Array]:
    r"""Read columns of numbers from a CSV file.

    The first line that is neither empty nor a comment names the columns; lines that begin with # are comments and
    should say where the points come from. An empty field is nan.

    Args:
        path: file, UTF-8, with commas.
        columns: names that must be present, such as ("rho", "z"); all columns of the file are returned.

    Returns:
        Column name -> (m,) float64.

    Raises:
        StorageError: the file cannot be read, lacks a column, has a row of another length or a field that is not a
            number; the message names the file and the line.

    Example:
        >>> from pathlib import Path
        >>> _ = Path("points.csv").write_text("# read off a figure\nrho,z\n0.85,4.3\n0.90,5.1\n")
        >>> jamlab.read_points("points.csv", ("rho", "z"))["z"]
        array([4.3, 5.1])
    """
    path = Path(path)
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise StorageError(f"{path} cannot be read as text: {error}") from None
    rows = [
        (number, line) for number, line in enumerate(lines, 1) if line.strip() and not line.lstrip().startswith("#")
    ]
    if not rows:
        raise StorageError(f"{path} is empty: its first line must name the columns")
    fields = list(csv.reader(line for _, line in rows))
    names = [name.strip() for name in fields[0]]
    missing = [name for name in columns if name not in names]
    if missing or len(set(names)) < len(names):
        raise StorageError(f"{path} has columns {', '.join(names)}: needs {', '.join(columns)}, each once")
    values = np.empty((len(fields) - 1, len(names)))
    for row, ((number, _), words) in enumerate(zip(rows[1:], fields[1:], strict=True)):
        if len(words) != len(names):
            raise StorageError(f"{path}, line {number}: {len(words)} fields, needs {len(names)}")
        for column, word in enumerate(words):
            try:
                values[row, column] = float(word) if word.strip() else np.nan
            except ValueError:
                raise StorageError(f"{path}, line {number}: {word!r} in column {names[column]} is no number") from None
    return {name: values[:, column] for column, name in enumerate(names)}
