"""Read packings from LAMMPS data files and text dumps, and how far their numbers are rounded."""

import re
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import islice
from typing import Any

import numpy as np

from jamlab.arguments.choices import AtomStyle
from jamlab.arrays import Array
from jamlab.errors import InputError, typed
from jamlab.packing.facts import facts_of_columns, lost_names
from jamlab.packing.lammps_files import described
from jamlab.storage.verified_file import FilePath
from jamlab.trajectories.columns import (
    Columns,
    CutOffError,
    DamageError,
    check_last_row,
    number,
    rounding,
    text_of,
    whole_frames,
)
from jamlab.trajectories.sites import SIZE_NAMES, Sites, check_flat, rings_of_bonds, rings_of_molecules

Sections = dict[str, tuple[str, list[list[str]]]]  # name -> comment behind it, rows of words

# columns of a section Atoms, then three image counts or none
_XYZ = ("x", "y", "z")
STYLES = {
    "atomic": ("id", "type", *_XYZ),
    "bond": ("id", "mol", "type", *_XYZ),
    "angle": ("id", "mol", "type", *_XYZ),
    "molecular": ("id", "mol", "type", *_XYZ),
    "charge": ("id", "type", "q", *_XYZ),
    "full": ("id", "mol", "type", "q", *_XYZ),
    "sphere": ("id", "type", "diameter", "density", *_XYZ),
    "bpm/sphere": ("id", "mol", "type", "diameter", "density", *_XYZ),
    "dipole": ("id", "type", "q", *_XYZ, "mux", "muy", "muz"),
}


def _ask() -> str:
    return f"write `Atoms # STYLE`, or give {typed('atom_style=', '--atom-style')}, one of {', '.join(STYLES)}"


def read_data(path: FilePath, atom_style: AtomStyle | None = None) -> Iterator[Sites]:
    """Read the one state of a data file: atoms unwrapped by their image counts, droplets where it has bonds.
    `atom_style`: of its atoms, if the file does not say."""
    with text_of(path) as file:
        lines = list(file)
        ended = not lines or lines[-1].endswith("\n")
        lines = [line.rstrip("\n") for line in lines]
        header, sections = _sections(lines)
        low, box = _box(header)
        if "Atoms" not in sections:
            raise InputError("not a LAMMPS data file of atoms: it has no section Atoms")
        comment, rows = sections["Atoms"]
        for what, held in (("atoms", rows), ("bonds", sections.get("Bonds", ("", []))[1])):
            announced = header.get(what, [str(len(held))])[0]
            if len(held) != int(number(announced)) or (what == "atoms" and not held):
                raise CutOffError(f"it announces {announced} {what} and holds {len(held)}")
        entries = described(lines)
        last = next(reversed(sections.values()))[1]
        check_last_row(last or [[]], len(last[0]) if last else 0, ended, "rounding" in entries)
        names = _columns(comment, atom_style, rows, header, sections)
        places = {name: k for k, name in enumerate(names)}
        atoms = Columns.of_rows(rows, places, len(names), "rounding" in entries).by_id()
        place = {int(k): m for m, k in enumerate(atoms.whole("id"))}
        positions, heights, imaged = atoms.points("x", "y"), atoms.numbers("z"), "ix" in atoms
        if imaged:
            positions = positions + np.column_stack([atoms.whole("ix"), atoms.whole("iy")]) @ box
            heights = heights + atoms.whole("iz") * np.ptp(_ends(header, "z"))
        check_flat(heights, box[0, 0])
        by_atom = {name: _by_atom(sections[name][1], place) for name in ("d_diameter", "d_a0") if name in sections}
        sizes = {"diameter": atoms.words("diameter")} if "diameter" in atoms else {}
        sizes |= {"diameters": by_atom["d_diameter"]} if "d_diameter" in by_atom else {}
        radius, error = Columns(sizes, "rounding" in entries).radius()
        ends = [word for name in ("xlo xhi", "ylo yhi", "xy xz yz") for word in header.get(name, ())]
        error += atoms.error("x", "y") + rounding(ends, box, chosen=True, stated="rounding" in entries)
        bonds = [_bond(row, place) for row in sections.get("Bonds", ("", []))[1]]
        yield Sites(
            box=box,
            positions=positions - low,
            types=atoms.types(),
            rings=partial(rings_of_bonds, np.array(bonds), len(rows)) if bonds else None,
            wrapped=not imaged,
            radius=radius,
            a0=Columns({"a0": by_atom["d_a0"]}).numbers("a0") if "d_a0" in by_atom else None,
            entries=entries,
            rounding=error,
        )


