"""Read packings from LAMMPS data files and text dumps, and how far their numbers are rounded."""

import bz2
import gzip
import lzma
import re
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.errors import InputError, JamlabError, StorageError
from jamlab.packing.lammps_files import STATE, described
from jamlab.packing.law_parameters import CONTACT_FORMS, ENSEMBLES
from jamlab.packing.neighbors import shortest_images
from jamlab.storage.system_errors import system_said
from jamlab.storage.verified_file import FilePath
from jamlab.trajectories.sites import (
    LAW_NAMES,
    SIZE_NAMES,
    Sites,
    check_flat,
    radius_of,
    rings_of_bonds,
    rings_of_molecules,
)

FULL_DIGITS = 15  # numbers of full precision rarely end in more than two zeros; LAMMPS writes 6 by default
_CHOSEN_DIGITS = 4  # sizes and boxes of no more are taken for numbers that somebody chose
_SAMPLE = 500  # coordinates that are looked at
_SAME_PLACE = 1e-12  # of the box: coordinates of one atom in two columns


COMPRESSED: dict[str, Any] = {".gz": gzip.open, ".bz2": bz2.open, ".xz": lzma.open}  # ending -> how to open it


# what Python, numpy, h5py, gsd and the packers of text raise on damaged files, beside errors of the system
DAMAGE = (
    *(ValueError, LookupError, TypeError, AttributeError, ArithmeticError, MemoryError, RuntimeError, SystemError),
    *(EOFError, TokenError, zlib.error, lzma.LZMAError),
)


@contextmanager
def text_of(path: FilePath) -> Iterator[Iterator[str]]:
    """Lines of a text file, which may be compressed; errors in reading them are those of `damage_named`."""
    how = COMPRESSED.get(Path(path).suffix.lower(), open)
    with damage_named(path), how(path, "rt", encoding="utf-8-sig") as file:
        yield iter(file)


@contextmanager
def damage_named(path: FilePath) -> Iterator[None]:
    """Turn whatever a damaged file leads to into a `StorageError` that names the file."""
    try:
        yield
    except JamlabError as error:
        raise type(error)(f"{path}: {error}") from error
    except OSError as error:
        raise StorageError(f"cannot read {path}: {system_said(error, 'check the name and its permissions')}") from error
    except DAMAGE as error:
        said = " ".join(str(error).split())
        raise StorageError(f"{path} is damaged or cut off ({said}): copy it or write it again") from error


def numbers(words: Sequence[Sequence[str]], column: int) -> Array:
    """One column of rows of words as float64."""
    values = np.array([float(row[column]) for row in words])
    if not np.isfinite(values).all():
        raise ValueError(f"{words[int(np.flatnonzero(~np.isfinite(values))[0])][column]} is no finite number")
    return values


def equal_rows(rows: list[list[str]], count: int) -> list[list[str]]:
    """Rows of words, none of which has more or fewer than it should."""
    wrong = next((k for k, row in enumerate(rows) if len(row) != count), None)
    if wrong is not None:
        raise ValueError(f"row {wrong} has {len(rows[wrong])} columns, {count} expected")
    return rows


def given_numbers(words: Sequence[Sequence[str]], columns: Mapping[str, int], names: Iterable[str]) -> dict[str, Array]:
    """Some columns of rows of words by name, those that there are."""
    return {name: numbers(words, columns[name]) for name in names if name in columns}


def whole_numbers(words: Sequence[Sequence[str]], column: int) -> NDArray[np.int64]:
    """One column of rows of words as int64; errors as in `numbers`."""
    return np.array([int(row[column]) for row in words], dtype=np.int64)


def rounding(words: Sequence[str], values: Array, *, chosen: bool = False) -> float:
    """How far numbers may be off because they were written with few digits, seen from some words; 0 for the digits of
    float64. Sizes and boxes may be chosen by hand: 0.7 is meant, 0.583333 is rounded."""
    digits = max(len(word.lower().partition("e")[0].lstrip("+-0.").replace(".", "")) for word in words[:_SAMPLE])
    largest = float(np.abs(values).max())
    if digits >= FULL_DIGITS or not largest or (chosen and digits <= _CHOSEN_DIGITS):
        return 0.0
    return float(0.5 * 10.0 ** (np.floor(np.log10(largest)) + 1 - max(digits, 1)))


