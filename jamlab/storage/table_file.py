"""Tables as files of any format that other programs read, by the ending of the name.

Numbers come back to the last bit in each: text has as many digits as it takes, the others hold doubles.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jamlab.errors import InputError
from jamlab.storage.atomic_file import atomic_file
from jamlab.storage.formats import check_ending

if TYPE_CHECKING:
    import pandas as pd


def check_table_format(name: str) -> None:
    """Refuse a format whose library is not installed, before any work."""
    if name == "parquet" and find_spec("pyarrow") is None:
        raise InputError("Parquet needs pyarrow: run `pip install 'jamlab[parquet]'`, or take csv, tsv, json or h5")


def write_table(frame: pd.DataFrame, path: Path) -> None:
    """Write a table without its index, in the format of the ending of the path; CSV without one."""
    check_ending(path, "tables")
    name = path.suffix.lower().removeprefix(".") or "csv"
    check_table_format(name)
    with atomic_file(path) as temporary:
        TABLE_FORMATS[name](frame, temporary)


def _write_csv(frame: pd.DataFrame, temporary: Path) -> None:
    frame.to_csv(temporary, index=False)


def _append_csv(frame: pd.DataFrame, temporary: Path) -> None:
    frame.to_csv(temporary, index=False, mode="a", header=False)


def _write_tsv(frame: pd.DataFrame, temporary: Path) -> None:
    frame.to_csv(temporary, index=False, sep="\t")


def _append_tsv(frame: pd.DataFrame, temporary: Path) -> None:
    frame.to_csv(temporary, index=False, sep="\t", mode="a", header=False)


def _write_json(frame: pd.DataFrame, temporary: Path) -> None:
    """Write a list of rows; null stands for numbers that are not finite."""
    columns = {str(name): [_plain(value) for value in frame[name].tolist()] for name in frame}
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    temporary.write_text(json.dumps(rows, ensure_ascii=False, allow_nan=False), encoding="utf-8")


def _plain(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _write_h5(frame: pd.DataFrame, temporary: Path) -> None:
    """Write each column as a dataset (rows,), text in UTF-8."""
    import h5py

    with h5py.File(temporary, "w") as file:
        for name in frame:
            values = frame[name].to_numpy()
            numbers = values.dtype.kind in "biuf"
            file.create_dataset(str(name), data=values, dtype=None if numbers else h5py.string_dtype())


def _write_parquet(frame: pd.DataFrame, temporary: Path) -> None:
    frame.to_parquet(temporary, index=False)


TABLE_FORMATS: dict[str, Callable[[pd.DataFrame, Path], None]] = {
    "csv": _write_csv,
    "tsv": _write_tsv,
    "json": _write_json,
    "h5": _write_h5,
    "parquet": _write_parquet,
}
IN_PARTS = {"csv": _append_csv, "tsv": _append_tsv}  # formats whose rows may be written in parts: how to append some