def _bond(row: list[str], place: dict[int, int]) -> list[int]:
    """Places of the two atoms of a row of the section Bonds."""
    try:
        return [place[int(word)] for word in row[2:4]]
    except (KeyError, ValueError):
        raise InputError(f"the bond {' '.join(row)!r:.60} names an atom that is not there") from None


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
        number(word)
    except DamageError:
        return False
    return True


def _box(header: dict[str, list[str]]) -> tuple[Array, Array]:
    """Lower left corner (2,) and lattice vectors (2, 2)."""
    if "avec" in header:
        raise InputError("a general triclinic box: let LAMMPS write a restricted one, whose first edge lies along x")
    return _cell(_ends(header, "x"), _ends(header, "y"), header.get("xy xz yz", ("0", "0", "0")))


def _cell(x: Sequence[float], y: Sequence[float], tilts: Sequence[str]) -> tuple[Array, Array]:
    """Lower left corner (2,) and lattice vectors (2, 2), from the ends of either side and the tilts xy, xz and yz."""
    xy, xz, yz = map(number, tilts)
    if xz or yz:
        raise InputError(f"the box is tilted by xz = {xz:g}, yz = {yz:g}: packings are two-dimensional")
    if not np.isfinite([*x, *y, xy]).all():
        raise DamageError("its box has edges that are not finite")
    for name, (least, most) in (("x", x), ("y", y)):
        if most <= least:
            raise InputError(f"the box runs from {least:g} to {most:g} along {name}: give the lower bound first")
    return np.array([x[0], y[0]]), np.array([[x[1] - x[0], 0.0], [xy, y[1] - y[0]]])


def _ends(header: dict[str, list[str]], axis: str) -> list[float]:
    words = header.get(f"{axis}lo {axis}hi", [])
    if len(words) != 2:
        raise InputError(f"the header has no line `{axis}lo {axis}hi` with two numbers")
    return [number(word) for word in words]


def _columns(
    comment: str, given: str | None, rows: list[list[str]], header: dict[str, list[str]], sections: Sections
) -> tuple[str, ...]:
    """Names of the columns of a section Atoms, from the style behind it or given; without one, only where no other
    style has such rows."""
    name, count = comment.partition(" ")[0], len(rows[0])
    if given is not None:
        if name not in ("", given):
            raise InputError(f"atom_style = {given!r} was given, but the file has {name!r}")
        name = given
    if not name:
        fit = [style for style in ("atomic", "molecular", "charge") if _fits(STYLES[style], rows, header)]
        if "molecular" in fit and "Bonds" in sections:
            fit = ["molecular"]
        if len(fit) != 1:
            said = f", which may be of style {' or '.join(fit)}" if fit else ""
            raise InputError(f"the section Atoms has no style and {count} columns{said}: {_ask()}")
        name = fit[0]
    if name not in STYLES or count not in (len(STYLES[name]), len(STYLES[name]) + 3):
        raise InputError(f"atoms of style {name!r} with {count} columns: {_ask()}")
    return (*STYLES[name], "ix", "iy", "iz")[:count]


def _fits(columns: tuple[str, ...], rows: list[list[str]], header: dict[str, list[str]]) -> bool:
    """Whether rows may have these columns, without image counts: molecules are whole numbers, types 1 to their number
    or labels."""
    if len(columns) != len(rows[0]):
        return False
    most = int(number(header.get("atom types", ["1"])[0]))
    kinds = {name: {row[columns.index(name)] for row in rows} for name in ("mol", "type") if name in columns}
    if not all(word.isdecimal() for word in kinds.get("mol", ())):
        return False
    return all(1 <= int(word) <= most if word.isdecimal() else not _is_number(word) for word in kinds["type"])


