"""Disks in tables without a box: text of named columns x, y and radius or diameter (CSV), and arrays of numpy."""

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.storage.verified_file import FilePath
from jamlab.trajectories.lammps_data import damage_named, equal_rows, numbers, rounding, text_of
from jamlab.trajectories.sites import SIZE_NAMES, Sites, check_flat, radius_of, rounding_of

_SHORT = {"r": "radius", "rad": "radius", "d": "diameter", "diam": "diameter", "t": "time", "species": "type"}
_FRAMES = ("frame", "step", "time")  # columns that number the states of one table
_KNOWN = {"x", "y", "z", "type", "id", "", *SIZE_NAMES, *_FRAMES}
_NO_ROWS = "it has no rows of numbers"
_UNIT = re.compile(r"\s*[\[(/].*")  # behind the name of a column


def read_csv(path: FilePath) -> Iterator[Sites]:
    """Read a text table, separated by commas, semicolons, tabs or blanks, whose first line names the columns."""
    with text_of(path) as file:
        lines = [line.strip("\r\n") for line in file]
        lines = [line for line in lines if line.strip() and (line is lines[0] or not line.startswith("#"))]
        if not lines:
            raise ValueError("it is empty")
        head = lines[0].lstrip("# ")
        separator = next((mark for mark in (";", "\t", ",") if mark in head), None)
        names = _names(head.split(separator))
        rows = [[word.strip().strip('"') for word in line.split(separator)] for line in lines[1:]]
        if separator != ",":
            rows = [[word.replace(",", ".") for word in row] for row in rows]
        if not equal_rows(rows, len(names)):
            raise ValueError(_NO_ROWS)
        columns = {name: numbers(rows, k) for k, name in enumerate(names) if name in _KNOWN - {"type", "id", ""}}
        words = {name: [row[k] for row in rows] for k, name in enumerate(names)}
        error = max(rounding(words[name], columns[name]) for name in ("x", "y"))
        error += sum(SIZE_NAMES[k] * rounding(words[k], columns[k], chosen=True) for k in SIZE_NAMES if k in words)
        yield from _states(names, columns, words.get("type"), error)


def _names(words: Sequence[str]) -> list[str]:
    """Names of the columns in lower case, without units, in full."""
    plain = [_UNIT.sub("", word.strip().strip('"').strip()).lower() for word in words]
    names = [_SHORT.get(name, name) for name in plain]
    for name in ("x", "y"):
        if name not in names:
            raise InputError(
                f"the first line {', '.join(words)!r:.60} names no column {name}: give x, y and radius or diameter"
            )
    if twice := next((name for name in names if name and names.count(name) > 1), None):
        raise InputError(f"two columns are a {twice}: {', '.join(words)}")
    return names


def read_npy(path: FilePath) -> Iterator[Sites]:
    """Read an array of numpy: (n, 2) or (n, 3) rows of x, y and radius, (frames, n, 2 or 3), or (n,) with named
    fields."""
    with damage_named(path):
        with open(path, "rb") as file:
            values = np.lib.format.read_array(file, allow_pickle=False)
        fields = values.dtype.names
        if fields is not None and values.ndim == 1:
            names = _names(fields)
            found = {name: values[field] for name, field in zip(names, fields, strict=True) if name in _KNOWN}
            types = [str(kind) for kind in found.pop("type").tolist()] if "type" in found else None
            columns = {name: _real(column) for name, column in found.items()}
            error = sum(rounding_of(column.dtype, columns[name]) for name, column in found.items())
            yield from _states(names, columns, types, error)
            return
        if values.ndim not in (2, 3) or values.shape[-1] not in (2, 3) or values.dtype.kind not in "fiu":
            raise InputError(f"an array of {values.dtype} {values.shape}: rows of x, y or x, y, radius expected")
        if not values.size:
            raise ValueError(_NO_ROWS)
        for state in values.reshape(-1, *values.shape[-2:]):
            names = ["x", "y", "radius"][: state.shape[1]]
            columns = {name: _real(state[:, k]) for k, name in enumerate(names)}
            yield from _states(names, columns, None, rounding_of(state.dtype, _real(state)))


def _real(values: Any) -> Array:
    found = np.asarray(values, dtype=np.float64)
    if not np.isfinite(found).all():
        raise ValueError("a number is not finite")
    return found


def _states(
    names: Sequence[str], columns: Mapping[str, Array], types: list[str] | None, error: float
) -> Iterator[Sites]:
    """States of a table, one for each value of the column that numbers them."""
    count = len(columns["x"])
    if not count:
        raise ValueError(_NO_ROWS)
    clock = next((columns[name] for name in _FRAMES if name in columns), np.zeros(count))
    radius, positions = radius_of(columns), np.column_stack([columns["x"], columns["y"]])
    for value in dict.fromkeys(clock.tolist()):
        rows = clock == value
        check_flat(columns.get("z", np.zeros(count))[rows], float(np.ptp(positions)))
        yield Sites(
            None,
            positions[rows],
            np.array(["1"] * count if types is None else types)[rows],
            radius=None if radius is None else radius[rows],
            deck=False,
            rounding=error,
            unread=[name for name in names if name not in _KNOWN],
        )
