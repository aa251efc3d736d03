"""Tables as text."""

from pathlib import Path
from typing import TYPE_CHECKING

from jamlab.storage.atomic_file import atomic_file
from jamlab.storage.formats import check_ending

if TYPE_CHECKING:
    import pandas as pd


def write_table(frame: "pd.DataFrame", path: Path) -> None:
    """Write a table without its index; numbers come back to the last bit."""
    check_ending(path, "table", "tabs")
    with atomic_file(path) as temporary:
        frame.to_csv(temporary, index=False, sep="\t" if path.suffix.lower() == ".tsv" else ",")
