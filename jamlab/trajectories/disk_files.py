"""Disks in files of other programs and groups: tables, arrays, extended xyz and H5MD.

Tables (CSV) and arrays (NPY) have columns x, y and radius or diameter, and no box. Extended xyz (freud, OVITO, ASE)
has `Lattice` and `Properties`. H5MD (https://www.nongnu.org/h5md/h5md.html) has one group of particles with position,
image, id, species, radius or diameter, and a box of lengths or vectors, each fixed or by frame.
"""

import re
from collections.abc import Iterator, Sequence
from itertools import islice
from typing import Any

import h5py
import numpy as np

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.storage.verified_file import FilePath, dataset, read_hdf5
from jamlab.trajectories.columns import DAMAGE, Columns, damage_named, rounding, rounding_of, text_of
from jamlab.trajectories.sites import LAW_NAMES, SIZE_NAMES, Sites, plane_box

_SHORT = {"r": "radius", "rad": "radius", "d": "diameter", "diam": "diameter", "t": "time", "species": "type"}
_FRAMES = ("frame", "step", "time")  # columns that number the states of one table
_TABLE = {"x", "y", "z", "type", "id", "", *SIZE_NAMES, *_FRAMES}
_NO_ROWS = "it has no rows of numbers"
_UNIT = re.compile(r"\s*[\[(/].*")  # behind the name of a column
_KEYS = re.compile(r'([^\s="]+)=(?:"([^"]*)"|(\S+))')  # of the second line of an extended xyz frame
# keys, columns and elements that are read, or that states at rest have no use for
_XYZ_KEYS = {"Lattice", "Properties", "pbc", "units", "Origin"}
_XYZ_COLUMNS = {"species", "type", "pos", *SIZE_NAMES, "id", "velo", "vel", "velocities", "force", "forces", "mass"}
_H5MD = {"position", "box", "image", "id", "species", *SIZE_NAMES, "velocity", "force", "mass", "charge"}
_H5MD_GROUPS = {"h5md", "particles", "observables"}  # `observables` hold results, not the state
_NUMBERS = "fiu"  # kinds of numpy


# tables and arrays ----------------------------------------------------------------------------------------------------


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
        yield from _states(Columns.of_rows(rows, {name: k for k, name in enumerate(names)}, len(names)), names)


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
            yield from _states(Columns({name: values[field] for name, field in zip(names, fields, strict=True)}), names)
            return
        if values.ndim not in (2, 3) or values.shape[-1] not in (2, 3) or values.dtype.kind not in _NUMBERS:
            raise InputError(f"an array of {values.dtype} {values.shape}: rows of x, y or x, y, radius expected")
        for state in values.reshape(-1, *values.shape[-2:]):
            names = ["x", "y", "radius"][: state.shape[1]]
            yield from _states(Columns(dict(zip(names, state.T, strict=True))), names)


def _states(columns: Columns, names: Sequence[str]) -> Iterator[Sites]:
    """States of a table, one for each value of the column that numbers them."""
    if not len(columns):
        raise ValueError(_NO_ROWS)
    numbered = next((name for name in _FRAMES if name in columns), None)
    clock = np.zeros(len(columns)) if numbered is None else columns.numbers(numbered)
    for value in dict.fromkeys(clock.tolist()):
        yield columns.taken(clock == value).disks(None, unread=[name for name in names if name not in _TABLE])


# extended xyz ---------------------------------------------------------------------------------------------------------


def read_xyz(path: FilePath) -> Iterator[Sites]:
    """Read the frames of an extended xyz file: disks in a periodic box, with radii if the file has them."""
    with text_of(path) as file:
        for line in file:
            if not line.strip():
                continue
            n = int(line)
            comment = next(file, "")
            entries = _KEYS.findall(comment)
            keys = {name: quoted or plain for name, quoted, plain in entries}
            if len(keys) < len(entries):
                raise InputError(f"the second line of a frame gives one key twice: {comment.strip():.200}")
            rest = _KEYS.sub(" ", comment).strip()
            rows = [row.split() for row in islice(file, n)]
            if len(rows) != n:
                raise ValueError(f"{len(rows)} rows of disks, {n} announced")
            yield _xyz_frame(keys, rows, [rest] if rest else [])


def _xyz_frame(keys: dict[str, str], rows: list[list[str]], rest: list[str]) -> Sites:
    lattice = keys.get("Lattice", "").split()
    box = plane_box("Lattice", _floats(lattice, 9, "Lattice").reshape(3, 3)) if lattice else None
    sides = keys.get("pbc", "T T F").split()
    if any(side.upper()[:1] not in ("T", "1") for side in sides[:2]):
        raise InputError(f"pbc={' '.join(sides)!r}: packings are periodic in x and y")
    widths = _properties(keys.get("Properties", "species:S:1:pos:R:3"))
    if widths.get("pos") not in (2, 3):
        raise InputError(f"columns {', '.join(widths)}: pos with 2 or 3 numbers expected")
    places: dict[str, int] = {}
    at = 0
    for name, width in widths.items():
        places |= {"xyz"[k]: at + k for k in range(width)} if name == "pos" else {name: at}
        at += width
    entries: dict[str, Any] = {name: keys[name] for name in ("units",) if name in keys}
    entries |= {name: float(keys[name]) for name in LAW_NAMES if name in keys}
    unread = [*rest, *(keys.keys() - _XYZ_KEYS - LAW_NAMES), *(widths.keys() - _XYZ_COLUMNS)]
    error = 0.0 if box is None else rounding(lattice, box, chosen=True)
    return Columns.of_rows(rows, places, at).disks(box, error, entries=entries, unread=unread)


