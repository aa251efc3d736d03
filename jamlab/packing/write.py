"""Write packings to a file of the format that its ending promises: HDF5, LAMMPS data, LAMMPS dump, extended xyz."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from jamlab.arrays import ArrayLike
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.packing.hdf5 import write_sweep
from jamlab.packing.lammps_files import write_data, write_dump
from jamlab.packing.packing import Packing
from jamlab.storage.atomic_file import FORMATS, atomic_file, begins_as, check_ending
from jamlab.storage.verified_file import FilePath

_KINDS = ("packings", "data", "dump", "xyz")


@checked
def write(
    path: FilePath, packings: Packing | Iterable[Packing], observables: Mapping[str, ArrayLike] | None = None
) -> None:
    """Write one packing or the frames of a sweep; the ending of the name decides the format.

    Args:
        path: file to create or replace. `.h5` (or no ending): HDF5 with everything; `.data`: LAMMPS data file of one
            packing; `.dump`: LAMMPS text dump; `.xyz`: extended xyz.
        packings: one packing, or several of one sweep, which share model, units, particles and law.
        observables: arrays by name, (frames,) or (frames, ...); HDF5 only.

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
    check_ending(path, *_KINDS)
    frames = [packings] if isinstance(packings, Packing) else list(packings)
    ending = Path(path).suffix.lower()
    kind = next((kind for kind in _KINDS if ending in FORMATS[kind]), begins_as(path) or "packings")
    if kind == "packings":
        write_sweep(path, frames, observables)
        return
    if observables:
        raise InputError(f"observables {', '.join(observables)}: a {ending} file holds none, write HDF5, such as x.h5")
    if kind == "dump":
        write_dump(path, frames)
    elif kind == "xyz":
        _write_xyz(path, frames)
    elif len(frames) == 1:
        write_data(path, frames[0])
    else:
        raise InputError(f"{len(frames)} packings: a LAMMPS data file holds one, write a .dump or .h5 file")


def _write_xyz(path: FilePath, frames: Sequence[Packing]) -> None:
    """Positions and radii of disks, or of the vertices of droplets with the radius of their rims."""
    if not frames:
        raise InputError("no packings to write")
    if any(packing.fixed is not None for packing in frames):
        raise InputError("fixed particles: extended xyz has no place for them; write .h5, .data or .dump")
    lines: list[str] = []
    for packing in frames:
        box = np.zeros((3, 3))
        box[:2, :2], box[2, 2] = packing.box, 1.0
        lattice = " ".join(f"{value:.17g}" for value in box.ravel())
        law = " ".join(f"{name}={value:.17g}" for name, value in packing.params.items() if isinstance(value, float))
        columns = f'Lattice="{lattice}" Properties=species:S:1:pos:R:3:radius:R:1:id:I:1 pbc="T T F"'
        lines += [str(len(packing.positions)), f"{columns} units={packing.units} {law}"]
        radius = packing.kind.dump_columns(packing)["radius"][packing.particle]
        rows = zip(packing.positions, radius, packing.particle + 1, strict=True)
        lines += [f"A {x:.17g} {y:.17g} 0 {r:.17g} {m}" for (x, y), r, m in rows]
    with atomic_file(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="ascii")
