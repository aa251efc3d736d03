"""The table behind `choose` and `estimate`: what packings made in every way gave at some packing fractions, and cost.

`jamlab chart estimates` measures it. It holds one row for each packing and packing fraction, so every number that
follows from it has an interval.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, cast

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import StorageError
from jamlab.estimates.ensemble_way import ONSET, EnsembleWay
from jamlab.estimates.table_file import read_table

SHIPPED = "ways.csv.gz"
N = 64  # particles of the packings whose mean is estimated, and which one packing stands for
QUANTITIES = ("z", "g", "b", "a", "void_sides")
WAY = ("start", "n", "nv", "contact", "tolerance")
COLUMNS = (*WAY, "seed", "rho", *QUANTITIES, ONSET, "seconds")
_COMMAND = "jamlab chart estimates"


@dataclass(frozen=True)
class WayRecord:
    """Packings made in one way."""

    way: EnsembleWay  # how they were made
    seeds: NDArray[np.int64]  # (m,) int64
    levels: Array  # (k,) rho, ascending
    # quantity -> (m, k), nan where a packing is not jammed or has no such value; "rho-J" -> (m, 1)
    values: dict[str, Array]
    seconds: Array  # (m, k) CPU time from the random start to each level, also of packings that failed there


Ways = Mapping[EnsembleWay, WayRecord]


def read_ways(path: Path | None = None) -> Ways:
    """Read the shipped table, or one written by `jamlab chart estimates`."""
    return _shipped_ways() if path is None else _read(path)


@cache
def _shipped_ways() -> Ways:
    return _read(None)


def _read(path: Path | None) -> Ways:
    table = read_table(path, SHIPPED, COLUMNS, _COMMAND)
    try:
        found, made_with = collect(table), table.attrs["parameters"]
    except (ValueError, KeyError) as error:
        raise StorageError(f"{path or SHIPPED} is no table of ways: {error}; make one with `{_COMMAND}`") from error
    law = defaults("dp")
    changed = [f"{name} = {was} (now {law.get(name)})" for name, was in made_with.items() if law.get(name) != was]
    if changed:
        raise StorageError(f"{path or SHIPPED} was made with {', '.join(changed)}: make it anew with `{_COMMAND}`")
    return found


def collect(table: pd.DataFrame) -> dict[EnsembleWay, WayRecord]:
    """Collect rows by the way that their packings were made in."""
    if table.empty:
        raise ValueError("it has no rows")
    levels = np.unique(table["rho"].to_numpy(dtype=np.float64))
    found = {}
    for key, rows in table.groupby(list(WAY), dropna=False, sort=False):
        ordered = rows.sort_values(["seed", "rho"])

        def column(name: str, rows: pd.DataFrame = ordered) -> Array:
            return rows[name].to_numpy(dtype=np.float64).reshape(-1, len(levels))

        values = {name: column(name) for name in QUANTITIES} | {ONSET: column(ONSET)[:, :1]}
        way = _way(*cast("tuple[Any, ...]", key))
        found[way] = WayRecord(way, column("seed")[:, 0].astype(np.int64), levels, values, column("seconds"))
    return found


def _way(start: str, n: int, nv: str | float, contact: str | float, tolerance: float) -> EnsembleWay:
    """The way of a row, in which what is not given is nan."""
    small, large = (int(count) for count in nv.split("/")) if isinstance(nv, str) else (0, 0)
    return EnsembleWay(
        start,
        int(n),
        (small, large) if large else None,
        contact if isinstance(contact, str) else None,
        None if np.isnan(tolerance) else float(tolerance),
    )
