"""The command line that runs a deck: force law and sizes of a packing as its variables, and ranks."""

import sys
from collections.abc import Mapping
from pathlib import Path

from jamlab.engine.installation import lammps_program
from jamlab.errors import InputError
from jamlab.packing.facts import law_columns
from jamlab.packing.lammps_files import MAX_TYPES, MOST_TYPES, types
from jamlab.packing.packing import Packing
from jamlab.processes.child import dying_line


def law_settings(packing: Packing) -> dict[str, object]:
    """Variables by which a deck knows the force law of a packing and, of disks, their diameters by type."""
    found = packing.kind.lammps_variables(packing)
    if not packing.kind.sizes_by_atom:
        if (table := types(packing)).classes:
            most = MAX_TYPES if packing.law.sizes_by_disk else MOST_TYPES
            raise InputError(f"more than {most} sizes of disks: decks take a size from its type; use Python")
        found |= {f"d{k}": d for k, d in enumerate(table.values, start=1)}
        if "law" in packing.params:
            columns = law_columns(packing)
            found |= {"column": tuple(columns), "column_value": tuple(columns.values())}
    return found


def lammps_line(path: Path, variables: Mapping[str, object], ranks: int, *words: str) -> list[str]:
    """Command line of LAMMPS for a deck, on some ranks of this machine; it ends with this process and needs
    `child_environment` and `program_environment`. `words`: more of its arguments."""
    if '"' in str(path.parent):  # by which decks quote the names of their parts
        raise InputError(
            f'{path.parent}: decks run in no folder with a " in its name; copy them to another by '
            "`jamlab decks --copy FOLDER` and run them there"
        )
    # inside a job of SLURM mpiexec would ask it to start the ranks
    line: list[object] = (
        [Path(sys.executable).with_name("mpiexec"), "-launcher", "fork", "-n", ranks] if ranks > 1 else []
    )
    line += [lammps_program(), "-in", path, "-nocite", *words]
    for name, value in {"dir": path.parent, **variables}.items():
        each = value if isinstance(value, tuple) else (value,)
        line += ["-var", name, *(f"{one:.17g}" if isinstance(one, float) else one for one in each)]
    return dying_line([str(word) for word in line])
