"""Files of other programs and groups: tables, extended xyz and GSD.

Tables (CSV) have columns x, y and radius or diameter, and no box. Extended xyz (freud, OVITO, ASE) has `Lattice` and
`Properties`. GSD (HOOMD) has float32 numbers, and droplets where bonds close rings.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np

from jamlab.errors import InputError
from jamlab.storage.verified_file import FilePath
from jamlab.trajectories.columns import Columns, damage_named, rounding, rounding_of, text_of
from jamlab.trajectories.sites import LAW_NAMES, Sites, plane_box, rings_of_bonds

_SHORT = {"r": "radius", "rad": "radius", "d": "diameter", "diam": "diameter", "t": "time", "species": "type"}
_FRAMES = ("frame", "step", "time")  # columns that number the states of one table
_UNIT = re.compile(r"\s*[\[(/].*")  # behind the name of a column
_KEYS = re.compile(r'([^\s="]+)=(?:"([^"]*)"|(\S+))')  # of the second line of an extended xyz frame

# tables ---------------------------------------------------------------------------------------------------------------


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
        yield from _states(Columns.of_rows(rows, {name: k for k, name in enumerate(names)}, len(names)))


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


def _states(columns: Columns) -> Iterator[Sites]:
    """States of a table, one for each value of the column that numbers them."""
    if not len(columns):
        raise ValueError("it has no rows of numbers")
    numbered = next((name for name in _FRAMES if name in columns), None)
    clock = np.zeros(len(columns)) if numbered is None else columns.numbers(numbered)
    for value in dict.fromkeys(clock.tolist()):
        yield columns.taken(clock == value).disks(None)


# extended xyz ---------------------------------------------------------------------------------------------------------


def read_xyz(path: FilePath) -> Iterator[Sites]:
    """Read the frames of an extended xyz file: disks in a periodic box, with radii if the file has them."""
    with text_of(path) as file:
        for line in file:
            if not line.strip():
                continue
            n = int(line)
            keys = {name: quoted or plain for name, quoted, plain in _KEYS.findall(next(file, ""))}
            rows = [row.split() for row in islice(file, n)]
            if len(rows) != n:
                raise ValueError(f"{len(rows)} rows of disks, {n} announced")
            yield _xyz_frame(keys, rows)


def _xyz_frame(keys: dict[str, str], rows: list[list[str]]) -> Sites:
    lattice = keys.get("Lattice", "").split()
    box = plane_box("Lattice", np.array(lattice, dtype=np.float64).reshape(3, 3)) if lattice else None
    sides = keys.get("pbc", "T T F").split()
    if any(side.upper()[:1] not in ("T", "1") for side in sides[:2]):
        raise InputError(f"pbc={' '.join(sides)!r}: packings are periodic in x and y")
    widths = _properties(keys.get("Properties", "species:S:1:pos:R:3"))
    if widths.get("pos") not in (2, 3):
        raise InputError(f"columns {', '.join(widths)}: the column pos must have 2 or 3 numbers")
    places: dict[str, int] = {}
    at = 0
    for name, width in widths.items():
        places |= {"xyz"[k]: at + k for k in range(width)} if name == "pos" else {name: at}
        at += width
    entries: dict[str, Any] = {name: keys[name] for name in ("units",) if name in keys}
    entries |= {name: float(keys[name]) for name in LAW_NAMES if name in keys}
    error = 0.0 if box is None else rounding(lattice, box, chosen=True)
    return Columns.of_rows(rows, places, at).disks(box, error, entries=entries)


def _properties(text: str) -> dict[str, int]:
    """Number of columns by name, in lower case."""
    fields = text.split(":")
    if len(fields) % 3:
        raise ValueError(f"Properties={text!r:.60}: name, kind and number of columns expected for each")
    return dict(zip(map(str.lower, fields[::3]), map(int, fields[2::3]), strict=True))


# GSD ------------------------------------------------------------------------------------------------------------------


def read_gsd(path: FilePath) -> Iterator[Sites]:
    """Read the frames of a GSD file: disks with diameters if the file has them, or closed rings of bonds."""
    try:
        import gsd.hoomd
    except ImportError as error:
        raise InputError(f"{path}: it needs the package gsd: pip install gsd") from error
    with damage_named(path), gsd.hoomd.open(str(path), "r") as file:
        for k, frame in enumerate(file):
            particles, bonds, (lx, ly, _, xy, *lean) = frame.particles, frame.bonds, frame.configuration.box
            if any(lean):
                raise InputError(f"frame {k} has tilt factors xz, yz = {lean}: it leans out of the plane")
            box = np.array([[lx, 0.0], [float(xy) * ly, ly]], dtype=np.float64)
            columns = dict(zip("xyz", particles.position.T, strict=True))
            columns["type"] = np.array(particles.types)[particles.typeid]
            # in a frame, or in the first one for all; without them gsd gives every particle the diameter 1
            if not bonds.N and any(file.file.chunk_exists(each, "particles/diameter") for each in (0, k)):
                columns["diameter"] = particles.diameter
            found = Columns(columns).disks(box, 2 * rounding_of(np.dtype("f4"), box))
            rings = rings_of_bonds(bonds.group.astype(np.int64), particles.N) if bonds.N else None
            yield replace(found, rings=rings, wrapped=True)
