"""Write packings to a file of the format that its ending promises: HDF5, LAMMPS data, LAMMPS dump, extended xyz."""

from __future__ import annotations

import reprlib
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from jamlab.arrays import ArrayLike
from jamlab.checks import checked
from jamlab.errors import InputError, JamlabError
from jamlab.packing.facts import facts_of, lost, words
from jamlab.packing.hdf5 import check_names, write_sweep
from jamlab.packing.lammps_files import site_columns, write_data, write_dump
from jamlab.packing.packing import Packing
from jamlab.storage.atomic_file import atomic_file, check_target
from jamlab.storage.formats import FORMATS, begins_as, check_ending
from jamlab.storage.verified_file import FilePath

_KINDS = ("packings", "data", "dump", "xyz")


@checked
def write(
    path: FilePath, packings: Packing | Iterable[Packing], observables: Mapping[str, ArrayLike] | None = None
) -> tuple[str, ...] | None:
    """Write one packing or the frames of a sweep; the ending of the name decides the format.

    If making the packings ends in an error, such as a sweep that does not converge, the packings before the error are
    written and the error is raised. If the file exists, it is not changed, and they are written to `NAME.part.h5`.

    Args:
        path: file to create or replace. `.h5` (or no ending): HDF5 with everything; `.data`: LAMMPS data file of one
            packing; `.dump`: LAMMPS text dump; `.xyz`: extended xyz.
        packings: one packing, or several of one sweep, which share model, units, particles and law.
        observables: arrays by name, (frames,) or (frames, ...); HDF5 only.

    Returns:
        None if the file holds everything, otherwise names of what it does not hold, such as the provenance in a dump.

    Raises:
        InputError: no packings, packings of different sweeps, or values or an ending that are not supported.
        StorageError: the file cannot be written.

    Example:
        >>> onset = jamlab.jam(n=16, seed=1)
        >>> jamlab.write("onset.data", onset)
        >>> jamlab.write("sweep.h5", [onset, *jamlab.compress(onset, to=0.88, step=0.02)])
        >>> jamlab.read("onset.data").n, len(jamlab.read_all("sweep.h5")) > 1
        (16, True)
    """
    kind, ending = format_of(path), Path(path).suffix.lower()
    if observables and kind != "packings":
        raise InputError(f"observables {', '.join(observables)}: a {ending} file holds none, write HDF5, such as x.h5")
    check_names(observables or {})
    check_target(path)  # before the work of making the packings
    if isinstance(packings, Packing):
        packings = [packings]
    frames: list[Packing] = []
    try:
        for packing in packings:
            if not isinstance(packing, Packing):
                raise InputError(f"{reprlib.repr(packing)} is no packing: give packings, as `compress` makes them")
            frames.append(packing)
    except BaseException as error:  # an interrupt too
        with suppress(JamlabError):
            if frames:
                kept = Path(path) if not Path(path).exists() else Path(path).with_suffix(f".part{Path(path).suffix}")
                _write(kind, kept, frames, None)
                error.add_note(f"{kept} holds the {len(frames)} packings before")
        raise
    return _write(kind, path, frames, observables)


def format_of(path: FilePath) -> str:
    """The format that a name promises, of `FORMATS`; another than those of packings is refused."""
    check_ending(path, *_KINDS)
    ending = Path(path).suffix.lower()
    return next((kind for kind in _KINDS if ending in FORMATS[kind]), begins_as(path) or "packings")


def _write(
    kind: str, path: FilePath, frames: list[Packing], observables: Mapping[str, ArrayLike] | None
) -> tuple[str, ...] | None:
    if kind == "packings":
        write_sweep(path, frames, observables)
        return None
    if kind == "dump":
        write_dump(path, frames)
    elif kind == "xyz":
        _write_xyz(path, frames)
    elif len(frames) == 1:
        write_data(path, frames[0])
    else:
        raise InputError(f"{len(frames)} packings: a LAMMPS data file holds one, write a .dump or .h5 file")
    return lost(kind, frames) or None


def _write_xyz(path: FilePath, frames: Sequence[Packing]) -> None:
    """Positions and radii of disks, or of the vertices of droplets with the radius of their rims; the second line of a
    frame holds all facts of the packing, see `jamlab.packing.facts`."""
    if not frames:
        raise InputError("no packings to write")
    lines: list[str] = []
    for packing in frames:
        box = np.zeros((3, 3))
        box[:2, :2], box[2, 2] = packing.box, 1.0
        lattice = " ".join(f"{value:.17g}" for value in box.ravel())
        own = site_columns(packing)
        for name in ("type", *(["mol"] if packing.offsets is None else [])):  # sizes tell types; disks are no molecules
            del own[name]
        shapes = {"i": "I:1", "f": "R:1"}  # of a column, by kind of numpy
        names = ":".join(f"{name}:{shapes[column.dtype.kind]}" for name, column in own.items())
        lines += [str(len(packing.positions))]
        lines += [f'Lattice="{lattice}" Properties=species:S:1:pos:R:3:{names} pbc="T T F" {words(facts_of(packing))}']
        rows = zip(packing.positions.tolist(), *(column.tolist() for column in own.values()), strict=True)
        lines += [f"A {x:.17g} {y:.17g} 0 {' '.join(f'{value:.17g}' for value in more)}" for (x, y), *more in rows]
    with atomic_file(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="ascii")
