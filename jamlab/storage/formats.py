"""Endings of the files that jamlab reads and writes."""

import os
from pathlib import Path

from jamlab.errors import InputError

FORMATS: dict[str, tuple[str, ...]] = {  # endings of what jamlab writes, the usual one first
    "packings": (".h5", ".hdf5", ".h5md"),
    "data": (".data", ".lmp", ".lammps"),
    "dump": (".dump", ".lammpstrj", ".lammpsdump"),
    "vtp": (".vtp",),
    "movie": (".mp4", ".gif"),
    "xyz": (".xyz", ".extxyz"),
    "page": (".html", ".htm"),
    "campaign": (".toml",),
    "picture": (".png", ".pdf", ".svg"),
    "png": (".png",),
    "table": (".csv",),
    "tabs": (".tsv",),
    "tables": (".csv", ".tsv", ".json", ".h5", ".parquet"),
}


def begins_as(path: str | os.PathLike[str]) -> str:
    """The kind of LAMMPS file that a name such as data.droplets begins with, or nothing."""
    start, _, rest = Path(os.fspath(path)).name.partition(".")
    # files that LAMMPS users name by what they begin with, as in data.droplets
    return start if rest and start in ("data", "dump") else ""


def check_ending(path: str | os.PathLike[str], *kinds: str, option: str = "") -> None:
    """Refuse a name whose ending promises another format than these; names without an ending promise nothing.
    `kinds`: of `FORMATS`; `option`: of the command line that gave the name."""
    name = os.fspath(path)
    ending = Path(name).suffix.lower()
    allowed = [known for kind in kinds for known in FORMATS[kind]]
    endings = {ending for endings in FORMATS.values() for ending in endings}
    if ending not in ("", *allowed) and not (begins_as(path) in kinds and ending not in endings):
        raise InputError(f"{option} {name}: name a file that ends in {', '.join(allowed)}".lstrip())
