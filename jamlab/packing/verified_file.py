"""Open an HDF5 file of jamlab for reading, once its checksum and its schema are verified."""

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import metadata
from typing import Any

import h5py
import numpy as np

from jamlab.errors import JamlabError, StorageError
from jamlab.packing.checksum import checksum

FilePath = str | os.PathLike[str]

SCHEMA = "jamlab"
SCHEMA_VERSION = 1
REMEDY = "copy it again, or run the task that wrote it again"


@contextmanager
def opened(path: FilePath) -> Iterator[Any]:
    """The open h5py.File of a file that jamlab wrote; errors of its reader become `StorageError`."""
    try:
        _check_source(path)
        found = checksum(path)
    except (OSError, ValueError) as error:
        if isinstance(error, JamlabError):
            raise
        reason = getattr(error, "strerror", None) or error
        raise StorageError(f"cannot read {path}: {reason}; check the name and its permissions") from error
    if found is not None and not found.matches:
        raise StorageError(f"{path} is damaged or truncated (its checksum does not match): {REMEDY}")
    if not h5py.is_hdf5(path):
        raise StorageError(f"{path} is not an HDF5 file: give a file that jamlab wrote")
    try:
        with h5py.File(path, "r") as file:
            _check_schema(path, file)
            if found is None and file.userblock_size:
                raise StorageError(f"{path} is damaged (the line with its checksum is unreadable): {REMEDY}")
            yield file
    except JamlabError:
        raise
    except (
        OSError,
        RuntimeError,
        LookupError,
        ValueError,
        TypeError,
        AttributeError,
        ArithmeticError,
        MemoryError,
    ) as error:
        raise StorageError(f"{path} is damaged or truncated ({error}): {REMEDY}") from error


def _check_source(path: FilePath) -> None:
    """Refuse what has no end (a device) or may never begin (a pipe)."""
    mode = os.stat(path).st_mode
    if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
        raise StorageError(f"cannot read {path}: it is a device, a pipe or a socket; give a file that jamlab wrote")


def _check_schema(path: FilePath, file: Any) -> None:
    schema = file.attrs.get("schema")
    if not isinstance(schema, str) or schema != SCHEMA:
        raise StorageError(
            f"{path} is HDF5 but not from jamlab (it lacks the root attribute schema = {SCHEMA!r}): "
            "give a file that jamlab wrote"
        )
    version = file.attrs.get("schema_version")
    if not isinstance(version, int | np.integer) or version < 1:
        raise StorageError(f"{path} is damaged (schema_version is {version!r}, not a whole number): {REMEDY}")
    if version > SCHEMA_VERSION:
        needed = file["h5md/creator"].attrs["version"]
        raise StorageError(
            f"{path} has schema version {version}, jamlab {jamlab_version()} reads up to {SCHEMA_VERSION}: "
            f"install jamlab {needed} or newer"
        )


def jamlab_version() -> str:
    """Version of the installed package."""
    try:
        return metadata.version("jamlab")
    except metadata.PackageNotFoundError:
        return "unknown"
