"""Packings of disks as other groups publish them: Leiden text, netCDF of Goodrich and Liu, extended xyz.

Leiden (github.com/vanheckelab/jambashbulk) writes one block a state: `N = , L = , L1= { , } , L2= { , } , P = , P0= ,`
and rows `x , y , R ,` in braces, of disks with energy (k/2)(R_i + R_j - r)^2, k = 1, in boxes sheared until stable.
Goodrich and Liu, as jax-md ships them (2d_*.nc, netCDF 4, which is HDF5), have one row a packing: `pos` in units of the
box, `rad` and `box`, energy (eps/2)(1 - r/s)^2, eps = 1. Extended xyz (freud, OVITO, ASE) has `Lattice` and
`Properties`.
"""

import re
from collections.abc import Iterator
from itertools import islice
from typing import Any

import h5py
import numpy as np

from jamlab.arrays import Array
from jamlab.errors import InputError, StorageError
from jamlab.storage.verified_file import FilePath, read_hdf5
from jamlab.trajectories.lammps_data import DAMAGE, damage_named, equal_rows, numbers, rounding, text_of
from jamlab.trajectories.sites import LAW_NAMES, SIZE_NAMES, Sites, check_flat, plane_box, radius_of, rounding_of

_HEAD = re.compile(
    r"N\s*=\s*(?P<n>\d+)\s*,\s*L\s*=.*?L1\s*=\s*\{(?P<first>[^}]*)\}\s*,\s*L2\s*=\s*\{(?P<second>[^}]*)\}"
    r"(?:\s*,\s*P\s*=\s*(?P<pressure>[^,]+))?"
)
_KEYS = re.compile(r'([^\s="]+)=(?:"([^"]*)"|(\S+))')  # of the second line of an extended xyz frame
# keys and columns of an extended xyz frame that are read, or that states at rest have no use for
_XYZ_KEYS = {"Lattice", "Properties", "pbc", "units", "Origin"}
_XYZ_COLUMNS = {"species", "type", "pos", *SIZE_NAMES, "id", "velo", "vel", "velocities", "force", "forces", "mass"}
_NETCDF = {"pos": 2, "rad": 1, "box": 4}  # names -> numbers a particle, or of the box
MOST_BYTES = 2**31  # of numbers in one netCDF file: 10^7 disks


def is_leiden(path: FilePath) -> bool:
    """Whether a text file begins like a packing of the Leiden group."""
    try:
        with text_of(path) as file:
            lines = (line for line in islice(file, 50) if line.strip() and not line.startswith("#"))
            return _HEAD.match(next(lines, "")) is not None
    except StorageError:
        return False


def read_leiden(path: FilePath) -> Iterator[Sites]:
    """Read the states of a text file of the Leiden group, in units of `k` and of its own length."""
    with text_of(path) as file:
        lines = (line.strip() for line in file)
        block = 0
        for line in lines:
            if not line or line.startswith("#"):
                continue
            head = _HEAD.match(line)
            if head is None:
                raise ValueError(f"block {block}: {line[:40]!r} stands where N, L1 and L2 should")
            box = np.array([_floats(head[name], 2, f"block {block}: lattice vector") for name in ("first", "second")])
            if next(lines, "") != "{":
                raise ValueError(f"block {block}: no brace opens the list of disks")
            yield _leiden_block(lines, head, box, block)
            block += 1


def _leiden_block(lines: Iterator[str], head: re.Match[str], box: Array, block: int) -> Sites:
    n, pressure, rows = int(head["n"]), head["pressure"], []
    for line in lines:
        if line == "}":
            break
        rows.append(line.rstrip(", \t").split(","))
    else:
        raise ValueError(f"block {block}: the list of disks has no end after {len(rows)} of {n}")
    if len(rows) != n or any(len(row) != 3 for row in rows):
        raise ValueError(f"block {block}: {len(rows)} rows of x, y, R, {n} expected")
    positions, radius = np.column_stack([numbers(rows, 0), numbers(rows, 1)]), numbers(rows, 2)
    error = rounding([word.strip() for row in rows for word in row[:2]], positions)
    error += rounding([row[2].strip() for row in rows], radius, chosen=True)
    error += rounding([word.strip() for k in ("first", "second") for word in head[k].split(",")], box, chosen=True)
    given = {} if pressure is None else {"pressure in the file": float(pressure)}
    return Sites(
        box=box,
        positions=positions,
        types=np.full(n, "1"),
        radius=radius,
        entries={"units": "k", "k": 1.0, "ensemble": "shear-stabilized"},
        rounding=error,
        provenance=given,
        unread=re.findall(r"(\w+)\s*=", head.string[head.end() :]),
    )


def is_netcdf(path: FilePath) -> bool:
    """Whether an HDF5 file is a netCDF 4 file."""
    try:
        with read_hdf5(path) as file:
            return "_NCProperties" in file.attrs and "jamlab" not in str(file.attrs.get("schema", ""))
    except (OSError, *DAMAGE):  # which its reader names
        return False


