"""Tables of pandas in files: CSV, tab-separated or Parquet by the ending of the name, every digit, all or nothing."""

from pathlib import Path
from typing import TYPE_CHECKING

from jamlab.errors import InputError
from jamlab.storage.atomic_file import atomic_file
from jamlab.storage.file_endings import check_ending

if TYPE_CHECKING:
    import pandas as pd


def write_table(frame: "pd.DataFrame", path: Path) -> None:
    """Write a table without its index; numbers come back to the last bit."""
    check_ending(path, "table", "tabs", "parquet")
    ending = path.suffix.lower()
    if ending == ".parquet":
        check_parquet()
    with atomic_file(path) as temporary:
        if ending == ".parquet":
            frame.to_parquet(temporary, index=False, engine="pyarrow")
        else:
            frame.to_csv(temporary, index=False, sep="\t" if ending == ".tsv" else ",")


def check_parquet() -> None:
    """Check that Parquet can be written."""
    try:
        import pyarrow  # noqa: F401
    except ImportError:
        raise InputError("Parquet needs pyarrow: pip install 'jamlab[parquet]', or export csv") from None
