"""Refuse options that a command would ignore, and files to write that it also reads, before it runs.

An option that stands in no line of `USES` is used in each way to run its command.
"""

import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from jamlab.errors import InputError

Values = Mapping[str, Any]  # of all parameters of a command, by name


class Use(NamedTuple):
    """When options are used."""

    commands: str
    options: str
    words: str  # that follow "used only"
    holds: Callable[[Values], bool]


def is_picture(values: Values) -> bool:
    """Whether `analyze` measures a picture."""
    return values["file"] is None or values["file"].suffix.lower() in PICTURES


def _is_of_packings(values: Values) -> bool:
    return not is_picture(values)


def _is_foreign(values: Values) -> bool:
    from jamlab.storage.verified_file import is_hdf5

    files = values["files"] if "files" in values else [values["file"]]
    return not any(file is not None and file.is_file() and is_hdf5(file) for file in files or ())


def _has_outlines(values: Values) -> bool:
    from jamlab.packing.kinds import MODELS

    name = values["model"]
    return name in MODELS.names() and MODELS.get(name).has_outlines


def _is_of_disks(values: Values) -> bool:
    return not _has_outlines(values)


def _has_ranks(values: Values) -> bool:
    from jamlab.packing.kinds import MODELS

    name = values["model"]
    return name not in MODELS.names() or MODELS.get(name).compiled_fire


PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
TIMED = "shear quasistatic-shear flow-curve oscillate creep relax-stress stop-flow"

USES = (
    Use("gstar", "n pressure phi seed sizes size_ratio fraction_large ensemble force_tolerance ranks", "without FILES",
        lambda v: not v["files"]),
    Use("gstar", "frame box radii model atom_style", "with FILES", lambda v: bool(v["files"])),
    Use("jam pack gstar", "size_ratio fraction_large", "without --sizes", lambda v: v["sizes"] is None),
    Use("jam", "size_ratio", "for disks: droplets have nv_small and nv_large, see --law", _is_of_disks),
    Use("jam", "ranks", "for disks", _has_ranks),
    Use("jam", "start", "for droplets", _has_outlines),
    Use("analyze", "pixel film contrast channel labels memory overlay out", "for pictures", is_picture),
    Use("analyze", "quantities workers units box radii law atom_style", "for files of packings", _is_of_packings),
    Use("analyze", "contrast", "without --labels", lambda v: v["labels"] is None),
    Use("analyze", "channel", "with FILE", lambda v: v["file"] is not None),
    Use("analyze", "model", "with --out", lambda v: v["out"] is not None or not is_picture(v)),
    Use(
        f"{TIMED} analyze explore convert relax compress decompress anneal swap-sizes relax-radii",
        "units box radii law model atom_style",
        "for files of other programs: HDF5 files of jamlab contain them",
        _is_foreign,
    ),
    Use(
        "gstar",
        "units box radii law model atom_style",
        "for files of other programs: HDF5 files of jamlab contain them",
        lambda v: not v["files"] or _is_foreign(v),
    ),
    Use("estimate", "rho", "for quantities other than rho_J", lambda v: v["quantity"] != "rho_J"),
    Use("estimate", "seed workers", "without --dry-run", lambda v: not v["dry_run"]),
    Use("decks", "json", "without NAME", lambda v: v["name"] is None),
)  # fmt: skip

INPUTS = ("file", "files", "labels")
OUTPUTS = ("out", "plot", "csv", "overlay", "target")


def check_given(command: str, values: Values, given: Mapping[str, str]) -> None:
    """Refuse options that would not be used, and files to write that are read, or written twice.

    Args:
        command: its name.
        values: of all its parameters.
        given: parameters that stand in the command line, each with its option.
    """
    for use in USES:
        if command in use.commands.split():
            for name in use.options.split():
                if name in given and not use.holds(values):
                    raise InputError(f"{given[name]} is used only {use.words}: leave it out")
    read = list(_paths(values, INPUTS))
    if values.get("sizes") is not None:
        from jamlab.protocols.size_distributions import FROM_FILE

        kind, colon, name = values["sizes"].partition(":")
        read += [Path(name)] if kind + colon == FROM_FILE else []
    written: list[Path] = []
    for path in _paths(values, OUTPUTS):
        check_apart(path, read, "it is also the input")
        check_apart(path, written, "another option names it too")
        written.append(path)


def _paths(values: Values, names: tuple[str, ...]) -> Iterator[Path]:
    for name in names:
        found = values.get(name)
        yield from found if isinstance(found, list | tuple) else [] if found is None else [found]


def check_apart(path: Path, others: list[Path], why: str) -> None:
    """Refuse a file to write that is one of others, by whatever name, link or hard link it is called."""
    if any(_is_same(path, other) for other in others):
        raise InputError(f"cannot write {path}: {why}; choose another name")


def _is_same(path: Path, other: Path) -> bool:
    try:
        return os.path.realpath(path) == os.path.realpath(other) or (
            path.exists() and other.exists() and os.path.samefile(path, other)
        )
    except (OSError, ValueError):  # a name that no file can have is refused by who opens it
        return False