# sections and columns that are read, or that states at rest have no use for
_SECTIONS = {"Atoms", "Bonds", "Masses", "Velocities", "d_diameter", "d_a0"}
_ENTRIES = {*LAW_NAMES, *STATE, "model", "units", "rounding"}
_COLUMNS = {
    *("id", "mol", "type", "element", "mass", "q", "density", "a0", "vx", "vy", "vz", "fx", "fy", "fz"),
    *(f"{axis}{kind}" for axis in "xyz" for kind in ("", "u", "s", "su")),
    *("ix", "iy", "iz", *SIZE_NAMES, *_ENTRIES),
}
Sections = dict[str, tuple[str, list[list[str]]]]  # name -> comment behind it, rows of words

# columns before x y z, then three image counts or none
STYLES = {
    "atomic": ("id", "type"),
    "bond": ("id", "mol", "type"),
    "angle": ("id", "mol", "type"),
    "molecular": ("id", "mol", "type"),
    "charge": ("id", "type", "q"),
    "full": ("id", "mol", "type", "q"),
    "sphere": ("id", "type", "diameter", "density"),
}


def read_data(path: FilePath) -> Sites:
    """Read a data file: atoms unwrapped by their image counts, droplets where it has bonds."""
    with text_of(path) as file:
        lines = [line.rstrip("\n") for line in file]
        header, sections = _sections(lines)
        low, box = _box(header)
        if "Atoms" not in sections:
            raise ValueError("it has no section Atoms")
        style, rows = sections["Atoms"]
        if len(rows) != int(header["atoms"][0]) or not rows:
            raise ValueError(f"it announces {header['atoms'][0]} atoms and holds {len(rows)}")
        columns = _columns(style, len(equal_rows(rows, len(rows[0]))[0]))
        ids = whole_numbers(rows, 0)
        place = {int(k): m for m, k in enumerate(np.sort(ids))}
        if len(place) != len(rows):
            raise ValueError("two atoms have the same id")
        rows = [rows[k] for k in np.argsort(ids)]
        at = len(columns)
        positions = np.column_stack([numbers(rows, at), numbers(rows, at + 1)])
        imaged = len(rows[0]) >= at + 6
        error = rounding([word for row in rows for word in row[at : at + 2]], positions)
        if imaged:
            positions = positions + np.column_stack([numbers(rows, at + 3), numbers(rows, at + 4)]) @ box
        z = numbers(rows, at + 2)
        check_flat(z + numbers(rows, at + 5) * np.ptp(_ends(header, "z")) if imaged else z, box[0, 0])
        sizes = {"diameter": numbers(rows, columns.index("diameter"))} if "diameter" in columns else {}
        error += sum(0.5 * rounding([row[columns.index(k)] for row in rows], v, chosen=True) for k, v in sizes.items())
        if "d_diameter" in sections:
            own = sections["d_diameter"][1]
            sizes["diameters"] = _by_atom(own, place)
            error += 0.5 * rounding([row[1] for row in own], sizes["diameters"], chosen=True)
        ends = [word for name in ("xlo xhi", "ylo yhi", "xy xz yz") for word in header.get(name, ())]
        error += rounding(ends, box, chosen=True)
        bonds = [[place[int(word)] for word in row[2:4]] for row in sections.get("Bonds", ("", []))[1]]
        entries = described(lines)
        return Sites(
            box=box,
            positions=positions - low,
            types=np.array([row[columns.index("type")] for row in rows]),
            rings=rings_of_bonds(np.array(bonds), len(rows)) if bonds else None,
            wrapped=not imaged,
            radius=radius_of(sizes),
            a0=_by_atom(sections["d_a0"][1], place) if "d_a0" in sections else None,
            entries=entries,
            rounding=max(error, entries.get("rounding", 0.0)),
            unread=[*(sections.keys() - _SECTIONS), *(name for name in entries if not _is_entry(name))],
        )


