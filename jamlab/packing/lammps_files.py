"""Text files for LAMMPS and OVITO: a data file with one state, a dump with the frames of a sweep.

Both say the same: one atom per disk or vertex, with ids 1, 2, ... in the order of `Packing.positions`; the molecule id
is the particle plus one; the atom type is the rank of the particle's size, smallest first. Numbers have 17 significant
digits, so they read back as the same doubles.

LAMMPS has no place for the force law, so a data file has a comment line for it and for all other facts of the packing,
see `jamlab.packing.facts`, which LAMMPS skips wherever it stands:
    # jamlab model=dp units=eps gamma=0.4 ka=300 eps=1 delta=0.25 eta=0 contact=outline ensemble=fixed-box converged=1
    # jamlab model=sp units=k k=1 d1=0.83333333333333337 d2=1.1666666666666665
`fixed` has a bit for each particle, eight in two hexadecimal digits, and `walls=1` says that these are walls.
`d1` .. are the diameters of the atom types. Beyond 64 sizes types are classes of size, and the section `d_diameter`
holds the diameter of each disk. A deck appends such a line to a file of `write_data` by `print ... append`.

In a LAMMPS deck, after `units lj`, `dimension 2` and `atom_modify map array`:
    SP: atom_style atomic;     read_data FILE
        beyond 64 sizes: fix d all property/atom d_diameter ghost yes;  read_data FILE fix d NULL d_diameter
    DP: atom_style molecular;  fix d_a0 all property/atom d_a0;  read_data FILE fix d_a0 NULL d_a0

In a triclinic box LAMMPS turns every position it reads into fractions of the box and back, which can change the last
digit: who needs all digits sets the positions again after read_data.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.packing.facts import columns_of, facts_of, facts_of_words, words
from jamlab.packing.packing import Packing
from jamlab.storage.atomic_file import atomic_file
from jamlab.storage.formats import check_ending

# Of particles of one size each. Type pairs take time when LAMMPS is started, of 4096 disks 0.3 s with 64 sizes, 0.9 s
# with 128 and 4.9 s with 256; with classes 0.15 s.
MAX_TYPES, MOST_TYPES = 64, 256
CLASSES = 8  # of size: reach of neighbor lists goes by type pairs; at 1:20 one class takes 1.5 times as long
MARK = "# jamlab "
_IMAGES = (-512, 511)  # LAMMPS packs an image flag into 10 bits


@dataclass(frozen=True, eq=False)
class TypeTable:
    """Atom types of a packing, as written to its files."""

    values: Array  # (ntypes,) float64, ascending. SP: diameter of each type. DP: rest area a0 of each type.
    types: NDArray[np.int64]  # (n,) int64, type of each particle, 1 to ntypes: particle m has size values[types[m] - 1]
    # whether types are classes of more than 64 sizes; `values` are then the largest of each class
    classes: bool = False

    @property
    def ntypes(self) -> int:
        """Number of atom types."""
        return len(self.values)


def types(packing: Packing) -> TypeTable:
    """Sort the particles of a packing by size into LAMMPS atom types, up to 64 sizes one type a size, or up to 256
    where the pair style of the law takes sizes from types alone."""
    values, rank = np.unique(packing.kind.type_sizes(packing), return_inverse=True)
    own = packing.kind.sizes_by_atom or (packing.kind.sizes_by_disk and packing.law.sizes_by_disk)
    if len(values) <= (MAX_TYPES if own else MOST_TYPES):
        return TypeTable(values, rank.reshape(-1).astype(np.int64) + 1)
    # of equal ratio: a class of wide ratio has long neighbor lists, an empty one is left out
    least = values[values > 0][0]
    place = np.log(np.maximum(values, least) / least) / np.log(values[-1] / least)
    inside = np.where(values > 0, np.minimum((CLASSES * place).astype(np.int64), CLASSES - 1), -1)  # flat walls: apart
    _, of_value = np.unique(inside, return_inverse=True)
    last = np.append(np.flatnonzero(np.diff(of_value)), len(values) - 1)
    return TypeTable(values[last], of_value.reshape(-1)[rank.reshape(-1)].astype(np.int64) + 1, True)


def write_data(path: str | os.PathLike[str], packing: Packing, *, described: bool = True) -> TypeTable:
    """Write a LAMMPS data file: triclinic box, atoms wrapped into it with image flags, DP: bonds and `d_a0`.

    Each vertex of a polygon has one bond, to its successor. Positions inside the box are written as they are; the
    others are shifted by the lattice vectors that their image flags count, so that LAMMPS unwraps polygons whole again.
    Returns the atom types written. Errors as in `jamlab.write`, and an InputError for a position more than 511 lattice
    vectors away from the box. `described`: False leaves out what LAMMPS does not read."""
    check_ending(path, "data")
    table = types(packing)
    first = title_of(packing) if described else MARK.strip()
    text = "\n".join([first, *_data_lines(packing, table)]) + "\n"
    with atomic_file(path) as temporary:
        temporary.write_text(text, encoding="ascii")
    return table


def write_dump(path: str | os.PathLike[str], packings: Iterable[Packing]) -> None:
    """Write packings as the frames of a LAMMPS text dump, for OVITO and MDAnalysis.

    Columns: id mol type xu yu zu radius, where the radius of a vertex is its rim radius, and a0 of droplets; then what
    is the same for all atoms of a frame, see `jamlab.packing.facts`: the parameters of the force law, ensemble, and all
    that is known of the minimum. A packing with fixed particles has the column fixed: 0 free, 1 fixed, 2 of a wall.
    Positions are not wrapped: polygons are whole. The time step is the number of the frame. All frames have the same
    number of positions, which readers rely on. Errors as in `jamlab.write`."""
    check_ending(path, "dump")
    frames = list(packings)
    if not frames:
        raise InputError("no packings to write: a dump needs at least one")
    for k, packing in enumerate(frames):
        if (packing.model, len(packing.positions)) != (frames[0].model, len(frames[0].positions)):
            raise InputError(
                f"frame {k} is model {packing.model} with {len(packing.positions)} positions, "
                f"frame 0 is model {frames[0].model} with {len(frames[0].positions)}: write them to separate files"
            )
    with atomic_file(path) as temporary, temporary.open("w", encoding="ascii") as file:
        for step, packing in enumerate(frames):
            file.write(dump_frame(packing.box, "ATOMS", len(packing.positions), _dump_columns(packing), step))


def title_of(packing: Packing) -> str:
    """Describe a packing in a comment line: all its facts, and the diameters of the types. Numbers have 17 significant
    digits; rest areas of droplets are left to the section `d_a0`."""
    facts = facts_of(packing)
    if not section_of_sizes(packing, types(packing)):
        facts |= {f"d{k}": value for k, value in enumerate(types(packing).values, start=1)}
    if not packing.frame.all_free:
        facts["fixed"] = np.packbits(packing.frame.fixed).tobytes().hex()
    return MARK + words(facts)


def section_of_sizes(packing: Packing, table: TypeTable) -> str:
    """Section of a data file that holds the size of each site; empty where types tell the sizes."""
    kind = packing.kind
    return f"d_{kind.size_column}" if kind.sizes_by_atom or table.classes else ""


def described(lines: Iterable[str]) -> dict[str, Any]:
    """Read the `# jamlab` comment among the lines of a data file, the last one if there are several: facts by name;
    empty without such a line."""
    found = [line for line in lines if line.startswith(MARK)]
    entries = dict(word.partition("=")[::2] for word in found[-1].removeprefix(MARK).split()) if found else {}
    try:
        return facts_of_words(entries)
    except ValueError as error:
        raise InputError(f"the comment `{MARK.strip()}` is not understood: {error}") from error


def _data_lines(packing: Packing, table: TypeTable) -> Iterator[str]:
    bonded, count = packing.kind.atom_style == "molecular", len(packing.positions)
    bonds = packing.kind.bonds(packing)
    lx, xy, ly = packing.box[0, 0], packing.box[1, 0], packing.box[1, 1]
    yield ""
    yield f"{count} atoms"
    if bonded:
        yield f"{len(bonds)} bonds"
    yield f"{table.ntypes} atom types"
    if bonded:
        yield f"{table.ntypes if packing.kind.bonds_by_size else 1} bond types"
    yield f"\n0 {lx:.17g} xlo xhi\n0 {ly:.17g} ylo yhi\n-0.5 0.5 zlo zhi\n{xy:.17g} 0 0 xy xz yz"

    yield "\nMasses\n"
    yield from (f"{k} 1 # {packing.kind.size_column} {value:.17g}" for k, value in enumerate(table.values, start=1))

    particle = packing.particle
    wrapped, image = wrap(packing)
    rows = enumerate(zip(table.types[particle], wrapped, image, strict=True), start=1)
    yield f"\nAtoms # {packing.kind.atom_style}\n"
    molecule = [f" {m + 1}" if bonded else "" for m in particle]
    yield from (f"{i}{molecule[i - 1]} {t} {x:.17g} {y:.17g} 0 {ix} {iy} 0" for i, (t, (x, y), (ix, iy)) in rows)
    if bonded:
        yield "\nBonds\n"
        of_bonds = table.types[particle[bonds[:, 0]]] if packing.kind.bonds_by_size else np.ones(len(bonds), np.int64)
        rows_of_bonds = enumerate(zip(of_bonds, bonds + 1, strict=True), start=1)
        yield from (f"{k} {kind} {i} {j}" for k, (kind, (i, j)) in rows_of_bonds)
    if section := section_of_sizes(packing, table):
        yield f"\n{section}\n"
        sizes = packing.kind.type_sizes(packing)[particle]
        yield from (f"{i} {value:.17g}" for i, value in enumerate(sizes, start=1))


def dump_frame(box: Array, items: str, count: int, columns: Mapping[str, NDArray[Any]], step: int = 0) -> str:
    """One frame of a text dump. `items`: ATOMS, or ENTRIES of a local dump; `columns`: (count,) each."""
    (lx, _), (xy, ly) = box
    lines = [f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF {items}\n{count}\nITEM: BOX BOUNDS xy xz yz pp pp pp"]
    # bounds of the parallelogram, not of its edges
    lines += [f"{min(0.0, xy):.17g} {lx + max(0.0, xy):.17g} {xy:.17g}\n0 {ly:.17g} 0\n-0.5 0.5 0"]
    lines += [f"ITEM: {items} {' '.join(columns)}"]
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    lines += [" ".join(f"{value:.17g}" for value in row) for row in rows]
    return "\n".join(lines) + "\n"


def site_columns(packing: Packing) -> dict[str, NDArray[Any]]:
    """What each site has of its own, beside its position."""
    particle = packing.particle
    columns: dict[str, NDArray[Any]] = {"id": np.arange(1, len(particle) + 1), "mol": particle + 1}
    columns["type"] = types(packing).types[particle]
    columns |= {name: values[particle] for name, values in packing.kind.dump_columns(packing).items()}
    if not packing.frame.all_free:
        columns["fixed"] = np.where(packing.frame.fixed_sites, 2 if packing.frame.has_walls else 1, 0)
    return columns


def _dump_columns(packing: Packing) -> dict[str, NDArray[Any]]:
    """What atoms have, each its own or, last, all the same."""
    count, own = len(packing.positions), site_columns(packing)
    x, y = packing.positions.T
    columns = {name: own.pop(name) for name in ("id", "mol", "type")}
    columns |= {"xu": x, "yu": y, "zu": np.zeros(count), **own}
    return columns | {name: np.full(count, value) for name, value in columns_of(facts_of(packing)).items()}


def wrap(packing: Packing) -> tuple[Array, NDArray[np.int64]]:
    """Positions inside the box and the (len(positions), 2) counts of lattice vectors taken off them. The counts are the
    floors of the fractional coordinates s, with x = s_x lx + s_y xy and y = s_y ly."""
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