def _by_atom(rows: list[list[str]], place: dict[int, int]) -> list[str]:
    """Words of a section in the order of the atoms."""
    words = ["nan"] * len(place)
    for row in rows:
        if len(row) < 2 or not row[0].isdecimal() or int(row[0]) not in place:
            raise InputError(f"the row {' '.join(row)!r:.60} names no atom of the file")
        words[place[int(row[0])]] = row[1]
    return words


def read_dump(path: FilePath) -> Iterator[Callable[[], Sites]]:
    """Read the frames of a dump as text; the atoms of one are made by calling it."""
    with text_of(path) as file:
        yield from whole_frames(path, _frames(file))


def _frames(file: Iterator[str]) -> Iterator[Callable[[], Sites]]:
    items: dict[str, Any] = {}
    for line in file:
        if not line.startswith("ITEM: "):
            if not line.strip() or line.startswith("#"):
                continue
            raise (CutOffError if not line.endswith("\n") else ValueError)(
                f"{line.strip()!r:.40} stands where a frame should begin with ITEM:"
            )
        item = line.removeprefix("ITEM: ").strip()
        if item.startswith("BOX BOUNDS"):
            items["BOX BOUNDS"] = (item.removeprefix("BOX BOUNDS").strip(), list(islice(file, 3)))
        elif item.startswith("ATOMS"):
            if missing := {"NUMBER OF ATOMS", "TIMESTEP", "BOX BOUNDS"} - items.keys():
                raise InputError(f"a frame has no line ITEM: {min(missing)}")
            yield partial(_sites, items["TIMESTEP"], items["BOX BOUNDS"], *_rows(item, items["NUMBER OF ATOMS"], file))
            items = {}
        elif item.startswith(("ENTRIES", "NUMBER OF ENTRIES", "GRID", "NUMBER OF GRID")):
            raise InputError(f"a dump of {item.split()[-1].lower()}, not of atoms: give the dump of the atoms")
        else:
            items[item] = next(file, "").strip()
    if items:
        raise CutOffError("the last frame has no atoms")


def _rows(item: str, announced: str, file: Iterator[str]) -> tuple[list[str], list[str]]:
    """Names of the columns and lines of the atoms of a frame, all of them."""
    if not announced.isdecimal() or not int(announced):
        raise InputError(f"a frame announces {announced!r:.40} atoms: a whole number, 1 or more, expected")
    names, rows = item.split()[1:], list(islice(file, int(announced)))
    if len(rows) < int(announced):
        raise CutOffError(f"it announces {announced} atoms and holds {len(rows)}")
    own = "rounding" in names
    check_last_row([row.split() for row in rows[-100:]], len(names), rows[-1].endswith("\n"), own)
    return names, rows


def _places(columns: list[str]) -> dict[str, int]:
    """Places of columns by name. Sizes and rest areas may be variables or properties, as v_radius, unless a column has
    such a name itself."""
    places = {name: k for k, name in reversed(list(enumerate(columns)))}
    for own in (SIZE_NAMES.keys(), {"a0"}):
        if not own & places.keys():
            # of a variable or property
            plain = {re.sub(r"^[vd]_", "", name): k for name, k in reversed(places.items())}
            places |= {name: plain[name] for name in plain.keys() & own}
    return places


