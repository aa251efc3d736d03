"""Text files for LAMMPS and OVITO: a data file with one state, a dump with the frames of a sweep.

Both say the same: one atom per disk or vertex, with ids 1, 2, ... in the order of `Packing.positions`; the molecule id
is the particle plus one; the atom type is the rank of the particle's size, smallest first. Numbers have 17 significant
digits, so they read back as the same doubles.

In a LAMMPS deck, after the commands of `common.settings`:
    SP: atom_style atomic;     read_data FILE
    DP: atom_style molecular;  fix d_a0 all property/atom d_a0;  read_data FILE fix d_a0 NULL d_a0

In a triclinic box LAMMPS turns every position it reads into fractions of the box and back, which can change the last
digit: who needs all digits sets the positions again after read_data.
"""

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.packing.atomic_file import atomic_file
from jamlab.packing.packing import Packing

Array = NDArray[np.float64]

MAX_TYPES = 64  # pair coefficients go by pairs of types: LAMMPS is meant for few of them
_IMAGES = (-512, 511)  # LAMMPS packs an image flag into 10 bits


@dataclass(frozen=True, eq=False)
class TypeTable:
    """Atom types of a packing, as written to its files.

    Attributes:
        values: (ntypes,) float64, ascending. SP: diameter of each type. DP: rest area a0 of each type.
        types: (n,) int64, type of each particle, 1 to ntypes: particle m has size values[types[m] - 1].
    """

    values: Array
    types: NDArray[np.int64]

    @property
    def ntypes(self) -> int:
        """Number of atom types."""
        return len(self.values)


def types(packing: Packing) -> TypeTable:
    """Sort the particles of a packing by size into LAMMPS atom types.

    Raises:
        InputError: more than 64 different sizes.
    """
    name, sizes = ("diameters", packing.diameters) if packing.model == "sp" else ("a0", packing.params["a0"])
    values, rank = np.unique(np.asarray(sizes, dtype=np.float64), return_inverse=True)
    if len(values) > MAX_TYPES:
        raise InputError(
            f"packing has {len(values)} different {name}: a LAMMPS run takes at most {MAX_TYPES} atom types; "
            "round the sizes to fewer values"
        )
    return TypeTable(values, rank.reshape(-1).astype(np.int64) + 1)


@checked
def write_data(path: str | os.PathLike[str], packing: Packing) -> TypeTable:
    """Write a LAMMPS data file: triclinic box, atoms wrapped into it with image flags, DP: bonds and `d_a0`.

    Each vertex of a polygon has one bond, to its successor. Positions inside the box are written as they are; the
    others are shifted by the lattice vectors that their image flags count, so that LAMMPS unwraps polygons whole again.

    Args:
        path: file to create or replace, all at once.
        packing: what to write.

    Returns:
        The atom types written.

    Raises:
        InputError: more than 64 sizes, or a position more than 511 lattice vectors away from the box.
        StorageError: the file cannot be written.
    """
    table = types(packing)
    text = "\n".join(_data_lines(packing, table)) + "\n"
    with atomic_file(path) as temporary:
        temporary.write_text(text, encoding="ascii")
    return table


@checked
def write_dump(path: str | os.PathLike[str], packings: Iterable[Packing]) -> None:
    """Write packings as the frames of a LAMMPS text dump, for OVITO and MDAnalysis.

    Columns: id mol type xu yu zu, and for disks radius. Positions are not wrapped: polygons are whole. The time step is
    the number of the frame.

    Args:
        path: file to create or replace, all at once.
        packings: the frames; all with the same number of positions, which readers rely on.

    Raises:
        InputError: no packings, packings of different size or model, or more than 64 particle sizes.
        StorageError: the file cannot be written.
    """
    frames = list(packings)
    if not frames:
        raise InputError("no packings to write: a dump needs at least one")
    for k, packing in enumerate(frames):
        if packing.model != frames[0].model or len(packing.positions) != len(frames[0].positions):
            raise InputError(
                f"frame {k} is model {packing.model} with {len(packing.positions)} positions, "
                f"frame 0 is model {frames[0].model} with {len(frames[0].positions)}: write them to separate files"
            )
    tables = [types(packing) for packing in frames]
    with atomic_file(path) as temporary, temporary.open("w", encoding="ascii") as file:
        for step, (packing, table) in enumerate(zip(frames, tables, strict=True)):
            file.write("\n".join(_dump_lines(step, packing, table)) + "\n")


