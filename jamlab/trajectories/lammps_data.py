"""Read LAMMPS data files: of jamlab, of its decks, of `write_data` and of other programs."""

from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.packing.lammps_files import described
from jamlab.storage.verified_file import FilePath
from jamlab.trajectories.lammps_text import numbers, rounding, text_of, whole_numbers
from jamlab.trajectories.rings import rings_of_bonds
from jamlab.trajectories.sites import Sites

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
        columns = _columns(style, len(rows[0]))
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
        radius = 0.5 * numbers(rows, columns.index("diameter")) if "diameter" in columns else None
        if radius is not None:
            error += rounding([row[columns.index("diameter")] for row in rows], radius, chosen=True)
        elif "d_diameter" in sections:
            radius = 0.5 * _by_atom(sections["d_diameter"][1], place)
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
            radius=radius,
            a0=_rest_areas(sections, place),
            entries=entries,
            rounding=max(error, entries.get("rounding", 0.0)),
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
    ends = np.array([[float(word) for word in header[f"{axis}lo {axis}hi"]] for axis in "xy"])
    xy, xz, yz = (float(word) for word in header.get("xy xz yz", ("0", "0", "0")))
    if xz or yz:
        raise InputError(f"the box leans out of the plane, xz = {xz:g}, yz = {yz:g}: packings are two-dimensional")
    if not np.isfinite([*ends.ravel(), xy]).all():
        raise ValueError("its box has edges that are not finite")
    (xlo, xhi), (ylo, yhi) = ends
    return np.array([xlo, ylo]), np.array([[xhi - xlo, 0.0], [xy, yhi - ylo]])


def _columns(style: str, count: int) -> tuple[str, ...]:
    """Columns before x; without the name of a style those of atomic or molecular."""
    name = style.partition(" ")[0] or {5: "atomic", 8: "atomic", 6: "molecular", 9: "molecular"}.get(count, "none")
    if name not in STYLES or count not in (len(STYLES[name]) + 3, len(STYLES[name]) + 6):
        raise InputError(
            f"atoms of style {name!r} with {count} columns: write `Atoms # STYLE`, STYLE one of {', '.join(STYLES)}"
        )
    return STYLES[name]


def _rest_areas(sections: Sections, place: dict[int, int]) -> Array | None:
    if "d_a0" not in sections:
        return None
    return _by_atom(sections["d_a0"][1], place)


def _by_atom(rows: Any, place: dict[int, int]) -> Array:
    values = np.full(len(place), np.nan)
    values[[place[int(row[0])] for row in rows]] = numbers(rows, 1)
    return values
