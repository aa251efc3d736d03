"""Read packings from LAMMPS data files and text dumps, and how far their numbers are rounded."""

import re
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import islice
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.packing.lammps_files import STATE, described
from jamlab.packing.law_parameters import CONTACT_FORMS, ENSEMBLES
from jamlab.storage.verified_file import FilePath
from jamlab.trajectories.columns import Columns, rounding, text_of
from jamlab.trajectories.sites import LAW_NAMES, Sites, check_flat, rings_of_bonds, rings_of_molecules

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


def read_data(path: FilePath) -> Iterator[Sites]:
    """Read the one state of a data file: atoms unwrapped by their image counts, droplets where it has bonds."""
    with text_of(path) as file:
        lines = [line.rstrip("\n") for line in file]
        header, sections = _sections(lines)
        low, box = _box(header)
        if "Atoms" not in sections:
            raise ValueError("it has no section Atoms")
        style, rows = sections["Atoms"]
        if len(rows) != int(header["atoms"][0]) or not rows:
            raise ValueError(f"it announces {header['atoms'][0]} atoms and holds {len(rows)}")
        names = _columns(style, len(rows[0]))
        atoms = Columns.of_rows(rows, {name: k for k, name in enumerate(names)}, len(names)).by_id()
        place = {int(k): m for m, k in enumerate(atoms.whole("id"))}
        positions, heights, imaged = atoms.points("x", "y"), atoms.numbers("z"), "ix" in atoms
        if imaged:
            positions = positions + atoms.points("ix", "iy") @ box
            heights = heights + atoms.numbers("iz") * np.ptp(_ends(header, "z"))
        check_flat(heights, box[0, 0])
        by_atom = {name: _by_atom(sections[name][1], place) for name in ("d_diameter", "d_a0") if name in sections}
        sizes = {"diameter": atoms.words("diameter")} if "diameter" in atoms else {}
        sizes |= {"diameters": by_atom["d_diameter"]} if "d_diameter" in by_atom else {}
        radius, error = Columns(sizes).radius()
        ends = [word for name in ("xlo xhi", "ylo yhi", "xy xz yz") for word in header.get(name, ())]
        error += atoms.error("x", "y") + rounding(ends, box, chosen=True)
        bonds = [[place[int(word)] for word in row[2:4]] for row in sections.get("Bonds", ("", []))[1]]
        entries = described(lines)
        yield Sites(
            box=box,
            positions=positions - low,
            types=atoms.types(),
            rings=rings_of_bonds(np.array(bonds), len(rows)) if bonds else None,
            wrapped=not imaged,
            radius=radius,
            a0=Columns({"a0": by_atom["d_a0"]}).numbers("a0") if "d_a0" in by_atom else None,
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
    return _cell(_ends(header, "x"), _ends(header, "y"), header.get("xy xz yz", ("0", "0", "0")))


def _cell(x: Sequence[float], y: Sequence[float], tilts: Sequence[str]) -> tuple[Array, Array]:
    """Lower left corner (2,) and lattice vectors (2, 2), from the ends of either side and the tilts xy, xz and yz."""
    xy, xz, yz = map(float, tilts)
    if xz or yz:
        raise InputError(f"the box is tilted by xz = {xz:g}, yz = {yz:g}: packings are two-dimensional")
    if not np.isfinite([*x, *y, xy]).all():
        raise ValueError("its box has edges that are not finite")
    return np.array([x[0], y[0]]), np.array([[x[1] - x[0], 0.0], [xy, y[1] - y[0]]])


def _ends(header: dict[str, list[str]], axis: str) -> list[float]:
    return [float(word) for word in header[f"{axis}lo {axis}hi"]]


def _columns(style: str, count: int) -> tuple[str, ...]:
    """Names of the columns of a section Atoms."""
    name = style.partition(" ")[0] or {5: "atomic", 8: "atomic", 6: "molecular", 9: "molecular"}.get(count, "none")
    if name not in STYLES or count not in (len(STYLES[name]) + 3, len(STYLES[name]) + 6):
        raise InputError(
            f"atoms of style {name!r} with {count} columns: write `Atoms # STYLE`, STYLE one of {', '.join(STYLES)}"
        )
    return (*STYLES[name], "x", "y", "z", "ix", "iy", "iz")[:count]


def _by_atom(rows: list[list[str]], place: dict[int, int]) -> list[str]:
    """Words of a section in the order of the atoms."""
    words = ["nan"] * len(place)
    for row in rows:
        words[place[int(row[0])]] = row[1]
    return words


_PREFIX = re.compile(r"^[vdi]_")  # of a variable, property or integer property
# columns of coordinates in the order of preference: unwrapped before wrapped; whether scaled; whether wrapped
_COORDINATES = (
    ("xu", "yu", False, False),
    ("xsu", "ysu", True, False),
    ("x", "y", False, True),
    ("xs", "ys", True, True),
)


def read_dump(path: FilePath) -> Iterator[Callable[[], Sites]]:
    """Read the frames of a dump as text; the atoms of one are made by calling it."""
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
                yield partial(_sites, step, bounds, item.split()[1:], rows)
                items = {}
            else:
                items[item] = next(file, "").strip()
        if items:
            raise ValueError("the last frame has no atoms")


def _sites(step: int, bounds: tuple[str, list[str]], columns: list[str], rows: list[str]) -> Sites:
    """Atoms of one frame, from the words behind BOX BOUNDS with three lines of numbers, and a line for each atom:
    positions unwrapped, droplets where a molecule has three atoms or more. A dump has no bonds:
    vertices of a droplet are taken to follow each other by id, as those of jamlab's decks do."""
    places = {_PREFIX.sub("", name): k for k, name in reversed(list(enumerate(columns)))}
    if "id" not in places:
        raise InputError("a dump without the column id: atoms come in any order; add id to the dump")
    atoms = Columns.of_rows([row.split() for row in rows], places, len(columns)).by_id()
    low, box = _box_of_dump(*bounds)
    ends = [word for line in bounds[1][:2] for word in line.split()]
    positions, wrapped, error = _positions(atoms, low, box)
    check_flat(*_heights(atoms, box))
    entries, rings = _entries(atoms), rings_of_molecules(atoms.whole("mol")) if "mol" in atoms else None
    radius, of_sizes = atoms.radius()
    error += of_sizes + rounding(ends, box, chosen=True)
    if rings is not None and radius is not None:
        if np.ptp(radius):
            raise InputError(f"vertices have rim radii of {radius.min():g} to {radius.max():g}: all must have the same")
        entries.setdefault("delta", 2 * float(radius[0]))
    return Sites(
        box=box,
        positions=positions,
        types=atoms.types(),
        rings=rings,
        wrapped=wrapped,
        radius=radius,
        a0=atoms.numbers("a0") if "a0" in atoms else None,
        entries=entries,
        rounding=max(error, entries.get("rounding", 0.0)),
        provenance={"step": step},
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
    lean, (x, y) = float(tilts[0]), ([float(word) for word in row[:2]] for row in rows[:2])
    return _cell([x[0] - min(0.0, lean), x[1] - max(0.0, lean)], y, tilts)


def _positions(atoms: Columns, low: Array, box: Array) -> tuple[Array, bool, float]:
    """(n, 2) positions, whether they are wrapped, and their rounding."""
    known = next((entry for entry in _COORDINATES if entry[0] in atoms and entry[1] in atoms), None)
    if known is None:
        raise InputError("a dump without positions: give it columns x y, xu yu, xs ys or xsu ysu")
    x, y, scaled, wrapped = known
    read, error = atoms.points(x, y), atoms.error(x, y)
    if scaled:
        positions, error = read @ box, error * float(np.abs(box).sum(axis=0).max())
    else:
        positions = read - low
    if wrapped and "ix" in atoms and "iy" in atoms:
        return positions + atoms.points("ix", "iy") @ box, False, error
    return positions, wrapped, error


def _heights(atoms: Columns, box: Array) -> tuple[Array, float]:
    """Heights of atoms, and what to compare them with: the width of the box, or for fractions of its height 1."""
    name = next((name for name in ("z", "zu", "zs", "zsu") if name in atoms), None)
    heights = np.zeros(len(atoms)) if name is None else atoms.numbers(name)
    return heights, 1.0 if name in ("zs", "zsu") else float(box[0, 0])


def _entries(atoms: Columns) -> dict[str, Any]:
    """Read the columns of `jamlab.write` that are the same for all atoms."""
    found: dict[str, Any] = {}
    for name in (name for name in (*LAW_NAMES, *STATE, "rounding") if name in atoms):
        words = list(dict.fromkeys(atoms.words(name)))
        values = np.array(list(map(float, words)))
        if np.ptp(values):
            raise InputError(f"{name} is {words[0]} on one atom and {words[1]} on another: they must be equal")
        found[name] = float(values[0])
    for name, names in (("contact", CONTACT_FORMS), ("ensemble", ENSEMBLES)):
        if name in found:
            found[name] = dict(enumerate(names))[int(found[name])]
    if "converged" in found:
        found["converged"] = bool(found["converged"])
    if "fixed" in atoms:
        found |= {"fixed": atoms.numbers("fixed"), "walls": bool((atoms.numbers("fixed") > 1).any())}
    if found.get("onset") == 0:
        del found["onset"]
    if found.get("max_force", 0) < 0:
        del found["max_force"]
    return found
