"""Tables, extended xyz and GSD: files of other programs and groups, and xyz of `jamlab.write`.

Tables (CSV) have columns x, y and radius or diameter, and no box. Extended xyz (freud, OVITO, ASE) has `Lattice` and
`Properties`. GSD (HOOMD) has float32 numbers, and droplets where bonds close rings. Rows of a frame are put in the
order of a column that names particles, so that they are the same in all frames.
"""

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import islice
from typing import Any

import numpy as np

from jamlab.errors import InputError, warn
from jamlab.packing.facts import STATE, facts_of_words, refuse_earlier, rounding_of, shared_parameters
from jamlab.packing.kinds import MODELS
from jamlab.storage.verified_file import FilePath
from jamlab.trajectories.columns import (
    DISK_AREA,
    Columns,
    CutOffError,
    DamageError,
    check_last_row,
    damage_named,
    number,
    rounding,
    text_of,
    whole_frames,
)
from jamlab.trajectories.sites import Sites, plane_box, rings_of_bonds, rings_of_molecules

_NAMES = {  # of columns of tables, by what programs call them
    **{"r": "radius", "rad": "radius", "d": "diameter", "diam": "diameter", "species": "type", "area": DISK_AREA},
    **{"position_x": "x", "position_y": "y", "position_z": "z"},  # TrackMate
}
# columns that number the states of one table
_NAMED_FRAMES = ("image", "snapshot")  # by number or by the name of a file
_FRAMES = ("frame", "slice", "step", "timestep", "time", "position_t", "imagenumber", *_NAMED_FRAMES)
_UNIT = re.compile(r"\s*[\[(/].*")  # behind the name of a column

# tables ---------------------------------------------------------------------------------------------------------------


def read_csv(path: FilePath) -> Iterator[Sites]:
    """Read a text table, separated by commas, semicolons, tabs or blanks, whose first line names the columns."""
    with text_of(path) as file:
        lines = [line for line in file if line.strip()]
        if not lines:
            raise CutOffError("it is empty")
        names, rows = _head_and_rows([line.strip("\r\n") for line in lines])
        try:
            cut = None
            check_last_row(rows or [[]], len(names), lines[-1].endswith("\n") or not rows)
        except CutOffError as error:
            cut = error
        columns = Columns.of_rows(rows[:-1] if cut else rows, {name: k for k, name in enumerate(names)}, len(names))
        states = list(_states(columns))
        if cut and len(states) < 2:
            raise cut
        if cut:
            warn(f"{path} ends within frame {len(states) - 1} ({cut}): the frames before are read")
        yield from (_disks(each) for each in (states[:-1] if cut else states))


def _head_and_rows(lines: Sequence[str]) -> tuple[list[str], list[list[str]]]:
    """Names of the columns, from the first line or a comment below it, and rows of words."""
    heads = [line for k, line in enumerate(lines) if all(above.startswith("#") for above in lines[:k])]
    tried = [_split(line.lstrip("# "), _separator(line)) for line in heads]
    good = next((k for k, words in enumerate(tried) if {"x", "y"} <= set(_plain_names(words))), 0)
    separator, names = _separator(heads[good]), _names(tried[good])
    body = [line for line in lines[good + 1 :] if not line.startswith("#")]
    rows = [_split(line, separator) for line in body]
    if separator != ",":
        rows = [[word.replace(",", ".") for word in row] for row in rows]
    if "POSITION_X" in tried[good]:  # TrackMate says names and units of the columns in up to three more rows
        rows = [row for k, row in enumerate(rows) if k >= 3 or _is_number(row[names.index("x") : names.index("x") + 1])]
    return names, rows


def _separator(line: str) -> str | None:
    return next((mark for mark in (";", "\t", ",") if mark in line), None)


def _split(line: str, separator: str | None) -> list[str]:
    words = line.split() if separator is None else next(csv.reader([line], delimiter=separator))
    return [word.strip().strip('"') for word in words]


def _is_number(words: Sequence[str]) -> bool:
    try:
        return bool([number(word) for word in words])
    except DamageError:
        return False


