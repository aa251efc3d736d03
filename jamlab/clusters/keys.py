"""Keys by which the workers of a run are known to its scheduler: in a folder of their own that only this user can read.

The folder is gone at the end of the run. A run that was killed leaves it behind, and the next start removes it: the
kernel has freed its lock.
"""

import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from jamlab.errors import StorageError
from jamlab.storage.atomic_file import make_folder
from jamlab.storage.system_errors import system_said

_OWNER = "owner"  # held by flock while the run lives


def _remove_abandoned(folder: Path) -> None:
    """Remove the keys of runs that were killed, and leave alone those of runs that live, also on other machines."""
    for keys in folder.glob("keys.*"):
        with suppress(OSError), open(keys / _OWNER, "a") as owner:  # no lock, or no file system that has any
            fcntl.flock(owner, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(keys, ignore_errors=True)


@contextmanager
def key_folder(folder: Path) -> Iterator[Path]:
    """Make the folder of keys of one run, in a folder that all nodes see."""
    make_folder(folder)
    _remove_abandoned(folder)
    try:
        made = Path(tempfile.mkdtemp(prefix=".keys.", dir=folder))  # mode 0700; the dot hides it until it is locked
        owner = open(made / _OWNER, "a")
    except OSError as error:
        raise StorageError(
            f"cannot write {folder}: {system_said(error, 'make room, or give another folder')}"
        ) from error
    keys = made.with_name(made.name[1:])
    try:
        with owner:
            with suppress(OSError):  # a file system without locks: then nobody removes these but this run
                fcntl.flock(owner, fcntl.LOCK_EX | fcntl.LOCK_NB)
            made.rename(keys)
            yield keys
    finally:
        shutil.rmtree(made, ignore_errors=True)
        shutil.rmtree(keys, ignore_errors=True)


def write_key(path: Path, content: str) -> str:
    """Write a file that only this user can read; returns its absolute path."""
    with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
        file.write(content)
    return str(path.absolute())
