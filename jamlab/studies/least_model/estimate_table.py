"""Measure the table behind `jamlab.estimate` and `jamlab.choose`: quantities of every packing made in every way, and
what it took.

The packings of one seed are made together: disks at onset carry droplets of several kinds, droplets of their own are
compressed beside them. Rows are kept as they come, so a run that was stopped goes on where it was.
"""

import csv
import gzip
import json
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

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
from jamlab.estimates.way_table import N, WayRecord, collect, way_of
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.packing.packing import Packing
from jamlab.statistics.published_numbers import MODELS_PART
from jamlab.storage.atomic_file import atomic_file, check_target
from jamlab.storage.verified_file import versions
from jamlab.studies.cpu_time import one_core

LEVELS = (0.84, 0.85, 0.86, 0.88, 0.90, 0.92, 0.94, 0.96, 0.98)  # rho: from the onsets to confluence
QUANTITIES = ("z", "g", "b", "a", "void_sides")
FEW_VERTICES = (8, 11)
OTHER_FORM = "segment/smooth"  # the third, "segment", has no minima to end in
LOOSE = 1e-6  # largest force: 1e-8 saves a third of what it saves, 1e-5 no more
SEEDS = range(20_001, 20_201)  # none that a test, a campaign or `jamlab.estimate` uses
_RARE = 4  # one in so many seeds has fewer vertices, another form, looser minima and fewer particles: these save less
COLUMNS = ("start", "n", "nv", "contact", "tolerance", "seed", "rho", *QUANTITIES, "rho-J", "seconds")

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
    """Measure packings of some seeds, and add their rows to a CSV file; packings that it has already are left out."""
    check_target(out)
    done = {(way_of(row), int(row["seed"])) for row in _read(out)} if out.exists() else set()
    with one_core():
        for seed in seeds:
            left = [group for group in groups(seed) if any((way, seed) not in done for way in group)]
            if left and progress is not None:
                progress(f"seed {seed}")
            rows = [row for group in left for way, row in _group_rows(group, seed) if (way, seed) not in done]
            with out.open("a", newline="", encoding="utf-8") as file:
                writer = csv.DictWriter(file, COLUMNS)
                if file.tell() == 0:
                    writer.writeheader()
                writer.writerows(rows)


def groups(seed: int) -> list[tuple[EnsembleWay, ...]]:
    """Ways to make packings of one seed: the first of a group is made by itself, and carries the others.

    Droplets from the start take most of the time, and stand for one seed in two.
    """
    nv, rare = default_vertices(), seed % _RARE == 1
    carried = [EnsembleWay("carried", N, nv)]
    if rare:
        carried += [EnsembleWay("carried", N, FEW_VERTICES), EnsembleWay("carried", N, nv, OTHER_FORM)]
    found: list[tuple[EnsembleWay, ...]] = [(EnsembleWay("disks", N), *carried)]
    if seed % 2:
        found.append((EnsembleWay("droplets", N, nv),))
    if rare:
        found.append((EnsembleWay("disks", N, tolerance=LOOSE), EnsembleWay("carried", N, nv, tolerance=LOOSE)))
        found += [(EnsembleWay("disks", 32), EnsembleWay("carried", 32, nv)), (EnsembleWay("droplets", 32, nv),)]
    return found


def _group_rows(group: tuple[EnsembleWay, ...], seed: int) -> Iterator[tuple[EnsembleWay, Row]]:
    """Rows of a group: droplets are handed over to at every level up to 0.88, and compressed from there on."""
    first = _Chain(group[0], seed)
    carried: dict[EnsembleWay, _Chain] = {}
    for rho in LEVELS:
        first.advance(rho)
        yield first.way, first.row(rho)
        for way in group[1:]:
            if rho <= MODELS_PART.value:
                carried[way] = first.hand_over(way)
            else:
                carried[way].advance(rho)
            yield way, carried[way].row(rho)


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
        way = asdict(self.way) | {"nv": "" if self.way.nv is None else f"{self.way.nv[0]}/{self.way.nv[1]}"}
        rounded = {name: f"{found[name]:.6g}" for name in QUANTITIES}
        onset = f"{self.onset:.6f}" if self.way.start != "carried" else ""
        return {**way, "seed": self.seed, "rho": rho, **rounded, "rho-J": onset, "seconds": f"{self.seconds:.3f}"}

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
