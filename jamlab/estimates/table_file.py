"""Read the tables of measurements behind `choose`, `scene`, `estimate` and `choose_flow`, which have one format.

A table is CSV below one line of JSON, its provenance, packed by gzip: `jamlab.studies.table` writes the text.
"""

from __future__ import annotations

import gzip
import io
import json
import zlib
from collections.abc import Iterable
from importlib import resources
from pathlib import Path

import pandas as pd

from jamlab.errors import StorageError


def read_table(path: Path | None, shipped: str, columns: Iterable[str], command: str) -> pd.DataFrame:
    """Read a table, or the shipped one; what all of its rows share, such as settings, is in `attrs`."""
    source = path or resources.files("jamlab.estimates").joinpath(shipped)
    try:
        with source.open("rb") as file:
            first, _, body = gzip.decompress(file.read()).decode().partition("\n")
        table = pd.read_csv(io.StringIO(body))
        table.attrs = json.loads(first.removeprefix("#"))["facts"]
        if missing := set(columns) - set(table.columns):
            raise ValueError(f"no columns {', '.join(sorted(missing))}")
    except (OSError, EOFError, zlib.error, ValueError, KeyError) as error:
        raise StorageError(f"cannot read the table {source}: {error}; make one with `{command}`") from error
    return table