def _sections(lines: list[str]) -> tuple[dict[str, list[str]], Sections]:
    """The header, words of each line by what follows its numbers, and the sections."""
    header: dict[str, list[str]] = {}
    sections: Sections = {}
    rows: list[list[str]] | None = None
    for line in lines[1:]:  # LAMMPS skips the first
        body, _, comment = line.partition("#")
        words = body.split()
        if not words:
            continue
        if not _is_number(words[0]):
            rows = []
            sections[" ".join(words)] = (comment.strip(), rows)
        elif rows is not None:
            rows.append(words)
        else:
            count = sum(map(_is_number, words))
            header[" ".join(words[count:])] = words[:count]
    if "atoms" not in header:
        raise InputError("not a LAMMPS data file: its header announces no atoms")
    return header, sections


def _is_number(word: str) -> bool:
    """Whether a word of a header is a number, "nan" and "inf" too; names of its lines are none."""
    try:
        float(word)
    except ValueError:
        return False
    return True


def _box(header: dict[str, list[str]]) -> tuple[Array, Array]:
    """Lower left corner (2,) and lattice vectors (2, 2)."""
    if "avec" in header:
        raise InputError("a general triclinic box: let LAMMPS write a restricted one, whose first edge lies along x")
    ends = np.array([_ends(header, axis) for axis in "xy"])
    xy, xz, yz = (float(word) for word in header.get("xy xz yz", ("0", "0", "0")))
    if xz or yz:
        raise InputError(f"the box leans out of the plane, xz = {xz:g}, yz = {yz:g}: packings are two-dimensional")
    if not np.isfinite([*ends.ravel(), xy]).all():
        raise ValueError("its box has edges that are not finite")
    (xlo, xhi), (ylo, yhi) = ends
    return np.array([xlo, ylo]), np.array([[xhi - xlo, 0.0], [xy, yhi - ylo]])


def _ends(header: dict[str, list[str]], axis: str) -> list[float]:
    return [float(word) for word in header[f"{axis}lo {axis}hi"]]


def _is_entry(name: str) -> bool:
    """Whether a packing has a place for an entry of the comment `# jamlab`."""
    return name in _ENTRIES or (name.startswith("d") and name[1:].isdigit())


def _columns(style: str, count: int) -> tuple[str, ...]:
    name = style.partition(" ")[0] or {5: "atomic", 8: "atomic", 6: "molecular", 9: "molecular"}.get(count, "none")
    if name not in STYLES or count not in (len(STYLES[name]) + 3, len(STYLES[name]) + 6):
        raise InputError(
            f"atoms of style {name!r} with {count} columns: write `Atoms # STYLE`, STYLE one of {', '.join(STYLES)}"
        )
    return STYLES[name]


def _by_atom(rows: Any, place: dict[int, int]) -> Array:
    values = np.full(len(place), np.nan)
    values[[place[int(row[0])] for row in rows]] = numbers(rows, 1)
    return values


_PREFIX = re.compile(r"^[vdci]_")  # of a variable, property, compute or integer property
# columns of coordinates in the order of preference: unwrapped before wrapped; whether scaled; whether wrapped
_COORDINATES = (
    ("xu", "yu", False, False),
    ("xsu", "ysu", True, False),
    ("x", "y", False, True),
    ("xs", "ys", True, True),
)


@dataclass(frozen=True)
class Frame:
    """One frame as text."""

    step: int  # time step
    bounds: tuple[str, list[str]]  # the words behind BOX BOUNDS, and three lines of numbers
    columns: list[str]  # names
    rows: list[str]  # one line for each atom
    items: dict[str, str]  # what else the frame says