def _sites(step: str, bounds: tuple[str, list[str]], columns: list[str], rows: list[str]) -> Sites:
    """Atoms of one frame, from the words behind BOX BOUNDS with three lines of numbers, and a line for each atom:
    positions unwrapped, droplets where a molecule has three atoms or more. A dump has no bonds:
    vertices of a droplet are taken to follow each other by id, as those of jamlab's decks do."""
    places = _places(columns)
    if "id" not in places:
        raise InputError("a dump without the column id: atoms come in any order; add id to the dump")
    if {"particle", "rattler"} <= places.keys():
        raise InputError("the points of a contact network, which are no packing: read the file of the packing itself")
    own = "rounding" in places
    atoms = Columns.of_rows([row.split() for row in rows], places, len(columns), own).by_id()
    low, box = _box_of_dump(*bounds)
    ends = [word for line in bounds[1][:2] for word in line.split()]
    positions, wrapped, error = _positions(atoms, low, box)
    check_flat(*_heights(atoms, box))
    entries, rings = _entries(atoms), rings_of_molecules(atoms.whole("mol")) if "mol" in atoms else None
    radius, of_sizes = atoms.radius()
    droplets = "a0" in atoms or "delta" in entries
    if rings is not None and radius is not None and np.ptp(radius) and not droplets:
        rings = None  # rims of droplets are equal: these are disks, whatever molecules they belong to
    sites = None
    if own and "mol" in atoms and not droplets:
        sites = int(np.unique(atoms.whole("mol"), return_counts=True)[1].max())
    return Sites(
        box=box,
        positions=positions,
        types=atoms.types(),
        rings=rings,
        sites=sites,
        guessed=True,
        wrapped=wrapped,
        radius=radius,
        a0=atoms.numbers("a0") if "a0" in atoms else None,
        fixed=atoms.numbers("fixed") > 0 if "fixed" in atoms else None,
        entries=entries,
        rounding=error + of_sizes + rounding(ends, box, chosen=True, stated=own),
        provenance={"step": int(number(step)), **({"lost": list(lost_names("dump"))} if own else {})},
    )


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
    tilts = [row[2] for row in rows] if words[:3] == ["xy", "xz", "yz"] else ["0", "0", "0"]
    if any(len(row) < 2 for row in rows[:2]):
        raise InputError(f"{' '.join(map(str.strip, lines))!r:.60} stands where bounds of the box should")
    lean, (x, y) = number(tilts[0]), ([number(word) for word in row[:2]] for row in rows[:2])
    return _cell([x[0] - min(0.0, lean), x[1] - max(0.0, lean)], y, tilts)


def _positions(atoms: Columns, low: Array, box: Array) -> tuple[Array, bool, float]:
    """(n, 2) positions, whether they are wrapped, and their rounding."""
    # columns of coordinates in the order of preference: unwrapped before wrapped; whether scaled; whether wrapped
    coordinates = (
        ("xu", "yu", False, False),
        ("xsu", "ysu", True, False),
        ("x", "y", False, True),
        ("xs", "ys", True, True),
    )
    known = next((entry for entry in coordinates if entry[0] in atoms and entry[1] in atoms), None)
    if known is None:
        raise InputError("a dump without positions: give it columns x y, xu yu, xs ys or xsu ysu")
    x, y, scaled, wrapped = known
    read, error = atoms.points(x, y), atoms.error(x, y)
    if scaled:
        positions, error = read @ box, error * float(np.abs(box).sum(axis=0).max())
    else:
        positions = read - low
    if wrapped and "ix" in atoms and "iy" in atoms:
        return positions + np.column_stack([atoms.whole("ix"), atoms.whole("iy")]) @ box, False, error
    return positions, wrapped, error


def _heights(atoms: Columns, box: Array) -> tuple[Array, float]:
    """Heights of atoms, and what to compare them with: the width of the box, or for fractions of its height 1."""
    name = next((name for name in ("z", "zu", "zs", "zsu") if name in atoms), None)
    heights = np.zeros(len(atoms)) if name is None else atoms.numbers(name)
    return heights, 1.0 if name in ("zs", "zsu") else float(box[0, 0])


def _entries(atoms: Columns) -> dict[str, Any]:
    """Read the columns of `jamlab.write` that are the same for all atoms."""
    found = facts_of_columns(atoms.names(), atoms.common)
    if "fixed" in atoms:
        found["walls"] = bool((atoms.numbers("fixed") > 1).any())
    return found
