"""Read packings from any file that jamlab knows: its own HDF5, LAMMPS data and dumps, GSD, files of other groups."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from jamlab.checks import checked
from jamlab.errors import InputError, StorageError
from jamlab.packing import hdf5
from jamlab.packing.packing import Packing
from jamlab.storage.file_endings import FORMATS, begins_as
from jamlab.storage.verified_file import FilePath, is_hdf5
from jamlab.trajectories.columns import COMPRESSED
from jamlab.trajectories.disk_files import (
    is_leiden,
    kind_of_hdf5,
    read_csv,
    read_h5md,
    read_leiden,
    read_netcdf,
    read_npy,
    read_xyz,
)
from jamlab.trajectories.lammps_data import read_data, read_dump, sites
from jamlab.trajectories.sites import Radii

DATA, DUMP = FORMATS["data"].endings, FORMATS["dump"].endings
GSD = (".gsd",)
XYZ = (".xyz", ".extxyz")
CSV = (".csv", ".tsv")
NPY = (".npy",)
_OF_ENDING = {
    ending: kind
    for kind, endings in (("data", DATA), ("dump", DUMP), ("gsd", GSD), ("xyz", XYZ), ("csv", CSV), ("npy", NPY))
    for ending in endings
}
_TEXT = ("data", "dump", "xyz", "csv")  # kinds that may be compressed
_FOREIGN = {
    **{"leiden": read_leiden, "netcdf": read_netcdf, "xyz": read_xyz},
    **{"csv": read_csv, "npy": read_npy},
}


@checked
def read(
    path: FilePath,
    frame: int = -1,
    *,
    radii: Radii = None,
    units: str | None = None,
    params: Mapping[str, Any] | None = None,
    box: ArrayLike | None = None,
) -> Packing:
    """Read one frame, by default the last; negative numbers count from the end.

    HDF5 files of jamlab hold everything; so do data files (`.data`) and dumps (`.dump`) that jamlab wrote. Packings of
    other groups are read as they publish them: text of the Leiden group, netCDF of Goodrich and Liu, extended xyz,
    H5MD. Tables hold disks without a box: text (`.csv`) of named columns x, y and radius or diameter, and arrays
    (`.npy`) with rows of x, y, radius. Text may be compressed (`.gz`, `.bz2`, `.xz`).

    For files of other programs give what they lack: parameters found nowhere have the defaults of the decks, and
    their names stand in `provenance["assumed"]`; names in the file that jamlab does not understand stand in
    `provenance["unread"]`. Coordinates with fewer digits than float64 (GSD, dumps with `%g`)
    leave `converged` False and `Packing.rounding` above 0: moduli and G* are refused, see `jamlab.relaxed`.

    Args:
        path: file; `.data`, `.dump`, `.gsd`, `.xyz`, `.csv`, `.npy` by their names, others by what they hold.
        frame: number of the frame.
        radii: of disks: one number, (n,), or by type, {"1": 0.5, "2": 0.7}.
        units: "eps" or "k", see `Packing`.
        params: of the force law, any of them, see `Packing`.
        box: two sides, or (2, 2) lattice vectors, of files without a periodic box.

    Raises:
        StorageError: no such file or frame, or not a whole file that this jamlab can read.
        InputError: the frame is no packing, or differs from what was given; the message names file, frame and value.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> p.write("packing.h5")
        >>> q = jamlab.read("packing.h5")
        >>> np.array_equal(q.positions, p.positions), q.converged
        (True, True)
    """
    if isinstance(frame, bool) or not isinstance(frame, int | np.integer):
        raise InputError(f"frame is {frame!r}: must be a whole number")
    if _kind(path) == "hdf5":
        own = hdf5.read(path, frame)
        _refuse_law(path, radii, units, params, box)
        return own
    frames = _frames(path, (radii, units, params, box), frame)
    found = next(frames, None)
    if found is None:
        raise StorageError(f"{path} has no frame {frame}")
    return found


@checked
def read_all(
    path: FilePath,
    *,
    radii: Radii = None,
    units: str | None = None,
    params: Mapping[str, Any] | None = None,
    box: ArrayLike | None = None,
) -> list[Packing]:
    """Read every frame, in the order written. Arguments and errors as in `read`.

    Example:
        >>> onset = jamlab.jam(n=16, seed=1)
        >>> jamlab.write("sweep.h5", jamlab.compress(onset, to=0.88, step=0.02))
        >>> phi = [p.phi for p in jamlab.read_all("sweep.h5")]
        >>> phi == sorted(phi)
        True
    """
    if _kind(path) == "hdf5":
        own = hdf5.read_all(path)
        _refuse_law(path, radii, units, params, box)
        return own
    frames = list(_frames(path, (radii, units, params, box), None))
    if not frames:
        raise StorageError(f"{path} holds no frame: copy it or write it again")
    return frames


def _kind(path: FilePath) -> str:
    file = Path(path)
    if file.is_dir():
        raise StorageError(f"{path} is a folder: give one of its files")
    if not file.exists() and any(mark in file.name for mark in "*?["):
        raise StorageError(f"there is no file {path}: give one name; `glob.glob` lists those that fit a pattern")
    if is_hdf5(path):
        return kind_of_hdf5(path)
    compressed = file.suffix.lower() in COMPRESSED
    ending = (file.with_suffix("") if compressed else file).suffix.lower()
    kind = _OF_ENDING.get(ending, begins_as(path))
    if kind and (kind in _TEXT or not compressed):
        return kind
    if is_leiden(path):
        return "leiden"
    if (compressed or ending not in ("", *FORMATS["packings"].endings)) and file.is_file():
        raise StorageError(
            f"{path} is of no kind that is read: give HDF5 of jamlab, a LAMMPS data file ({', '.join(DATA)}) or dump "
            f"({', '.join(DUMP)}), {', '.join((*XYZ, *CSV))}, each also with {', '.join(COMPRESSED)}, "
            f"{', '.join((*GSD, *NPY))}, or packings of other groups; pictures go to `analyze`"
        )
    return "hdf5"  # its reader refuses other files with a reason


def _refuse_law(path: FilePath, *given: object) -> None:
    if any(value is not None for value in given):
        raise InputError(f"{path} holds box, sizes, units and force law: leave out radii, units, params and box")


_Given = tuple[Radii, str | None, Mapping[str, Any] | None, ArrayLike | None]  # radii, units, params, box


def _frames(path: FilePath, given: _Given, frame: int | None) -> Iterator[Packing]:
    kind = _kind(path)
    source = Path(path).name
    if kind == "gsd":
        from jamlab.trajectories.from_universe import read_gsd

        yield from read_gsd(path, *given[:3], frame)
        return
    if kind == "data":
        found: Iterable[Any] = [] if frame not in (None, 0, -1) else [(0, read_data(path))]
    elif kind == "h5md":
        found = read_h5md(path, frame)
    elif kind in _FOREIGN:
        found = _chosen(_FOREIGN[kind](path), frame)
    else:
        found = ((k, sites(path, text)) for k, text in _chosen(read_dump(path), frame))
    for k, atoms in found:
        try:
            packing = atoms.packing(*given)
        except InputError as error:
            raise type(error)(f"{path}, frame {k}: {error}") from error
        yield packing.with_state(provenance={"source": source})


def _chosen(frames: Iterator[Any], frame: int | None) -> Iterator[tuple[int, Any]]:
    if frame is None:
        yield from enumerate(frames)
    elif frame >= 0:
        yield from ((frame, text) for text in islice(frames, frame, frame + 1))
    else:
        last = deque(enumerate(frames), maxlen=-frame)
        if len(last) == -frame:
            yield last[0]
