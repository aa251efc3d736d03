"""Read text dumps of LAMMPS: of jamlab, of its decks and of other runs."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.packing.lammps_files import STATE
from jamlab.packing.law_parameters import CONTACT_FORMS, ENSEMBLES, FORCE_LAW, OPTIONAL
from jamlab.storage.verified_file import FilePath
from jamlab.trajectories.lammps_text import damage_named, numbers, rounding, text_of, whole_numbers
from jamlab.trajectories.rings import rings_of_molecules
from jamlab.trajectories.sites import Sites

_PREFIX = re.compile(r"^[vdci]_")  # of a variable, property, compute or integer property
_LAW = {name for names in (*FORCE_LAW.values(), *OPTIONAL.values()) for name in names} - {"a0"}
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
                count = int(items["NUMBER OF ATOMS"])
                rows = list(islice(file, count))
                if len(rows) < max(count, 1):
                    raise ValueError(f"a frame announces {count} atoms and holds {len(rows)}")
                yield Frame(int(items["TIMESTEP"]), items["BOX BOUNDS"], item.split()[1:], rows)
                items = {}
            else:
                items[item] = next(file, "").strip()
        if items:
            raise ValueError("the last frame has no atoms")


def sites(path: FilePath, frame: Frame) -> Sites:
    """Atoms of one frame: positions unwrapped, droplets where a molecule has three atoms or more. A dump has no bonds:
    vertices of a droplet are taken to follow each other by id, as those of jamlab's decks do."""
    with damage_named(path):
        columns = {_PREFIX.sub("", name): k for k, name in reversed(list(enumerate(frame.columns)))}
        if "id" not in columns:
            raise InputError("a dump without the column id: atoms come in any order; add id to the dump")
        rows = [row.split() for row in frame.rows]
        ids = whole_numbers(rows, columns["id"])
        if len(np.unique(ids)) != len(ids):
            raise ValueError("two atoms of a frame have the same id")
        rows = [rows[k] for k in np.argsort(ids)]
        low, box = _box(*frame.bounds)
        positions, wrapped, error = _positions(rows, columns, low, box)
        error += rounding([word for line in frame.bounds[1][:2] for word in line.split()], box, chosen=True)
        entries = _entries(rows[0], columns)
        a0 = numbers(rows, columns["a0"]) if "a0" in columns else None
        rings = rings_of_molecules(whole_numbers(rows, columns["mol"])) if "mol" in columns else None
        radius = numbers(rows, columns["radius"]) if "radius" in columns else None
        if radius is not None:
            error += rounding([row[columns["radius"]] for row in rows], radius, chosen=True)
        if rings is not None and radius is not None:
            entries.setdefault("delta", 2 * float(radius[0]))
        return Sites(
            box=box,
            positions=positions,
            types=np.array([row[columns["type"]] if "type" in columns else "1" for row in rows]),
            rings=rings,
            wrapped=wrapped,
            radius=radius,
            a0=a0,
            entries=entries,
            rounding=max(error, entries.get("rounding", 0.0)),
            provenance={"step": frame.step},
        )


def _box(kind: str, lines: list[str]) -> tuple[Array, Array]:
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
    known = [entry for entry in _COORDINATES if entry[0] in columns and entry[1] in columns]
    if not known:
        raise InputError("a dump without coordinates: it needs the columns x y, xu yu, xs ys or xsu ysu")
    x, y, scaled, wrapped = known[0]
    read = np.column_stack([numbers(rows, columns[x]), numbers(rows, columns[y])])
    error = rounding([row[columns[name]] for row in rows for name in (x, y)], read)
    if scaled:
        read, error = read @ box, error * float(np.abs(box).sum(axis=0).max())
    else:
        read = read - low
    if wrapped and "ix" in columns and "iy" in columns:
        read = read + np.column_stack([numbers(rows, columns["ix"]), numbers(rows, columns["iy"])]) @ box
        wrapped = False
    return read, wrapped, error


def _entries(row: list[str], columns: dict[str, int]) -> dict[str, Any]:
    """Read the columns of `jamlab.write_dump` that are the same for all atoms."""
    found: dict[str, Any] = {name: float(row[columns[name]]) for name in {*_LAW, *STATE, "rounding"} & columns.keys()}
    for name, names in (("contact", CONTACT_FORMS), ("ensemble", ENSEMBLES)):
        if name in found:
            found[name] = dict(enumerate(names))[int(found[name])]
    if "converged" in found:
        found["converged"] = bool(found["converged"])
    if found.get("onset") == 0:
        del found["onset"]
    if found.get("max_force", 0) < 0:
        del found["max_force"]
    if "k" in found:
        found["units"] = "k"
    elif "eps" in found:
        found["units"] = "eps"
    return found
