"""Numbers and names of files as LAMMPS takes them for one word."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np


def text(value: object) -> str:
    """A value as a word, a number with all its digits."""
    # numpy scalars print as np.float64(...), which LAMMPS cannot read; 17 digits give the same double back
    return f"{float(value):.17g}" if isinstance(value, float | np.floating) else str(value)


@contextmanager
def plain_name(file: Path) -> Iterator[str]:
    """Name a file by what LAMMPS takes for one word, whatever letters the folders of TMPDIR or of jamlab have."""
    if str(file).isascii() and not set("\"'$&#\\ \t\n") & set(str(file)):
        yield str(file)
        return
    with open(file, "rb") as opened:
        yield f"/dev/fd/{opened.fileno()}"