def _plain_names(words: Sequence[str]) -> list[str]:
    """Names of the columns in lower case, without units, in full."""
    names = []
    for word in words:
        name = _UNIT.sub("", word).strip().lower()
        timed = name == "t" and _UNIT.search(word.strip())  # a column t with a unit is no type
        names.append("time" if timed else _NAMES.get(name, name))
    return names


def _names(words: Sequence[str]) -> list[str]:
    names = _plain_names(words)
    for name in ("x", "y"):
        if name not in names:
            raise InputError(
                f"the first line {', '.join(words)!r:.60} names no column {name}: give x, y and radius or diameter"
            )
    if twice := next((name for name in names if name and names.count(name) > 1), None):
        raise InputError(f"two columns are a {twice}: {', '.join(words)}")
    return names


def _states(columns: Columns) -> Iterator[Columns]:
    """States of a table, one for each value of the column that numbers them."""
    if not len(columns):
        raise CutOffError("it has no rows of numbers")
    numbered = next((name for name in _FRAMES if name in columns), None)
    if numbered is None and "t" in columns:
        if _is_time(columns):
            numbered = "t"
        elif "type" not in columns:
            columns = columns.renamed("t", "type")
    if numbered in _NAMED_FRAMES and not _is_number(columns.words(numbered)):
        clock = np.unique(columns.words(numbered), return_inverse=True)[1].astype(np.float64)
    else:
        clock = np.zeros(len(columns)) if numbered is None else columns.numbers(numbered)
    for value in dict.fromkeys(clock.tolist()):
        state = columns.taken(clock == value)
        for other in (name for name in _FRAMES if name in columns and name != numbered):
            if _is_number(state.words(other)) and np.ptp(state.numbers(other)):
                raise InputError(f"rows of {numbered} {value:g} differ in {other}: keep one column that numbers states")
        yield state


def _is_time(columns: Columns) -> bool:
    """Whether a column t numbers states rather than types of particles, if that can be told."""
    if not _is_number(columns.words("t")):
        return False
    values = columns.numbers("t")
    if not np.ptp(values):
        return False
    if (values != np.rint(values)).any():
        return True
    if (name := _particles(columns)) is not None:
        named, count = np.column_stack([columns.numbers(name), values]), len(values)
        if len(np.unique(named[:, 0])) == count:
            return False
        if len(np.unique(named, axis=0)) == count:
            return True
    if (sizes := columns.radius()[0]) is not None and np.ptp(sizes):
        each = [np.unique(sizes[values == value]) for value in np.unique(values)]
        if all(len(found) == 1 for found in each):  # sizes go by it
            return False
    raise InputError(
        f"the column t has {len(np.unique(values))} whole numbers, which may be times or types: call it time or type"
    )


def _particles(columns: Columns) -> str | None:
    """The column that names particles, if all of them have a number there."""
    particles = ("particle", "track_id", "id")  # columns that name a particle in all states, the surest first
    name = next((name for name in particles if name in columns), None)
    if name is None or not _is_number(columns.words(name)):
        return None
    values = columns.numbers(name)
    if name == "track_id" and len(np.unique(values)) < len(values):  # tracks of TrackMate split and merge
        return None
    return name if np.array_equal(values, np.rint(values)) else None


def _disks(columns: Columns, box: Any = None, error: float = 0.0, **more: Any) -> Sites:
    name = _particles(columns)
    return (columns if name is None else columns.by_id(name)).disks(box, error, **more)


# extended xyz ---------------------------------------------------------------------------------------------------------


def read_xyz(path: FilePath) -> Iterator[Sites]:
    """Read the frames of an extended xyz file: disks in a periodic box, with radii if the file has them; droplets where
    `jamlab.write` wrote them."""
    with text_of(path) as file:
        yield from whole_frames(path, _xyz_frames(file))