def read_netcdf(path: FilePath) -> Iterator[Sites]:
    """Read the packings of a netCDF file as Goodrich and Liu wrote them, in units of `eps`."""
    with damage_named(path), read_hdf5(path) as file:
        if missing := [name for name in _NETCDF if name not in file]:
            raise InputError(
                f"a netCDF file of another kind than that of Goodrich and Liu: it has {', '.join(file) or 'nothing'}, "
                f"but not {', '.join(missing)}"
            )
        arrays = {name: _dataset(file, name) for name in _NETCDF}
        unread = [name for name in file if name not in _NETCDF and "_Netcdf4Dimid" not in file[name].attrs]
        error = sum(rounding_of(file[name].dtype, values) for name, values in arrays.items())
        count, n = arrays["rad"].shape
        for name, each in _NETCDF.items():
            expected = (count, each if name == "box" else n * each)
            if arrays[name].shape != expected:
                raise ValueError(f"{name} is {arrays[name].shape}, {expected} expected: only packings of disks in 2D")
        for pos, rad, cell in zip(arrays["pos"], arrays["rad"], arrays["box"], strict=True):
            box = cell.reshape(2, 2).T  # the file has lattice vectors as columns
            law = {"units": "eps", "eps": 1.0}
            yield Sites(
                box,
                pos.reshape(-1, 2) @ box,
                np.full(n, "1"),
                radius=rad,
                entries=law,
                rounding=error * max(1.0, float(np.abs(box).sum(axis=0).max())),
                unread=unread,
            )


def _dataset(file: h5py.File, name: str) -> Array:
    found = file.get(name, getlink=True)
    if not isinstance(found, h5py.HardLink) or not isinstance(file[name], h5py.Dataset):
        raise ValueError(f"it has no array {name}")
    data = file[name]
    if data.ndim != 2 or data.dtype.kind != "f" or data.size * data.dtype.itemsize > MOST_BYTES:
        raise ValueError(f"{name} is {data.dtype} of shape {data.shape}: rows of float64 expected, 2 GB at most")
    values = np.asarray(data[()], dtype=np.float64)
    if not np.isfinite(values).all():
        raise ValueError(f"{name}, row {int(np.flatnonzero(~np.isfinite(values).all(axis=1))[0])}, is not finite")
    return values


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
    box = plane_box("Lattice", _floats(",".join(lattice), 9, "Lattice").reshape(3, 3)) if lattice else None
    sides = keys.get("pbc", "T T F").split()
    if any(side.upper()[:1] not in ("T", "1") for side in sides[:2]):
        raise InputError(f"pbc={' '.join(sides)!r}: packings are periodic in x and y")
    columns = _columns(keys.get("Properties", "species:S:1:pos:R:3"))
    if "pos" not in columns:
        raise InputError(f"the xyz frame has no column pos, only {', '.join(columns)}")
    equal_rows(rows, sum(width for _, width in columns.values()))
    at, width = columns["pos"]
    if width not in (2, 3):
        raise InputError(f"pos has {width} columns: 2 or 3 expected")
    positions = np.column_stack([numbers(rows, at), numbers(rows, at + 1)])
    if width == 3:
        check_flat(numbers(rows, at + 2), float(np.ptp(positions) if box is None else box[0, 0]))
    error = rounding([word for row in rows for word in row[at : at + 2]], positions)
    sizes = {name: numbers(rows, columns[name][0]) for name in SIZE_NAMES if name in columns}
    for name, values in sizes.items():
        error += SIZE_NAMES[name] * rounding([row[columns[name][0]] for row in rows], values, chosen=True)
    if box is not None:
        error += rounding(lattice, box, chosen=True)
    kinds = next((columns[name][0] for name in ("species", "type") if name in columns), None)
    entries: dict[str, Any] = {name: keys[name] for name in ("units",) if name in keys}
    entries |= {name: float(keys[name]) for name in LAW_NAMES if name in keys}
    return Sites(
        box,
        positions,
        np.array(["1"] * len(rows) if kinds is None else [row[kinds] for row in rows]),
        radius=radius_of(sizes),
        entries=entries,
        deck=False,
        rounding=error,
        unread=[*rest, *(keys.keys() - _XYZ_KEYS - LAW_NAMES), *(columns.keys() - _XYZ_COLUMNS)],
    )


def _columns(properties: str) -> dict[str, tuple[int, int]]:
    """First column and number of columns by name, in lower case."""
    fields = properties.split(":")
    if len(fields) % 3:
        raise ValueError(f"Properties={properties!r:.60}: name, kind and number of columns expected for each")
    columns: dict[str, tuple[int, int]] = {}
    at = 0
    for name, count in zip(fields[::3], fields[2::3], strict=True):
        if name.lower() in columns:
            raise InputError(f"two properties are named {name}")
        columns[name.lower()], at = (at, int(count)), at + int(count)
    return columns


def _floats(text: str, count: int, what: str) -> Array:
    values = np.array([float(word) for word in text.split(",") if word.strip()])
    if len(values) != count or not np.isfinite(values).all():
        raise ValueError(f"{what} {text.strip()!r:.60}: {count} numbers expected")
    return values
