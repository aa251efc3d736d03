"""Folders of one program that are gone with it, whatever ends it.

The program holds a lock in its folder. One that was killed leaves the folder behind, and the next one that makes such a
folder there removes it: the kernel has freed the lock.
"""

import fcntl
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from jamlab.errors import StorageError
from jamlab.storage.system_errors import system_said

_OWNER = "owner"  # held by flock while the program lives
_HIDDEN = 60.0  # s after which a folder that is not locked yet never will be


@contextmanager
def held_folder(parent: Path, name: str) -> Iterator[Path]:
    """Make a folder `<name>.<letters>` that only this user can read, and remove it when the block ends; those of
    programs that were killed are removed as well."""
    _remove_abandoned(parent, name)
    try:
        made = Path(tempfile.mkdtemp(prefix=f".{name}.", dir=parent))  # mode 0700; the dot hides it until it is locked
        owner = open(made / _OWNER, "a")
    except OSError as error:
        raise StorageError(
            f"cannot write {parent}: {system_said(error, 'make room, or give another folder')}"
        ) from error
    folder = made.with_name(made.name[1:])
    try:
        with owner:
            with suppress(OSError):  # a file system without locks: then nobody removes it but this program
                fcntl.flock(owner, fcntl.LOCK_EX | fcntl.LOCK_NB)
            made.rename(folder)
            yield folder
    finally:
        shutil.rmtree(made, ignore_errors=True)
        shutil.rmtree(folder, ignore_errors=True)


def remove_if_abandoned(folder: Path) -> None:
    """Remove the folder of a program that was killed; that of one that lives stays, also on other machines."""
    with suppress(OSError), open(folder / _OWNER, "r+") as owner:  # no lock, or no file system that has any
        fcntl.flock(owner, fcntl.LOCK_EX | fcntl.LOCK_NB)
        shutil.rmtree(folder, ignore_errors=True)


def _remove_abandoned(parent: Path, name: str) -> None:
    for folder in parent.glob(f"{name}.*"):
        remove_if_abandoned(folder)
    for folder in parent.glob(f".{name}.*"):
        with suppress(OSError):
            if time.time() - folder.stat().st_mtime > _HIDDEN:
                remove_if_abandoned(folder)