def _data_lines(packing: Packing, table: TypeTable) -> Iterator[str]:
    polygons = packing.model == "dp"
    count = len(packing.positions)
    lx, xy, ly = packing.box[0, 0], packing.box[1, 0], packing.box[1, 1]
    yield f"# jamlab {packing.model}, units {packing.units}"
    yield ""
    yield f"{count} atoms"
    if polygons:
        yield f"{count} bonds"
    yield f"{table.ntypes} atom types"
    if polygons:
        yield "1 bond types"
    yield f"\n0 {lx:.17g} xlo xhi\n0 {ly:.17g} ylo yhi\n-0.5 0.5 zlo zhi\n{xy:.17g} 0 0 xy xz yz"

    yield "\nMasses\n"
    size = "a0" if polygons else "diameter"
    yield from (f"{k} 1 # {size} {value:.17g}" for k, value in enumerate(table.values, start=1))

    particle = packing.particle
    wrapped, image = wrap(packing)
    rows = enumerate(zip(particle, table.types[particle], wrapped, image, strict=True), start=1)
    if polygons:
        yield "\nAtoms # molecular\n"
        yield from (f"{i} {m + 1} {t} {x:.17g} {y:.17g} 0 {ix} {iy} 0" for i, (m, t, (x, y), (ix, iy)) in rows)
        yield "\nBonds\n"
        yield from (f"{i} 1 {i} {j + 1}" for i, j in enumerate(packing.successor, start=1))
        yield "\nd_a0\n"
        yield from (f"{i} {value:.17g}" for i, value in enumerate(packing.params["a0"][particle], start=1))
    else:
        yield "\nAtoms # atomic\n"
        yield from (f"{i} {t} {x:.17g} {y:.17g} 0 {ix} {iy} 0" for i, (_, t, (x, y), (ix, iy)) in rows)


def _dump_lines(step: int, packing: Packing, table: TypeTable) -> Iterator[str]:
    lx, xy, ly = packing.box[0, 0], packing.box[1, 0], packing.box[1, 1]
    yield f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n{len(packing.positions)}"
    yield "ITEM: BOX BOUNDS xy xz yz pp pp pp"  # bounds of the parallelogram, not of its edges
    yield f"{min(0.0, xy):.17g} {lx + max(0.0, xy):.17g} {xy:.17g}\n0 {ly:.17g} 0\n-0.5 0.5 0"
    particle = packing.particle
    rows = enumerate(zip(particle, table.types[particle], packing.positions, strict=True), start=1)
    if packing.model == "dp":
        yield "ITEM: ATOMS id mol type xu yu zu"
        yield from (f"{i} {m + 1} {t} {x:.17g} {y:.17g} 0" for i, (m, t, (x, y)) in rows)
    else:
        yield "ITEM: ATOMS id mol type xu yu zu radius"
        radius = 0.5 * table.values
        yield from (f"{i} {m + 1} {t} {x:.17g} {y:.17g} 0 {radius[t - 1]:.17g}" for i, (m, t, (x, y)) in rows)


def wrap(packing: Packing) -> tuple[Array, NDArray[np.int64]]:
    """Positions inside the box and the (len(positions), 2) counts of lattice vectors taken off them.

    The counts are the floors of the fractional coordinates s, with x = s_x lx + s_y xy and y = s_y ly.
    """
    box = packing.box
    x, y = packing.positions.T
    iy = np.floor(y / box[1, 1])
    ix = np.floor((x - y * (box[1, 0] / box[1, 1])) / box[0, 0])
    image = np.column_stack([ix, iy])
    far = np.argwhere((image < _IMAGES[0]) | (image > _IMAGES[1]))
    if len(far):
        k = far[0, 0]
        raise InputError(
            f"positions[{k}] of particle {packing.particle[k]} lies {np.abs(image[k]).max():.0f} boxes away: LAMMPS "
            f"counts {_IMAGES[1]} at most; shift the particle back by whole lattice vectors"
        )
    # positions inside lose exactly zero: they keep their bits
    return packing.positions - image @ box, image.astype(np.int64)