def read_dump(path: FilePath) -> Iterator[Frame]:
    """Read the frames of a dump as text, see `sites`."""
    with text_of(path) as file:
        items: dict[str, Any] = {}
        for line in file:
            if not line.startswith("ITEM: "):
                if not line.strip():
                    continue
                raise ValueError(f"{line.strip()[:40]!r} stands where a frame should begin")
            item = line.removeprefix("ITEM: ").strip()
            if item.startswith("BOX BOUNDS"):
                items["BOX BOUNDS"] = (item.removeprefix("BOX BOUNDS").strip(), list(islice(file, 3)))
            elif item.startswith("ATOMS"):
                count = int(items.pop("NUMBER OF ATOMS"))
                rows = list(islice(file, count))
                if len(rows) < max(count, 1):
                    raise ValueError(f"a frame announces {count} atoms and holds {len(rows)}")
                step, bounds = int(items.pop("TIMESTEP")), items.pop("BOX BOUNDS")
                yield Frame(step, bounds, item.split()[1:], rows, items)
                items = {}
            else:
                items[item] = next(file, "").strip()
        if items:
            raise ValueError("the last frame has no atoms")


def sites(path: FilePath, frame: Frame) -> Sites:
    """Atoms of one frame: positions unwrapped, droplets where a molecule has three atoms or more. A dump has no bonds:
    vertices of a droplet are taken to follow each other by id, as those of jamlab's decks do."""
    with damage_named(path):
        columns = {_plain(name): k for k, name in reversed(list(enumerate(frame.columns)))}
        if "id" not in columns:
            raise InputError("a dump without the column id: atoms come in any order; add id to the dump")
        rows = equal_rows([row.split() for row in frame.rows], len(frame.columns))
        ids = whole_numbers(rows, columns["id"])
        if len(np.unique(ids)) != len(ids):
            raise ValueError("two atoms of a frame have the same id")
        rows = [rows[k] for k in np.argsort(ids)]
        low, box = _box_of_dump(*frame.bounds)
        positions, wrapped, error = _positions(rows, columns, low, box)
        error += rounding([word for line in frame.bounds[1][:2] for word in line.split()], box, chosen=True)
        check_flat(*_heights(rows, columns, box))
        entries = _entries(rows, columns)
        a0 = numbers(rows, columns["a0"]) if "a0" in columns else None
        rings = rings_of_molecules(whole_numbers(rows, columns["mol"])) if "mol" in columns else None
        sizes = given_numbers(rows, columns, SIZE_NAMES)
        radius = radius_of(sizes)
        for name, values in sizes.items():
            error += SIZE_NAMES[name] * rounding([row[columns[name]] for row in rows], values, chosen=True)
        if rings is not None and radius is not None:
            if np.ptp(radius):
                raise InputError(f"vertices have rims of {radius.min():g} to {radius.max():g}: all must have one")
            entries.setdefault("delta", 2 * float(radius[0]))
        kind = next((name for name in ("type", "element") if name in columns), None)
        return Sites(
            box=box,
            positions=positions,
            types=np.array(["1" if kind is None else row[columns[kind]] for row in rows]),
            rings=rings,
            wrapped=wrapped,
            radius=radius,
            a0=a0,
            entries=entries,
            rounding=max(error, entries.get("rounding", 0.0)),
            provenance={"step": frame.step},
            unread=[
                *(n for k, n in enumerate(frame.columns) if columns[_plain(n)] != k or _plain(n) not in _COLUMNS),
                *frame.items,
            ],
        )


def _plain(name: str) -> str:
    """Name of a column without that of a variable, property or compute; a compute knows no force law."""
    plain = _PREFIX.sub("", name)
    return name if name.startswith("c_") and plain in _ENTRIES else plain


def _box_of_dump(kind: str, lines: list[str]) -> tuple[Array, Array]:
    """Lower left corner (2,) and lattice vectors (2, 2) from the bounds of the parallelogram."""
    words = kind.split()
    if words[:1] == ["abc"]:
        raise InputError(
            "a general triclinic box: let LAMMPS write a restricted one (`dump_modify triclinic/general no`)"
        )
    sides = words[-3:-1]
    if sides and not all(side == "pp" for side in sides):
        raise InputError(f"boundaries {' '.join(words[-3:])}: packings are periodic in x and y")
    rows = [line.split() for line in lines]
    xy, xz, yz = (float(row[2]) for row in rows) if words[:3] == ["xy", "xz", "yz"] else (0.0, 0.0, 0.0)
    if xz or yz:
        raise InputError(f"the box leans out of the plane, xz = {xz:g}, yz = {yz:g}: packings are two-dimensional")
    xlo, xhi = float(rows[0][0]) - min(0.0, xy), float(rows[0][1]) - max(0.0, xy)
    ylo, yhi = float(rows[1][0]), float(rows[1][1])
    if not np.isfinite([xlo, xhi, ylo, yhi, xy]).all():
        raise ValueError("its box has edges that are not finite")
    return np.array([xlo, ylo]), np.array([[xhi - xlo, 0.0], [xy, yhi - ylo]])


