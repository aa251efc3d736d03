"""Defaults of the models and the protocols, read from the LAMMPS decks that use them.

`lammps_inputs/*.parameters` hold lines `variable NAME index VALUE`. The decks include these files and this module reads
them, so each default is written once.
"""

import re
from pathlib import Path

from jamlab.errors import EngineError, StorageError
from jamlab.kernels.installed_files import installed
from jamlab.storage.atomic_file import atomic_file, make_folder

_DEFAULT = re.compile(r"^variable\s+(\w+)\s+index\s+(\S+)", re.MULTILINE)
_SUMMARY = re.compile(r"(.*?)(?:, by plain LAMMPS|[.:] |[.]$)")


def deck(name: str) -> Path:
    """Path of an installed deck or include file, e.g. `deck("sp.force")`."""
    path = installed("lammps_inputs") / name
    if not path.is_file():
        raise EngineError(f"{path} is missing: reinstall jamlab with `pip install --force-reinstall .`")
    return path


def summaries(folder: Path) -> dict[str, str]:
    """Names of the decks in a folder, each with what the first sentence of its comment says it does."""
    found = {}
    for path in sorted(folder.glob("in.*")):
        comment = " ".join(line.removeprefix("#").strip() for line in path.read_text().split("\n\n")[0].splitlines())
        found[path.name] = _SUMMARY.match(comment)[1]  # type: ignore[index]
    return found


def copy_decks(folder: Path) -> Path:
    """Copy all decks, their parts and the folder of examples, to be changed.

    Returns:
        The folder, as an absolute path.

    Raises:
        StorageError: the folder cannot be made or written to, or already holds a file of one of the names.
    """
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


def defaults(name: str) -> dict[str, float | str]:
    """Values of `lammps_inputs/<name>.parameters`: numbers as float, the rest as str."""

    def parsed(text: str) -> float | str:
        try:
            return float(text)
        except ValueError:
            return text

    return {key: parsed(value) for key, value in _DEFAULT.findall(deck(f"{name}.parameters").read_text())}