def _xyz_frames(file: Iterator[str]) -> Iterator[Sites]:
    for line in file:
        if not (said := line.strip()):
            continue
        if not said.isdecimal() or not int(said):
            raise InputError(f"{said!r:.40} stands where a frame should begin with its number of disks")
        comment, n = next(file, ""), int(said)
        keys = {name: quoted or plain for name, quoted, plain in re.findall(r'([^\s="]+)=(?:"([^"]*)"|(\S+))', comment)}
        lines = list(islice(file, n))
        rows = [row.split() for row in lines]
        if len(rows) != n:
            raise CutOffError(f"{n} rows are announced, {len(rows)} are there")
        check_last_row(rows, max(map(len, rows)), lines[-1].endswith("\n"), "rounding" in keys)
        yield _xyz_frame(keys, rows)


def _xyz_frame(keys: dict[str, str], rows: list[list[str]]) -> Sites:
    lattice, own = keys.get("Lattice", "").split(), "rounding" in keys
    if len(lattice) not in (0, 4, 9):
        raise ValueError(
            f"Lattice={keys['Lattice']!r:.60} has {len(lattice)} numbers, not 4 (two vectors) or 9 (three)"
        )
    side = 2 if len(lattice) == 4 else 3
    box = plane_box("Lattice", np.array([*map(number, lattice)]).reshape(side, side)) if lattice else None
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
    refuse_earlier(keys)
    known = {"units", "law", *shared_parameters(keys.get("law")), *(("model", "provenance", *STATE) if own else ())}
    entries = facts_of_words({name: keys[name] for name in known & keys.keys()})
    error = 0.0 if box is None else rounding(lattice, box, chosen=True, stated=own)
    atoms = Columns.of_rows(rows, places, at, own)
    atoms = atoms if (named := _particles(atoms)) is None else atoms.by_id(named)
    more: dict[str, Any] = {"fixed": atoms.numbers("fixed") > 0} if own and "fixed" in atoms else {}
    if "model" in entries and MODELS.get(entries["model"]).has_outlines:
        more["rings"] = rings_of_molecules(atoms.whole("mol"))
        more["a0"] = atoms.numbers("a0")
    return atoms.disks(box, error, entries=entries, **more)


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
    with damage_named(path):
        try:
            file = gsd.hoomd.open(str(path), "r")
        except RuntimeError as error:
            raise DamageError(str(error)) from error
        with file:
            yield from _gsd_frames(file)


def _gsd_frames(file: Any) -> Iterator[Sites]:
    for k, frame in enumerate(file):
        particles, bonds, (lx, ly, _, xy, *lean) = frame.particles, frame.bonds, frame.configuration.box
        if any(lean):
            raise InputError(f"frame {k} has tilt factors xz, yz = {lean}: it leans out of the plane")
        box = np.array([[lx, 0.0], [float(xy) * ly, ly]], dtype=np.float64)
        columns = dict(zip("xyz", particles.position.T, strict=True))
        kinds, typeid = np.array(particles.types), particles.typeid
        if len(wrong := np.flatnonzero(typeid >= len(kinds))):
            said = f"the typeid {typeid[wrong[0]]}, but there are {len(kinds)} types"
            raise InputError(f"particle {wrong[0]} of frame {k} has {said}")
        columns["type"] = kinds[typeid]
        # in a frame, or in the first one for all; without them gsd gives every particle the diameter 1
        if any(file.file.chunk_exists(each, "particles/diameter") for each in (0, k)):
            columns["diameter"] = particles.diameter
        elif shapes := [_diameter(shape) for shape in particles.type_shapes or []]:
            if len(shapes) == len(kinds) and None not in shapes:
                columns["diameter"] = np.array(shapes, dtype=np.float64)[typeid]
        found = Columns(columns).disks(box, 2 * rounding_of(np.dtype("f4"), box))
        rings = partial(rings_of_bonds, bonds.group.astype(np.int64), particles.N) if bonds.N else None
        yield replace(found, rings=rings, wrapped=True)


def _diameter(shape: dict[str, Any]) -> float | None:
    """Diameter of a shape of HOOMD, if it is a disk."""
    if shape.get("type") == "Ellipsoid" and shape.get("a") == shape.get("b"):
        return 2 * float(shape["a"])
    return float(shape["diameter"]) if shape.get("type") in ("Sphere", "Disk") and "diameter" in shape else None
