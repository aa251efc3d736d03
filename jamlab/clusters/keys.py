"""Keys by which the workers of a run are known to its scheduler: in a folder of their own that only this user can read.

The folder is gone at the end of the run. Of a run that was killed, its workers or the next start remove it.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from jamlab.storage.atomic_file import make_folder
from jamlab.storage.held_folder import held_folder


@contextmanager
def key_folder(folder: Path) -> Iterator[Path]:
    """Make the folder of keys of one run, in a folder that all nodes see."""
    make_folder(folder)
    with held_folder(folder, "keys") as keys:
        yield keys


def write_key(path: Path, content: str) -> str:
    """Write a file that only this user can read; returns its absolute path."""
    with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
        file.write(content)
    return str(path.absolute())
