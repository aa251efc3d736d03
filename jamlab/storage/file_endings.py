"""Endings of file names: which format each promises, and which function writes it."""

import os
from dataclasses import dataclass
from pathlib import Path

from jamlab.errors import InputError


@dataclass(frozen=True)
class Format:
    """A format that jamlab writes."""

    refusal: str  # what is said of a name that promises another one
    endings: tuple[str, ...]  # the usual one first
    writer: str = ""  # function or command that writes it, if it is of one kind


FORMATS = {
    "packings": Format("packings are written as HDF5", (".h5", ".hdf5", ".h5md"), "jamlab.write"),
    "data": Format("this is a LAMMPS data file", (".data", ".lmp", ".lammps"), "jamlab.write_data"),
    "dump": Format("this is a LAMMPS dump", (".dump", ".lammpstrj", ".lammpsdump"), "jamlab.write_dump"),
    "vtp": Format("points and lines are written for VTK", (".vtp",), "jamlab.write_contacts"),
    "movie": Format("a film is drawn", (".mp4", ".gif"), "jamlab.write_movie"),
    "page": Format("a page is written as HTML", (".html", ".htm"), "jamlab.write_page"),
    "campaign": Format("a campaign file is TOML", (".toml",), "jamlab campaign new"),
    "picture": Format("a picture is drawn", (".png", ".pdf", ".svg")),
    "png": Format("the picture is drawn as PNG", (".png",)),
    "table": Format("a table is written as CSV, with commas", (".csv",)),
    "tabs": Format("a table is written with tabs", (".tsv",)),
    "parquet": Format("a table is written as Parquet", (".parquet",)),
}
_WRITERS = {ending: form.writer for form in FORMATS.values() for ending in form.endings if form.writer}
_OF_LAMMPS = ("data", "dump")  # files that LAMMPS users name by what they begin with, as in data.droplets


def begins_as(path: str | os.PathLike[str]) -> str:
    """The kind of LAMMPS file that a name such as data.droplets begins with, or nothing."""
    start, _, rest = Path(os.fspath(path)).name.partition(".")
    return start if rest and start in _OF_LAMMPS else ""


def check_ending(path: str | os.PathLike[str], *kinds: str, option: str = "") -> None:
    """Refuse a name whose ending promises another format than these; names without an ending promise nothing.
    `kinds`: of `FORMATS`; `option`: of the command line that gave the name."""
    name = os.fspath(path)
    ending = Path(name).suffix.lower()
    allowed = [FORMATS[kind] for kind in kinds]
    if ending in ("", *(known for form in allowed for known in form.endings)):
        return
    if begins_as(path) in kinds and ending not in _WRITERS:
        return
    writer = _WRITERS.get(ending)
    hint = f"; {writer} writes {ending}" if writer else ""
    ways = ", or ".join(f"{form.refusal}; name a file that ends in {', '.join(form.endings)}" for form in allowed)
    raise InputError(f"{option} {name}: {ways}{hint}".lstrip())