def _properties(text: str) -> dict[str, int]:
    """Number of columns by name, in lower case."""
    fields = text.split(":")
    if len(fields) % 3:
        raise ValueError(f"Properties={text!r:.60}: name, kind and number of columns expected for each")
    names = [name.lower() for name in fields[::3]]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise InputError(f"two properties are named {twice}")
    return dict(zip(names, map(int, fields[2::3]), strict=True))


def _floats(words: Sequence[str], count: int, what: str) -> Array:
    values = np.array([float(word) for word in words if word.strip()])
    if len(values) != count or not np.isfinite(values).all():
        raise ValueError(f"{what} {' '.join(words)!r:.60}: {count} numbers expected")
    return values


# HDF5 -----------------------------------------------------------------------------------------------------------------


def kind_of_hdf5(path: FilePath) -> str:
    """What an HDF5 file is: "h5md" of another program, or "hdf5" of jamlab."""
    try:
        with read_hdf5(path) as file:
            if file.visititems_links(_leads_away) is not None:  # to what may never end
                return "hdf5"
            creator = file["h5md/creator"].attrs.get("name", "") if "h5md/creator" in file else ""
            foreign = "schema" not in file.attrs and str(creator) not in ("jamlab", "b'jamlab'")
            return "h5md" if "particles" in file and foreign else "hdf5"
    except (OSError, *DAMAGE):  # which its reader names
        return "hdf5"


def _leads_away(name: str, link: Any) -> str | None:
    return name if isinstance(link, h5py.ExternalLink) else None


def read_h5md(path: FilePath, frame: int | None) -> Iterator[tuple[int, Sites]]:
    """Read one frame of a file, or all, with their numbers, in the length that it is written in."""
    with damage_named(path), read_hdf5(path) as file:
        names = [name for name in file["particles"] if "position" in file["particles"][name]]
        if len(names) != 1 and "all" not in names:
            raise InputError(
                f"groups of particles with positions: {', '.join(names) or 'none'}; one expected, or `all`"
            )
        chosen = "all" if "all" in names else names[0]
        group = file["particles"][chosen]
        if "connectivity" in file:
            raise InputError("the file has bonds: give the vertices of droplets to jamlab.from_outlines")
        unread = [*(group.keys() - _H5MD), *(file.keys() - _H5MD_GROUPS)]
        unread += [f"particles/{name}" for name in file["particles"] if name != chosen]
        count = len(_element(group, "position")) if _by_frame(group, "position") else 1
        every = range(count)
        for k in every if frame is None else every[frame : frame + 1 or None]:
            yield k, _h5md_frame(group, k, count, unread)


def _h5md_frame(group: Any, frame: int, count: int, unread: list[str]) -> Sites:
    positions = _at(group, "position", frame, count, 2)
    cell, box, error = group.get("box"), None, 0.0
    if cell is not None:
        sides = [side.decode() if isinstance(side, bytes) else str(side) for side in cell.attrs.get("boundary", ())]
        if any(side != "periodic" for side in sides[:2]):
            raise InputError(f"boundaries {', '.join(sides)}: packings are periodic in x and y")
        edges = _at(cell, "edges", frame, count, _element(cell, "edges").ndim - _by_frame(cell, "edges"))
        box = plane_box("box edges", edges)
        error = rounding_of(edges.dtype, box)
    if positions.shape[1] not in (2, 3):
        raise InputError(f"positions of {positions.shape[1]} dimensions: packings have two")
    columns = dict(zip("xyz", positions.T, strict=False))
    if "image" in group and box is not None:
        shift = _at(group, "image", frame, count, 2)[:, :2] @ box
        error += rounding_of(positions.dtype, positions)
        columns |= {"x": positions[:, 0] + shift[:, 0], "y": positions[:, 1] + shift[:, 1]}
    columns |= {name: _at(group, name, frame, count, 1) for name in ("id", "species", *SIZE_NAMES) if name in group}
    found = Columns(columns)
    return (found.by_id() if "id" in found else found).disks(box, error, unread=unread)


def _by_frame(group: Any, name: str) -> bool:
    """Whether an element has a row for each frame, and not one for all."""
    return isinstance(group[name], h5py.Group)


def _element(group: Any, name: str) -> Any:
    """Dataset of an element."""
    return dataset(group, f"{name}/value" if _by_frame(group, name) else name, _NUMBERS)


def _at(group: Any, name: str, frame: int, count: int, dimensions: int) -> Any:
    """One of so many frames of an element, in the type that the file has."""
    data, moving = _element(group, name), _by_frame(group, name)
    if moving and len(data) != count:
        raise InputError(f"{data.name} has {len(data)} frames, positions {count}: which belong together is not known")
    values = np.asarray(data[frame] if moving else data[()])
    if values.ndim != dimensions or not np.isfinite(values).all():
        raise ValueError(f"{data.name}, frame {frame}: finite numbers in {dimensions} dimensions expected")
    return values
