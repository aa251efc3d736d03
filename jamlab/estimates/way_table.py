"""The table behind `choose` and `estimate`: what packings made in every way gave at some packing fractions, and cost.

`jamlab chart estimates` measures it. It holds one row for each packing and packing fraction, so every number that
follows from it has an interval.
"""

import gzip
import io
import json
import math
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, cast

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import StorageError
from jamlab.estimates.ensemble_way import ONSET, EnsembleWay
from jamlab.statistics.confidence import bend, between, neighbours


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
        start, n, nv, contact, tolerance = (None if pd.isna(part) else part for part in cast("tuple[Any, ...]", key))
        vertices: Any = tuple(int(count) for count in nv.split("/")) if nv else None
        way = EnsembleWay(start, int(n), vertices, contact, tolerance)
        found[way] = WayRecord(way, column("seed")[:, 0].astype(np.int64), levels, values, column("seconds"))
    return found


QUANTUM = {"z": 2.0, "void_sides": 1.0}  # over n: least step of what is counted; packings of equal z still scatter
_FEWEST = (
    100  # packings of a way: with 50, 24 of 32 intervals by 32 disks held; by others 83 to 100 %, some of few draws
)
_FEWEST_VALUES = 12  # of them that have the quantity, at the levels beside rho


@dataclass(frozen=True)
class Difference:
    """Difference of two ensemble means."""

    value: float  # mean of the first way minus that of the reference
    error: float  # standard error
    freedom: float  # degrees of freedom of it


@dataclass(frozen=True)
class Scatter:
    """What one packing of a way gives and costs at rho."""

    deviation: float  # standard deviation from packing to packing
    freedom: float  # degrees of freedom of it
    share: float  # of the seeds that give a value
    seconds: float  # CPU time of a seed


def scatter(record: WayRecord, quantity: str, rho: float) -> Scatter:
    """Scatter, yield and cost of a way at rho, between the levels of its table."""
    levels, count = _levels(record, quantity), _count(record, quantity)
    deviation = math.exp(between(levels, np.log(deviations(record, quantity)), rho))
    share = between(levels, count / len(record.seeds), rho)
    seconds = between(levels, record.seconds.mean(axis=0), rho)
    return Scatter(deviation, _skewed(between(levels, count, rho)), share, seconds)


def is_known(record: WayRecord, reference: WayRecord, quantity: str, rho: float) -> bool:
    """Whether both have enough packings in the table beside rho for their difference to have an error."""
    fewest = _FEWEST if record is not reference else _FEWEST_VALUES
    left, right, _ = neighbours(_levels(record, quantity), rho)
    return all(
        len(one.seeds) >= fewest
        and min(_count(one, quantity)[[left, right]]) >= _FEWEST_VALUES
        and min(deviations(one, quantity)[[left, right]]) > 0
        for one in (record, reference)
    )


def difference(record: WayRecord, reference: WayRecord, quantity: str, rho: float) -> Difference:
    """Mean over packings of one way minus that of a reference, at rho; both share the levels of their table."""
    levels = _levels(record, quantity)
    means, variances = zip(*(_mean(one, quantity) for one in (record, reference)), strict=True)
    offsets = means[0] - means[1]
    error = math.hypot(between(levels, np.sqrt(sum(variances)), rho), bend(levels, offsets, rho))
    freedom = _skewed(min(len(record.seeds), len(reference.seeds)))
    return Difference(between(levels, offsets, rho), error, freedom)


def deviations(record: WayRecord, quantity: str) -> Array:
    """(k,) standard deviation from packing to packing at every level; nan where fewer than two have a value."""
    values = record.values[quantity]
    count = _count(record, quantity)
    squares = np.nansum((values - np.nansum(values, axis=0) / np.maximum(count, 1)) ** 2, axis=0)
    found = np.sqrt(squares / np.maximum(count - 1, 1))
    return np.where(count > 1, np.maximum(found, 0.5 * QUANTUM.get(quantity, 0.0) / record.way.n), np.nan)


def _levels(record: WayRecord, quantity: str) -> Array:
    return record.levels[:1] if quantity == ONSET else record.levels


def _mean(record: WayRecord, quantity: str) -> tuple[Array, Array]:
    """(k,) means at the levels, and their variances; nan where none has a value."""
    count = np.where(_count(record, quantity) > 0, _count(record, quantity), np.nan)
    return np.nansum(record.values[quantity], axis=0) / count, deviations(record, quantity) ** 2 / count


def _count(record: WayRecord, quantity: str) -> Array:
    return np.asarray(np.isfinite(record.values[quantity]).sum(axis=0, dtype=np.float64))


def _skewed(packings: float) -> float:
    """Degrees of freedom: half of the usual ones, as the scatter of skewed quantities is known less well."""
    return 0.5 * (packings - 1)