def _positions(rows: list[list[str]], columns: dict[str, int], low: Array, box: Array) -> tuple[Array, bool, float]:
    """(n, 2) positions, whether they are wrapped, and their rounding; all columns of coordinates must agree."""
    known = [entry for entry in _COORDINATES if entry[0] in columns and entry[1] in columns]
    if not known:
        raise InputError("a dump without coordinates: it needs the columns x y, xu yu, xs ys or xsu ysu")
    read, error = _coordinates(rows, columns, known[0], low, box)
    for other in known[1:]:
        too, its_error = _coordinates(rows, columns, other, low, box)
        apart = too - read
        apart = np.abs(apart - shortest_images(apart, box) @ box).max(axis=1)
        if apart[k := int(apart.argmax())] > 2 * (error + its_error) + _SAME_PLACE * np.abs(box).sum():
            raise InputError(f"columns {known[0][0]} and {other[0]} put atom {rows[k][columns['id']]} in two places")
    wrapped = known[0][3]
    if wrapped and "ix" in columns and "iy" in columns:
        read = read + np.column_stack([numbers(rows, columns["ix"]), numbers(rows, columns["iy"])]) @ box
        wrapped = False
    return read, wrapped, error


def _coordinates(
    rows: list[list[str]], columns: dict[str, int], entry: tuple[str, str, bool, bool], low: Array, box: Array
) -> tuple[Array, float]:
    """(n, 2) places of one pair of columns, an entry of `_COORDINATES`, and their rounding."""
    x, y, scaled, _ = entry
    read = np.column_stack([numbers(rows, columns[x]), numbers(rows, columns[y])])
    error = rounding([row[columns[name]] for row in rows for name in (x, y)], read)
    if scaled:
        return read @ box, error * float(np.abs(box).sum(axis=0).max())
    return read - low, error


def _heights(rows: list[list[str]], columns: dict[str, int], box: Array) -> tuple[Array, float]:
    """Heights of atoms, and what to compare them with: the width of the box, or for fractions of its height 1."""
    scaled = next((name for name in ("zs", "zsu") if name in columns), None)
    name = next((name for name in ("z", "zu") if name in columns), scaled)
    heights = np.zeros(len(rows)) if name is None else numbers(rows, columns[name])
    return heights, 1.0 if name == scaled else float(box[0, 0])


def _one_value(what: str, rows: list[list[str]], column: int) -> float:
    words = list(dict.fromkeys(row[column] for row in rows))
    values = np.array([float(word) for word in words])
    if np.ptp(values):
        raise InputError(f"{what} is {words[0]} on one atom and {words[1]} on another: all must have one")
    return float(values[0])


def _entries(rows: list[list[str]], columns: dict[str, int]) -> dict[str, Any]:
    """Read the columns of `jamlab.write_dump` that are the same for all atoms."""
    shared = [name for name in (*LAW_NAMES, *STATE, "rounding") if name in columns]
    found: dict[str, Any] = {name: _one_value(name, rows, columns[name]) for name in shared}
    for name, names in (("contact", CONTACT_FORMS), ("ensemble", ENSEMBLES)):
        if name in found:
            found[name] = dict(enumerate(names))[int(found[name])]
    if "converged" in found:
        found["converged"] = bool(found["converged"])
    if found.get("onset") == 0:
        del found["onset"]
    if found.get("max_force", 0) < 0:
        del found["max_force"]
    return found
