"""The table behind `jamlab.estimate`: what packings made in every way gave at some packing fractions, and their cost.

`jamlab chart estimates` measures it. It holds one row for each packing and packing fraction, so every number that
follows from it has an interval.
"""

from __future__ import annotations

import csv
import gzip
import json
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import StorageError
from jamlab.estimates.ensemble_way import EnsembleWay

SHIPPED = "ways.csv.gz"
ONSET = "rho-J"
N = 64  # particles of the packings whose mean is estimated, and which one packing stands for
_KEYS = ("start", "n", "nv", "contact", "tolerance", "seed", "rho", "seconds")


@dataclass(frozen=True)
class WayRecord:
    """Packings made in one way.

    Attributes:
        way: how they were made.
        seeds: (m,) int64.
        levels: (k,) rho, ascending.
        values: quantity -> (m, k), nan where a packing is not jammed or has no such value; "rho-J" -> (m, 1).
        seconds: (m, k) CPU time from the random start to each level, also of packings that failed there.
    """

    way: EnsembleWay
    seeds: NDArray[np.int64]
    levels: Array
    values: dict[str, Array]
    seconds: Array


@cache
def read_ways(path: Path | None = None) -> dict[EnsembleWay, WayRecord]:
    """Read the shipped table, or one written by `jamlab chart estimates`.

    Raises:
        StorageError: it cannot be read, is not such a table, or was made with other parameters than the present ones.
    """
    source = path or resources.files("jamlab.estimates").joinpath(SHIPPED)
    try:
        with source.open("rb") as file:
            lines = gzip.decompress(file.read()).decode().splitlines()
        made_with = json.loads(lines[0].removeprefix("#"))["parameters"]
        found = collect(list(csv.DictReader(lines[1:])))
    except (OSError, EOFError, zlib.error, ValueError, KeyError, IndexError) as error:
        raise StorageError(
            f"cannot read the table {source}: {error}; make one with `jamlab chart estimates`"
        ) from error

    law = defaults("dp")
    changed = [f"{name} = {was} (now {law.get(name)})" for name, was in made_with.items() if law.get(name) != was]
    if changed:
        raise StorageError(f"{source} was made with {', '.join(changed)}: make it anew with `jamlab chart estimates`")
    return found


def collect(rows: list[dict[str, str]]) -> dict[EnsembleWay, WayRecord]:
    """Collect rows of a CSV table by the way that their packings were made in.

    Raises:
        KeyError, ValueError: a column is missing, or a packing lacks a level.
    """
    levels = np.array(sorted({float(row["rho"]) for row in rows}))
    names = [name for name in rows[0] if name not in (*_KEYS, ONSET)]
    by_way: dict[EnsembleWay, list[dict[str, str]]] = {}
    for row in rows:
        by_way.setdefault(way_of(row), []).append(row)
    return {way: _record(way, own, levels, names) for way, own in by_way.items()}


def way_of(row: Mapping[str, str]) -> EnsembleWay:
    """The way of a row."""
    nv = tuple(int(v) for v in row["nv"].split("/")) if row["nv"] else None
    return EnsembleWay(
        row["start"],
        int(row["n"]),
        None if nv is None else (nv[0], nv[1]),
        row["contact"] or None,
        float(row["tolerance"]) if row["tolerance"] else None,
    )


def _record(way: EnsembleWay, rows: list[dict[str, str]], levels: Array, names: list[str]) -> WayRecord:
    rows = sorted(rows, key=lambda row: (int(row["seed"]), float(row["rho"])))

    def column(name: str) -> Array:
        return np.array([float(row[name] or "nan") for row in rows]).reshape(-1, len(levels))

    values = {name: column(name) for name in names} | {ONSET: column(ONSET)[:, :1]}
    return WayRecord(way, column("seed")[:, 0].astype(np.int64), levels, values, column("seconds"))
