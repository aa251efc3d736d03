"""Decks of LAMMPS and the defaults in them, which decks and Python share.

A line `# [NAME]` of a deck or part opens a section; the lines `variable NAME index VALUE` below it are defaults, which
this module reads, so each is written once.
"""

import os
import re
import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from types import MappingProxyType

import numpy as np

from jamlab.engine.installation import lammps_program
from jamlab.errors import EngineError, InputError, StorageError
from jamlab.kernels.library import installed, installed_file
from jamlab.packing.lammps_files import MAX_TYPES, types
from jamlab.packing.packing import Packing
from jamlab.processes.child import dying_line
from jamlab.storage.atomic_file import atomic_file, make_folder

_INDEX = re.compile(r"^variable\s+(\w+)\s+index\s+(\S+)", re.MULTILINE)
# what a variable may be, where a deck says it behind the default: an interval, "whole" or "even" numbers, or words
LIMITS = re.compile(
    r"^variable\s+(\w+)\s+index\s+\S+\s+# ([\[(]\S+, \S+\](?: even| whole)?|[\w/]+(?: \| [\w/]+)+)", re.MULTILINE
)
_SECTION = re.compile(r"^# \[(\S+)\].*\n((?:variable .*\n)+)", re.MULTILINE)
_INCLUDED = re.compile(r"include \"\$\{dir\}/([\w./${}]+)\"")
# beside those of decks: `jam` and moduli of droplets have steps that decks do without
_OF_PYTHON: dict[str, dict[str, float | str]] = {
    "onset": {
        "phi_near": 0.70,  # from here on the first increment is step_near
        "step_near": 2e-3,
        "step_paper": 1e-4,  # search="incremental": first increment of Boromand et al.
        "step_fine": 2.5e-4,  # where jammed, this close above unjammed: go down to onset
        "phi_carried": 0.80,  # droplets: up to here, or until they jam, disks carry them
    },
    "strain": {"strain_dp": 3e-7},  # their contacts are less linear: 1e-6 costs 1e-4 of G
}


def deck(name: str) -> Path:
    """Path of an installed deck or part, e.g. `deck("parts/sp")`."""
    return installed_file("lammps_inputs", name)


def summaries(folder: Path) -> dict[str, str]:
    """Names of the decks in a folder, each with the first line of its comment."""
    return {path.name: path.read_text().splitlines()[0].removeprefix("# ") for path in sorted(folder.glob("in.*"))}


def copy_decks(folder: Path) -> Path:
    """Copy all decks, their parts and the folder of examples, to be changed; files of the folder are not replaced.
    Returns the folder, as an absolute path."""
    make_folder(folder)
    source = installed("lammps_inputs")
    parts = {part: folder / part.relative_to(source) for part in sorted(source.rglob("*")) if part.is_file()}
    for copy in parts.values():
        if copy.exists():
            raise StorageError(f"{copy} exists and may have been changed: choose another folder")
    for part, copy in parts.items():
        make_folder(copy.parent)
        with atomic_file(copy) as temporary:
            temporary.write_bytes(part.read_bytes())
    return folder.resolve()


def text_of(folder: Path, name: str, model: str = "") -> str:
    """Text of a deck, then that of each part that it includes."""
    text = (folder / name).read_text()
    model = model or dict(_INDEX.findall(text)).get("model", "")
    return "".join(
        [text, *(text_of(folder, part.replace("${model}", model), model) for part in _INCLUDED.findall(text))]
    )


def settings(folder: Path, name: str, model: str = "", what: re.Pattern[str] = _INDEX) -> dict[str, str]:
    """Variables that `lmp -var` may set in a deck, each with its default: its own, then those of what it includes.
    `what`: LIMITS for what they may be."""
    text = (folder / name).read_text()
    found = dict(reversed(what.findall(text)))  # of two lines for one name the first counts
    model = model or dict(_INDEX.findall(text)).get("model", "")
    for part in _INCLUDED.findall(text):
        found = settings(folder, part.replace("${model}", model), model, what) | found
    return found


def defaults(name: str) -> dict[str, float | str]:
    """Values of the section `# [name]` of the decks: numbers as float, the rest as str."""
    if name not in _sections():
        raise EngineError(f"no deck has the section {name}: reinstall jamlab with `pip install --force-reinstall .`")
    return {key: _parsed(value) for key, value in _INDEX.findall(_sections()[name])} | _OF_PYTHON.get(name, {})


@cache
def numbers(name: str) -> Mapping[str, float]:
    """Values of a section that holds numbers alone."""
    return MappingProxyType({key: float(value) for key, value in defaults(name).items()})


@cache
def _sections() -> dict[str, str]:
    folder = installed("lammps_inputs")
    files = [*folder.glob("parts/*"), *folder.glob("in.*")]
    return {name: lines for path in files for name, lines in _SECTION.findall(path.read_text())}


def _parsed(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


COMPONENT = 0.5  # of a force's norm: LAMMPS compares components, of which two make a norm of up to sqrt(2) times one
_FEW = 8  # ranks that any machine may run, if slowly


def check_ranks(ranks: int, one: bool = False) -> None:
    """Refuse what is no number of threads or MPI ranks; `one`: more than one, for droplets, which have one."""
    most = max(os.cpu_count() or 1, _FEW)
    if isinstance(ranks, bool) or not isinstance(ranks, int | np.integer) or not 1 <= ranks <= most:
        raise InputError(f"ranks = {ranks!r}: must be a whole number of processors of this machine, 1 to {most}")
    if ranks > 1 and one:
        raise InputError(f"ranks = {ranks}: polygons are minimised on one rank")


def law_settings(packing: Packing) -> dict[str, object]:
    """Variables by which a deck knows the force law of a packing and, of disks, their diameters by type."""
    found = packing.kind.lammps_variables(packing)
    if not packing.kind.sizes_by_atom:
        if (table := types(packing)).classes:
            raise InputError(f"more than {MAX_TYPES} sizes of disks: decks take a size from its type; use Python")
        found |= {f"d{k}": d for k, d in enumerate(table.values, start=1)}
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
        line += ["-var", name, f"{value:.17g}" if isinstance(value, float) else value]
    return dying_line([str(word) for word in line])
