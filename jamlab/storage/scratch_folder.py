"""Folders of temporary files that name the process they belong to, so that those of a killed process are found."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """Give a folder of this process on this machine, which is removed when the block ends."""
    with tempfile.TemporaryDirectory(prefix=_prefix(os.getpid())) as folder:
        yield Path(folder)


def remove_scratch_folders(process: int) -> None:
    """Remove the folders of a process of this machine that is gone."""
    for folder in Path(tempfile.gettempdir()).glob(f"{_prefix(process)}*"):
        shutil.rmtree(folder, ignore_errors=True)  # those of other users cannot be removed


def _prefix(process: int) -> str:
    return f"jamlab-{process}-"
