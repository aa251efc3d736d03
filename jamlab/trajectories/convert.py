"""Write the packings of one file in another format, with what else the file holds, or the names of what is lost."""

from pathlib import Path
from typing import Any, NamedTuple

from jamlab.checks import checked
from jamlab.packing.hdf5 import read_observables
from jamlab.packing.packing import Packing
from jamlab.packing.write import format_of, write
from jamlab.storage.atomic_file import atomic_file
from jamlab.storage.verified_file import USER_BLOCK, FilePath, add_checksum, is_hdf5, opened
from jamlab.trajectories.files import read, read_all

_RECORDS = {
    "flow": "record of a flow",
    "campaign": "record of a task",
    "tables": "tables of a task",
}  # groups of a file


class Converted(NamedTuple):
    """What has been written."""

    packings: list[Packing]
    lost: tuple[str, ...]  # names of what the source has and the new file does not hold


@checked
def convert(source: FilePath, target: FilePath, frame: int | None = None, **reading: Any) -> Converted:
    """Write the packings of a file in the format of another name.

    A file of jamlab that becomes one as a whole is copied with its observables and the record of its flow. One frame
    keeps its observables.

    Args:
        source: file for `jamlab.read`.
        target: file for `jamlab.write`.
        frame: one frame; default: all.
        reading: keyword arguments of `jamlab.read`.

    Returns:
        The packings, and names of what is lost.

    Raises:
        StorageError, InputError: as in `jamlab.read` and `jamlab.write`.

    Example:
        >>> from jamlab.trajectories.convert import convert
        >>> p = jamlab.pack(n=16, pressure=1e-2, seed=1)
        >>> jamlab.write("a.h5", p, jamlab.measure([p], ["z", "rho"]))
        >>> convert("a.h5", "b.h5").lost, convert("a.h5", "b.dump").lost
        ((), ('provenance', 'observables rho, z'))
    """
    kind = format_of(target)
    packings = read_all(source, **reading) if frame is None else [read(source, frame, **reading)]
    records, observables = _beside(source) if is_hdf5(source) else ([], {})
    if kind != "packings":
        lost = write(target, packings) or ()
        named = [f"observables {', '.join(sorted(observables))}"] if observables else []
        return Converted(packings, (*lost, *named, *records))
    if frame is not None:
        write(target, packings, {name: values[[frame]] for name, values in observables.items()})
        return Converted(packings, tuple(records))
    if is_hdf5(source):
        content = Path(source).read_bytes()
        with opened(source) as file:
            image = content[USER_BLOCK:] if file.userblock_size else content
        with atomic_file(target) as temporary:
            temporary.write_bytes(add_checksum(image))
    else:
        write(target, packings)
    return Converted(packings, ())


def _beside(source: FilePath) -> tuple[list[str], dict[str, Any]]:
    """Names of the records that a file of jamlab has beside its packings, and its observables."""
    with opened(source) as file:
        records = [words for name, words in _RECORDS.items() if name in file]
    return records, read_observables(source)
