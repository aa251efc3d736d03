"""Kinds of files that are met in place of those that are read: known by how they begin, and named with the way out."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from jamlab.errors import StorageError
from jamlab.storage.verified_file import FilePath

_ARRAYS = "load it with numpy and give positions, diameters and box to jamlab.Packing"
_TEXT = "let LAMMPS write a text dump: `dump ID all custom N FILE.dump id type x y radius`"


class _Kind(NamedTuple):
    begins: bytes  # anywhere in the first bytes if `inside`
    is_a: str
    remedy: str
    inside: bool = False


_KINDS = (
    _Kind(b"\x28\xb5\x2f\xfd", "compressed with zstd", "unpack it first, `zstd -d FILE`"),
    _Kind(b"\x04\x22\x4d\x18", "compressed with lz4", "unpack it first, `lz4 -d FILE`"),
    _Kind(b"\x1f\x8b", "compressed with gzip", "give its name the ending .gz"),
    _Kind(b"1AY&SY", "compressed with bzip2", "give its name the ending .bz2", inside=True),
    _Kind(b"\xfd7zXZ", "compressed with xz", "give its name the ending .xz"),
    _Kind(
        b"PK\x03\x04", "a zip archive, such as .npz of numpy or .xlsx", f"of arrays: {_ARRAYS}; of a table: save CSV"
    ),
    _Kind(b"\x93NUMPY", "an array of numpy", _ARRAYS),
    *(_Kind(b"CDF" + version, "netCDF", _TEXT) for version in (b"\x01", b"\x02", b"\x05")),
    _Kind(b"DUMPATOM", "a binary dump of LAMMPS", _TEXT, inside=True),
    _Kind(b"DUMPCUSTOM", "a binary dump of LAMMPS", _TEXT, inside=True),
    _Kind(
        b"LammpS RestartT", "a restart file of LAMMPS", "turn it into a data file: `lmp -restart2data FILE FILE.data`"
    ),
    _Kind(b"---\n", "YAML, as of LAMMPS' `dump yaml`", _TEXT),
    _Kind(b"\xff\xfe", "text in UTF-16", "save it as UTF-8"),
    _Kind(b"\xfe\xff", "text in UTF-16", "save it as UTF-8"),
    _Kind(b"%PDF", "a PDF", "give the numbers behind it"),
    _Kind(b"\x89PNG", "a picture", "give it to jamlab.micrograph or `jamlab analyze`"),
)


def refuse_foreign(path: FilePath, compressed: bool) -> None:
    """Name a file of a kind that is not read, with the way out. `compressed`: whether its ending says so.

    Raises:
        StorageError: it is of such a kind.
    """
    try:
        with Path(path).open("rb") as file:
            begin = file.read(64)
    except (OSError, ValueError):  # whoever reads it says why
        return
    for kind in () if compressed and begin[:2] in (b"\x1f\x8b", b"BZ", b"\xfd7") else _KINDS:
        if kind.begins in begin if kind.inside else begin.startswith(kind.begins):
            raise StorageError(f"{path} is {kind.is_a}, which is not read: {kind.remedy}")
