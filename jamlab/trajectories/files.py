"""Read packings from any file that jamlab knows: its own HDF5, LAMMPS data and dumps, GSD, extended xyz, tables."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any

from jamlab.arguments.choices import AtomStyle, Law, ModelName, Units
from jamlab.arrays import ArrayLike
from jamlab.checks import checked
from jamlab.errors import InputError, StorageError, named
from jamlab.packing.hdf5 import read_all_hdf5, read_hdf5
from jamlab.packing.packing import Packing
from jamlab.storage.formats import FORMATS, begins_as
from jamlab.storage.verified_file import FilePath, is_hdf5
from jamlab.trajectories import disk_files, lammps_data
from jamlab.trajectories.columns import COMPRESSED, damage_named
from jamlab.trajectories.foreign_kinds import refuse_foreign
from jamlab.trajectories.sites import Radii

_READERS: dict[str, Callable[..., Iterator[Any]]] = {  # kinds of files: each frame, or what makes it
    **{"data": lammps_data.read_data, "dump": lammps_data.read_dump},
    **{"xyz": disk_files.read_xyz, "csv": disk_files.read_csv, "gsd": disk_files.read_gsd},
}
_KIND_OF = {
    ending: kind
    for kind, endings in {
        **{kind: FORMATS[kind] for kind in ("data", "dump", "xyz")},
        **{"csv": (".csv", ".tsv"), "gsd": (".gsd",)},
    }.items()
    for ending in endings
}


@checked
def read(
    path: FilePath,
    frame: int = -1,
    *,
    radii: Radii = None,
    units: Units | None = None,
    law: Law | None = None,
    box: ArrayLike | None = None,
    model: ModelName | None = None,
    atom_style: AtomStyle | None = None,
) -> Packing:
    """Read one frame of a file, by default the last; negative numbers count from the end.

    Formats: HDF5 of jamlab, LAMMPS data files (`.data`) and dumps (`.dump`), extended xyz, GSD, and tables of disks
    (`.csv` with columns x, y and radius or diameter; give `box`). Text may be compressed (`.gz`, `.bz2`, `.xz`).

    Pass sizes, units or parameters if a file of another program lacks them. Missing parameters have the defaults of the
    decks and are listed in `provenance["assumed"]`. Unknown columns are ignored. Particles are in the order of the
    column `id`, in tables also `particle`. Coordinates with fewer digits than float64 (GSD, dumps with `%g`) set
    `Packing.rounding`; moduli and G* are then refused, see `jamlab.relax`. If a dump, xyz file or table
    ends within a frame, for example because a job was killed, the complete frames are read, with a warning.

    Args:
        path: file; the format follows from the ending, or from the content.
        frame: number of the frame.
        radii: radii of disks: one number, (n,), or by type, {"1": 0.5, "2": 0.7}.
        units: "eps" or "k", see `Packing`.
        law: force law, by its name as in `jamlab.pack`, or some or all of its parameters, see `Packing`; "a0", the rest
            areas of droplets, may be one number.
        box: two sides, or (2, 2) lattice vectors, for files without a periodic box.
        model: name of the model, if the file does not state it. Default: atoms with molecules or bonds are vertices of
            droplets, other atoms are disks.
        atom_style: for a LAMMPS data file that does not name it, such as "sphere".

    Raises:
        StorageError: no such file or frame, or an incomplete or unknown file.
        InputError: the frame is not a valid packing, or contradicts the arguments.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> jamlab.write("packing.h5", p)
        >>> q = jamlab.read("packing.h5")
        >>> np.array_equal(q.positions, p.positions), q.converged
        (True, True)
    """
    return _read(path, frame, (radii, units, law, box, model), atom_style)[0]


@checked
def read_all(
    path: FilePath,
    *,
    radii: Radii = None,
    units: Units | None = None,
    law: Law | None = None,
    box: ArrayLike | None = None,
    model: ModelName | None = None,
    atom_style: AtomStyle | None = None,
) -> list[Packing]:
    """Read every frame, in the order written. Arguments and errors as in `read`.

    Example:
        >>> onset = jamlab.jam(n=16, seed=1)
        >>> jamlab.write("sweep.h5", jamlab.compress(onset, to=0.88, step=0.02))
        >>> phi = [p.phi for p in jamlab.read_all("sweep.h5")]
        >>> phi == sorted(phi)
        True
    """
    return _read(path, None, (radii, units, law, box, model), atom_style)


# radii, units, law, box, model
_Given = tuple[Radii, Units | None, Law | None, ArrayLike | None, ModelName | None]


def _read(path: FilePath, frame: int | None, given: _Given, atom_style: AtomStyle | None) -> list[Packing]:
    """One frame of a file, or all."""
    kind = _kind(path)
    if atom_style is not None and kind != "data":
        raise InputError(
            f"{named('atom_style', atom_style)}: "
            f"{path} is no LAMMPS data file, whose atoms alone have a style; leave it out"
        )
    if kind == "hdf5":
        own = read_all_hdf5(path) if frame is None else [read_hdf5(path, frame)]
        if any(value is not None for value in given):
            raise InputError(
                f"{path} contains box, sizes, units and force law: leave out radii, units, law, box and model"
            )
        return own
    packings = []
    for k, atoms in _chosen(_READERS[kind](path, *([atom_style] if kind == "data" else [])), frame):
        with damage_named(f"{path}, frame {k}"):
            packings.append((atoms() if callable(atoms) else atoms).packing(*given))
    if not packings:
        raise StorageError(
            f"{path} has no frame{'' if frame is None else f' {frame}'}: use another frame, or write the file again"
        )
    # a packing whose file keeps its provenance says where it came from first
    return [p.with_state(provenance={"source": Path(path).name, **p.provenance}) for p in packings]


def _kind(path: FilePath) -> str:
    file = Path(path)
    if file.is_dir():
        raise StorageError(f"{path} is a folder: give one of its files")
    if not file.exists() and any(mark in file.name for mark in "*?["):
        raise StorageError(f"there is no file {path}: give one name; `glob.glob` lists those that fit a pattern")
    if is_hdf5(path):
        return "hdf5"
    compressed = file.suffix.lower() in COMPRESSED
    refuse_foreign(path, compressed)
    ending = (file.with_suffix("") if compressed else file).suffix.lower()
    kind = _KIND_OF.get(ending, begins_as(path))
    if kind and not (compressed and kind == "gsd"):
        return kind
    if (compressed or ending not in ("", *FORMATS["packings"])) and file.is_file():
        raise StorageError(
            f"{path} is of an unknown file type: give HDF5 of jamlab, {', '.join(_KIND_OF)}, compressed text "
            f"({', '.join(COMPRESSED)}) or, to `jamlab analyze`, a picture"
        )
    return "hdf5"  # its reader refuses other files with a reason


def _chosen(frames: Iterator[Any], frame: int | None) -> Iterator[tuple[int, Any]]:
    if frame is None:
        yield from enumerate(frames)
    elif frame >= 0:
        yield from ((frame, atoms) for atoms in islice(frames, frame, frame + 1))
    else:
        last = deque(enumerate(frames), maxlen=-frame)
        if len(last) == -frame:
            yield last[0]
