"""Measure the table behind `jamlab.estimate`: every quantity of every packing made in every way, and what it took.

The packings of one seed are made together: disks at onset carry droplets of several kinds, droplets of their own are
compressed beside them. Rows are kept as they come, so a run that was stopped goes on where it was.
"""

import csv
import gzip
import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from jamlab.benchmarks.cpu_time import one_core
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import JamlabError
from jamlab.estimates.ensemble_way import (
    STEP,
    EnsembleWay,
    bring_on,
    default_vertices,
    find_onset,
    hand_over,
    values_at,
)
from jamlab.estimates.way_table import WayRecord, collect
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.packing.atomic_file import atomic_file, check_target
from jamlab.packing.packing import Packing
from jamlab.packing.versions import versions
from jamlab.statistics.published_numbers import MODELS_PART

LEVELS = (0.84, 0.85, 0.86, 0.88, 0.90, 0.92, 0.94, 0.96, 0.98)  # rho: from the onsets to confluence
QUANTITIES = ("z", "g", "b", "a", "void_sides")
FEW_VERTICES = (8, 11)
SEEDS = range(20_001, 20_101)  # none that a test, a campaign or `jamlab.estimate` uses
_RARE = 4  # one in so many seeds has fewer vertices and fewer particles, which no first trial found to pay
COLUMNS = ("start", "n", "nv", "seed", "rho", *QUANTITIES, "rho-J", "seconds")

Row = dict[str, Any]


def make_table(
    out: Path, seeds: range = SEEDS, *, progress: Callable[[str], None] | None = None
) -> dict[EnsembleWay, WayRecord]:
    """Measure the table, and write it.

    Args:
        out: file to write, `ways.csv.gz`. Rows are kept in `ways.csv` beside it as they come: a run that was stopped
            goes on there; one of more seeds adds to the file, if there is one.
        seeds: of the packings.
        progress: called with each seed.

    Raises:
        StorageError: the file cannot be written; raised before the work.
    """
    check_target(out)
    rows = out.with_name(out.name.removesuffix(".gz"))
    if out.exists() and not rows.exists():
        rows.write_text(_unpack(out), encoding="utf-8")
    measure_rows(rows, seeds, progress=progress)
    return write_table(rows, out)


def write_table(rows: Path, out: Path) -> dict[EnsembleWay, WayRecord]:
    """Pack the rows of a CSV file, with their provenance in the first line; a file of the same rows keeps its own."""
    text = rows.read_text(encoding="utf-8")
    found = collect(list(csv.DictReader(text.splitlines())))
    if out.exists() and _unpack(out) == text:
        return found
    seeds = sorted({int(row["seed"]) for row in csv.DictReader(text.splitlines())})
    law = {k: v for k, v in defaults("dp").items() if k != "longest_edge"}
    provenance = {
        "command": "jamlab chart estimates",
        "seeds": [seeds[0], seeds[-1]],
        "seconds": "CPU time of one core from the random start to rho",
        "step": STEP,
        "parameters": law,
        **versions(),
    }
    whole = f"# {json.dumps(provenance)}\n{text}"
    with atomic_file(out) as temporary:
        temporary.write_bytes(gzip.compress(whole.encode(), mtime=0))
    return found


def _unpack(out: Path) -> str:
    """Rows of a packed file."""
    return gzip.decompress(out.read_bytes()).decode().partition("\n")[2]


def measure_rows(out: Path, seeds: range, *, progress: Callable[[str], None] | None = None) -> None:
    """Measure packings of some seeds, and add their rows to a CSV file; seeds that it has already are left out."""
    check_target(out)
    done = {int(row["seed"]) for row in _read(out)} if out.exists() else set()
    with one_core():
        for seed in seeds:
            if seed in done:
                continue
            if progress is not None:
                progress(f"seed {seed}")
            rows = list(_seed_rows(seed))
            with out.open("a", newline="", encoding="utf-8") as file:
                writer = csv.DictWriter(file, COLUMNS)
                if file.tell() == 0:
                    writer.writeheader()
                writer.writerows(rows)


def ways(n: int) -> tuple[EnsembleWay, ...]:
    """Ways to make packings of n particles: droplets last."""
    nv = default_vertices()
    kinds = (("disks", None), ("carried", nv), ("carried", FEW_VERTICES), ("droplets", nv))
    return tuple(EnsembleWay(start, n, vertices) for start, vertices in kinds)


def _seed_rows(seed: int) -> Iterator[Row]:
    """Rows of one seed: droplets from the start take most of the time, and stand for one in two."""
    disks, carried, coarse, droplets = ways(64)
    rare = seed % _RARE == 1
    yield from _carried_rows((disks, carried, coarse) if rare else (disks, carried), seed)
    if seed % 2:
        yield from _droplet_rows(droplets, seed)
    if rare:
        disks, carried, _, droplets = ways(32)
        yield from _carried_rows((disks, carried), seed)
        yield from _droplet_rows(droplets, seed)


def _droplet_rows(way: EnsembleWay, seed: int) -> Iterator[Row]:
    chain = _Chain(way, seed)
    for rho in LEVELS:
        chain.advance(rho)
        yield chain.row(rho)


def _carried_rows(several: tuple[EnsembleWay, ...], seed: int) -> Iterator[Row]:
    """Rows of disks, and of the droplets that they carry: handed over at every level, from 0.88 on compressed."""
    disks = _Chain(several[0], seed)
    carried: dict[EnsembleWay, _Chain] = {}
    for rho in LEVELS:
        disks.advance(rho)
        yield disks.row(rho)
        for way in several[1:]:
            if rho <= MODELS_PART.value:
                carried[way] = disks.hand_over(way)
            else:
                carried[way].advance(rho)
            yield carried[way].row(rho)


class _Chain:
    """A packing on its way up, with the CPU time that it took; without one after a failure."""

    def __init__(self, way: EnsembleWay, seed: int) -> None:
        self.way, self.seed = way, seed
        self.seconds = 0.0
        self.packing: Packing | None = None
        self._timed(lambda: find_onset(way, seed))
        self.onset = packing_fraction(self.packing) if self.packing else float("nan")

    def advance(self, rho: float) -> None:
        packing = self.packing
        if packing is not None and not (rho <= self.onset):
            self._timed(lambda: bring_on(self.way, packing, rho))

    def hand_over(self, way: EnsembleWay) -> "_Chain":
        disks = self.packing
        new = object.__new__(_Chain)
        new.way, new.seed, new.seconds, new.packing, new.onset = way, self.seed, self.seconds, None, self.onset
        if disks is not None and packing_fraction(disks) > self.onset + 1e-9:
            new._timed(lambda: hand_over(way, disks))
        return new

    def row(self, rho: float) -> Row:
        found = dict.fromkeys(QUANTITIES, float("nan"))
        if self.packing is not None and rho > self.onset:
            found = values_at(self.packing, QUANTITIES)
        nv = "" if self.way.nv is None else f"{self.way.nv[0]}/{self.way.nv[1]}"
        row = {"start": self.way.start, "n": self.way.n, "nv": nv, "seed": self.seed, "rho": rho, **found}
        rounded = {name: f"{row[name]:.6g}" for name in QUANTITIES}
        onset = f"{self.onset:.6f}" if self.way.start != "carried" else ""
        return {**row, **rounded, "rho-J": onset, "seconds": f"{self.seconds:.3f}"}

    def _timed(self, make: Callable[[], Packing]) -> None:
        began = time.process_time()
        try:
            self.packing = make()
        except JamlabError:
            self.packing = None
        self.seconds += time.process_time() - began


def _read(path: Path) -> list[Row]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))
