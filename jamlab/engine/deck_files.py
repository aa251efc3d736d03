"""Where the decks of LAMMPS are, and copies of them to be changed."""

from pathlib import Path

from jamlab.errors import StorageError
from jamlab.installed_files import installed
from jamlab.storage.atomic_file import atomic_file, make_folder


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
