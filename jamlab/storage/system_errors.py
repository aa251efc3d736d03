"""Reasons and remedies of failures with files, from the errors of the system."""

import errno
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from jamlab.errors import StorageError


def system_error(error: BaseException) -> int | None:
    """Number of the error of the system behind an error; None if there is none, so that the content is at fault."""
    found = error.errno if isinstance(error, OSError) else None
    of_hdf5 = re.compile(r"errno = (\d+)")  # HDF5 gives the number in its text alone where h5py does not pass it on
    number = found or next(map(int, of_hdf5.findall(str(error))), 0)
    return number or None


def system_said(error: BaseException, remedy: str) -> str:
    """Reason and remedy; `remedy`: where the reason itself suggests no other."""
    number = system_error(error)
    reason = os.strerror(number) if number is not None else error
    remedies = {
        **dict.fromkeys(
            (errno.EIO, errno.ESTALE, errno.ETIMEDOUT, errno.ENXIO, errno.ENODEV),
            "the file system failed, not the file: try again, or ask who runs it",
        ),
        **dict.fromkeys((errno.ENOLCK, errno.ENOTSUP), "this file system cannot do that: take a folder on another one"),
        errno.EDQUOT: "your quota is used up: remove files, or ask for more",
    }
    return f"{reason}; {remedies.get(number or 0, remedy)}"


@contextmanager
def using(path: Path) -> Iterator[None]:
    """Turn errors of the file system in a block that uses a path into StorageError."""
    try:
        yield
    except OSError as error:
        raise StorageError(f"cannot use {path}: {system_said(error, 'check its permissions')}") from error
